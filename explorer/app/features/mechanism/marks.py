"""Labels a1 … b4, ghosts of the other assembly modes, and the handle to drag."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.scene.bodies import platform_plate
from explorer.app.scene.placing import Placed, scene_scale
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import GHOST
from explorer.errors import InputError
from explorer.mechanism.margins import mode_name
from explorer.mechanism.pose import Pose, quaternion_from_rotation
from explorer.numerics.arrays import FloatArray

BASE_LABELS = ("a1", "a2", "a3")
PLATFORM_LABELS = ("b1", "b2", "b3", "b4")

HANDLE_NAME = "/handle"
HANDLE_SCALE = 1.9
# From the gizmo's origin to the tip of an arrow, as viser draws it.
HANDLE_REACH = 1.25 * HANDLE_SCALE


class Labels:
    """The names of the attachment points."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._handles = {
            name: scene.add_label(
                f"{'/base' if name in BASE_LABELS else '/platform'}/label/{name}",
                name,
                anchor="bottom-left",
                font_screen_scale=0.95,
            )
            for name in (*BASE_LABELS, *PLATFORM_LABELS)
        }

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws the labels of this frame."""
        for name, handle in self._handles.items():
            own = placed.points if name in BASE_LABELS else placed.platform_points
            lift = 0.3 if name in BASE_LABELS else 0.3 * placed.facing
            yield handle, "visible", placed.frame.state.view.labels
            yield handle, "position", tuple((own[name] + [0.0, 0.0, lift]).tolist())


class Ghosts:
    """The seven other assembly modes of the same joints, each with its sign triple."""

    def __init__(self, scene: viser.SceneApi) -> None:
        # Instanced meshes cannot change their shape, and these follow the design.
        self._plates = [
            scene.add_mesh_simple(
                f"/ghosts/platform/{i}",
                np.zeros((3, 3)),
                np.array([[0, 1, 2]]),
                color=GHOST,
                opacity=0.35,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
            for i in range(7)
        ]
        self._legs = scene.add_line_segments(
            "/ghosts/legs",
            np.zeros((28, 2, 3)),
            GHOST,
            thickness=1.2,
            thickness_units="screen",
        )
        self._names = [
            scene.add_label(f"/ghosts/name/{i}", mode_name(i), font_screen_scale=0.75)
            for i in range(7)
        ]

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws the ghosts of this frame."""
        state = placed.frame.state
        visible = state.view.ghosts
        for handle in (*self._plates, self._legs, *self._names):
            yield handle, "visible", visible
        if not visible:
            return
        others = _others(placed)
        solution = placed.frame.snapshot.modes
        positions = placed.scale * solution.position[others]
        rotations = solution.rotation[others]
        vertices, faces = platform_plate(placed)
        wxyzs = quaternion_from_rotation(rotations)
        for plate, position, wxyz in zip(self._plates, positions, wxyzs, strict=True):
            yield plate, "vertices", vertices.astype(np.float32)
            yield plate, "faces", faces.astype(np.uint32)
            yield plate, "position", tuple(position.tolist())
            yield plate, "wxyz", tuple(wxyz.tolist())
        tips = ghost_points(placed)
        yield self._legs, "points", self._leg_lines(placed, tips).astype(np.float32)
        for label, mode, tip in zip(self._names, others, tips[:, 0], strict=True):
            yield label, "text", mode_name(mode)
            yield label, "position", tuple(tip.tolist())

    @staticmethod
    def _leg_lines(placed: Placed, tips: FloatArray) -> FloatArray:
        bases = np.zeros_like(tips)
        bases[:, 1:3, 0] = tips[:, 1:3, 0]
        bases[:, 3] = placed.points["a3"]
        return np.stack([bases, tips], axis=2).reshape(-1, 2, 3)


def ghost_points(placed: Placed) -> FloatArray:
    """Return b1 … b4 of the seven other assembly modes in the scene, shape (7, 4, 3)."""
    others = _others(placed)
    solution = placed.frame.snapshot.modes
    local = np.array(list(placed.platform_points.values()))
    turned = np.einsum("mij,nj->mni", solution.rotation[others], local)
    return placed.scale * solution.position[others][:, None] + turned


def handle_tips(placed: Placed) -> FloatArray:
    """Return the tips of the gizmo's three arrows in the scene, shape (3, 3)."""
    return placed.points["b4"] + HANDLE_REACH * placed.frame.snapshot.rotation.T


def _others(placed: Placed) -> list[int]:
    return [mode for mode in range(8) if mode != placed.frame.state.mode]


class DragHandle:
    """The gizmo at b4: arrows move the platform, arcs turn it."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self.handle = scene.add_transform_controls(
            HANDLE_NAME, scale=HANDLE_SCALE, line_width=2.0, depth_test=False, opacity=0.85
        )

    def pose(self, state: State) -> Pose:
        """Return the pose of the platform where the gizmo is.

        Raises:
            InputError: it is where no platform can be.
        """
        x, y, z = (np.asarray(self.handle.position) / scene_scale(state)).tolist()
        w, i, j, k = np.asarray(self.handle.wxyz, dtype=np.float64).tolist()
        return Pose((x, y, z), (w, i, j, k))

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what keeps the gizmo on the platform."""
        state = placed.frame.state
        yield self.handle, "visible", state.view.handle
        with contextlib.suppress(InputError):
            # Writing back what the hand has just set would fight with it.
            if self.pose(state) == state.pose:
                return
        yield self.handle, "position", tuple(placed.points["b4"].tolist())
        yield self.handle, "wxyz", state.pose.quaternion
