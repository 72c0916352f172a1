"""Labels a1 … b4, and the drag handle."""

from __future__ import annotations

import contextlib

import numpy as np

from explorer.app.features.feature import Services, follow_drags
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart, scene_scale
from explorer.app.scene.shapes import add_label
from explorer.app.state.actions import Action, Set
from explorer.app.state.moves import set_pose
from explorer.app.state.parts import value_at
from explorer.app.state.state import State
from explorer.errors import InputError
from explorer.mechanism.configuration import position_of
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.page.widgets.assigning import Updates

# Names of the points, by the node whose frame their labels have.
LABELS = {"/base": ("a1", "a2", "a3"), "/platform": ("b1", "b2", "b3", "b4")}

HANDLE_NAME = "/handle"
HANDLE_SCALE = 1.9
# Length from the gizmo's origin to the tip of an arrow, as viser draws it.
ARROW_LENGTH = 1.25 * HANDLE_SCALE


class Labels(ScenePart):
    """The names of the attachment points."""

    def __init__(self, services: Services) -> None:
        self._handles = {
            name: add_label(services.scene, f"{node}/label/{name}", name)
            for node, names in LABELS.items()
            for name in names
        }

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the labels of this frame."""
        # The points stay where they are when the parts about them move apart.
        shown = placed.frame.state.view.labels and not placed.is_apart
        points = placed.points | placed.platform_points
        for name, handle in self._handles.items():
            yield handle, "visible", shown
            yield handle, "position", tuple(points[name].tolist())


class DragHandle(ScenePart):
    """The gizmo at b4 or at the tool point: arrows move the platform, arcs turn it about it.

    It moves another pose instead while a feature has one to be edited.
    """

    def __init__(self, services: Services) -> None:
        self.handle = services.scene.add_transform_controls(
            HANDLE_NAME, scale=HANDLE_SCALE, line_width=2.0, depth_test=False, opacity=0.85
        )
        # Time of the last movement that the platform has followed.
        self._followed = self.handle.update_timestamp
        follow_drags(services, self.handle, "drag", self._follow)

    def pose(self, state: State) -> Pose:
        """Return the pose where the gizmo is.

        Raises:
            InputError: The gizmo is where no platform can be.
        """
        x, y, z = (np.asarray(self.handle.position) / scene_scale(state)).tolist()
        w, i, j, k = np.asarray(self.handle.wxyz, dtype=np.float64).tolist()
        return state.pose_at((x, y, z), Pose(state.pose.position, (w, i, j, k)))

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that keep the gizmo on the platform, or at what is edited."""
        state = placed.frame.state
        pose = value_at(state, handled_pose(state))
        yield self.handle, "visible", _is_handle_visible(placed)
        # Put back, the gizmo would lose a movement that the platform is yet to follow.
        if self.handle.update_timestamp != self._followed:
            return
        with contextlib.suppress(InputError):
            # A pose that was written back during a drag would move the gizmo under the pointer.
            if self.pose(state) == pose:
                return
        there = np.array(position_of(state.design, pose, state.view.at))
        yield self.handle, "position", tuple((placed.scale * there).tolist())
        yield self.handle, "wxyz", pose.quaternion

    def corners(self, placed: Placed) -> FloatArray:
        """Return the tips of the three arrows."""
        if not _is_handle_visible(placed):
            return NO_POINTS
        return placed.point + ARROW_LENGTH * placed.frame.snapshot.rotation.T

    def _follow(self, state: State) -> Action:
        self._followed = self.handle.update_timestamp
        path, pose = handled_pose(state), self.pose(state)
        return set_pose(pose) if path == "pose" else Set(path, pose, "Pose of the path", "dragged")


def handled_pose(state: State) -> str:
    """Return the path in the state of the pose that the gizmo moves."""
    parts = state.parts.items()
    edited = (f"{name}.{part.handled}" for name, part in parts if part.handled)
    return next(edited, "pose")


def _is_handle_visible(placed: Placed) -> bool:
    # Apart, the platform is not where the handle would move it.
    return placed.frame.state.view.handle and not placed.is_apart
