"""Moves that keep a tool point straight, from the interpolation of SciPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation, Slerp

from explorer import Pose
from explorer.numerics.arrays import FloatArray


def tool_move(
    start: Pose, end: Pose, shares: ArrayLike, tool: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return positions of b4 (n, 3) and rotations (n, 3, 3) of a move that keeps the tool straight.

    Args:
        start: Pose at the start of the move.
        end: Pose at its end.
        shares: Shares of the move, shape (n,).
        tool: Tool point in the platform frame, shape (3,).
    """
    share = np.atleast_1d(np.asarray(shares, dtype=np.float64))
    turns = Slerp([0.0, 1.0], Rotation.from_matrix(np.array([start.rotation, end.rotation])))
    rotations = turns(share).as_matrix()
    first, last = (np.array(pose.position) + pose.rotation @ tool for pose in (start, end))
    line = (1.0 - share)[:, None] * first + share[:, None] * last
    return line - rotations @ tool, rotations
