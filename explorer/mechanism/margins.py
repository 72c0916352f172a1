"""The three margins of a pose, and the assembly mode that their signs name.

The manipulator is singular exactly where one of three tetrahedra is flat, that is where two
elements of the base and platform flags are incident (the paper's section on singularities).
These singularities are parallel, type 2 of Gosselin and Angeles (1990): an instantaneous freedom
with locked actuators. Each margin is a signed number in design units that is zero at one of these
incidences, linear in the position at a fixed orientation. The poses with one sign triple are a
maximal connected set without a singular pose, an *aspect* in the field's terms; no path leaves it
without one, so that the mechanism is non-cuspidal. Margins depend on the pose alone, not on the
design.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.pose import pose_rows, rotation_array
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector, column, dot3

INCIDENCES = (
    "a1 on the platform plane",
    "lines a1a2 and b2b3 meeting",
    "b4 on the base plane",
)
"""The incidence at a margin of zero, in the order δ1, δ2, δ3."""

MARGIN_WORDS = (
    "how far a1 is from the platform plane",
    "how far the lines a1a2 and b2b3 are from meeting",
    "how far b4 is from the base plane",
)
"""What each margin says, in the order δ1, δ2, δ3."""

TETRAHEDRA = (("b1", "b2", "b3", "a1"), ("a1", "a2", "b2", "b3"), ("b4", "a1", "a2", "a3"))
"""The tetrahedra of the three trilaterations, in the order δ1, δ2, δ3."""

MARGIN_KINDS = "δ1 and δ3 are distances, δ2 is a distance times a sine"
"""The meaning of the margins, for texts that compare them with one another."""

INCIDENT = 1e-9
"""Tolerance of an incidence, by which a pose has its stratum: a share of the reach, or radians."""

SINGULAR = 1e-13
"""Share of |p| up to which a margin is rounding, so that the pose counts as singular for loads."""

LOST = 1e-13
"""Share of the largest singular value of J, or length of a plane's normal, that is rounding."""

ROUNDING = 1e-14
"""Share of |p|, or sine of the lines' angle, at which a pose is its own nearest singular pose."""

MODE_BITS = np.array([4, 2, 1])


def margins(position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the signed margins (δ1, δ2, δ3), shape (..., 3), in design units.

    δ1 = -(R ẑ)·p is zero where a1 lies on the platform plane, δ2 = (x̂ × R x̂)·p where the
    lines a1a2 and b2b3 meet or are parallel, δ3 = ẑ·p where b4 lies on the base plane. δ1 and
    δ3 are distances from the plane; δ2 is the mutual moment of the two unit lines, their distance
    times the sine between them. The pose is b4 in the base frame, shape (..., 3), in design units,
    and platform to base, shape (..., 3, 3).

    Raises:
        InputError: The position is not finite, or the rotation is not one.
    """
    positions, rotations, batch = pose_rows(position, rotation)
    out = np.empty((len(positions), 3))
    margin_rows(len(out), positions, rotations, out)
    return out.reshape(*batch, 3)


@helper
def margins_of(p: Vector, u: Vector, n: Vector) -> Vector:
    """Return the margins (δ1, δ2, δ3) of a position and the directions of the platform's x and z.

    The first two are linear in the position and in the directions, so that rates follow from
    rates of these.
    """
    return (-dot3(n, p), u[1] * p[2] - u[2] * p[1], p[2])


@helper
def margins_at(p: FloatArray, r: FloatArray) -> Vector:
    """Return the margins (δ1, δ2, δ3) of a position (3,) and a rotation (3, 3)."""
    return margins_of((p[0], p[1], p[2]), column(r, 0), column(r, 2))


@kernel("void(f8[:,::1], f8[:,:,::1], f8[:,::1])")
def margin_rows(position: FloatArray, rotation: FloatArray, out: FloatArray) -> None:
    """Write the margins of n poses, shape (n, 3)."""
    for k in range(position.shape[0]):
        out[k, 0], out[k, 1], out[k, 2] = margins_at(position[k], rotation[k])


def planes_of_singularity(rotation: ArrayLike) -> FloatArray:
    """Return the gradients of (δ1, δ2, δ3) with respect to p, shape (..., 3, 3), in rows.

    At a fixed orientation the singular positions are up to three planes through a1 with these
    normals. The first two coincide where the guide is parallel to the platform plane, the last two
    where b2b3 is parallel to the base plane, all three where platform and base are parallel.
    The gradient of δ2 has the length of the sine between the lines a1a2 and b2b3, which is zero
    if they are parallel; the others have unit length. The rotation has the shape (..., 3, 3).
    """
    r = rotation_array(rotation)
    gradients = np.zeros(r.shape)
    gradients[..., 0, :] = -r[..., :, 2]
    gradients[..., 1, 1], gradients[..., 1, 2] = -r[..., 2, 0], r[..., 1, 0]
    gradients[..., 2, 2] = 1.0
    return gradients


def mode_of(margin: FloatArray) -> IntArray:
    """Return the assembly modes 0 to 7, shape (...), of margins (..., 3).

    Bit 2 is set if δ1 is positive, bit 1 if δ2 is, bit 0 if δ3 is.
    """
    return np.asarray((margin > 0.0) @ MODE_BITS, dtype=np.int64)


def signs_of(mode: int) -> tuple[int, int, int]:
    """Return the sign triple (±1, ±1, ±1) of an assembly mode."""
    return (1 if mode & 4 else -1, 1 if mode & 2 else -1, 1 if mode & 1 else -1)


def mode_name(mode: int) -> str:
    """Return the sign triple of an assembly mode as text, such as "+ − +"."""
    return " ".join("+" if sign > 0 else "−" for sign in signs_of(mode))


def describe_modes(modes: tuple[int, ...]) -> str:
    """Return the modes that meet in a pose as text, such as "boundary of modes 1 and 3" or "5"."""
    if len(modes) == 1:
        return str(modes[0])
    if len(modes) == 8:
        return "boundary of all eight modes"
    *most, last = modes
    return f"boundary of modes {', '.join(map(str, most))} and {last}"
