"""The limits of a design as primitive solids in the space of p, at one orientation.

At a fixed rotation each limit is a ball, a cylinder along x, a half-space or a cone of
positions (design.md, section 6), and the constant-orientation workspace their intersection. Every
primitive carries how its own parameters move with the design variables, the yaw and its
limit, so that derivatives of volumes follow by the chain rule.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import TOLERANCE, VARIABLES, Design, Swing
from explorer.mechanism.home import home_pose
from explorer.mechanism.kinematics import attachment_points
from explorer.mechanism.margins import margins, mode_of, signs_of
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import BoolArray, FloatArray, finite_array

YAW = "yaw"
"""The parameter of a rotation of the platform about the base's z-axis, in radians."""

Rates: TypeAlias = Mapping[str, FloatArray]
"""By parameter: the rates of a primitive's own parameters, centre or normal first."""

X, Y, Z = np.eye(3)
GAP = "gap |d1 − d3|"
CARRIAGE_ORDER = "carriage order"
# The sine of the angle between two lines that only rounding keeps from being parallel.
PARALLEL = 1e-15


@dataclass(frozen=True)
class Round:
    """A ball, or a cylinder along x, of positions.

    Attributes:
        name: The limit, such as "l1 maximum".
        centre: Shape (3,); of a cylinder x counts for nothing.
        radius: In design units.
        is_ball: A ball, or else a cylinder.
        inside: Whether the limit keeps p inside, or else outside.
        rates: Of (centre, radius), shape (4,) each.
    """

    name: str
    centre: FloatArray
    radius: float
    is_ball: bool
    inside: bool
    rates: Rates = field(default_factory=dict[str, FloatArray])

    def slack(self, p: FloatArray) -> FloatArray:
        """Return by how much positions (..., 3) keep the limit; negative where they do not."""
        off = p - self.centre
        distance = np.sqrt(
            off[..., 1] ** 2 + off[..., 2] ** 2 + (off[..., 0] ** 2 if self.is_ball else 0.0)
        )
        return self.radius - distance if self.inside else distance - self.radius

    def distance(self, p: FloatArray) -> FloatArray:
        """Return the distances of positions (..., 3) from the surface."""
        return np.abs(self.slack(p))


@dataclass(frozen=True)
class HalfSpace:
    """The positions with normal · p <= offset.

    Attributes:
        name: The limit, such as "box z minimum".
        normal: Shape (3,), of unit length but for those of κ2.
        offset: In design units.
        rates: Of (normal, offset), shape (4,) each.
    """

    name: str
    normal: FloatArray
    offset: float
    rates: Rates = field(default_factory=dict[str, FloatArray])

    def slack(self, p: FloatArray) -> FloatArray:
        """Return by how much positions (..., 3) keep the limit; negative where they do not."""
        return self.offset - p @ self.normal

    def distance(self, p: FloatArray) -> FloatArray:
        """Return the distances of positions (..., 3) from the surface."""
        return np.abs(self.slack(p)) / float(np.linalg.norm(self.normal))


@dataclass(frozen=True)
class Cone:
    """The positions in which a leg keeps to the cone of a joint.

    Attributes:
        name: The limit, such as "swing a1".
        apex: Shape (3,).
        axis: Shape (3,), of unit length.
        half_angle: In radians.
        flat: Whether only the yz-part of p counts, as for the legs on the guide.
    """

    name: str
    apex: FloatArray
    axis: FloatArray
    half_angle: float
    flat: bool

    def slack(self, p: FloatArray) -> FloatArray:
        """Return the angle left to the cone at positions (..., 3), in radians."""
        return self.half_angle - angle_between(self._leg(p), self.axis)

    def distance(self, p: FloatArray) -> FloatArray:
        """Return the distances of positions (..., 3) from the surface, near it."""
        return np.abs(self.slack(p)) * np.linalg.norm(self._leg(p), axis=-1)

    def _leg(self, p: FloatArray) -> FloatArray:
        return (p - self.apex) * (np.array([0.0, 1.0, 1.0]) if self.flat else 1.0)


@dataclass(frozen=True)
class Never:
    """A limit that no position keeps, at this orientation."""

    name: str

    def slack(self, p: FloatArray) -> FloatArray:
        """Return minus infinity for positions (..., 3)."""
        return np.full(p.shape[:-1], -math.inf)

    def distance(self, p: FloatArray) -> FloatArray:
        """Return infinity for positions (..., 3): it has no surface."""
        return np.full(p.shape[:-1], math.inf)


Constraint: TypeAlias = Round | HalfSpace | Cone | Never


def constraints(design: Design, rotation: ArrayLike) -> tuple[Constraint, ...]:
    """Return the limits of a design at an orientation, in the order of the design file.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3).

    Raises:
        InputError: not a rotation.
    """
    r = checked_rotation(rotation)
    return (
        *_lengths(design, r),
        *_guide(design, r),
        *_box(design),
        *_margins(design, r),
        *_swings(design, r),
    )


def slacks(limits: tuple[Constraint, ...], position: ArrayLike) -> FloatArray:
    """Return by how much positions (..., 3) keep each of n limits, shape (..., n).

    In design units, but for cones in radians.
    """
    p = finite_array("position", position, (3,))
    return np.stack([limit.slack(p) for limit in limits], axis=-1)


def keeps(design: Design, limits: tuple[Constraint, ...], position: ArrayLike) -> BoolArray:
    """Return which of n limits positions (..., 3) keep, to the tolerance, shape (..., n)."""
    allowed = [TOLERANCE if isinstance(each, Cone) else design.tolerance for each in limits]
    return slacks(limits, position) >= -np.array(allowed)


def _turning(vector: FloatArray) -> FloatArray:
    """Return the rate of a vector that turns about z with the platform."""
    return np.array([-vector[1], vector[0], 0.0])


def _four(vector: FloatArray, last: float = 0.0) -> FloatArray:
    return np.array([*vector, last])


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
    for name, centre, is_ball, moves in legs:
        low, high = design.length_range(name)
        rates = {key: _four(rate) for key, rate in moves.items()}
        if low > 0.0:
            least = f"{name} minimum"
            own = {**rates, least: _four(np.zeros(3), 1.0)}
            yield Round(least, centre, low, is_ball, inside=False, rates=own)
        most = f"{name} maximum"
        own = {**rates, most: _four(np.zeros(3), 1.0)}
        if getattr(design.limits, name)[1] is None:
            # Tied to the reach, which moves with a3 and has no parameter of its own.
            del own[most]
            for key, share in zip(("a3x", "a3y"), a3 / design.reach, strict=False):
                own[key] = own.get(key, np.zeros(4)) + _four(np.zeros(3), float(share))
        yield Round(most, centre, high, is_ball, inside=True, rates=own)


def _guide(design: Design, r: FloatArray) -> Iterator[Constraint]:
    u = r[:, 0]
    if design.limits.guide is not None:
        low, high = design.limits.guide
        for joint, variable, b in (("d1", "b2", design.b2), ("d3", "b3", design.b3)):
            shift, turning = b * float(u[0]), b * float(_turning(u)[0])
            yield HalfSpace(
                f"{joint} minimum",
                -X,
                shift - low,
                {
                    variable: _four(np.zeros(3), float(u[0])),
                    YAW: _four(np.zeros(3), turning),
                    "guide minimum": _four(np.zeros(3), -1.0),
                },
            )
            yield HalfSpace(
                f"{joint} maximum",
                X,
                high - shift,
                {
                    variable: _four(np.zeros(3), -float(u[0])),
                    YAW: _four(np.zeros(3), -turning),
                    "guide maximum": _four(np.zeros(3), 1.0),
                },
            )
    # d3 - d1 is the same in every position.
    apart = (design.b3 - design.b2) * float(u[0])
    if abs(apart) < design.limits.gap - design.tolerance:
        yield Never(GAP)
    if demanded_order(design) * apart < -design.tolerance:
        yield Never(CARRIAGE_ORDER)


def _box(design: Design) -> Iterator[Constraint]:
    if design.limits.box is None:
        return
    for axis, name, low, high in zip((X, Y, Z), "xyz", *design.limits.box, strict=True):
        least, most = f"box {name} minimum", f"box {name} maximum"
        yield HalfSpace(least, -axis, -low, {least: _four(np.zeros(3), -1.0)})
        yield HalfSpace(most, axis, high, {most: _four(np.zeros(3), 1.0)})


def _margins(design: Design, r: FloatArray) -> Iterator[Constraint]:
    least = design.limits.margin
    if least is None:
        return
    u, n = r[:, 0], r[:, 2]
    # κ = k·p; the home's sign triple says on which side of zero it lies.
    gradients = (
        ("margin κ1", -n, -_turning(n)),
        ("margin κ2", np.cross(X, u), np.cross(X, _turning(u))),
        ("margin κ3", Z, np.zeros(3)),
    )
    for (name, k, turning), sign in zip(gradients, home_signs(design), strict=True):
        # The lines are parallel, and the margin is nothing wherever b4 is.
        if float(np.linalg.norm(k)) <= PARALLEL:
            yield Never(name)
            continue
        rates = {YAW: _four(-sign * turning), "margin": _four(np.zeros(3), -1.0)}
        yield HalfSpace(name, -sign * k, -least, rates)


@dataclass(frozen=True)
class JointCone:
    """The cone that a universal or ball joint keeps its leg in, about the home's direction.

    Attributes:
        joint: Such as "a1".
        leg: 1 to 4.
        axis: The leg's direction in the home pose, from base to platform, of unit length;
            in the platform frame for the ball joints, else in the base's. None where the
            leg has no length at home: no pose keeps such a cone.
        half_angle: In radians.
        in_platform: In which frame the axis is.
    """

    joint: str
    leg: int
    axis: FloatArray | None
    half_angle: float
    in_platform: bool


def joint_cones(design: Design) -> tuple[JointCone, ...]:
    """Return the cones of the joints that a design bounds."""
    swing = design.limits.swing
    if swing == Swing():
        return ()
    home = home_pose(design)
    at_home = legs(design, np.array(home.position), home.rotation)
    found: list[JointCone] = []
    for joint in swing.__struct_fields__:
        degrees = getattr(swing, joint)
        if degrees is None:
            continue
        leg = 4 if joint == "a3" else int(joint[1])
        direction = at_home[leg - 1]
        length = float(np.linalg.norm(direction))
        in_platform = joint.startswith("b")
        axis = direction / length if length > 0.0 else None
        if axis is not None and in_platform:
            axis = home.rotation.T @ axis
        found.append(JointCone(joint, leg, axis, math.radians(degrees), in_platform))
    return tuple(found)


def legs(design: Design, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the four legs of a pose as vectors from base to platform, shape (4, 3).

    Those on the guide are perpendicular to it.
    """
    points = attachment_points(design, position, rotation)
    across = np.array([0.0, 1.0, 1.0])
    return np.array([points.b1, points.b2 * across, points.b3 * across, points.b4 - points.a3])


def angle_between(vector: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the angles (...) of vectors (..., 3) and an axis (3,), in radians."""
    across = np.linalg.norm(np.cross(vector, axis), axis=-1)
    return np.asarray(np.arctan2(across, vector @ axis))


def _swings(design: Design, r: FloatArray) -> Iterator[Constraint]:
    b1x, b1y = design.b1
    # Where in p each leg has no length.
    apexes = (
        -(b1x * r[:, 0] + b1y * r[:, 1]),
        -design.b2 * r[:, 0],
        -design.b3 * r[:, 0],
        np.array([*design.a3, 0.0]),
    )
    for each in joint_cones(design):
        name = f"swing {each.joint}"
        if each.axis is None:
            yield Never(name)
            continue
        axis = r @ each.axis if each.in_platform else each.axis
        yield Cone(name, apexes[each.leg - 1], axis, each.half_angle, each.leg in (2, 3))


def home_signs(design: Design) -> tuple[int, int, int]:
    """Return the sign triple of the design's home pose."""
    home = home_pose(design)
    return signs_of(int(mode_of(margins(home.position, home.rotation))))


def demanded_order(design: Design) -> int:
    """Return the sign of d3 − d1 that a design's limits demand, that of its home; 0 for either.

    Where the carriages coincide in the home pose, to the tolerance, there is no order to keep.
    """
    if design.limits.carriage_order == "any":
        return 0
    apart = (design.b3 - design.b2) * float(home_pose(design).rotation[0, 0])
    if abs(apart) <= design.tolerance:
        return 0
    return 1 if apart > 0.0 else -1


PARAMETERS = (*VARIABLES, YAW)
"""What every workspace depends on, besides its limits."""
