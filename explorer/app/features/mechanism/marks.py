"""Labels a1 … b4, and the drag handle."""

from __future__ import annotations

import contextlib
import math

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.incidences import approaches
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart, scene_scale
from explorer.app.scene.shapes import add_label
from explorer.app.session.clock import Pause, now
from explorer.app.state.actions import SetPose
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Updates
from explorer.errors import InputError
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray

# Names of the points, by the node whose frame their labels have.
LABELS = {"/base": ("a1", "a2", "a3"), "/platform": ("b1", "b2", "b3", "b4")}

HANDLE_NAME = "/handle"
HANDLE_SCALE = 1.9
# Length from the gizmo's origin to the tip of an arrow, as viser draws it.
ARROW_LENGTH = 1.25 * HANDLE_SCALE
# Size and opacity of the gizmo, and where it would hide what matters.
CLEAR_HANDLE, FAINT_HANDLE = (HANDLE_SCALE, 0.85), (0.6 * HANDLE_SCALE, 0.3)
# Seconds without a movement after which the gizmo's look may change during a drag.
PAUSE = 0.2


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
    """The gizmo at b4 or at the tool point: arrows move the platform, arcs turn it about the point.

    It is small and faint where it would hide the end of a gap to a near incidence.
    """

    def __init__(self, services: Services) -> None:
        scene, (scale, opacity) = services.scene, CLEAR_HANDLE
        self.handle = scene.add_transform_controls(
            HANDLE_NAME, scale=scale, line_width=2.0, depth_test=False, opacity=opacity
        )
        self._session = services.session
        self._moved_at = -math.inf
        self._pause = Pause(PAUSE, services.session.redraw)
        self.handle.on_update(self._move_platform)
        services.at_end(self._pause.cancel)

    def pose(self, state: State) -> Pose:
        """Return the pose of the platform where the gizmo is.

        Raises:
            InputError: The gizmo is where no platform can be.
        """
        x, y, z = (np.asarray(self.handle.position) / scene_scale(state)).tolist()
        w, i, j, k = np.asarray(self.handle.wxyz, dtype=np.float64).tolist()
        return state.pose_at((x, y, z), Pose(state.pose.position, (w, i, j, k)))

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that keep the gizmo on the platform."""
        state = placed.frame.state
        yield self.handle, "visible", _is_handle_visible(placed)
        scale, opacity = self._look(placed)
        yield self.handle, "scale", scale
        yield self.handle, "opacity", opacity
        with contextlib.suppress(InputError):
            # A pose that was written back during a drag would move the gizmo under the pointer.
            if self.pose(state) == state.pose:
                return
        yield self.handle, "position", tuple(placed.point.tolist())
        yield self.handle, "wxyz", state.pose.quaternion

    def corners(self, placed: Placed) -> FloatArray:
        """Return the tips of the three arrows."""
        if not _is_handle_visible(placed):
            return NO_POINTS
        return placed.point + ARROW_LENGTH * placed.frame.snapshot.rotation.T

    def _look(self, placed: Placed) -> tuple[float, float]:
        """Return size and opacity for a frame, or the present ones while the gizmo moves."""
        present = self.handle.scale, self.handle.opacity
        wanted = FAINT_HANDLE if hides_a_gap(placed) else CLEAR_HANDLE
        # viser's client forgets the movement that it has yet to send when the gizmo's look changes.
        if wanted == present or now() - self._moved_at > PAUSE:
            return wanted
        self._pause.begin()
        return present

    async def _move_platform(self, event: viser.TransformControlsEvent) -> None:
        if event.client_id is not None:
            self._moved_at = now()
            self._session.post(
                "drag",
                lambda state: SetPose(self.pose(state)),
                stamp=self.handle.update_timestamp,
                who=event.client_id,
            )


def hides_a_gap(placed: Placed) -> bool:
    """Whether an end of the gap to a near incidence lies within the gizmo."""
    return any(
        float(np.linalg.norm(each.ends - placed.point, axis=1).min()) < ARROW_LENGTH
        for each in approaches(placed, None)
        if each.ends is not None and each.has_gap
    )


def _is_handle_visible(placed: Placed) -> bool:
    # Apart, the platform is not where the handle would move it.
    return placed.frame.state.view.handle and not placed.is_apart
