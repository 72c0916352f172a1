"""Cameras of browsers stand where they are put, or where somebody moved them."""

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from explorer.app.scene.camera import FIRST_ASPECT, REMEMBERED, Cameras, framing
from explorer.app.scene.placing import Placed
from explorer.app.state import Frame, opened
from explorer.arrays import FloatArray
from explorer.design_file import PRESETS

PLACED = Placed(Frame(opened(PRESETS["paper-optimal"])))
# Of viser, before it is told where to begin.
UNTOLD = np.array([3.0, 3.0, 3.0])
FIRST = framing(PLACED, "isometric", FIRST_ASPECT)[0]


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

        def on_update(self, callback: Any) -> None:
            self.updated = callback

    def __init__(self) -> None:
        self.camera = Browser.Camera()

    def atomic(self) -> Any:
        return nullcontext()

    def tell(self, position: FloatArray) -> None:
        self.camera.position = position
        self.camera.updated(None)


@pytest.fixture
def browser() -> Any:
    return Browser()


@pytest.fixture
def cameras() -> Cameras:
    first: Any = SimpleNamespace()
    made = Cameras(first, lambda: PLACED)
    assert np.allclose(first.position, FIRST)
    return made


EYE = framing(PLACED, "isometric", 0.7)[0]


@pytest.mark.parametrize("missed", [0, 1, REMEMBERED + 3])
@pytest.mark.parametrize("start", [UNTOLD, FIRST])
def test_a_browser_that_misses_where_its_camera_is_put_is_told_again(
    cameras: Cameras, browser: Any, missed: int, start: FloatArray
) -> None:
    cameras.connected(browser)
    for _ in range(missed):
        browser.tell(start)
        assert not cameras.stands(browser)
        cameras.look_again(browser)
        assert np.allclose(browser.camera.position, EYE)
    browser.tell(EYE * (1.0 + 1e-7))
    assert cameras.stands(browser)


def test_a_camera_that_somebody_moved_is_left_alone(cameras: Cameras, browser: Any) -> None:
    cameras.connected(browser)
    elsewhere = np.array([1.0, -30.0, 2.0])
    browser.tell(elsewhere)
    assert cameras.stands(browser)
    cameras.look_again(browser)
    browser.camera.aspect = 1.4
    browser.tell(elsewhere)
    assert browser.camera.position.tolist() == elsewhere.tolist()


def test_a_camera_is_put_again_when_its_browser_changes_its_shape(
    cameras: Cameras, browser: Any
) -> None:
    cameras.connected(browser)
    browser.camera.aspect = 1.4
    browser.tell(EYE)
    assert np.allclose(browser.camera.position, framing(PLACED, "isometric", 1.4)[0])
    cameras.disconnected(browser)
    browser.camera.aspect = 0.9
    browser.tell(EYE)
    assert browser.camera.position.tolist() == EYE.tolist()
    assert cameras.stands(browser)
