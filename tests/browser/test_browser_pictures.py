"""The pictures of the README are what the explorer draws today, as far as the eye can tell."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import viser
from likeness import Likeness, Part, assert_alike, decoded, likeness
from pictures import DESIGN, FOLDER, SCENES, draw
from playwright.sync_api import Browser, Page
from scipy import ndimage

from explorer.app.features.listed import FEATURES
from explorer.app.features.mechanism.legs import Telescopes
from explorer.app.scene.placing import Placed
from explorer.app.screenshot import (
    SCENE_ALONE,
    open_page,
    picture,
    settle,
    stable_picture,
    take,
)
from explorer.app.server import Running, start
from explorer.app.state.action import Action
from explorer.app.state.actions import Set, SetPose, SetPosition
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.widgets.assigning import Update
from explorer.numerics.arrays import FloatArray

# One browser draws the same picture to the last bit each time. Another version or machine may
# smooth edges differently, but never shift them by more than half a pixel: that shift measures
# up to (0.026, 0.49, 4.7), and faces in one plane, of which each draws another in front, up to
# 5.5. The smallest of the faults below, a missing tetrahedron, has a spot of 7, a missing leg
# one of 12.
SCENE_LIMIT = Likeness(structure=0.03, colour=0.6, spot=5.6)
# Text in another font of the same size measures (0.24, 1.8) and any spot; a message that
# appears (0.24, 3.3). What the panels say is tested in words.
PANELS_LIMIT = Likeness(structure=0.3, colour=2.5, spot=100.0)
# The scene alone, between the docked panels, and above the drawer where that is open.
BETWEEN_PANELS = (slice(90, 750), slice(310, 910))
ABOVE_DRAWER = (slice(90, 490), slice(310, 910))
DRAWN_OUT = {"compare", "optimise"}
# Scenes of thousands of points, which change more in half a pixel than others without a leg. They
# are compared with their panels only.
OF_POINTS = {"tilt"}

Alteration = Callable[["Stage"], None]


@pytest.mark.parametrize("name", SCENES)
def test_a_fresh_picture_looks_like_the_stored_one(browser: Browser, name: str) -> None:
    expected = (FOLDER / f"{name}.png").read_bytes()
    got = draw(browser, SCENES[name])
    if not SCENES[name].panels:
        assert_alike(name, expected, got, SCENE_LIMIT)
        return
    if name not in OF_POINTS:
        assert_alike(f"{name}-scene", expected, got, SCENE_LIMIT, scene_of(name))
    assert_alike(f"{name}-panels", expected, got, PANELS_LIMIT)


def scene_of(name: str) -> Part:
    return ABOVE_DRAWER if name in DRAWN_OUT else BETWEEN_PANELS


def test_a_picture_is_that_of_a_page_which_draws_every_frame(
    stage: Stage, browser: Browser
) -> None:
    got = picture(browser, DESIGN, None, view="isometric", size=SCENES["home"].size)
    assert_alike("every-frame", stage.picture(), got, SCENE_LIMIT)


def test_pictures_of_the_command_have_no_handle_unless_asked(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextmanager
    def same_browser() -> Generator[Browser]:
        yield browser

    monkeypatch.setattr("explorer.app.screenshot.headless_browser", same_browser)

    def taken(*, handle: bool) -> bytes:
        out = tmp_path / "shot.png"
        take(DESIGN, None, view="isometric", out=out, size=(480, 300), handle=handle)
        return out.read_bytes()

    usual = picture(browser, DESIGN, None, view="isometric", size=(480, 300))
    assert likeness(decoded(usual), decoded(taken(handle=True))).is_within(SCENE_LIMIT)
    assert not likeness(decoded(usual), decoded(taken(handle=False))).is_within(SCENE_LIMIT)


def half_a_pixel_aside(picture: FloatArray) -> FloatArray:
    return ndimage.shift(picture, (0.5, 0.5, 0.0), order=1, mode="nearest")


def softer(picture: FloatArray) -> FloatArray:
    return ndimage.gaussian_filter(picture, (1.0, 1.0, 0.0))


def darker(picture: FloatArray) -> FloatArray:
    return picture**1.03


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("other", [half_a_pixel_aside, softer, darker])
def test_what_rasterisers_differ_in_is_tolerated(
    name: str, other: Callable[[FloatArray], FloatArray]
) -> None:
    picture = decoded((FOLDER / f"{name}.png").read_bytes())
    drawn = other(picture)
    if SCENES[name].panels:
        assert likeness(picture, drawn).is_within(PANELS_LIMIT)
        if name in OF_POINTS:
            return
        picture, drawn = picture[scene_of(name)], drawn[scene_of(name)]
    assert likeness(picture, drawn).is_within(SCENE_LIMIT)


@dataclass
class Stage:
    """The home scene in a page of its own, to be altered."""

    running: Running
    page: Page
    client: viser.ClientHandle
    start: State

    def do(self, action: Action) -> None:
        """Do something to the state."""
        self.running.page.session.do(action)

    def picture(self) -> bytes:
        """Return a picture of what is there now."""
        assert self.running.page.session.wait_until_idle()
        settle(self.page, self.client)
        return stable_picture(self.page)


@pytest.fixture(scope="module")
def opened_stage(browser: Browser) -> Iterator[Stage]:
    running = start(DESIGN, port=0, panels=False)
    page, client = open_page(browser, running, SCENES["home"].size)
    page.add_style_tag(content=SCENE_ALONE)
    settle(page, client)
    yield Stage(running, page, client, running.page.session.state)
    page.close()
    running.stop()


@pytest.fixture
def stage(opened_stage: Stage) -> Iterator[Stage]:
    """The home scene as it is stored, and so again afterwards."""
    opened_stage.running.page.point_cameras("isometric")
    yield opened_stage
    opened_stage.do(Set("view", opened_stage.start.view))
    opened_stage.do(SetPose(opened_stage.start.pose))


def without_tetrahedron(index: int) -> Alteration:
    shown = [i != index for i in range(3)]

    def alter(stage: Stage) -> None:
        tetrahedra = (shown[0], shown[1], shown[2])
        stage.do(Set("view", replace(stage.start.view, tetrahedra=tetrahedra)))

    return alter


def with_flags_turned_orange(stage: Stage) -> None:
    stage.do(Set("view", replace(stage.start.view, warn_below=8.8)))


def with_the_platform_aside(stage: Stage) -> None:
    stage.do(SetPosition(0, stage.start.pose.position[0] + 0.1))


def with_the_camera_turned(stage: Stage) -> None:
    eye, target = np.array(stage.client.camera.position), np.array(stage.client.camera.look_at)
    turn = np.radians(1.0)
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    stage.client.camera.position = target + rotation @ (eye - target)


@pytest.mark.parametrize(
    "alter",
    [
        without_tetrahedron(0),
        without_tetrahedron(1),
        with_flags_turned_orange,
        with_the_platform_aside,
        with_the_camera_turned,
    ],
    ids=["no δ1", "no δ2", "orange flags", "platform aside", "camera turned by 1°"],
)
def test_an_altered_scene_is_told_from_the_stored_one(stage: Stage, alter: Alteration) -> None:
    alter(stage)
    assert_told_from_home(stage)


@pytest.mark.parametrize("leg", [1, 2, 4])
def test_a_missing_leg_is_told(stage: Stage, leg: int, monkeypatch: pytest.MonkeyPatch) -> None:
    along = Telescopes.along

    def all_but_one(
        self: Telescopes, placed: Placed, bases: FloatArray, tips: FloatArray
    ) -> Iterator[Update]:
        tips = tips.copy()
        tips[leg - 1] = bases[leg - 1] + [0.0, 0.0, 1e-6]
        yield from along(self, placed, bases, tips)

    with monkeypatch.context() as patched:
        patched.setattr(Telescopes, "along", all_but_one)
        stage.running.page.session.redraw()
        assert_told_from_home(stage)


def assert_told_from_home(stage: Stage) -> None:
    expected = decoded((FOLDER / "home.png").read_bytes())
    measured = likeness(expected, decoded(stage.picture()))
    assert not measured.is_within(SCENE_LIMIT), measured


def test_pictures_that_differ_are_kept_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("likeness.FAILED", tmp_path)
    home, twin = ((FOLDER / f"{name}.png").read_bytes() for name in ("home", "twin"))
    assert_alike("same", home, home, Likeness(0.0, 0.0, 0.0))
    with pytest.raises(AssertionError, match=r"other-got\.png"):
        assert_alike("other", home, twin, SCENE_LIMIT)


def test_lines_are_made_with_the_kind_of_colours_that_they_get(running: Running) -> None:
    # A line made with one colour and then given many is white if it was drawn in between.
    made: dict[int, tuple[int, ...]] = {}

    class Recorder(viser.SceneApi):
        def add_line_segments(self, *args: Any, **kwargs: Any) -> viser.LineSegmentsHandle:
            handle = super().add_line_segments(*args, **kwargs)
            made[id(handle)] = np.shape(handle.colors)
            return handle

    running.viser.scene.__class__ = Recorder
    # Parts are made anew; feeds and what else the page has stay.
    services, placed = running.page.services, Placed(Frame(opened(DESIGN)))
    parts = [part(services) for feature in FEATURES for part in feature.scene]
    updates = [update for part in parts for update in part.updates(placed)]
    given = {id(h): np.shape(np.asarray(v)) for h, name, v in updates if name == "colors"}
    assert len(given) > 3
    assert given == {number: made[number] for number in given}
