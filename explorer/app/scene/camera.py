"""Cameras that frame the mechanism, in the four views that CAD programs offer.

The views from the front, the side and the top have no perspective: a script of the page,
`projection.js`, draws in parallel projection while a camera looks along an axis. A length in the
plane of its target is as large as with perspective.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import viser

from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray, triple
from explorer.page.browser.viser_gaps import put_camera

ViewName = Literal["isometric", "front", "side", "top"]
VIEWS: tuple[ViewName, ...] = get_args(ViewName)

FIELD_OF_VIEW = math.radians(32.0)
# Directions from the target to the eye; front looks along +y, side along -x, top down.
DIRECTIONS: dict[ViewName, tuple[float, float, float]] = {
    "isometric": (0.72, -1.0, 0.62),
    "front": (0.0, -1.0, 0.0),
    "side": (1.0, 0.0, 0.0),
    # Slightly off the vertical, so that y points up on the screen.
    "top": (0.0, -1e-4, 1.0),
}

# Number of earlier positions at which a camera counts as not moved by its user.
REMEMBERED = 4
# Sine of the largest angle between the axes of a camera and those of the scene at which the camera
# has no perspective; `projection.js` has the same.
ALONG = 1e-3
# Share by which points may lie beyond the edge of a picture and still count as in it.
EDGE = 0.02
# Share of the picture's width and height below which what is drawn is too small to see.
SMALLEST = 0.2
# Guess of width over height of the scene in a new browser.
FIRST_ASPECT = 1.2


def framing(
    points: FloatArray, view: ViewName | FloatArray, aspect: float
) -> tuple[FloatArray, FloatArray]:
    """Return the eye and the target, in scene units, that show all of some points (n, 3).

    The view is a name, or a direction (3,) from the target to the eye, not along z; the aspect is
    the picture's width over its height.
    """
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    towards = _direction(view)
    forward, right, up = _axes(-towards)
    half = math.tan(0.5 * FIELD_OF_VIEW)
    depth = _depth(points, centre, forward)
    distance, target = 0.0, centre
    for axis, slope in ((up, half), (right, half * max(aspect, 0.2))):
        # From the distance D, shifted by s, a point at x is seen if |x - s| <= slope (D + depth).
        along = (points - centre) @ axis
        low, high = float((along + slope * depth).min()), float((along - slope * depth).max())
        distance = max(distance, 0.5 * (high - low) / slope)
        target = target + 0.5 * (low + high) * axis
    return target - 1.05 * distance * forward, target


def _direction(view: ViewName | FloatArray) -> FloatArray:
    """Return the direction (3,) from the target to the eye of a view."""
    return np.array(DIRECTIONS[view]) if isinstance(view, str) else view


def places_in_picture(
    points: FloatArray, eye: FloatArray, target: FloatArray, field_of_view: float, aspect: float
) -> FloatArray:
    """Return where an upright camera sees points (n, 3), as shares of half the picture, (n, 2).

    From −1 to 1 they are to the right and upwards; infinite for points behind the camera. It is at
    an eye (3,) and looks at a target (3,). The field of view is the vertical angle in radians, the
    aspect the picture's width over its height.
    """
    forward, right, up = _axes(target - eye)
    away = points - eye
    depth = float(np.linalg.norm(target - eye)) + _depth(points, target, forward)
    half = math.tan(0.5 * field_of_view) * depth
    # Behind the camera the half height is negative.
    size = np.outer(np.where(half > 0.0, half, np.nan), [aspect, 1.0])
    return np.nan_to_num(np.stack([away @ right, away @ up], axis=-1) / size, nan=np.inf)


def are_in_picture(places: FloatArray) -> bool:
    """Whether all of some places (n, 2) are in the picture."""
    return bool((np.abs(places) <= 1.0 + EDGE).all())


def are_out_of_sight(places: FloatArray) -> bool:
    """Whether nothing between some places (n, 2) is in the picture, or all is too small to see."""
    low, high = places.min(axis=0), places.max(axis=0)
    is_beside = bool((low > 1.0).any() or (high < -1.0).any())
    return is_beside or bool((high - low).max() < 2.0 * SMALLEST)


def has_perspective(direction: FloatArray) -> bool:
    """Whether an upright camera that looks in a direction (3,) draws nearer things larger."""
    return any(int((np.abs(axis) > ALONG).sum()) > 1 for axis in _axes(direction))


def _depth(points: FloatArray, centre: FloatArray, forward: FloatArray) -> FloatArray:
    """Return how far points (n, 3) lie behind a centre for the perspective of a camera, (n,)."""
    if has_perspective(forward):
        return (points - centre) @ forward
    return np.zeros(len(points))


def _axes(direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return unit vectors (3,) forward, right and up of an upright camera looking not along z."""
    forward = direction / np.linalg.norm(direction)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return forward, right, np.cross(right, forward)


@dataclass(frozen=True)
class _Placement:
    """The positions at which the explorer put a browser's camera, for an aspect ratio."""

    view: ViewName | FloatArray
    aspect: float
    # Eyes before the camera was put, which a slow browser reports for long.
    first: tuple[FloatArray, ...]
    # Eyes where it was put, the newest last; a browser may report an earlier one.
    eyes: tuple[FloatArray, ...]
    # Target of the newest eye.
    target: FloatArray

    def has(self, client: viser.ClientHandle) -> bool:
        """Whether a browser's camera is at any of the positions."""
        return any(self.is_at(client, eye) for eye in (*self.first, *self.eyes))

    def is_at(self, client: viser.ClientHandle, eye: FloatArray) -> bool:
        """Whether a browser's camera is at an eye."""
        distance = float(np.linalg.norm(self.eyes[-1] - client.camera.look_at))
        return float(np.abs(client.camera.position - eye).max()) <= 1e-3 * distance


class Cameras:
    """The cameras of all open browsers; those of new ones begin with the first camera.

    A browser reports its size before its panels are laid out, and users resize windows. A camera
    that its user has not moved is therefore put again when the size changes, or when its browser
    moved it back to the first position while loading. The position of a camera is always the one
    that its browser reported, since a browser may miss what was sent to it.

    A camera that showed all points to frame, shape (n, 3), follows them when they leave the
    picture, as after a change of the design, and keeps its direction. A user who came closer to
    look at a part stays there, as long as something is in sight.
    """

    def __init__(self, first: viser.InitialCameraConfig, points: Callable[[], FloatArray]) -> None:
        self._first = first
        self._points = points
        self._placements: dict[int, _Placement] = {}
        # The points that cameras followed last, and the browsers that show all of them.
        self._followed: FloatArray | None = None
        self._showing: set[int] = set()
        # Browsers report several sizes at once while they load: the last one counts.
        self._lock = threading.RLock()

    def frame_first(self) -> None:
        """Make the first camera of new browsers frame the points."""
        first = self._first
        first.position, first.look_at = framing(self._points(), "isometric", FIRST_ASPECT)

    def fit(self, client: viser.ClientHandle) -> None:
        """Show the whole mechanism in one browser from the present direction of its camera."""
        self.turn(client, self.direction(client))

    def direction(self, client: viser.ClientHandle) -> Triple:
        """Return the direction from the target of a browser's camera to its eye, of length one.

        It is that of its last place while the user has not moved it, wherever a browser that is
        still loading reports it.
        """
        placement = self._placements.get(client.client_id)
        if placement is not None and placement.has(client):
            away = _direction(placement.view)
        else:
            away = np.asarray(client.camera.position) - np.asarray(client.camera.look_at)
        return triple(away / max(float(np.linalg.norm(away)), 1e-300))

    def turn(self, client: viser.ClientHandle, towards: Triple) -> None:
        """Show the whole mechanism in one browser from a direction, unless that is along z."""
        # A browser never makes its camera vertical, but a script or a link may have.
        if math.hypot(*towards[:2]) > 1e-6 * math.hypot(*towards):
            self.point(client, np.array(towards))

    def connected(self, client: viser.ClientHandle) -> None:
        """Point a new browser's camera, and keep it framed until its user moves it."""
        self.point(client, "isometric")
        client.camera.on_update(lambda _: self._on_report(client))

    def disconnected(self, client: viser.ClientHandle) -> None:
        """Forget a browser."""
        with self._lock:
            self._placements.pop(client.client_id, None)
            self._showing.discard(client.client_id)

    def follow(self, clients: Iterable[viser.ClientHandle]) -> None:
        """Move the cameras that no longer show all points, or none, keeping their directions.

        The clients are browsers whose users hold nothing.
        """
        points = self._points()
        for client in clients:
            with self._lock:
                places = _places(client, points)
                have_left = client.client_id in self._showing and not are_in_picture(places)
                # A browser that is still loading will be where it was put.
                is_lost = self.stands(client) and are_out_of_sight(places)
            if have_left or is_lost:
                self.fit(client)
        self._followed = points

    def look_again(self, client: viser.ClientHandle) -> None:
        """Put a browser's camera at its last position again, unless its user moved it."""
        with self._lock:
            placement = self._placements.get(client.client_id)
            if placement is None or not placement.has(client):
                return
            if client.camera.aspect == placement.aspect:
                put_camera(client, placement.eyes[-1], placement.target, FIELD_OF_VIEW)
            else:
                self.point(client, placement.view)

    def stands(self, client: viser.ClientHandle) -> bool:
        """Whether a browser's camera is where it was put last, or where its user moved it.

        A browser that is still loading may miss what was sent, and report its first position.
        """
        placement = self._placements.get(client.client_id)
        if placement is None:
            return True
        return placement.is_at(client, placement.eyes[-1]) or not placement.has(client)

    def _on_report(self, client: viser.ClientHandle) -> None:
        """Note what a browser's camera shows, and put it again if its report calls for that."""
        with self._lock:
            if self._followed is None or are_in_picture(_places(client, self._followed)):
                self._showing.add(client.client_id)
            else:
                self._showing.discard(client.client_id)
            placement = self._placements.get(client.client_id)
            if placement is None:
                return
            has_new_shape = client.camera.aspect != placement.aspect
            if has_new_shape or not placement.is_at(client, placement.eyes[-1]):
                self.look_again(client)

    def point(self, client: viser.ClientHandle, view: ViewName | FloatArray) -> None:
        """Show the mechanism in one browser from a view, or from a direction (3,)."""
        with self._lock:
            reported = client.camera.aspect
            aspect = reported if math.isfinite(reported) and reported > 0.0 else 1.0
            eye, target = framing(self._points(), view, aspect)
            placement = self._placements.get(client.client_id)
            if placement is None:
                first, before = (self._first.position, np.array(client.camera.position)), ()
            else:
                first, before = placement.first, placement.eyes[-REMEMBERED:]
            self._placements[client.client_id] = _Placement(
                view, reported, first, (*before, eye), target
            )
            put_camera(client, eye, target, FIELD_OF_VIEW)


def _places(client: viser.ClientHandle, points: FloatArray) -> FloatArray:
    """Return where a browser's camera shows points; see `places_in_picture`."""
    camera = client.camera
    eye, target = np.asarray(camera.position), np.asarray(camera.look_at)
    return places_in_picture(points, eye, target, camera.fov, camera.aspect)
