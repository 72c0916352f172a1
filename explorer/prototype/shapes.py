"""The parts as closed meshes by manifold3d, and whether they overlap.

The only module of the prototype that uses manifold3d.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from explorer.errors import ExplorerError
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray
from explorer.prototype.chains import Places
from explorer.prototype.forms import forms_of
from explorer.prototype.kernel import Circle
from explorer.prototype.part import Part
from explorer.prototype.sizes import Sizes

if TYPE_CHECKING:
    from manifold3d import Manifold

SEGMENTS = 48
"""Edges of a circle."""


def parts_of(sizes: Sizes) -> tuple[Part, ...]:
    """Return all parts, the base first.

    Raises:
        ExplorerError: a boolean fails.
    """
    unit = sizes.design.unit_mm
    return tuple(
        _part(name, body, shape, unit) for name, body, shape in forms_of(sizes, MeshKernel())
    )


class MeshKernel:
    """Makes bodies of plane faces: chords of circles, within them but for holes."""

    def disc(self, circle: Circle, low: float, high: float) -> Manifold:
        """Return a cylinder along z between two heights."""
        from manifold3d import Manifold

        made = Manifold.cylinder(high - low, circle.radius, circle.radius, SEGMENTS)
        return made.translate((circle.x, circle.y, low))

    def hole(self, circle: Circle, low: float, high: float) -> Manifold:
        """Return what to cut out for a round hole, whose chords lie outside the circle."""
        return self.disc(
            circle._replace(radius=circle.radius / math.cos(math.pi / SEGMENTS)), low, high
        )

    def ball(self, radius: float) -> Manifold:
        """Return a ball about the origin."""
        from manifold3d import Manifold

        return Manifold.sphere(radius, SEGMENTS)

    def cavity(self, radius: float) -> Manifold:
        """Return what to cut out for a ball about the origin."""
        return self.ball(radius / _inscribed())

    def box(self, low: Triple, high: Triple) -> Manifold:
        """Return a box between two corners."""
        from manifold3d import Manifold

        x, y, z = (b - a for a, b in zip(low, high, strict=True))
        return Manifold.cube((x, y, z)).translate(low)

    def union(self, shapes: Sequence[Manifold]) -> Manifold:
        """Return the union of some shapes."""
        from manifold3d import Manifold, OpType

        return Manifold.batch_boolean(list(shapes), OpType.Add)

    def hull(self, circles: Sequence[Circle], low: float, high: float) -> Manifold:
        """Return a plate between two heights, whose outline is the convex hull of circles."""
        from manifold3d import Manifold

        return Manifold.batch_hull([self.disc(each, low, high) for each in circles])


@functools.cache
def _inscribed() -> float:
    """Return how near the faces of a ball of radius 1 come to its centre."""
    mesh: Any = MeshKernel().ball(1.0).to_mesh64()
    corners = np.array(mesh.vert_properties)[:, :3][np.array(mesh.tri_verts)]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normals = np.cross(b - a, c - a)
    distances = np.einsum("ij,ij->i", normals, a) / np.linalg.norm(normals, axis=1)
    return float(distances.min())


def overlaps(parts: Sequence[Part], places: Places) -> Iterator[tuple[str, str, float]]:
    """Yield the pairs of parts that share a volume, and the volume in cubed design units.

    Args:
        parts: Those to look at.
        places: Where the bodies are, at one pose.

    Raises:
        ExplorerError: a boolean fails.
    """
    known, boxes = _placed(parts, places)
    for j, second in enumerate(known):
        for i, first in enumerate(known[:j]):
            if _touching(boxes[i], boxes[j]):
                volume = float(_sound(first ^ second).volume())
                if volume > 0.0:
                    yield parts[i].name, parts[j].name, volume


def least_gap(parts: Sequence[Part], places: Places, within: float) -> tuple[float, str, str]:
    """Return the least distance of two parts, and their names.

    Args:
        parts: Those to look at.
        places: Where the bodies are, at one pose.
        within: Distances beyond it are not looked for, in design units.
    """
    known, boxes = _placed(parts, places)
    found = (within, "", "")
    for j, second in enumerate(known):
        for i, first in enumerate(known[:j]):
            low, high = boxes[i]
            if _touching((low - found[0], high + found[0]), boxes[j]):
                gap = float(first.min_gap(second, found[0]))
                if gap < found[0]:
                    found = (gap, parts[i].name, parts[j].name)
    return found


def _placed(
    parts: Sequence[Part], places: Places
) -> tuple[list[Manifold], list[tuple[FloatArray, FloatArray]]]:
    """Return the parts at one pose, and the corners of their boxes."""
    from manifold3d import Manifold, Mesh64

    known: list[Manifold] = []
    boxes: list[tuple[FloatArray, FloatArray]] = []
    for part in parts:
        turn, origin = places.rotation[part.body_index], places.origin[part.body_index]
        points = np.ascontiguousarray(part.vertices @ turn.T + origin)
        known.append(Manifold(Mesh64(points, part.faces.astype(np.uint64))))
        boxes.append((points.min(axis=0), points.max(axis=0)))
    return known, boxes


def _touching(one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]) -> bool:
    return bool((one[0] <= other[1]).all() and (other[0] <= one[1]).all())


def _sound(shape: Manifold) -> Manifold:
    from manifold3d import Error

    if shape.status() != Error.NoError:
        raise ExplorerError(f"the body of a part cannot be made: {shape.status().name}")
    return shape


def _part(name: str, body: str, shape: Manifold, unit_mm: float) -> Part:
    mesh: Any = _sound(shape).to_mesh64()
    vertices = np.array(mesh.vert_properties, dtype=np.float64)[:, :3] / unit_mm
    return Part(name, body, vertices, np.array(mesh.tri_verts, dtype=np.int32))
