"""The limits of a design as primitive solids of positions p of b4, at one orientation.

At a fixed rotation the positions that satisfy a limit form a ball, a cylinder along x, a
half-space, a cone, or the outside of one of these. The constant-orientation workspace is their
intersection. Each primitive has the derivatives of its own parameters with respect to the design
variables, the yaw and its limit, so that derivatives of volumes follow by the chain rule.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.design import TOLERANCE, Design
from explorer.mechanism.pose import checked_rotation
from explorer.mechanism.tool_point import tool_offset
from explorer.numerics.arrays import BoolArray, FloatArray, finite_array
from explorer.workspace.limits.joint_cones import angle_between, joint_cones

YAW = "yaw"
"""The name of the platform's rotation about the base's z-axis, in radians, as a parameter."""

Rates: TypeAlias = Mapping[str, FloatArray]
"""Derivatives of a primitive's centre and radius, or normal and offset, by parameter, (4,) each."""

X, Y, Z = np.eye(3)
GAP = "gap |d1 − d3|"
CARRIAGE_ORDER = "carriage order"
# Lines at an angle with a smaller sine are parallel but for rounding.
PARALLEL = 1e-15


@dataclass(frozen=True)
class BallOrCylinder:
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

    def distance(self, p: FloatArray) -> FloatArray:
        """Return the distances of positions (..., 3) from the surface."""
        return np.abs(self.slack(p))

    def shifted(self, offset: FloatArray) -> BallOrCylinder:
        """Return the limit of positions that are moved by a constant vector, shape (3,)."""
        return replace(self, centre=self.centre + offset)


@dataclass(frozen=True)
class HalfSpace:
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

    def distance(self, p: FloatArray) -> FloatArray:
        """Return the distances of positions (..., 3) from the surface."""
        return np.abs(self.slack(p)) / float(np.linalg.norm(self.normal))

    def shifted(self, offset: FloatArray) -> HalfSpace:
        """Return the limit of positions that are moved by a constant vector, shape (3,)."""
        rates = {
            name: np.array([*rate[:3], rate[3] + rate[:3] @ offset])
            for name, rate in self.rates.items()
        }
        return replace(self, offset=self.offset + float(self.normal @ offset), rates=rates)


@dataclass(frozen=True)
class Cone:
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
        return self.half_angle - angle_between(self._leg(p), self.axis)

    def distance(self, p: FloatArray) -> FloatArray:
        """Return the distances of positions (..., 3) from the nearby surface, to first order."""
        return np.abs(self.slack(p)) * np.linalg.norm(self._leg(p), axis=-1)

    def shifted(self, offset: FloatArray) -> Cone:
        """Return the limit of positions that are moved by a constant vector, shape (3,)."""
        return replace(self, apex=self.apex + offset)

    def _leg(self, p: FloatArray) -> FloatArray:
        return (p - self.apex) * (np.array([0.0, 1.0, 1.0]) if self.flat else 1.0)


@dataclass(frozen=True)
class Never:
    """A limit that no position satisfies at this orientation."""

    name: str

    def slack(self, p: FloatArray) -> FloatArray:
        """Return minus infinity for positions (..., 3)."""
        return np.full(p.shape[:-1], -math.inf)

    def distance(self, p: FloatArray) -> FloatArray:
        """Return infinity for positions (..., 3), since the limit has no surface."""
        return np.full(p.shape[:-1], math.inf)

    def shifted(self, _: FloatArray) -> Never:
        """Return the limit itself."""
        return self


Constraint: TypeAlias = BallOrCylinder | HalfSpace | Cone | Never


def constraints(
    design: Design, rotation: ArrayLike, signs: tuple[int, int, int] | None = None
) -> tuple[Constraint, ...]:
    """Return the limits of a design at an orientation, in the order of the design file.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3).
        signs: Sign triple to demand instead of the home's, even if no margin is demanded.

    Raises:
        InputError: not a rotation.
    """
    r = checked_rotation(rotation)
    return (
        *_lengths(design, r),
        *_guide(design, r),
        *_box(design),
        *_margins(design, r, signs),
        *_swings(design, r),
    )


def constraints_over(
    design: Design, rotations: ArrayLike, tool: ArrayLike | None = None
) -> list[tuple[Constraint, ...]]:
    """Return the limits of a design at each of n orientations as solids of positions of a point.

    Args:
        design: The manipulator.
        rotations: Platform to base, shape (n, 3, 3).
        tool: The point in the platform frame, shape (3,), in design units; None for b4.

    Raises:
        InputError: not rotations, or not a point.
    """
    matrices = checked_rotation(rotations)
    if matrices.ndim != 3 or not len(matrices):
        raise InputError(f"rotations must have the shape (n, 3, 3); got {matrices.shape}")
    families = [constraints(design, r) for r in matrices]
    if tool is None:
        return families
    offsets = tool_offset(matrices, tool)
    return [
        tuple(limit.shifted(offset) for limit in family)
        for family, offset in zip(families, offsets, strict=True)
    ]


def slacks(limits: tuple[Constraint, ...], position: ArrayLike) -> FloatArray:
    """Return the slacks of n limits at positions (..., 3), shape (..., n); negative if violated.

    Slacks are in design units, those of cones in radians.
    """
    p = finite_array("position", position, (3,))
    return np.stack([limit.slack(p) for limit in limits], axis=-1)


def satisfies(design: Design, limits: tuple[Constraint, ...], position: ArrayLike) -> BoolArray:
    """Return whether positions (..., 3) satisfy each of n limits to its tolerance, (..., n)."""
    tolerances = [TOLERANCE if isinstance(limit, Cone) else design.tolerance for limit in limits]
    return slacks(limits, position) >= -np.array(tolerances)


def _turning(vector: FloatArray) -> FloatArray:
    """Return the derivative by the yaw of a vector that turns about z with the platform."""
    return np.array([-vector[1], vector[0], 0.0])


def _vector_rate(vector: FloatArray) -> FloatArray:
    """Return the derivative of a primitive whose centre or normal alone changes."""
    return np.array([*vector, 0.0])


def _scalar_rate(rate: float) -> FloatArray:
    """Return the derivative of a primitive whose radius or offset alone changes."""
    return np.array([0.0, 0.0, 0.0, rate])


def _lengths(design: Design, r: FloatArray) -> Iterator[Constraint]:
    u, v = r[:, 0], r[:, 1]
    b1x, b1y = design.b1
    arm = b1x * u + b1y * v
    a3 = np.array([*design.a3, 0.0])
    yz = np.array([0.0, 1.0, 1.0])
    legs: tuple[tuple[str, FloatArray, bool, dict[str, FloatArray]], ...] = (
        ("l1", -arm, True, {"b1x": -u, "b1y": -v, YAW: -_turning(arm)}),
        ("d2", -design.b2 * u * yz, False, {"b2": -u * yz, YAW: -design.b2 * _turning(u) * yz}),
        ("d4", -design.b3 * u * yz, False, {"b3": -u * yz, YAW: -design.b3 * _turning(u) * yz}),
        ("l4", a3, True, {"a3x": X, "a3y": Y}),
    )
    for name, centre, is_ball, centre_rates in legs:
        low, high = design.length_range(name)
        minimum, maximum = f"{name} minimum", f"{name} maximum"
        rates = {key: _vector_rate(rate) for key, rate in centre_rates.items()}
        if low > 0.0:
            limit_rates = {**rates, minimum: _scalar_rate(1.0)}
            yield BallOrCylinder(minimum, centre, low, is_ball, inside=False, rates=limit_rates)
        limit_rates = {**rates, maximum: _scalar_rate(1.0)}
        if getattr(design.limits, name)[1] is None:
            # A maximum at the reach follows a3 and has no parameter of its own.
            del limit_rates[maximum]
            for key, share in zip(("a3x", "a3y"), a3 / design.reach, strict=False):
                limit_rates[key] = limit_rates.get(key, np.zeros(4)) + _scalar_rate(float(share))
        yield BallOrCylinder(maximum, centre, high, is_ball, inside=True, rates=limit_rates)


def _guide(design: Design, r: FloatArray) -> Iterator[Constraint]:
    u = r[:, 0]
    if design.limits.guide is not None:
        low, high = design.limits.guide
        for joint, variable, b in (("d1", "b2", design.b2), ("d3", "b3", design.b3)):
            shift, turning = b * float(u[0]), b * float(_turning(u)[0])
            for end, side, offset in (
                ("minimum", -1.0, shift - low),
                ("maximum", 1.0, high - shift),
            ):
                rates = {
                    variable: _scalar_rate(-side * float(u[0])),
                    YAW: _scalar_rate(-side * turning),
                    f"guide {end}": _scalar_rate(side),
                }
                yield HalfSpace(f"{joint} {end}", side * X, offset, rates)
    # d3 - d1 is the same at every position.
    difference = (design.b3 - design.b2) * float(u[0])
    if abs(difference) < design.limits.gap - design.tolerance:
        yield Never(GAP)
    if design.demanded_order * difference < -design.tolerance:
        yield Never(CARRIAGE_ORDER)


def _box(design: Design) -> Iterator[Constraint]:
    if design.limits.box is None:
        return
    for axis, name, low, high in zip((X, Y, Z), "xyz", *design.limits.box, strict=True):
        minimum, maximum = f"box {name} minimum", f"box {name} maximum"
        yield HalfSpace(minimum, -axis, -low, {minimum: _scalar_rate(-1.0)})
        yield HalfSpace(maximum, axis, high, {maximum: _scalar_rate(1.0)})


def _margins(
    design: Design, r: FloatArray, signs: tuple[int, int, int] | None
) -> Iterator[Constraint]:
    least = design.limits.margin
    if least is None and signs is None:
        return
    least = least or 0.0
    u, n = r[:, 0], r[:, 2]
    # δ = k·p, on the side of zero that the home's sign triple demands.
    gradients = (
        ("margin δ1", -n, -_turning(n)),
        ("margin δ2", np.cross(X, u), np.cross(X, _turning(u))),
        ("margin δ3", Z, np.zeros(3)),
    )
    for (name, k, turning), sign in zip(gradients, signs or design.home_signs, strict=True):
        # The lines are parallel, and the margin is zero at every position.
        if float(np.linalg.norm(k)) <= PARALLEL:
            yield Never(name)
        else:
            rates = {YAW: _vector_rate(-sign * turning), "margin": _scalar_rate(-1.0)}
            yield HalfSpace(name, -sign * k, -least, rates)


def _swings(design: Design, r: FloatArray) -> Iterator[Constraint]:
    b1x, b1y = design.b1
    # The position p at which each leg has no length.
    apexes = (
        -(b1x * r[:, 0] + b1y * r[:, 1]),
        -design.b2 * r[:, 0],
        -design.b3 * r[:, 0],
        np.array([*design.a3, 0.0]),
    )
    for cone in joint_cones(design):
        name = f"swing {cone.joint}"
        if cone.axis is None:
            yield Never(name)
            continue
        axis = r @ cone.axis if cone.in_platform else cone.axis
        yield Cone(name, apexes[cone.leg - 1], axis, cone.half_angle, cone.leg in (2, 3))
