"""A table on six legs (a Stewart-Gough platform), and its poses; all lengths in millimetres.

Each leg joins a point of the base to one of the platform and is one prismatic actuator between two
spherical joints, or a universal and a spherical one. At one orientation a length of a leg is a
ball of positions of the platform's origin, about the base point less the turned platform point,
and the swing of a leg a cone.
"""

from __future__ import annotations

import math
from functools import cached_property
from itertools import product
from typing import Any, Literal

import msgspec
import numpy as np
from msgspec.structs import force_setattr as _set
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import DesignError
from explorer.measures.snapshot import Indices
from explorer.mechanism.built_machine import BuiltPose
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Pose, Quadruple, Triple, rotation_array
from explorer.numerics import checks
from explorer.numerics.arrays import (
    FloatArray,
    batch_shape,
    finite_array,
    lengths_of,
    position_array,
    triple,
)
from explorer.numerics.number_text import Unit
from explorer.workspace.limits.constraints import AXES, BallOrCylinder, Cone, Constraint

LONGEST = 100_000.0
"""Largest length of a leg or coordinate of a point of a table, in millimetres."""

# Most characters of a source.
LONGEST_SOURCE = 1000

MOST_CONE = 179.0
"""Largest half-angle of a cone, in degrees."""

# Steps of Newton's method, the longest of them over the longest leg, and the largest error of
# lengths that close, over it.
STEPS, LONGEST_STEP, CLOSED = 60, 0.3, 1e-12
# |det J| with lengths over the size of the base up to which a pose is singular but for rounding.
SINGULAR = 1e-12

Points = tuple[Triple, Triple, Triple, Triple, Triple, Triple]


class TableHome(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The home pose of a table.

    Attributes:
        position_mm: The platform's origin in the base frame, in millimetres.
        quaternion: (w, x, y, z), platform to base.
    """

    position_mm: Triple
    quaternion: Quadruple = (1.0, 0.0, 0.0, 0.0)


class SixLegged(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A table on six legs, as its file states it.

    Attributes:
        schema: Version of the file format.
        kind: The word by which the file is told from a design.
        name: One printable line.
        base_mm: The ends of the legs at the base, in the base frame, in millimetres.
        platform_mm: Their ends at the platform, in its frame, in millimetres.
        shortest_mm: Least lengths of the legs, in millimetres.
        longest_mm: Largest lengths, in millimetres.
        cones_deg: Half-angles, in degrees, of the cones about the legs at home within which each
            leg stays, as seen from the base and from the platform; None for no bound.
        home: The home pose.
        source: Where the numbers are from; "" if nothing is said.

    Raises:
        DesignError: A value is out of range, a leg cannot reach home, or every pose is singular.
    """

    schema: Literal[1] = 1
    kind: Literal["table"] = "table"
    name: str = "table"
    base_mm: Points
    platform_mm: Points
    shortest_mm: Six
    longest_mm: Six
    cones_deg: Six | None = None
    home: TableHome
    source: str = ""

    def __post_init__(self) -> None:
        _set(self, "name", checks.title("name", self.name))
        if self.source:
            _set(self, "source", checks.title("source", self.source, LONGEST_SOURCE))
        for name in ("base_mm", "platform_mm"):
            points = finite_array(name, getattr(self, name), (6, 3), LONGEST)
            _set(self, name, tuple(map(triple, points)))
        for name in ("shortest_mm", "longest_mm"):
            _set(self, name, tuple(checks.numbers(name, getattr(self, name), 6, LONGEST)))
        if self.cones_deg is not None:
            cones = checks.numbers("cones_deg", self.cones_deg, 6)
            if not all(0.0 < cone <= MOST_CONE for cone in cones):
                raise DesignError(
                    f"cones_deg are half-angles above 0° and up to {MOST_CONE:g}°; got {cones}; "
                    "null for no bound",
                    "cones_deg",
                )
            _set(self, "cones_deg", tuple(cones))
        checks.instance("home", self.home, TableHome)
        home = Pose(self.home.position_mm, self.home.quaternion)
        _set(self, "home", TableHome(home.position, home.quaternion))
        at_home = zip(self.home_lengths.tolist(), self.shortest_mm, self.longest_mm, strict=True)
        for leg, (length, low, high) in enumerate(at_home, 1):
            if not (0.0 <= low < high and low <= length <= high):
                raise DesignError(
                    f"leg {leg} has {length:.6g} mm at home, which must lie within its shortest_mm "
                    f"{low:g} and longest_mm {high:g}: change these, or home"
                )
            if self.cones_deg is not None and not length:
                raise DesignError(
                    f"leg {leg} has no length at home, so that its cone has no axis: change home, "
                    "or give null as cones_deg"
                )
        # Near home, since a table may be singular there alone.
        turns = Rotation.from_rotvec([(0.0, 0.0, 0.0), *product((-0.3, 0.4), repeat=3)])
        positions = np.array(home.position) + 0.1 * self.base_size * turns.as_rotvec()
        poses = TablePoses(self, positions, turns.as_matrix() @ home.rotation)
        if not self.base_size or (poses.manipulability < SINGULAR).all():
            raise DesignError(
                "every pose is singular: the six legs never fix the platform; move some of the "
                "points of base_mm or platform_mm"
            )

    @property
    def reach(self) -> float:
        """The longest leg, in millimetres."""
        return max(self.longest_mm)

    @property
    def base_size(self) -> float:
        """The largest distance of two base points, as |a1 a3| is for a design, in millimetres.

        Lengths in J are taken over it: no stroke changes it.
        """
        points = np.array(self.base_mm)
        return float(lengths_of(points[:, None] - points).max())

    @property
    def unit_mm(self) -> float:
        """The millimetres in a unit of the table, 1."""
        return 1.0

    @property
    def millimetres(self) -> Unit:
        """The unit of lengths."""
        return Unit("mm")

    @property
    def home_pose(self) -> Pose:
        """The home pose, in millimetres."""
        return Pose(self.home.position_mm, self.home.quaternion)

    @property
    def home_poses(self) -> TablePoses:
        """The table in its home pose."""
        home = self.home_pose
        return TablePoses(self, home.position, home.rotation)

    @property
    def home_lengths(self) -> FloatArray:
        """The lengths of the legs at home, shape (6,), in millimetres."""
        return self.home_poses.lengths

    def limits(self, rotation: FloatArray) -> tuple[Constraint, ...]:
        """Return the lengths and cones as solids of positions at an orientation (3, 3).

        The parameters of their rates are "base 1 x", "platform 1 x", "leg 1 minimum" and
        "leg 1 maximum", with legs 1 to 6 and axes x, y, z.
        """
        solids: list[Constraint] = []
        turned, home = np.array(self.platform_mm) @ rotation.T, self.home_poses
        for k, apex in enumerate(np.array(self.base_mm) - turned):
            rates = {f"base {k + 1} {axis}": row for axis, row in zip("xyz", AXES, strict=True)}
            rates |= {f"platform {k + 1} {a}": -rotation[:, i] for i, a in enumerate("xyz")}
            for end, radius, inside in (
                ("minimum", self.shortest_mm[k], False),
                ("maximum", self.longest_mm[k], True),
            ):
                if radius > 0.0:
                    name = f"leg {k + 1} {end}"
                    by = {key: np.array([*rate, 0.0]) for key, rate in rates.items()}
                    by[name] = np.array([0.0, 0.0, 0.0, 1.0])
                    solids.append(BallOrCylinder(name, apex, radius, True, inside, by))
            if self.cones_deg is not None:
                axis = home.directions[k]
                angle = math.radians(self.cones_deg[k])
                # At home's orientation both cones are one.
                of_platform = rotation @ home.rotation.T @ axis
                solids.append(Cone(f"cone {k + 1} at the base", apex, axis, angle, flat=False))
                if not np.allclose(of_platform, axis, rtol=0.0, atol=1e-12):
                    name = f"cone {k + 1} at the platform"
                    solids.append(Cone(name, apex, of_platform, angle, flat=False))
        return tuple(solids)

    def forward(
        self,
        lengths_mm: ArrayLike,
        position: ArrayLike | None = None,
        rotation: ArrayLike | None = None,
    ) -> BuiltPose:
        """Return poses with lengths (..., 6), by Newton's method from home or from other starts.

        There may be up to 40 poses with the same lengths, of which one is found from each start:
        from home the one that a machine reaches, as long as the lengths are near to home's. Starts
        have the shapes (..., 3), in millimetres, and (..., 3, 3). Where the steps do not converge,
        `closes` is False; a singular start may never be left.

        Raises:
            InputError: Lengths are not finite, or a start is no pose, or they do not broadcast.
        """
        home = self.home_pose
        lengths = finite_array("lengths_mm", lengths_mm, (6,), LONGEST)
        p = position_array("position", home.position if position is None else position)
        r = rotation_array(home.rotation if rotation is None else rotation)
        scale = np.repeat([1.0, 1.0 / self.base_size], 3)
        for _ in range(STEPS):
            poses = TablePoses(self, p, r)
            j, off = poses.homogeneous, (lengths - poses.lengths)[..., None]
            across = np.swapaxes(j, -1, -2)
            # A little damping, as a start may be singular.
            step = np.linalg.solve(across @ j + SINGULAR * np.eye(6), across @ off)[..., 0]
            size = np.linalg.norm(step, axis=-1, keepdims=True)
            step *= scale * np.minimum(1.0, LONGEST_STEP * self.reach / np.maximum(size, 1e-300))
            turns = Rotation.from_rotvec(step[..., 3:].reshape(-1, 3)).as_matrix()
            p, r = p + step[..., :3], turns.reshape(*step.shape[:-1], 3, 3) @ r
        off = np.abs(TablePoses(self, p, r).lengths - lengths).max(axis=-1)
        return BuiltPose(p, r, np.asarray(off <= CLOSED * self.reach))


def table_of(**fields: Any) -> SixLegged:
    """Return a table with fields of `SixLegged`, which may be arrays."""
    return SixLegged(**fields)


class TablePoses(Indices):
    """A table in a pose or a batch of poses, with its indices.

    Args:
        table: The table.
        position: The platform's origin in the base frame, shape (..., 3), in millimetres.
        rotation: Platform to base, shape (..., 3, 3).

    Raises:
        InputError: A position is not finite, a rotation is not one, or they do not broadcast.
    """

    def __init__(self, table: SixLegged, position: ArrayLike, rotation: ArrayLike) -> None:
        self.table = table
        self.position = position_array("position", position)
        self.rotation = rotation_array(rotation)
        batch_shape((self.position, 1), (self.rotation, 2))

    @cached_property
    def joint_arms(self) -> FloatArray:
        """The vectors from the platform's origin to its points along base axes, (..., 6, 3)."""
        return np.array(self.table.platform_mm) @ np.swapaxes(self.rotation, -1, -2)

    @cached_property
    def ends(self) -> FloatArray:
        """Both ends of each leg in the base frame, shape (..., 6, 2, 3), in millimetres."""
        tips = self.position[..., None, :] + self.joint_arms
        return np.stack([np.broadcast_to(np.array(self.table.base_mm), tips.shape), tips], axis=-2)

    @cached_property
    def lengths(self) -> FloatArray:
        """The lengths of the legs, shape (..., 6), in millimetres."""
        return lengths_of(self.ends[..., 1, :] - self.ends[..., 0, :])

    @cached_property
    def directions(self) -> FloatArray:
        """The unit vectors of the legs from base to platform, shape (..., 6, 3); 0 without one."""
        legs, lengths = self.ends[..., 1, :] - self.ends[..., 0, :], self.lengths[..., None]
        return np.divide(legs, lengths, out=np.zeros_like(legs), where=lengths > 0.0)

    @cached_property
    def jacobian(self) -> FloatArray:
        """J at the platform's origin: rates of the lengths = J @ (v; ω), shape (..., 6, 6).

        Columns 4 to 6 are in millimetres. The sign of det J is no assembly mode: modes of a table
        may share it.
        """
        moments = np.cross(np.broadcast_to(self.joint_arms, self.directions.shape), self.directions)
        return np.concatenate([self.directions, moments], axis=-1)

    @property
    def homogeneous(self) -> FloatArray:
        """J with lengths over the size of the base, shape (..., 6, 6)."""
        return self.jacobian / np.repeat([1.0, self.table.base_size], 3)

    @cached_property
    def singular_values(self) -> FloatArray:
        """The singular values of `homogeneous`, descending, shape (..., 6)."""
        return np.asarray(np.linalg.svd(self.homogeneous, compute_uv=False), dtype=np.float64)

    @cached_property
    def twists(self) -> FloatArray:
        """J⁻¹, shape (..., 6, 6): twist of the platform's origin = J⁻¹ @ rates of the lengths."""
        is_singular = (self.manipulability < SINGULAR)[..., None, None]
        regular = np.where(is_singular, np.eye(6), self.jacobian)
        return np.where(is_singular, np.inf, np.linalg.inv(regular))
