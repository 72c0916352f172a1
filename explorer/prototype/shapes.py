"""The parts as closed meshes, made by manifold3d.

No other module of the prototype uses manifold3d.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from explorer.errors import ExplorerError
from explorer.mechanism.pose import Triple
from explorer.prototype.forms import forms_of
from explorer.prototype.kernel import Circle
from explorer.prototype.part import Part
from explorer.prototype.sizes import Sizes

if TYPE_CHECKING:
    from manifold3d import Manifold

SEGMENTS = 48
"""Number of edges of a circle."""


def make_parts(sizes: Sizes) -> tuple[Part, ...]:
    """Make all parts, the base first.

    Raises:
        ExplorerError: a boolean fails.
    """
    unit = sizes.design.unit_mm
    return tuple(
        _part(name, body, shape, unit) for name, body, shape in forms_of(sizes, MeshKernel())
    )


class MeshKernel:
    """A maker of polyhedra: inscribed in round shapes, circumscribed about round holes."""

    def disc(self, circle: Circle, low: float, high: float) -> Manifold:
        """Return a cylinder along z between two heights."""
        from manifold3d import Manifold

        cylinder = Manifold.cylinder(high - low, circle.radius, circle.radius, SEGMENTS)
        return cylinder.translate((circle.x, circle.y, low))

    def hole(self, circle: Circle, low: float, high: float) -> Manifold:
        """Return the tool that cuts a round hole; its chords lie outside the circle."""
        radius = circle.radius / math.cos(math.pi / SEGMENTS)
        return self.disc(circle._replace(radius=radius), low, high)

    def ball(self, radius: float) -> Manifold:
        """Return a ball about the origin."""
        from manifold3d import Manifold

        return Manifold.sphere(radius, SEGMENTS)

    def cavity(self, radius: float) -> Manifold:
        """Return the tool that cuts a seat for a ball about the origin."""
        return self.ball(radius / _inscribed_radius())

    def box(self, low: Triple, high: Triple) -> Manifold:
        """Return a box between two corners."""
        from manifold3d import Manifold

        x, y, z = (b - a for a, b in zip(low, high, strict=True))
        return Manifold.cube((x, y, z)).translate(low)

    def union(self, shapes: Sequence[Manifold]) -> Manifold:
        """Return the union of shapes."""
        from manifold3d import Manifold, OpType

        return Manifold.batch_boolean(list(shapes), OpType.Add)

    def hull(self, circles: Sequence[Circle], low: float, high: float) -> Manifold:
        """Return a plate between two heights, whose outline is the convex hull of circles."""
        from manifold3d import Manifold

        return Manifold.batch_hull([self.disc(circle, low, high) for circle in circles])


@functools.cache
def _inscribed_radius() -> float:
    """Return the inner radius of the polyhedron for a ball of radius 1."""
    mesh: Any = MeshKernel().ball(1.0).to_mesh64()
    corners = np.array(mesh.vert_properties)[:, :3][np.array(mesh.tri_verts)]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normals = np.cross(b - a, c - a)
    distances = np.einsum("ij,ij->i", normals, a) / np.linalg.norm(normals, axis=1)
    return float(distances.min())


def _part(name: str, body: str, shape: Manifold, unit_mm: float) -> Part:
    from manifold3d import Error

    if shape.status() != Error.NoError:
        raise ExplorerError(f"the {name} cannot be made: manifold3d reports {shape.status().name}")
    mesh: Any = shape.to_mesh64()
    vertices = np.array(mesh.vert_properties, dtype=np.float64)[:, :3] / unit_mm
    return Part(name, body, vertices, np.array(mesh.tri_verts, dtype=np.int32))
