"""The paper's test for leg interference over one sampling step, by swept tetrahedra.

Over a step at constant orientation a leg stays within the tetrahedron of its two base ends and
its two platform ends. The step is free if no two of the four tetrahedra overlap or touch. Legs 1
and 4 have fixed base ends, so their tetrahedra are triangles. The test ignores the legs' radii.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.clearance import PAIRS, joined_pairs, leg_axes
from explorer.legs.tetrahedra import tetrahedra_overlap
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.numerics.arrays import BoolArray, FloatArray


def swept_tetrahedra(
    design: Design,
    start_position: ArrayLike,
    start_rotation: ArrayLike,
    end_position: ArrayLike,
    end_rotation: ArrayLike,
) -> FloatArray:
    """Return the tetrahedra that contain the four legs over a step, shape (..., 4, 4, 3).

    The vertices of a tetrahedron are the leg's base ends at the start and at the end of the
    step, then its platform ends. All batch axes are broadcast.

    Args:
        design: The manipulator.
        start_position: b4 in the base frame, shape (..., 3), in design units.
        start_rotation: Platform to base, shape (..., 3, 3).
        end_position: b4 at the end of the step, shape (..., 3).
        end_rotation: Platform to base at the end of the step, shape (..., 3, 3).

    Raises:
        InputError: A position is not finite, or a rotation is not one.
    """
    start = leg_axes(Configuration(design, start_position, start_rotation))
    end = leg_axes(Configuration(design, end_position, end_rotation))
    start, end = np.broadcast_arrays(start, end)
    # From (base, platform) of both poses to (base, base, platform, platform).
    both = np.stack([start, end], axis=-2)
    return both.reshape(*both.shape[:-3], 4, 3)


def step_overlaps(
    design: Design,
    start_position: ArrayLike,
    start_rotation: ArrayLike,
    end_position: ArrayLike,
    end_rotation: ArrayLike,
) -> BoolArray:
    """Return which pairs of swept tetrahedra overlap, shape (..., 6), in the order of `PAIRS`.

    The result is False for a pair that shares a joint, see `explorer.legs.clearance.joined_pairs`.
    Arguments and errors are those of `swept_tetrahedra`.
    """
    swept = swept_tetrahedra(design, start_position, start_rotation, end_position, end_rotation)
    overlaps = np.zeros((*swept.shape[:-3], len(PAIRS)), dtype=np.bool_)
    for index, joined in enumerate(joined_pairs(design)):
        if not joined:
            first, second = PAIRS[index]
            overlaps[..., index] = tetrahedra_overlap(
                swept[..., first - 1, :, :], swept[..., second - 1, :, :]
            )
    return overlaps


def step_is_free(
    design: Design,
    start_position: ArrayLike,
    start_rotation: ArrayLike,
    end_position: ArrayLike,
    end_rotation: ArrayLike,
) -> BoolArray:
    """Return whether no two of the four swept tetrahedra overlap, shape (...).

    Arguments and errors are those of `swept_tetrahedra`.
    """
    arrays = (start_position, start_rotation, end_position, end_rotation)
    return np.asarray(~step_overlaps(design, *arrays).any(axis=-1))
