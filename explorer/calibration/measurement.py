"""What is measured of a machine in its poses, and how it depends on them and on the setup.

Lengths are in design units and angles in radians, standard deviations too.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray, IntArray, dot, finite_array, lengths_of

Kind = Literal["poses", "targets", "bar", "gauge"]
"""What is measured: whole poses, positions of points of the platform, distances of one from a ball
of the base, or distances of one from planes."""

STEP = 1e-6
"""Difference by which slopes are taken, in radians and design units."""


@dataclass(frozen=True, eq=False)
class Measurement:
    """What was measured in n poses, and the setup as far as it is known.

    Unknowns are added to what is stated here: of points, then of the frame, the ball or the planes.

    Attributes:
        kind: What is measured.
        values: Values, shape (n, m), NaN where there is none: position and rotation vector of the
            platform's frame, the positions of all points, or one distance.
        sigma: Standard deviations of their errors, of a shape that broadcasts to (n, m).
        points: Measured points in the platform frame, shape (s, 3); the origin for whole poses.
        points_known: Whether they are there exactly, as is the origin.
        in_base: Whether poses and targets are in the base frame, rather than in another fixed one.
        base: Ball of the base, shape (1, 3), or planes, shape (p, 4): normals, and distances of
            the planes from the origin.
        plane: Planes of the poses, shape (n,), in turn if there are fewer.

    Raises:
        InputError: Values are not rows of numbers, or a deviation is not positive.
    """

    kind: Kind
    values: FloatArray
    sigma: FloatArray
    points: FloatArray = field(default_factory=lambda: np.zeros((1, 3)))
    points_known: bool = False
    in_base: bool = True
    base: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    plane: IntArray = field(default_factory=lambda: np.zeros(1, dtype=np.int64))

    def __post_init__(self) -> None:
        columns = {"poses": 6, "targets": self.points.size}.get(self.kind, 1)
        if self.values.shape[1:] != (columns,) or np.isinf(self.values).any():
            raise InputError(
                f"measured {self.kind} must be rows of {columns} numbers, finite or NaN, one for "
                f"each pose; got the shape {self.values.shape}"
            )
        if (finite_array("sigma", self.sigma, ()) <= 0.0).any():
            raise InputError(f"sigma must be positive; got {np.min(self.sigma):g}")
        shape = np.shape(self.sigma)
        if shape not in ((), (1,), (columns,), (len(self.values), 1), self.values.shape):
            raise InputError(
                f"sigma must be one number, one for each of {columns} columns, or one for each "
                f"value; got the shape {shape}"
            )

    @property
    def point_unknowns(self) -> int:
        """Number of unknowns of the points."""
        return 0 if self.points_known or self.kind == "poses" else self.points.size

    @property
    def unknowns(self) -> int:
        """Number of unknowns of the setup."""
        return self.point_unknowns + 3 * len(self.base) + (0 if self.in_base else 6)

    def model(self, position: FloatArray, rotation: FloatArray, unknowns: FloatArray) -> FloatArray:
        """Return the values in poses (n, 3) and (n, 3, 3), given unknowns (k,), shape (n, m)."""
        count, moved = self.point_unknowns, np.zeros(self.points.size)
        moved[:count] = unknowns[:count]
        off = unknowns[count:]
        places = self.points + moved.reshape(-1, 3)
        points = position[:, None] + places @ np.swapaxes(rotation, 1, 2)
        if self.kind == "bar":
            return lengths_of(points - self.base - off)
        if self.kind == "gauge":
            # Of a plane, two tilts and the distance are unknown.
            off, normals = off.reshape(-1, 1, 3), self.base[:, None, :3]
            normals = normals + off[..., :2] @ np.linalg.svd(normals)[2][:, 1:]
            normals /= lengths_of(normals)[..., None]
            distances = off[..., 2] + self.base[:, 3:]
            plane = np.resize(self.plane, len(points))
            return dot(points, normals[plane]) - distances[plane]
        turn = np.eye(3) if self.in_base else Rotation.from_rotvec(off[:3]).as_matrix()
        values = (points @ turn.T + (0.0 if self.in_base else off[3:])).reshape(len(points), -1)
        if self.kind == "targets":
            return values
        return np.concatenate([values, Rotation.from_matrix(turn @ rotation).as_rotvec()], axis=1)

    def slopes(
        self, position: FloatArray, rotation: FloatArray, unknowns: FloatArray
    ) -> FloatArray:
        """Return slopes of the model by the twist (v; ω) of the platform's frame and the unknowns.

        They are differences, shape (n, m, 6 + k).
        """
        here, columns = self.model(position, rotation, unknowns), list[FloatArray]()
        for off in STEP * np.eye(6 + len(unknowns)):
            turned = Rotation.from_rotvec(off[3:6]).as_matrix() @ rotation
            there = self.model(position + off[:3], turned, unknowns + off[6:])
            columns.append(self.differences(there, here) / STEP)
        return np.stack(columns, axis=-1)

    def differences(self, values: FloatArray, others: FloatArray) -> FloatArray:
        """Return values less others, each (n, m), turns from one to the other as such."""
        off = values - others
        if self.kind == "poses":
            turns = np.nan_to_num(values[:, 3:]), np.nan_to_num(others[:, 3:])
            there, here = map(Rotation.from_rotvec, turns)
            off[:, 3:] = np.where(np.isnan(off[:, 3:]), np.nan, (there * here.inv()).as_rotvec())
        return off

    def square_distances(self, off: FloatArray) -> FloatArray:
        """Return mean squared distances of the points of n poses, (n,), by differences (n, m)."""
        lengths = off[:, :3] if self.kind == "poses" else off
        return mean_squares(lengths) * min(3, lengths.shape[1])

    def align(self, position: FloatArray, rotation: FloatArray) -> Measurement:
        """Return the measurement moved as a whole, so that its points fit those of poses best.

        The poses are of shape (n, 3) and (n, 3, 3). In the base frame nothing is moved.

        Raises:
            InputError: There are fewer than three points.
        """
        if self.in_base:
            return self
        there = self.values[:, : self.points.size].reshape(-1, 3)
        here = (position[:, None] + self.points @ np.swapaxes(rotation, 1, 2)).reshape(-1, 3)
        known = np.isfinite(there + here).all(axis=1)
        if known.sum() < 3:
            raise InputError("a frame of its own is placed by three measured points at least")
        middles = there[known].mean(axis=0), here[known].mean(axis=0)
        turn = Rotation.align_vectors(here[known] - middles[1], there[known] - middles[0])[0]
        values = (turn.apply(there - middles[0]) + middles[1]).reshape(len(position), -1)
        if self.kind == "poses":
            vectors = (turn * Rotation.from_rotvec(np.nan_to_num(self.values[:, 3:]))).as_rotvec()
            values = np.concatenate([values, vectors + 0.0 * self.values[:, 3:]], axis=1)
        return replace(self, values=values)


def setup_of(
    design: Design,
    kind: Kind,
    points: ArrayLike | None = None,
    sigma_mm: float = 0.01,
    sigma_deg: float = 0.005,
    base: ArrayLike | None = None,
    *,
    points_known: bool = False,
    in_base: bool = True,
) -> Measurement:
    """Return the setup of a measurement of a design, without values, as far as it is known.

    The points are one to three targets, or that of a bar or gauge, shape (s, 3); the tool for None.
    The base has the ball of a bar, shape (1, 3), or up to three planes of a gauge, shape (p, 4), of
    normals of any length, and distances; the plane z = 0 for None. The standard deviations are
    those of lengths and turns, the rest is that of a `Measurement`; bars and gauges are in the base
    frame always.

    Raises:
        InputError: Targets or ball are not given, points are too many, or a normal is zero.
    """
    length = np.array(sigma_mm / design.unit_mm)
    if kind == "poses":
        sigma = np.repeat([length, np.radians(sigma_deg)], 3)
        return Measurement(kind, np.empty((0, 6)), sigma, in_base=in_base)
    if points is None and kind == "targets":
        raise InputError("targets need a table of where they are (--targets): columns x, y, z")
    at = design.tool.position if points is None else points
    places = np.atleast_2d(finite_array("points", at, (3,)))
    if len(places) > (most := 3 if kind == "targets" else 1):
        raise InputError(f"{kind}: points of the platform are at most {most}; got {len(places)}")
    ends = np.zeros((0, 3))
    if kind == "bar":
        if base is None:
            raise InputError("--ball X Y Z says about where the ball of the base is")
        ends = np.atleast_2d(finite_array("ball", base, (3,)))
    elif kind == "gauge":
        planes = (0.0, 0.0, 1.0, 0.0) if base is None else base
        ends = np.atleast_2d(finite_array("planes", planes, (4,)))
        sizes = lengths_of(ends[:, :3])[:, None]
        if not sizes.all():
            raise InputError("the normal of a plane must not be all zeros")
        ends = np.hstack([ends[:, :3] / sizes, ends[:, 3:]])
    return Measurement(
        kind,
        np.empty((0, places.size if kind == "targets" else 1)),
        length,
        places,
        points_known=points_known,
        in_base=in_base or kind != "targets",
        base=ends,
        plane=np.arange(len(ends)),
    )


def mean_squares(values: FloatArray) -> FloatArray:
    """Return the mean squares of rows (n, m), shape (n,); NaN for those without a number."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.nansum(values**2, axis=1) / np.isfinite(values).sum(axis=1))
