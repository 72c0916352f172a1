"""Mass, centre of mass and inertia of bars, balls and closed meshes, all in closed form.

Units are those of the lengths and the density given.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from explorer.numerics.arrays import FloatArray


@dataclass(frozen=True)
class Mass:
    """The mass properties of a rigid body.

    Attributes:
        mass: Mass, positive.
        centre: Centre of mass in the body's frame, shape (3,).
        inertia: Inertia about the centre, along the axes of the body's frame, shape (3, 3).
    """

    mass: float
    centre: FloatArray
    inertia: FloatArray

    def scaled(self, length: float, mass: float = 1.0) -> Mass:
        """Return the properties in other units, given the factors for lengths and masses."""
        return Mass(self.mass * mass, self.centre * length, self.inertia * (mass * length**2))


def bar(radius: float, start: FloatArray, end: FloatArray, density: float) -> Mass:
    """Return the mass properties of a round bar between two points (3,), zero if they coincide."""
    along = end - start
    length = float(np.linalg.norm(along))
    mass = density * math.pi * radius**2 * length
    across = mass * (radius**2 / 4.0 + length**2 / 12.0)
    about_axis = mass * radius**2 / 2.0
    axis = along / length if length > 0.0 else np.zeros(3)
    inertia = across * np.eye(3) + (about_axis - across) * np.outer(axis, axis)
    return Mass(mass, 0.5 * (start + end), inertia)


def ball(radius: float, centre: FloatArray, density: float) -> Mass:
    """Return the mass properties of a ball about a point (3,)."""
    mass = density * 4.0 / 3.0 * math.pi * radius**3
    return Mass(mass, centre, 0.4 * mass * radius**2 * np.eye(3))


def total_mass(parts: Iterable[Mass]) -> Mass:
    """Return the mass properties of parts joined as one body; at least one part has a mass."""
    masses = list(parts)
    mass = sum(part.mass for part in masses)
    centre = np.sum([part.mass * part.centre for part in masses], axis=0) / mass
    inertia = np.zeros((3, 3))
    for part in masses:
        off = part.centre - centre
        inertia += part.inertia + part.mass * (off @ off * np.eye(3) - np.outer(off, off))
    return Mass(mass, centre, inertia)


def mesh_mass(vertices: FloatArray, faces: NDArray[np.int32], density: float) -> Mass:
    """Return the mass properties of the body that a closed mesh encloses, exactly.

    They are sums over the tetrahedra between the faces (m, 3), counter-clockwise from outside, and
    one point; their second moments have a closed form.
    """
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    corners = (vertices - middle)[faces]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    volume = float(volumes.sum())
    sums = a + b + c
    centre = volumes @ sums / (4.0 * volume)
    # ∫ x xᵀ over a tetrahedron with a corner at 0 is V/20 (Σ c cᵀ + Σc Σcᵀ).
    moments = np.einsum("i,ikj,ikl->jl", volumes, corners, corners, optimize=True)
    moments = (moments + (volumes[:, None] * sums).T @ sums) / 20.0
    moments -= volume * np.outer(centre, centre)
    inertia = density * (np.trace(moments) * np.eye(3) - moments)
    return Mass(density * volume, centre + middle, inertia)
