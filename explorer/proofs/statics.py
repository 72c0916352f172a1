"""Loads, accelerations, errors and deflections over a box of positions at one orientation.

All are largest sizes of vectors that are smooth in the position: forces of the actuators under unit
loads, which are also the motions for unit rates of the actuators, times constants and lengths. Over
a cell such a vector is within Σ h² m / 2 of a mean of its values at the corners, with h half an
edge of the cell and m the largest second derivative along it; so its size is at most the largest at
a corner plus that. The derivatives are bounded term by term along the closed form of the forces of
`explorer.motion.inverse_jacobian`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from explorer.measures.box import box_margins
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import GUIDE_ROWS, STRUT_ROWS, Design
from explorer.mechanism.margins import planes_of_singularity
from explorer.mechanism.pose import Triple
from explorer.motion.weights import payload_wrench
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.numerics.cells import CellValues, corners_of_cells, largest_values
from explorer.proofs.proof import Proof, proofs_of
from explorer.statics.accuracy import actuator_errors, worst_errors
from explorer.statics.compliance import compliance_of, largest_deflection, stiffness_of
from explorer.statics.reactions import PART_NAMES, least_limits, utilisations_in_motion

# Tolerance of a proof, over the largest value allowed: what is computed keeps to the value itself.
TOLERANCE = 1e-6


class Bounds(NamedTuple):
    """Upper bounds over n cells of the size of a quantity, and of its derivatives along each axis.

    The shapes of all three begin with (n, 3), where 1 stands for what is the same.
    """

    size: FloatArray
    first: FloatArray
    second: FloatArray

    def plus(self, other: Bounds) -> Bounds:
        """Return the bounds of the sum of two quantities."""
        return Bounds(*(own + more for own, more in zip(self, other, strict=True)))

    def times(self, other: Bounds) -> Bounds:
        """Return the bounds of the product of two quantities."""
        return Bounds(
            self.size * other.size,
            self.first * other.size + self.size * other.first,
            self.second * other.size + 2.0 * self.first * other.first + self.size * other.second,
        )

    def over(self, least: FloatArray) -> Bounds:
        """Return the bounds of one over the quantity, of which the least sizes are given."""
        return Bounds(
            1.0 / least,
            self.first / least**2,
            2.0 * self.first**2 / least**3 + self.second / least**2,
        )

    def scaled(self, factor: FloatArray | float) -> Bounds:
        """Return the bounds of the quantity times a constant."""
        return self.each(lambda each: each * np.abs(factor))

    def added_up(self) -> Bounds:
        """Return the bounds of the sum of the components, which are the last axis."""
        return self.each(lambda each: each.sum(axis=-1, keepdims=True))

    def each(self, change: Callable[[FloatArray], FloatArray]) -> Bounds:
        """Return the three arrays after a change."""
        return Bounds(*map(change, self))


def prove_load(
    design: Design,
    box: tuple[Triple, Triple],
    rotation: FloatArray,
    *,
    most: float = 1.0,
    acceleration: float = 0.0,
) -> list[Proof]:
    """Prove that a design holds its load over a box, or find where it does not.

    The load is the payload's weight and its force of any direction; the legs count as weightless.
    Amounts are utilisations of actuators, struts and guide over the largest one allowed, less 1.

    Args:
        design: The manipulator.
        box: Lows and highs of the positions of b4, in design units.
        rotation: Platform to base, shape (3, 3).
        most: Largest utilisation that is allowed.
        acceleration: Acceleration from rest, in m/s², that the platform must have in every
            direction besides, without turning.
    """
    limits = least_limits(design)
    parts = np.flatnonzero(np.isfinite(limits))
    what = "acceleration by" if acceleration else "load of"

    def ratios(at: Configuration) -> FloatArray:
        return utilisations_in_motion(at, acceleration)[..., parts] / most

    def second(forces: CellForces) -> FloatArray:
        force = forces.of_load(design, acceleration)
        along = force.each(lambda each: each[..., GUIDE_ROWS])
        bending = along.times(forces.struts).second
        every = [force.second, bending, force.second[..., STRUT_ROWS], bending]
        return (np.concatenate(every, axis=-1) / limits)[..., parts] / most

    names = [f"{what} {PART_NAMES[part]}" for part in parts]
    return _prove(design, box, rotation, names, ratios, second)


def prove_error(
    design: Design, box: tuple[Triple, Triple], rotation: FloatArray, most: float
) -> list[Proof]:
    """Prove that the actuators' errors displace the tool by at most a length over a box.

    Amounts are the displacement over the length, less 1. Design, box and rotation are those of
    `prove_load`.
    """
    errors = actuator_errors(design)

    def ratios(at: Configuration) -> FloatArray:
        return worst_errors(at, errors).displacement[..., None] / most

    def second(forces: CellForces) -> FloatArray:
        return (forces.at_tool.second @ errors)[..., None] / most

    return _prove(design, box, rotation, ["error"], ratios, second)


def prove_deflection(
    design: Design, box: tuple[Triple, Triple], rotation: FloatArray, most: float
) -> list[Proof]:
    """Prove that the load displaces the tool by at most a length over a box, as `prove_error`."""
    stiffness, struts = stiffness_of(design)
    weight, force = payload_wrench(design, rotation), design.payload.force_n

    def ratios(at: Configuration) -> FloatArray:
        soft = compliance_of(at, stiffness, struts)
        return largest_deflection(soft, weight, force)[0][..., None] / most

    def second(forces: CellForces) -> FloatArray:
        still = np.zeros((len(forces.struts.size), 3, 6))
        soft = Bounds(still + 1.0 / stiffness, still.copy(), still.copy())
        cubes = forces.struts.times(forces.struts).times(forces.struts)
        for own, cube in zip(soft, cubes, strict=True):
            own[..., GUIDE_ROWS] += cube / (3.0 * struts)
        moved = soft.times(forces.at_tool).times(forces.of_load(design))
        return moved.second.sum(axis=-1, keepdims=True) / most

    return _prove(design, box, rotation, ["deflection"], ratios, second)


def _prove(
    design: Design,
    box: tuple[Triple, Triple],
    rotation: FloatArray,
    names: Sequence[str],
    ratios: Callable[[Configuration], FloatArray],
    second: Callable[[CellForces], FloatArray],
) -> list[Proof]:
    """Return the proofs that m ratios, which follow from a configuration (..., m), are at most 1.

    Bounds of their second derivatives along each axis follow from the forces, shape (n, 3, m).
    """

    def measure(lows: FloatArray, highs: FloatArray) -> CellValues:
        places = corners_of_cells(lows, highs)
        found = ratios(Configuration(design, places, rotation, design.tool.position)) - 1.0
        worst = found.argmax(axis=1)[:, None]
        values = np.take_along_axis(found, worst, axis=1)[:, 0]
        half = 0.5 * (highs - lows)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            bends = second(_cell_forces(design, rotation, lows + half, half))
            bounds = values + 0.5 * np.einsum("na,nam->nm", half**2, bends)
        where = np.take_along_axis(places, worst[:, 0, :, None], axis=1)
        return CellValues(values, where, np.where(np.isfinite(bounds), bounds, np.inf))

    if box_margins(box, rotation).all():
        found = largest_values(measure, *np.array(box), enough=TOLERANCE)
        found = found._replace(bounds=np.maximum(found.values, found.bounds - TOLERANCE))
    else:
        infinite, corners = np.full(len(names), np.inf), np.tile(box[0], (len(names), 1))
        found = CellValues(infinite, corners, infinite)
    return proofs_of(names, found, lambda _, place: (place, rotation))


class CellForces(NamedTuple):
    """Bounds over cells of the forces of the six actuators, shape (n, 3, 6).

    Attributes:
        at_tool: Those under forces of 1 N at the tool along the three axes, as one vector.
        at_payload: The same for the payload's centre.
        by_weight: Those under the payload's weight.
        struts: Lengths of struts 2 and 3, shape (n, 3, 2).
    """

    at_tool: Bounds
    at_payload: Bounds
    by_weight: Bounds
    struts: Bounds

    def of_load(self, design: Design, acceleration: float = 0.0) -> Bounds:
        """Return those of the design's load, and of an acceleration of its payload in m/s²."""
        payload = design.payload
        inertia = self.at_payload.scaled(payload.mass_kg * acceleration)
        return self.by_weight.plus(self.at_tool.scaled(payload.force_n)).plus(inertia)


def _cell_forces(
    design: Design, rotation: FloatArray, middles: FloatArray, half: FloatArray
) -> CellForces:
    """Return the bounds over cells with middles and half edges (n, 3); infinite if unknown."""
    at, u = Configuration(design, middles, rotation), rotation[:, 0]

    def linear(slope: FloatArray, offset: FloatArray | float = 0.0) -> Bounds:
        """Return the bounds of k·p + c, given k (loads, components, 3) and c."""
        first = np.moveaxis(np.abs(slope), -1, 0)[None]
        size = np.abs(np.tensordot(middles, slope, axes=(1, -1)) + offset)
        size += np.tensordot(half, np.abs(slope), axes=(1, -1))
        return Bounds(size[:, None], first, np.zeros_like(first))

    def one_over(slope: FloatArray) -> Bounds:
        """Return the bounds of 1 / (k·p), given k (3,)."""
        least = np.abs(middles @ slope) - half @ np.abs(slope)
        return linear(slope[None, None]).over(np.maximum(least, 0.0)[:, None, None, None])

    def length(leg: int) -> tuple[Bounds, FloatArray]:
        """Return the bounds of the length of a leg, and the least length."""
        axes = np.array([0.0 if leg in (1, 2) else 1.0, 1.0, 1.0])[None, :, None, None]
        way = lengths_of(axes[0, :, 0, 0] * half)[:, None, None, None]
        size = at.leg_lengths[:, leg, None, None, None]
        least = np.maximum(size - way, 0.0)
        return Bounds(size + way, axes, axes / least), least

    # Loads about b4: three forces at the tool, three at the payload's centre, and its weight.
    gravity = design.payload.weight_n * np.array(design.gravity)
    loads = np.vstack([np.eye(3), np.eye(3), gravity])
    points = np.array([design.tool.position, design.payload.centre]) @ rotation.T
    moments = np.cross(points[[0, 0, 0, 1, 1, 1, 1]], loads)
    by_delta1, by_delta2, by_delta3 = map(one_over, planes_of_singularity(rotation))
    (l1, _), (d2, least2), (d4, least4), (l4, _) = map(length, range(4))
    # Forces of legs 1 and 4 over their lengths.
    f1 = by_delta1.scaled(moments @ u[:, None] / design.b1[1])
    turns = np.stack([np.zeros(7), loads[:, 2], -loads[:, 1]], axis=-1)[:, None]
    f4 = by_delta3.times(linear(turns, moments[:, :1])).scaled(1.0 / design.a3[1])
    a3, arm = np.array([*design.a3, 0.0]), rotation[:, :2] @ design.b1
    across = np.eye(3) - np.outer(u, u)
    swing = np.outer(arm, u) - (u @ arm) * np.eye(3)
    forces = [f1.times(l1)]
    for own, other, strut, least in (
        (design.b2, design.b3, d2, least2),
        (design.b3, design.b2, d4, least4),
    ):
        # What the leg holds across u, over the distance of b2 and b3.
        pull = other * across
        constant = np.abs(np.cross(u, moments) + loads @ pull)[None, None]
        held = Bounds(constant, np.zeros_like(constant), np.zeros_like(constant))
        held = held.plus(f1.times(linear((swing + pull)[None], pull @ arm)))
        held = held.plus(f4.times(linear(pull[None], -pull @ a3)))
        held = held.scaled(1.0 / (design.b3 - design.b2))
        # Its part along u makes its force lie in the plane of the guide and the strut.
        end = linear(np.eye(3)[1:][None], own * u[1:])
        twist = end.times(held.each(lambda each: each[..., [2, 1]])).added_up()
        held = held.plus(twist.times(by_delta2).scaled(u))
        forces.append(held.each(lambda each: each[..., :1]))
        radial = end.times(held.each(lambda each: each[..., 1:])).added_up()
        forces.append(radial.times(strut.over(least)))
    forces.append(f4.times(l4))
    shape = (len(middles), 3, len(loads), 1)
    every = Bounds(
        *(
            np.concatenate([np.broadcast_to(each, shape) for each in parts], axis=-1)
            for parts in zip(*forces, strict=True)
        )
    )
    at_tool, at_payload = (
        every.each(
            lambda each, first=first: lengths_of(each[:, :, first : first + 3].swapaxes(2, 3))
        )
        for first in (0, 3)
    )
    struts = Bounds(*(np.concatenate(pair, axis=-1)[:, :, 0] for pair in zip(d2, d4, strict=True)))
    return CellForces(at_tool, at_payload, every.each(lambda each: each[:, :, 6]), struts)
