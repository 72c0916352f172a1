"""Cameras that frame the mechanism, in the four views that CAD programs offer."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import viser

from explorer.app.browser.viser_gaps import put_camera
from explorer.app.features.mechanism.flags import flag_corners
from explorer.app.features.mechanism.legs import guide_span
from explorer.app.features.mechanism.marks import ghost_points, handle_tips
from explorer.app.features.prototype.scene import part_corners
from explorer.app.scene.placing import Placed
from explorer.numerics.arrays import FloatArray

ViewName = Literal["isometric", "front", "side", "top"]
VIEWS: tuple[ViewName, ...] = get_args(ViewName)

FIELD_OF_VIEW = math.radians(32.0)
# From the target towards the eye; front looks along +y, side along -x, top down.
DIRECTIONS: dict[ViewName, tuple[float, float, float]] = {
    "isometric": (0.72, -1.0, 0.62),
    "front": (0.0, -1.0, 0.0),
    "side": (1.0, 0.0, 0.0),
    # A hair off the vertical, so that y points up on the screen.
    "top": (0.0, -1e-4, 1.0),
}

# How many earlier places of a camera count as not moved by hand.
REMEMBERED = 4
# Width over height of the scene of a new browser, as far as anybody can guess.
FIRST_ASPECT = 1.2


def framing(
    placed: Placed, view: ViewName | FloatArray, aspect: float
) -> tuple[FloatArray, FloatArray]:
    """Return the eye and the target, in scene units, that show the whole mechanism.

    Args:
        placed: What to show.
        view: From where, or from the target towards the eye (3,), not along z.
        aspect: Width over height of the picture.
    """
    points = outermost_points(placed)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    towards = np.array(DIRECTIONS[view]) if isinstance(view, str) else view
    forward = -towards / np.linalg.norm(towards)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    half = math.tan(0.5 * FIELD_OF_VIEW)
    depth = (points - centre) @ forward
    distance, target = 0.0, centre
    for axis, slope in ((up, half), (right, half * max(aspect, 0.2))):
        # From the distance D, shifted by s, a point at x is seen if |x - s| <= slope (D + depth).
        along = (points - centre) @ axis
        low, high = float((along + slope * depth).min()), float((along - slope * depth).max())
        distance = max(distance, 0.5 * (high - low) / slope)
        target = target + 0.5 * (low + high) * axis
    return target - 1.05 * distance * forward, target


def outermost_points(placed: Placed) -> FloatArray:
    """Return what must be in the picture, shape (n, 3): all but the grid."""
    view = placed.frame.state.view
    joints = np.array(list(placed.points.values()))
    if view.ghosts:
        joints = np.concatenate([joints, ghost_points(placed).reshape(-1, 3)])
    around = np.array(np.meshgrid(*[(-0.8, 0.8)] * 3)).reshape(3, -1).T
    low, high = guide_span(placed)
    guide = np.array([[low, 0.0, 0.0], [high, 0.0, 0.0]])
    seen = [(joints[:, None] + around).reshape(-1, 3), guide]
    if view.flags:
        seen.append(flag_corners(placed))
    if view.handle:
        seen.append(handle_tips(placed))
    if placed.parts is not None:
        seen.append(part_corners(placed, placed.parts))
    if placed.extent is not None:
        ends = placed.scale * placed.extent
        seen.append(np.array(np.meshgrid(*ends.T)).reshape(3, -1).T)
    return np.concatenate(seen)


@dataclass(frozen=True)
class _Aimed:
    view: ViewName | FloatArray
    aspect: float
    # Where it may have begun: a slow browser tells of that for long.
    first: tuple[FloatArray, ...]
    # Where the camera was put, the last time last. A browser may still tell of one before.
    eyes: tuple[FloatArray, ...]
    # At what it looks from the last of them.
    target: FloatArray

    def has(self, client: viser.ClientHandle) -> bool:
        """Whether a browser's camera is where it was ever put."""
        return any(self.is_at(client, eye) for eye in (*self.first, *self.eyes))

    def is_at(self, client: viser.ClientHandle, eye: FloatArray) -> bool:
        """Whether it is at one of these places."""
        distance = float(np.linalg.norm(self.eyes[-1] - client.camera.look_at))
        return float(np.abs(client.camera.position - eye).max()) <= 1e-3 * distance


class Cameras:
    """The cameras of all open browsers.

    A browser tells its size before its panels are laid out, and people resize windows. A
    camera that still stands where it was put is therefore put again when the size changes,
    and so is one that a browser, while it loads, moved back to where it began. Where a camera
    stands is only ever what its browser told: what was sent to a browser may not have come
    to anything.

    Args:
        first: Where the camera of a new browser begins; put to show what there is now.
        placed: Gives what to frame at the time.
        put: Sends a browser the eye and the target of its camera, and makes it tell of them.
    """

    def __init__(
        self,
        first: viser.InitialCameraConfig,
        placed: Callable[[], Placed],
        put: Callable[[viser.ClientHandle, FloatArray, FloatArray], None] | None = None,
    ) -> None:
        self._first = first
        self._placed = placed
        self._send = _put_with_this_lens if put is None else put
        self._aimed: dict[int, _Aimed] = {}
        # Browsers tell of several sizes at once while they load: the last one counts.
        self._lock = threading.RLock()
        first.position, first.look_at = framing(placed(), "isometric", FIRST_ASPECT)

    def point(self, client: viser.ClientHandle, view: ViewName) -> None:
        """Point one browser's camera."""
        self._put(client, view)

    def fit(self, client: viser.ClientHandle) -> None:
        """Show the whole mechanism from where one browser's camera looks."""
        towards = np.asarray(client.camera.position) - np.asarray(client.camera.look_at)
        # The browser turns no camera upright, but a script may have.
        if np.linalg.norm(towards[:2]) > 1e-6 * np.linalg.norm(towards):
            self._put(client, towards)

    def connected(self, client: viser.ClientHandle) -> None:
        """Point a new browser's camera and keep it framed while nobody moves it."""
        self.point(client, "isometric")
        client.camera.on_update(lambda _: self._told(client))

    def disconnected(self, client: viser.ClientHandle) -> None:
        """Forget a browser."""
        with self._lock:
            self._aimed.pop(client.client_id, None)

    def look_again(self, client: viser.ClientHandle) -> None:
        """Put a browser's camera where it was put last, unless somebody moved it."""
        with self._lock:
            aimed = self._aimed.get(client.client_id)
            if aimed is None or not aimed.has(client):
                return
            if client.camera.aspect == aimed.aspect:
                self._send(client, aimed.eyes[-1], aimed.target)
            else:
                self._put(client, aimed.view)

    def stands(self, client: viser.ClientHandle) -> bool:
        """Whether a browser's camera is where it was put last, or where somebody moved it.

        A browser that is still loading may miss where it is put, and tell of its first place.
        """
        aimed = self._aimed.get(client.client_id)
        if aimed is None:
            return True
        return aimed.is_at(client, aimed.eyes[-1]) or not aimed.has(client)

    def _told(self, client: viser.ClientHandle) -> None:
        """Follow what a browser tells of its camera."""
        with self._lock:
            aimed = self._aimed.get(client.client_id)
            if aimed is None:
                return
            has_new_shape = client.camera.aspect != aimed.aspect
            if has_new_shape or not aimed.is_at(client, aimed.eyes[-1]):
                self.look_again(client)

    def _put(self, client: viser.ClientHandle, view: ViewName | FloatArray) -> None:
        with self._lock:
            given = client.camera.aspect
            aspect = given if math.isfinite(given) and given > 0.0 else 1.0
            eye, target = framing(self._placed(), view, aspect)
            aimed = self._aimed.get(client.client_id)
            if aimed is None:
                first, before = (self._first.position, np.array(client.camera.position)), ()
            else:
                first, before = aimed.first, aimed.eyes[-REMEMBERED:]
            self._aimed[client.client_id] = _Aimed(view, given, first, (*before, eye), target)
            self._send(client, eye, target)


def _put_with_this_lens(client: viser.ClientHandle, eye: FloatArray, target: FloatArray) -> None:
    put_camera(client, eye, target, FIELD_OF_VIEW)
