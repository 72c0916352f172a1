"""The pictures of the README are what the explorer draws today, as far as the eye can tell."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from likeness import Likeness, Part, assert_alike, decoded, likeness
from pictures import DESIGN, FOLDER, SCENES, draw
from playwright.sync_api import Browser
from scipy import ndimage

from explorer.app.features.mechanism.bodies import Telescopes
from explorer.app.scene.camera import DIRECTIONS
from explorer.app.scene.placing import Placed
from explorer.app.screenshot import (
    SCENE_ALONE,
    open_page,
    settle,
    stable_picture,
    take,
)
from explorer.app.server import Running, start
from explorer.app.state.actions import Set
from explorer.app.state.moves import set_position
from explorer.app.state.view import View
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.page.widgets.assigning import Update

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

# Those that are drawn again each day: they hold every kind of thing that is drawn.
DAILY = {"near-singular"}

Alteration = Callable[[Running, pytest.MonkeyPatch], None]
VIEW = View()


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in DAILY else pytest.mark.long) for name in SCENES],
)
def test_picture_that_is_drawn_now_looks_like_the_stored_one(browser: Browser, name: str) -> None:
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


@pytest.mark.long
def test_picture_is_that_of_a_page_which_draws_every_frame(browser: Browser) -> None:
    size = SCENES["home"].size
    running = start(DESIGN, port=0, panels=False)
    page, client = open_page(browser, running, size)
    try:
        page.add_style_tag(content=SCENE_ALONE)
        settle(page, client)
        running.page.point_cameras("isometric")
        settle(page, client)
        got = draw(browser, SCENES["home"])
        assert_alike("every-frame", stable_picture(page), got, SCENE_LIMIT)
    finally:
        page.close()
        running.stop()


@pytest.mark.long
def test_picture_of_the_command_has_the_handle_only_if_it_is_asked_for(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextmanager
    def same_browser() -> Generator[Browser]:
        yield browser

    monkeypatch.setattr("explorer.app.screenshot.headless_browser", same_browser)

    def draw_with(*, handle: bool) -> FloatArray:
        out = tmp_path / "shot.png"
        take(DESIGN, None, view="isometric", out=out, size=(480, 300), handle=handle)
        return decoded(out.read_bytes())

    # It is red, as nothing else is but the axes in the corner.
    reds = [int(is_red(draw_with(handle=handle)[:200]).sum()) for handle in (False, True)]
    assert reds[0] == 0
    assert reds[1] > 0


def is_red(picture: FloatArray) -> BoolArray:
    red, green, blue = (picture[..., i] for i in range(3))
    return (red > 0.78) & (green < 0.24) & (blue < 0.63)


def half_a_pixel_aside(picture: FloatArray) -> FloatArray:
    return ndimage.shift(picture, (0.5, 0.5, 0.0), order=1, mode="nearest")


def softer(picture: FloatArray) -> FloatArray:
    return ndimage.gaussian_filter(picture, (1.0, 1.0, 0.0))


def darker(picture: FloatArray) -> FloatArray:
    return picture**1.03


@pytest.mark.long
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("other", [half_a_pixel_aside, softer, darker])
def test_likeness_tolerates_what_rasterisers_differ_in(
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


def without_tetrahedron(index: int) -> Alteration:
    shown = [i != index for i in range(3)]
    tetrahedra = (shown[0], shown[1], shown[2])
    return lambda running, _: show(running, replace(VIEW, tetrahedra=tetrahedra))


def show(running: Running, view: View) -> None:
    running.page.session.do(Set("view", view))


def move_platform(running: Running, _: pytest.MonkeyPatch) -> None:
    x = running.page.session.state.pose.position[0]
    running.page.session.do(set_position(0, x + 0.1))


def turn_camera(running: Running, patch: pytest.MonkeyPatch) -> None:
    x, y, z = DIRECTIONS["isometric"]
    c, s = math.cos(math.radians(1.0)), math.sin(math.radians(1.0))
    patch.setitem(DIRECTIONS, "isometric", (c * x - s * y, s * x + c * y, z))


def without_leg(leg: int) -> Alteration:
    along = Telescopes.along

    def all_but_one(
        self: Telescopes, placed: Placed, bases: FloatArray, tips: FloatArray, radii: FloatArray
    ) -> Iterator[Update]:
        tips = tips.copy()
        tips[leg - 1] = bases[leg - 1] + [0.0, 0.0, 1e-6]
        yield from along(self, placed, bases, tips, radii)

    def alter(running: Running, patch: pytest.MonkeyPatch) -> None:
        patch.setattr(Telescopes, "along", all_but_one)
        running.page.session.redraw()

    return alter


ALTERATIONS: dict[str, Alteration] = {
    "no δ1": without_tetrahedron(0),
    "no δ2": without_tetrahedron(1),
    "orange flags": lambda running, _: show(running, replace(VIEW, warn_below=8.8)),
    "platform aside": move_platform,
    "camera turned by 1°": turn_camera,
    **{f"no leg {leg}": without_leg(leg) for leg in (1, 2, 4)},
}


@pytest.mark.long
@pytest.mark.parametrize("alteration", ALTERATIONS)
def test_likeness_of_an_altered_scene_is_beyond_the_limit(
    browser: Browser, alteration: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def alter(running: Running) -> None:
        ALTERATIONS[alteration](running, monkeypatch)

    got = draw(browser, SCENES["home"], alter)
    expected = decoded((FOLDER / "home.png").read_bytes())
    measured = likeness(expected, decoded(got))
    assert not measured.is_within(SCENE_LIMIT), measured


@pytest.mark.long
def test_pictures_that_differ_are_kept_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("likeness.FAILED", tmp_path)
    home, twin = ((FOLDER / f"{name}.png").read_bytes() for name in ("home", "twin"))
    assert_alike("same", home, home, Likeness(0.0, 0.0, 0.0))
    with pytest.raises(AssertionError, match=r"other-got\.png"):
        assert_alike("other", home, twin, SCENE_LIMIT)
