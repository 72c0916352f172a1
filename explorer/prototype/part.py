"""A part of the prototype: a closed mesh of one piece in the frame of its body."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from explorer.numerics.arrays import FloatArray
from explorer.prototype.chains import BODIES
from explorer.prototype.mass import Mass, mesh_mass
from explorer.workspace.solids.solid import Solid


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
