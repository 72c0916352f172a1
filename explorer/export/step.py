"""The workspace as STEP: true spheres, cylinders, cones and planes.

Each limit of the workspace is an exact primitive of OpenCASCADE, which the booleans keep, so that
the file is small and its volume is that of `explorer.workspace.slices.volume`; each face has the
name and the colour of its limit. AP242, in millimetres of the base frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.errors import ExplorerError, NoAnswerError
from explorer.export import opencascade as cad
from explorer.export.mesh import colour_of
from explorer.export.opencascade import Document, ExactShape, occ, primitive
from explorer.files.extras import check_extra
from explorer.measures.box import corners_of
from explorer.numerics.arrays import FloatArray, triple
from explorer.workspace.limits.constraints import BallOrCylinder, Cone, Constraint
from explorer.workspace.limits.region import Region
from explorer.workspace.slices.volume import volume_of
from explorer.workspace.workspace import Workspace

GOOD_ERROR, LARGEST_ERROR = 1e-6, 1e-4
"""Relative errors of the volume: the first is accepted at once, beyond the last is refused."""

# Overhang of the first box over the workspace, relative to the largest extent.
_BEYOND = 0.1
# Size of half-spaces, relative to the largest extent.
_FAR = 4.0


@dataclass(frozen=True)
class ExactSolid:
    """The workspace as a `TopoDS_Shape` in millimetres, with the limit of each of its faces."""

    shape: Any
    limit_of_face: tuple[str, ...]

    @property
    def volume(self) -> float:
        """The volume in cubic millimetres, integrated over the exact faces."""
        return cad.volume_of(self.shape)

    def shift(self, offset: FloatArray) -> ExactSolid:
        """Return the solid moved by a vector in millimetres, shape (3,)."""
        return replace(self, shape=ExactShape(self.shape).translate(triple(offset)).shape)


def exact_workspace(workspace: Workspace) -> ExactSolid:
    """Return a workspace with its exact faces.

    Raises:
        MissingExtraError: OpenCASCADE is not installed.
        NoAnswerError: The workspace is empty.
        ExplorerError: A boolean operation fails, or OpenCASCADE is off by too much of the volume.
    """
    check_extra("cad")
    exact = volume_of(workspace)
    if exact.volume <= 0.0:
        reason = ", ".join(exact.empty_because)
        raise NoAnswerError(f"there is nothing to export, the workspace is empty: {reason}")
    limits, unit = workspace.limits, workspace.design.unit_mm
    lows, highs = (end * unit for end in workspace.region.ends)
    best, least_error = None, math.inf
    for shape in _Primitives(lows, highs, unit).attempts(limits, workspace.region):
        faces = cad.faces_of(shape)
        solid = ExactSolid(shape, tuple(_limit_of(face, limits, unit) for face in faces))
        error = abs(solid.volume / unit**3 - exact.volume) / exact.volume
        if error < least_error:
            best, least_error = solid, error
        if least_error <= GOOD_ERROR + exact.error / exact.volume:
            break
    if best is None or least_error > LARGEST_ERROR + exact.error / exact.volume:
        raise ExplorerError(
            f"OpenCASCADE is off by {least_error:.1g} of the volume of this workspace, which may "
            "be too thin for it; as 3mf, ply or stl it can be exported"
        )
    return best


Step: TypeAlias = tuple[ExactShape, bool]
"""A primitive and whether it keeps positions inside."""


class _Primitives:
    """The primitives of the limits, in millimetres, as large as a box of positions needs."""

    def __init__(self, lows: FloatArray, highs: FloatArray, unit: float) -> None:
        self.unit = unit
        self.size = float((highs - lows).max())
        self.lows = lows - _BEYOND * self.size
        self.highs = highs + _BEYOND * self.size

    def attempts(self, limits: tuple[Constraint, ...], region: Region) -> Iterator[Any]:
        """Yield the intersection of the limits of a region, computed in several orders.

        Where surfaces nearly touch, the booleans fail in some orders only.
        """
        steps = list(self._steps(limits, region))
        half = len(steps) // 2
        for order in (steps, steps[::-1], steps[half:] + steps[:half]):
            shape = primitive("Box", cad.point(self.lows), cad.point(self.highs))
            for block, inside in order:
                shape = shape ^ block if inside else shape - block
            yield shape.shape

    def _steps(self, limits: tuple[Constraint, ...], region: Region) -> Iterator[Step]:
        """Yield the primitives that bound the region, and whether they keep p inside."""
        corners = corners_of(np.array([self.lows, self.highs]))
        for plane in (region.low_limit, region.high_limit, *region.plane_limits):
            if plane and (corners @ plane.normal).max() > plane.offset * self.unit:
                yield self._half_space(plane.normal, plane.offset), True
        for limit in region.circle_limits:
            axes, radius = slice(0 if limit.is_ball else 1, 3), limit.radius * self.unit
            centre = limit.centre * self.unit
            gaps = np.maximum(0.0, np.maximum(self.lows - centre, centre - self.highs))
            near = np.linalg.norm(gaps[axes])
            far = np.linalg.norm((corners - centre)[:, axes], axis=1).max()
            if radius < far if limit.inside else radius > near:
                yield self._round(limit), limit.inside
        for limit in limits:
            if isinstance(limit, Cone):
                yield from self._cone(limit)

    def _half_space(self, normal: FloatArray, offset: float) -> ExactShape:
        """Return the block of the positions with normal · p <= offset."""
        length = float(np.linalg.norm(normal))
        unit_normal = normal / length
        middle = 0.5 * (self.lows + self.highs)
        foot = middle + (offset * self.unit / length - middle @ unit_normal) * unit_normal
        frame: Any = occ("gp_Ax2")(cad.point(foot), cad.direction(-unit_normal))
        far = _FAR * self.size
        x, y = (cad.coordinates(axis) for axis in (frame.XDirection(), frame.YDirection()))
        frame.SetLocation(cad.point(foot - far * (x + y)))
        return primitive("Box", frame, 2.0 * far, 2.0 * far, 2.0 * far)

    def _round(self, limit: BallOrCylinder) -> ExactShape:
        radius, centre = limit.radius * self.unit, limit.centre * self.unit
        if limit.is_ball:
            away = self._away(centre)
            aside = _cross(away, np.eye(3)[np.abs(away).argmin()])
            return primitive("Sphere", self._frame(centre, aside), radius)
        start = np.array([self.lows[0] - self.size, centre[1], centre[2]])
        frame = self._frame(start, np.array([1.0, 0.0, 0.0]))
        length = float(self.highs[0] - self.lows[0]) + 2.0 * self.size
        return primitive("Cylinder", frame, radius, length)

    def _away(self, point: FloatArray) -> FloatArray:
        """Return a vector from the middle of the workspace to a point, never zero."""
        away = point - 0.5 * (self.lows + self.highs)
        return away if np.linalg.norm(away) > 1e-9 * self.size else np.array([0.0, 0.0, 1.0])

    def _frame(self, origin: FloatArray, axis: FloatArray) -> Any:
        """Return a frame whose seam is away from the workspace, where it would break booleans."""
        away = self._away(origin)
        across = _cross(_cross(axis, away), axis)
        if np.linalg.norm(across) <= 1e-9 * np.linalg.norm(away) * (axis @ axis):
            return occ("gp_Ax2")(cad.point(origin), cad.direction(axis))
        return occ("gp_Ax2")(cad.point(origin), cad.direction(axis), cad.direction(across))

    def _cone(self, cone: Cone) -> Iterator[Step]:
        """Yield primitives and whether they keep p inside; a section of a cone is a wedge."""
        apex, axis, angle = cone.apex, cone.axis, cone.half_angle
        if cone.flat:
            across = math.hypot(axis[1], axis[2])
            if abs(math.cos(angle)) >= across:
                return
            axis, angle = np.array([0.0, *axis[1:]]) / across, math.acos(math.cos(angle) / across)
        outside = angle > 0.5 * math.pi
        if outside:
            axis, angle = -axis, math.pi - angle
        if abs(math.cos(angle)) < 1e-9:
            yield self._half_space(-axis, -float(axis @ apex)), True
        elif cone.flat:
            # The planes of a wedge meet in a line along x through the apex.
            turns = (np.array([sign * (angle + 0.5 * math.pi), 0.0, 0.0]) for sign in (1, -1))
            normals = [Rotation.from_rotvec(turn).apply(axis) for turn in turns]
            sides = [self._half_space(normal, float(normal @ apex)) for normal in normals]
            if outside:
                yield sides[0] ^ sides[1], False
            else:
                yield from ((side, True) for side in sides)
        else:
            apex = apex * self.unit
            far = np.maximum(np.abs(self.lows - apex), np.abs(self.highs - apex))
            height = 1.1 * float(np.linalg.norm(far))
            frame = self._frame(apex, axis)
            cone_shape = primitive("Cone", frame, 0.0, height * math.tan(angle), height)
            yield cone_shape, not outside


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.cross(a, b), dtype=np.float64)


def _limit_of(face: Any, limits: tuple[Constraint, ...], unit: float) -> str:
    """Return the limit on whose surface a face lies."""
    surface: Any = occ("BRepAdaptor_Surface")(face)
    shares = (1.0 / 3.0, 2.0 / 3.0)
    u0, v0 = float(surface.FirstUParameter()), float(surface.FirstVParameter())
    du, dv = float(surface.LastUParameter()) - u0, float(surface.LastVParameter()) - v0
    samples = [surface.Value(u0 + a * du, v0 + b * dv) for a in shares for b in shares]
    points = np.array([cad.coordinates(point) for point in samples]) / unit
    return min(limits, key=lambda limit: float(limit.distance(points).max())).name


def step_bytes(solid: ExactSolid, name: str) -> bytes:
    """Return a STEP file of a solid, each face with the name and colour of its limit."""
    document = Document()
    top = document.shapes.AddShape(solid.shape, False)
    document.set_name(top, name)
    for face, limit in zip(cad.faces_of(solid.shape), solid.limit_of_face, strict=True):
        label = document.shapes.AddSubShape(top, face)
        document.set_name(label, limit)
        document.set_colour(label, colour_of(limit))
    return document.step()
