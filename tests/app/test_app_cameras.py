"""Cameras of browsers stand where they are put, or where somebody moved them."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, strategies as st

from explorer.app.scene.camera import (
    FIELD_OF_VIEW,
    FIRST_ASPECT,
    REMEMBERED,
    Cameras,
    are_in_picture,
    framing,
    has_perspective,
)
from explorer.numerics.arrays import FloatArray

POINTS = np.random.default_rng(5).uniform(-6.0, 9.0, (20, 3))
# Of viser, before it is told where to begin.
UNTOLD = np.array([3.0, 3.0, 3.0])
FIRST = framing(POINTS, "isometric", FIRST_ASPECT)[0]


class Browser:
    """A browser, as far as cameras know one; at first it may miss where its camera is put."""

    client_id = 5

    class Camera:
        """Of the browser, as the server knows it."""

        aspect = 0.7
        fov = 0.6
        up_direction = (0.0, 0.0, 1.0)
        position = UNTOLD
        look_at = np.zeros(3)

        def __init__(self) -> None:
            self.updated: Any = print

        def on_update(self, callback: Any) -> None:
            self.updated = callback

    def __init__(self) -> None:
        self.camera = Browser.Camera()
        self.puts: list[FloatArray] = []

    def put(self, _: Any, eye: FloatArray, __: FloatArray) -> None:
        """Take note of where the camera is put; whether it goes there is another matter."""
        self.puts.append(eye)

    def tell(self, position: FloatArray) -> None:
        self.camera.position = position
        self.camera.updated(None)


@pytest.fixture
def browser() -> Any:
    return Browser()


@pytest.fixture
def cameras(browser: Any) -> Cameras:
    first: Any = SimpleNamespace()
    cameras = Cameras(first, lambda: POINTS, browser.put)
    cameras.frame_first()
    assert np.allclose(first.position, FIRST)
    cameras.connected(browser)
    return cameras


EYE = framing(POINTS, "isometric", 0.7)[0]


@pytest.mark.parametrize("missed", [0, 1, REMEMBERED + 3])
@pytest.mark.parametrize("start", [UNTOLD, FIRST])
def test_camera_of_a_browser_that_missed_its_place_is_put_there_again(
    cameras: Cameras, browser: Any, missed: int, start: FloatArray
) -> None:
    for _ in range(missed):
        puts = len(browser.puts)
        browser.tell(start)
        assert not cameras.stands(browser)
        # At once, since nothing may follow.
        assert len(browser.puts) == puts + 1
        assert np.allclose(browser.puts[-1], EYE)
    browser.tell(EYE * (1.0 + 1e-7))
    assert cameras.stands(browser)


def test_camera_of_a_browser_that_says_nothing_is_put_again_and_does_not_stand(
    cameras: Cameras, browser: Any
) -> None:
    """What was sent to a browser that is still loading may have been lost."""
    for looks in range(2, 5):
        assert not cameras.stands(browser)
        cameras.look_again(browser)
        assert len(browser.puts) == looks
        assert np.allclose(browser.puts[-1], EYE)


def test_camera_is_put_last_for_the_shape_that_its_browser_told_last(browser: Any) -> None:
    """While its panels are laid out a browser tells of several, each heard on its own thread."""
    others: list[threading.Thread] = []

    def points() -> FloatArray:
        # Another shape is told while this one is framed.
        if browser.camera.aspect == 1.6:
            browser.camera.aspect = 0.9
            others.append(threading.Thread(target=browser.camera.updated, args=(None,)))
            others[-1].start()
            others[-1].join(0.1)
        return POINTS

    cameras = Cameras(cast("Any", SimpleNamespace()), points, browser.put)
    cameras.frame_first()
    cameras.connected(browser)
    browser.camera.aspect = 1.6
    browser.tell(EYE)
    for other in others:
        other.join()
    assert np.allclose(browser.puts[-1], framing(POINTS, "isometric", 0.9)[0])


def test_camera_that_somebody_moved_is_left_alone(cameras: Cameras, browser: Any) -> None:
    elsewhere = np.array([1.0, -30.0, 2.0])
    browser.tell(elsewhere)
    assert cameras.stands(browser)
    cameras.look_again(browser)
    browser.camera.aspect = 1.4
    browser.tell(elsewhere)
    assert len(browser.puts) == 1


def test_camera_is_put_again_when_its_browser_changes_its_shape(
    cameras: Cameras, browser: Any
) -> None:
    browser.camera.aspect = 1.4
    browser.tell(EYE)
    assert np.allclose(browser.puts[-1], framing(POINTS, "isometric", 1.4)[0])
    cameras.disconnected(browser)
    browser.camera.aspect = 0.9
    browser.tell(EYE)
    assert len(browser.puts) == 2
    assert cameras.stands(browser)


@given(
    st.tuples(st.floats(0.0, 6.3), st.floats(-1.1, 1.1)),
    st.floats(0.4, 2.5),
    st.integers(0, 2**32 - 1),
    st.floats(0.01, 100.0),
)
def test_framed_points_are_in_the_picture_and_not_from_closer(
    angles: tuple[float, float], aspect: float, seed: int, size: float
) -> None:
    azimuth, elevation = angles
    flat = np.array([np.cos(azimuth), np.sin(azimuth), np.tan(elevation)])
    points = size * np.random.default_rng(seed).uniform(-6.0, 9.0, (20, 3))
    eye, target = framing(points, flat, aspect)
    assert are_in_picture(points, eye, target, FIELD_OF_VIEW, aspect)
    closer = target + 0.85 * (eye - target)
    assert not are_in_picture(points, closer, target, FIELD_OF_VIEW, aspect)
    # Nothing behind a camera is in its picture, if it has perspective.
    if has_perspective(target - eye):
        behind = 2.0 * eye - target + 0.0 * points
        assert not are_in_picture(behind, eye, target, 2.0, aspect)


@pytest.mark.parametrize("axis", [*np.eye(3), *-np.eye(3)], ids=str)
def test_camera_has_no_perspective_along_an_axis_alone(axis: FloatArray) -> None:
    upright = axis + [0.0, -1e-4, 0.0] if axis[2] else axis
    assert not has_perspective(3.0 * upright)
    assert has_perspective(3.0 * (upright + 0.01 * np.array([0.3, 0.5, 0.8])))


@pytest.mark.parametrize("depth", [-100.0, 0.0, 3.0])
def test_camera_without_perspective_frames_the_same_whatever_the_depth(depth: float) -> None:
    """Height and breadth count, not how far away a point is."""
    size = np.linalg.norm(np.subtract(*framing(POINTS, "front", 1.2)))
    deeper = POINTS * [1.0, depth, 1.0]
    assert np.linalg.norm(np.subtract(*framing(deeper, "front", 1.2))) == pytest.approx(size)


def test_camera_follows_what_leaves_its_picture_and_keeps_its_direction(browser: Any) -> None:
    points, first = POINTS.copy(), SimpleNamespace()

    def look(_: Any, eye: FloatArray, target: FloatArray) -> None:
        browser.puts.append(eye)
        browser.camera.look_at = target
        browser.tell(eye)

    def count_puts_with(factor: float) -> int:
        points[:] *= factor
        cameras.follow([browser])
        return len(browser.puts)

    browser.camera.fov = FIELD_OF_VIEW
    cameras = Cameras(cast("Any", first), lambda: points, look)
    cameras.frame_first()
    cameras.connected(browser)
    assert count_puts_with(1.0) == 1
    # The user turns it to where everything is seen.
    eye, target = framing(points, np.array([-1.0, -0.4, 0.3]), 0.7)
    browser.camera.look_at = target
    browser.tell(target + 1.2 * (eye - target))
    assert count_puts_with(1.1) == 1
    assert count_puts_with(2.0) == 2
    towards = (browser.camera.position - browser.camera.look_at) / (eye - target)
    assert np.ptp(towards) < 1e-9
    # The user comes closer to look at a part, and stays there.
    browser.tell(browser.camera.look_at + 0.3 * (eye - target))
    assert count_puts_with(1.5) == 2
