"""The parts as closed meshes, made by manifold3d; no other module of the prototype uses it."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from explorer.errors import ExplorerError
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray
from explorer.prototype.chains import BODIES
from explorer.prototype.forms import Circle, Kernel, forms_of
from explorer.prototype.sizes import Sizes
from explorer.prototype.weights import Mass, mesh_mass
from explorer.workspace.solids.solid import Solid

if TYPE_CHECKING:
    from manifold3d import Manifold


@dataclass(frozen=True)
class Part:
    """A part, in design units.

    Attributes:
        name: Unique name, such as "cylinder 2".
        body: Body that it belongs to, one of `explorer.prototype.chains.BODIES`.
        vertices: Vertices in the frame of the body, shape (n, 3).
        faces: Indices of vertices, counter-clockwise from outside, shape (m, 3).
    """

    name: str
    body: str
    vertices: FloatArray
    faces: NDArray[np.int32]

    @property
    def kind(self) -> str:
        """The name without its number, on which the colour depends."""
        return self.name.partition(" ")[0]

    @property
    def body_index(self) -> int:
        """The index of the body in `BODIES`."""
        return BODIES.index(self.body)

    @cached_property
    def solid(self) -> Solid:
        """The part as a closed mesh in its own frame."""
        limit_of_face = np.zeros(len(self.faces), dtype=np.int64)
        return Solid(self.vertices, self.faces, limit_of_face, (self.name,), 0.0)

    @cached_property
    def unit_mass(self) -> Mass:
        """The mass properties at a density of 1, in design units."""
        return mesh_mass(self.vertices, self.faces, 1.0)

    def mass(self, density: float, unit_mm: float) -> Mass:
        """Return the mass properties in kilograms and metres, at a density in kg/m³."""
        metres = 1e-3 * unit_mm
        return self.unit_mass.scaled(metres, density * metres**3)


SEGMENTS = 48
"""Number of edges of a circle."""


def make_parts(sizes: Sizes) -> tuple[Part, ...]:
    """Make all parts, the base first."""
    unit = sizes.design.unit_mm
    return tuple(
        _part(name, body, shape, unit) for name, body, shape in forms_of(sizes, MeshKernel())
    )


class MeshKernel(Kernel):
    """A maker of polyhedra: inscribed in round shapes, circumscribed about round holes."""

    def __init__(self) -> None:
        import manifold3d

        self._library = manifold3d

    def disc(self, circle: Circle, low: float, high: float) -> Manifold:
        """Return a cylinder along z between two heights."""
        radius, length = circle.radius, high - low
        cylinder = self._library.Manifold.cylinder(length, radius, radius, SEGMENTS)
        return cylinder.translate((circle.x, circle.y, low))

    def hole(self, circle: Circle, low: float, high: float) -> Manifold:
        """Return the tool that cuts a round hole; its chords lie outside the circle."""
        radius = circle.radius / math.cos(math.pi / SEGMENTS)
        return self.disc(circle._replace(radius=radius), low, high)

    def ball(self, radius: float) -> Manifold:
        """Return a ball about the origin."""
        return self._library.Manifold.sphere(radius, SEGMENTS)

    def cavity(self, radius: float) -> Manifold:
        """Return the tool that cuts a seat for a ball about the origin."""
        return self.ball(radius / _inscribed_radius())

    def box(self, low: Triple, high: Triple) -> Manifold:
        """Return a box between two corners."""
        x, y, z = (b - a for a, b in zip(low, high, strict=True))
        return self._library.Manifold.cube((x, y, z)).translate(low)

    def union(self, shapes: Sequence[Manifold]) -> Manifold:
        """Return the union of shapes."""
        return self._library.Manifold.batch_boolean(list(shapes), self._library.OpType.Add)

    def hull(self, circles: Sequence[Circle], low: float, high: float) -> Manifold:
        """Return a plate between two heights, whose outline is the convex hull of circles."""
        return self._library.Manifold.batch_hull([self.disc(each, low, high) for each in circles])


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
