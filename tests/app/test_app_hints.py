"""Every control tells what it does, and in which unit; both themes are legible."""

from __future__ import annotations

import re

import pytest

from explorer.app.features.ground.ground import GRID
from explorer.app.look import read_stylesheet
from explorer.app.server import Running
from explorer.app.widgets import charts
from explorer.app.widgets.colours import OUTLINE, Rgb
from explorer.app.widgets.pieces import Widget, widgets
from explorer.app.widgets.theme import BRAND, BRAND_ON_DARK

# Of panels, of the scene, and of fields within panels, as viser draws them.
LIGHT = {"panel": "#ffffff", "scene": "#ffffff", "field": "#ffffff"}
DARK = {"panel": "#242424", "scene": "#141414", "field": "#2e2e2e"}

UNITS = re.compile(
    r"design units|units³|\bunits\b|\bmm\b|millimetres|pixels|\(px\)|°|degrees|\(s\)|seconds"
    r"|kg/m³|\bstep\b|\bkg\b|\bN( m)?\b|\bGPa\b|\bMPa\b"
)

WITHOUT_UNIT = {
    "Starts": "a count of designs",
    "Magnification (0: automatic)": "a ratio",
    "Exploded": "a share, from 0 to 1",
    "Go to step": "the number of a step",
    "Number of designs": "a count of designs",
    "Name": "a name",
    "Direction": "a direction, of length 1",
}
"""Controls of values that have no unit, and what they are."""

OUT_OF_SIGHT = {"Presses on markup"}
"""What the page writes to and nobody reads."""


def name(widget: Widget) -> str:
    return " / ".join((*widget.path, widget.label))


def test_every_control_says_in_short_sentences_what_it_does(running: Running) -> None:
    found = [each for each in widgets(running.viser) if each.label not in OUT_OF_SIGHT]
    assert len(found) > 100
    for widget in found:
        assert 5 < len(widget.hint) <= 240, name(widget)
        assert widget.hint.endswith("."), f"{name(widget)}: {widget.hint!r} is no sentence"
        assert not widget.hint[0].islower() or widget.hint[0] in "xyab", name(widget)


def test_every_value_says_its_unit(running: Running) -> None:
    values = (each for each in widgets(running.viser) if each.kind == "value")
    without = {
        widget.label
        for widget in values
        if UNITS.search(" ".join((*widget.path, widget.label, widget.hint))) is None
    }
    assert without <= {*WITHOUT_UNIT, *OUT_OF_SIGHT}, "these tell no unit"


def rgb(colour: str) -> Rgb:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue


def luminance(colour: Rgb) -> float:
    """Return the relative luminance as WCAG 2 defines it."""
    shares = [value / 255.0 for value in colour]
    linear = [s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: Rgb, other: Rgb) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_is_that_of_its_definition() -> None:
    assert contrast((0, 0, 0), (255, 255, 255)) == pytest.approx(21.0)
    assert contrast((119, 119, 119), (255, 255, 255)) == pytest.approx(4.48, abs=0.005)


@pytest.mark.parametrize("name", ["grey", "within", "close", "beyond"])
def test_words_are_legible_in_both_themes(name: str) -> None:
    found = re.search(rf"--ex-{name}: light-dark\((#\w+), (#\w+)\)", read_stylesheet())
    assert found is not None
    for colour, backgrounds in zip(found.groups(), (LIGHT, DARK), strict=True):
        for place, background in backgrounds.items():
            assert contrast(rgb(colour), rgb(background)) >= 4.5, f"{colour} on a {place}"


def test_lines_of_charts_and_alerts_are_seen_in_both_themes() -> None:
    for chart in ("BLUE", "TEAL", "VIOLET", "ORANGE", "NEUTRAL"):
        for backgrounds in (LIGHT, DARK):
            assert contrast(getattr(charts, chart), rgb(backgrounds["panel"])) >= 3.0
    assert contrast(OUTLINE, rgb(LIGHT["panel"])) >= 3.0


def test_tab_in_front_and_buttons_are_legible() -> None:
    assert contrast(BRAND, rgb(LIGHT["panel"])) >= 4.5
    assert contrast(BRAND_ON_DARK, rgb(DARK["panel"])) >= 4.5
    # viser writes on buttons in white or black by what is behind.
    for brand in (BRAND, BRAND_ON_DARK):
        assert max(contrast(brand, (255, 255, 255)), contrast(brand, (0, 0, 0))) >= 4.5


@pytest.mark.parametrize("dark", [False, True])
def test_grid_is_seen_and_stays_in_the_background(dark: bool) -> None:
    background = rgb((DARK if dark else LIGHT)["scene"])
    cell, section = (contrast(each, background) for each in GRID[dark])
    assert 1.15 < cell < section < 2.2
