"""The limits of a design as primitive solids of positions p of b4, at one orientation.

At a fixed rotation the positions that satisfy a limit form a ball, a cylinder along x, a
half-space, a cone, or the outside of one of these. The constant-orientation workspace is their
intersection. Each primitive has the derivatives of its own parameters with respect to the design
variables, the yaw and its limit, so that derivatives of volumes follow by the chain rule.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray, position_array
from explorer.workspace.limits import quantities
from explorer.workspace.limits.quantities import Bound, Demand, LegAngle

YAW = "yaw"
"""The name of the platform's rotation about the base's z-axis, in radians, as a parameter."""

Rates: TypeAlias = Mapping[str, FloatArray]
"""Derivatives of a primitive's centre and radius, or normal and offset, by parameter, (4,) each."""

AXES = np.eye(3)
ACROSS = np.array([0.0, 1.0, 1.0])
# Lines at an angle with a smaller sine are parallel but for rounding.
PARALLEL = 1e-15


class _Distances(ABC):
    """Distances that follow from the slack of a limit."""

    @abstractmethod
    def slack(self, p: FloatArray) -> FloatArray:
        """Return the slack of positions (..., 3); negative where violated."""

    def signed_distance(self, p: FloatArray) -> FloatArray:
        """Return the distances of positions (..., 3) from the surface, negative outside."""
        return self.slack(p)

    def distance(self, p: FloatArray) -> FloatArray:
        """Return the distances of positions (..., 3) from the surface; infinite if it has none."""
        return np.abs(self.signed_distance(p))


@dataclass(frozen=True)
class BallOrCylinder(_Distances):
    """A limit on the distance of p from a point (a ball) or from a line along x (a cylinder).

    Attributes:
        name: Name of the limit, such as "l1 maximum".
        centre: Centre of the ball, or a point of the cylinder's axis, shape (3,).
        radius: Radius in design units.
        is_ball: Whether it is a ball rather than a cylinder.
        inside: Whether positions inside satisfy the limit, rather than those outside.
        rates: Derivatives of (centre, radius), shape (4,) each.
    """

    name: str
    centre: FloatArray
    radius: float
    is_ball: bool
    inside: bool
    rates: Rates = field(default_factory=dict[str, FloatArray])

    def slack(self, p: FloatArray) -> FloatArray:
        """Return the slack of positions (..., 3) in design units; negative where violated."""
        off = p - self.centre
        distance = np.sqrt(
            off[..., 1] ** 2 + off[..., 2] ** 2 + (off[..., 0] ** 2 if self.is_ball else 0.0)
        )
        return self.radius - distance if self.inside else distance - self.radius


@dataclass(frozen=True)
class HalfSpace(_Distances):
    """The positions with normal · p <= offset.

    Attributes:
        name: Name of the limit, such as "box z minimum".
        normal: Outward normal, shape (3,), of unit length except for δ2.
        offset: Offset in design units, times the length of the normal.
        rates: Derivatives of (normal, offset), shape (4,) each.
    """

    name: str
    normal: FloatArray
    offset: float
    rates: Rates = field(default_factory=dict[str, FloatArray])

    def slack(self, p: FloatArray) -> FloatArray:
        """Return the slack of positions (..., 3) in design units; negative where violated."""
        return self.offset - p @ self.normal

    def signed_distance(self, p: FloatArray) -> FloatArray:
        """Return the distances of positions (..., 3) from the surface, negative outside."""
        return self.slack(p) / float(np.linalg.norm(self.normal))


@dataclass(frozen=True)
class Cone(_Distances):
    """The positions at which a leg lies within the cone of a joint.

    Attributes:
        name: Name of the limit, such as "swing a1".
        apex: Position at which the leg has no length, shape (3,).
        axis: Unit axis, shape (3,).
        half_angle: Half-angle in radians.
        flat: Whether only the yz-part of p counts, as for the legs on the guide.
    """

    name: str
    apex: FloatArray
    axis: FloatArray
    half_angle: float
    flat: bool

    def slack(self, p: FloatArray) -> FloatArray:
        """Return the slack of positions (..., 3) in radians; negative outside the cone."""
        return self.half_angle - angle_between(self.leg(p), self.axis)

    def signed_distance(self, p: FloatArray) -> FloatArray:
        """Return the distances of positions (..., 3) from the nearby surface, to first order."""
        return self.slack(p) * np.linalg.norm(self.leg(p), axis=-1)

    def leg(self, p: FloatArray) -> FloatArray:
        """Return the leg, or what counts of it, at positions (..., 3)."""
        return (p - self.apex) * (ACROSS if self.flat else 1.0)


@dataclass(frozen=True)
class Never(_Distances):
    """A limit that no position satisfies at this orientation."""

    name: str

    def slack(self, p: FloatArray) -> FloatArray:
        """Return minus infinity for positions (..., 3)."""
        return np.full(p.shape[:-1], -math.inf)


Constraint: TypeAlias = BallOrCylinder | HalfSpace | Cone | Never


def shift(limit: Constraint, offset: FloatArray) -> Constraint:
    """Return the limit of positions moved by a vector, shape (3,); a half-space loses its rates."""
    match limit:
        case BallOrCylinder():
            return replace(limit, centre=limit.centre + offset)
        case HalfSpace():
            return replace(limit, offset=limit.offset + float(limit.normal @ offset), rates={})
        case Cone():
            return replace(limit, apex=limit.apex + offset)
        case Never():
            return limit


def surface_of(
    limit: BallOrCylinder | HalfSpace | Cone,
) -> tuple[FloatArray, FloatArray, FloatArray, float, float]:
    """Return (origin, scale, axis, steepness, level) of the surface of a limit.

    It is steepness |s (p − origin)| + axis · s (p − origin) = level, with less than the level
    inside. The scale s of the axes is (0, 1, 1) for cylinders and flat cones, otherwise 1.
    """
    match limit:
        case HalfSpace():
            length = float(np.linalg.norm(limit.normal))
            return np.zeros(3), np.ones(3), limit.normal / length, 0.0, limit.offset / length
        case BallOrCylinder():
            side, scale = 1.0 if limit.inside else -1.0, np.ones(3) if limit.is_ball else ACROSS
            return limit.centre * scale, scale, np.zeros(3), side, side * limit.radius
        case Cone():
            scale = ACROSS if limit.flat else np.ones(3)
            return limit.apex * scale, scale, -limit.axis, math.cos(limit.half_angle), 0.0


def slacks(limits: Sequence[Constraint], position: ArrayLike) -> FloatArray:
    """Return the slacks of n limits at positions (..., 3), shape (..., n); negative if violated.

    Slacks are in design units, those of cones in radians.
    """
    p = position_array("position", position)
    return np.stack([limit.slack(p) for limit in limits], axis=-1)


def angle_between(vector: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the angles (...) of vectors (..., 3) and an axis (3,), in radians."""
    across = np.linalg.norm(np.cross(vector, axis), axis=-1)
    return np.asarray(np.arctan2(across, vector @ axis))


def solids_of(design: Design, r: FloatArray, demand: Demand) -> Iterator[Constraint]:
    """Yield the solids of a demand at a rotation (3, 3): its quantity is of one of four forms."""
    kind = demand.quantity
    if kind <= quantities.D3:
        yield from _half_spaces(demand, *line_of(design, r, kind))
    elif quantities.L1 <= kind <= quantities.L4:
        leg = kind - quantities.L1
        yield from _balls(demand, *apex_of(design, r, leg), is_ball=leg in (0, 3))
    elif kind <= quantities.ORDER:
        # d3 − d1 is the same at every position.
        apart = line_of(design, r, kind)[1]
        value = apart if kind == quantities.ORDER else abs(apart)
        _, low, high, *_ = demand.row(design)
        if not low <= value <= high:
            yield Never(demand.name)
    elif demand.angle is not None:
        yield _cone(design, r, demand, demand.angle)


def apex_of(design: Design, r: FloatArray, leg: int) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Return the position (3,) at which a leg has no length, and its derivatives by parameter.

    For the legs on the guide x is 0. The rotation has the shape (3, 3).
    """
    u, v = r[:, 0], r[:, 1]
    if leg == 3:
        return np.array([*design.a3, 0.0]), {"a3x": AXES[0], "a3y": AXES[1]}
    if leg == 0:
        b1x, b1y = design.b1
        arm = b1x * u + b1y * v
        return -arm, {"b1x": -u, "b1y": -v, YAW: -_turning(arm)}
    name, b = ("b2", design.b2) if leg == 1 else ("b3", design.b3)
    return -b * u * ACROSS, {name: -u * ACROSS, YAW: -b * _turning(u) * ACROSS}


def _balls(
    demand: Demand, centre: FloatArray, centre_rates: dict[str, FloatArray], *, is_ball: bool
) -> Iterator[Constraint]:
    """Yield the balls, or the cylinders, of a demand on the distance from a centre."""
    for bound, name, side in demand.finite_ends():
        if side > 0.0 or bound.value > 0.0:
            rates = {key: np.array([*rate, 0.0]) for key, rate in centre_rates.items()}
            _add_rates(rates, bound, 1.0)
            yield BallOrCylinder(name, centre, bound.value, is_ball, side > 0.0, rates)


def line_of(
    design: Design, r: FloatArray, kind: int
) -> tuple[FloatArray, float, dict[str, FloatArray]]:
    """Return k (3,), c and the derivatives (4,) of both by parameter of a quantity k·p + c.

    The rotation has the shape (3, 3). For the distance d3 − d1 of the carriages k is zero.
    """
    u, n = r[:, 0], r[:, 2]
    if kind >= quantities.D1:
        names = {quantities.D1: {"b2": 1.0}, quantities.D3: {"b3": 1.0}}
        shares = names.get(kind, {"b3": 1.0, "b2": -1.0})
        b = sum(share * getattr(design, name) for name, share in shares.items())
        rates = {name: _scalar_rate(share * float(u[0])) for name, share in shares.items()}
        rates[YAW] = _scalar_rate(-b * float(u[1]))
        return AXES[0] if kind in names else np.zeros(3), b * float(u[0]), rates
    if kind <= quantities.Z:
        return AXES[kind - quantities.X], 0.0, {}
    if kind == quantities.DELTA1:
        gradient, turning = -n, -_turning(n)
    elif kind == quantities.DELTA2:
        gradient, turning = (np.array([0.0, -v[2], v[1]]) for v in (u, _turning(u)))
    else:
        gradient, turning = AXES[2], np.zeros(3)
    return gradient, 0.0, {YAW: np.append(turning, 0.0)}


def _half_spaces(
    demand: Demand, k: FloatArray, c: float, line_rates: dict[str, FloatArray]
) -> Iterator[Constraint]:
    """Yield the half-spaces of a demand on k·p + c."""
    if float(np.linalg.norm(k)) <= PARALLEL:
        # Lines are parallel, and their margin is zero at every position.
        yield Never(demand.name)
        return
    for bound, name, side in demand.finite_ends():
        # The offset shrinks where c grows.
        signs = np.array([side, side, side, -side])
        rates = {key: signs * rate for key, rate in line_rates.items()}
        _add_rates(rates, bound, side)
        yield HalfSpace(name, side * k, side * (bound.value - c), rates)


def _cone(design: Design, r: FloatArray, demand: Demand, angle: LegAngle) -> Constraint:
    if angle.axis is None:
        return Never(demand.name)
    axis = r @ angle.axis if angle.in_platform else angle.axis
    apex, on_guide = apex_of(design, r, angle.leg)[0], angle.leg in (1, 2)
    return Cone(demand.name, apex, axis, math.radians(demand.high.value), on_guide)


def _add_rates(rates: dict[str, FloatArray], bound: Bound, sign: float) -> None:
    """Add the derivatives of a bound, which is a radius or an offset."""
    for key, rate in bound.rates.items():
        rates[key] = rates.get(key, np.zeros(4)) + _scalar_rate(sign * rate)


def _turning(vector: FloatArray) -> FloatArray:
    """Return the derivative by the yaw of a vector (3,) that turns about z with the platform."""
    return np.array([-vector[1], vector[0], 0.0])


def _scalar_rate(rate: float) -> FloatArray:
    """Return derivatives of primitives whose radius or offset alone changes, shape (4,)."""
    return np.array([0.0, 0.0, 0.0, rate])
