"""The three margins of a pose, and the assembly mode that their signs name.

The manipulator is singular exactly where one of three tetrahedra is flat, which is where
two flags meet (the paper's section on singularities). Each margin is the signed distance to one
such incidence. Margins depend on the pose alone, not on the design.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray, IntArray, batch_shape, dot, finite_array

INCIDENCES = (
    "a1 on the platform plane",
    "lines a1a2 and b2b3 meeting",
    "b4 on the base plane",
)
"""What a margin of zero means, in the order κ1, κ2, κ3."""

TETRAHEDRA = (("b1", "b2", "b3", "a1"), ("a1", "a2", "b2", "b3"), ("b4", "a1", "a2", "a3"))
"""The tetrahedra of the three trilaterations, in the order κ1, κ2, κ3."""

MODE_BITS = np.array([4, 2, 1])


def margins(position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the signed margins (κ1, κ2, κ3), shape (..., 3), in design units.

    κ1 = -(R ẑ)·p, κ2 = (x̂ × R x̂)·p and κ3 = ẑ·p: zero where a1 lies on the platform
    plane, where the lines a1a2 and b2b3 meet or are parallel, where b4 lies on the base
    plane. They do not depend on the design.

    Args:
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).

    Raises:
        InputError: a pose that is not finite or not a rotation.
    """
    p = finite_array("position", position, (3,))
    r = checked_rotation(rotation)
    shape = batch_shape((p, 1), (r, 2))
    kappa1 = -dot(r[..., 2], p)
    kappa2 = r[..., 1, 0] * p[..., 2] - r[..., 2, 0] * p[..., 1]
    kappa3 = np.broadcast_to(p[..., 2], shape)
    return np.stack([kappa1, kappa2, kappa3], axis=-1)


def mode_of(margin: FloatArray) -> IntArray:
    """Return the assembly mode 0 to 7 of margins (..., 3): bit 2 is set where κ1 > 0, …."""
    return np.asarray((margin > 0.0) @ MODE_BITS, dtype=np.int64)


def signs_of(mode: int) -> tuple[int, int, int]:
    """Return the sign triple (±1, ±1, ±1) of an assembly mode."""
    return (1 if mode & 4 else -1, 1 if mode & 2 else -1, 1 if mode & 1 else -1)


def mode_name(mode: int) -> str:
    """Return the sign triple as people read it, such as ``+ − +``."""
    return " ".join("+" if sign > 0 else "−" for sign in signs_of(mode))


def mode_words(modes: tuple[int, ...]) -> str:
    """Return the modes that meet in a pose, such as "boundary of modes 1 and 3", or "5"."""
    if len(modes) == 1:
        return str(modes[0])
    if len(modes) == 8:
        return "boundary of all eight modes"
    *most, last = modes
    return f"boundary of modes {', '.join(map(str, most))} and {last}"
