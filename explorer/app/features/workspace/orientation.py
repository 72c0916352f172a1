"""The orientation of the workspace that is shown, and where its paths start.

The workspace of the tool point is that of b4, moved by the vector between them.
"""

from __future__ import annotations

import numpy as np

from explorer.app.features.workspace.regions import Rows, rows_of
from explorer.app.state.frame import Frame
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray

# Rotations whose entries differ by less are the same.
SAME = 1e-9


def workspace_pose(frame: Frame) -> Pose:
    """Return the pose whose orientation the workspace has: the present one, or that of home."""
    state = frame.state
    is_home = state.view.workspace.orientation == "home"
    return state.design.home_pose if is_home else state.pose


def orientation_word(frame: Frame) -> str:
    """Return which orientation the workspace has: "present" or "home"."""
    return "home" if frame.state.view.workspace.orientation == "home" else "present"


def turned_suffix(design: Design, rotation: Rows) -> str:
    """Return what follows the names of a workspace's measures; "" in the orientation of home."""
    is_home = np.allclose(rotation, design.home_pose.rotation, atol=SAME)
    return "" if is_home else ", turned"


def workspace_rotation(frame: Frame) -> FloatArray:
    """Return the orientation of the workspace that is shown, shape (3, 3)."""
    return workspace_pose(frame).rotation


def workspace_rows(frame: Frame) -> Rows:
    """Return the rows of `workspace_rotation` as plain numbers."""
    return rows_of(workspace_rotation(frame))


def workspace_position(frame: Frame) -> Triple:
    """Return b4 where the shown point is where it is, in the orientation of the workspace."""
    state, pose = frame.state, workspace_pose(frame)
    return pose.position if pose == state.pose else state.pose_at(state.position, pose).position


def workspace_start(frame: Frame) -> Triple | None:
    """Return the position of b4 where paths start; None for home."""
    is_here = frame.state.view.workspace.start == "pose"
    return workspace_position(frame) if is_here else None
