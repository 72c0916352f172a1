"""The sketch of the design variables: its figures are the design's, and no two texts overlap."""

from __future__ import annotations

import itertools
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from strategies import designs

from explorer.app.features.mechanism.sketch import (
    FIGURE_WIDTH,
    HEIGHT,
    WIDTH,
    figures,
    sketch,
)
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.design_file import PRESETS

# Height of type of 11 pixels from the top of b to the bottom of y.
TYPE_HEIGHT = 11.0


@given(designs())
def test_texts_of_a_sketch_are_within_it_and_do_not_overlap(design: Design) -> None:
    for figure, left in zip(figures(design), (0.0, WIDTH - FIGURE_WIDTH), strict=True):
        for word in figure.words:
            assert left <= word.left
            assert word.left + word.width <= left + FIGURE_WIDTH + 1e-9
            assert 0.5 * TYPE_HEIGHT <= word.at[1] <= HEIGHT - 0.5 * TYPE_HEIGHT
        for one, other in itertools.combinations(figure.words, 2):
            right = min(one.left + one.width, other.left + other.width)
            across = right - max(one.left, other.left)
            assert across <= 0.0 or abs(one.at[1] - other.at[1]) >= TYPE_HEIGHT, (one, other)


@given(designs())
def test_dimension_is_as_long_as_its_variable_in_one_scale(design: Design) -> None:
    values: dict[str, float] = dict(zip(VARIABLES, design.variables, strict=True))
    measured: dict[str, float] = {}
    for figure in figures(design):
        lengths = {each.word.variable: each.line for each in figure.dimensions}
        # One scale for each figure: that of its longest dimension.
        longest = max(lengths, key=lambda name: abs(values[name]))
        drawn = {
            name: (end[0] - start[0]) if start[1] == end[1] else (start[1] - end[1])
            for name, (start, end) in lengths.items()
        }
        scale = drawn[longest] / values[longest]
        assert scale > 0.0
        for name, length in drawn.items():
            assert length == pytest.approx(scale * values[name], abs=1e-6 * FIGURE_WIDTH)
            measured[name] = length
    assert sorted(measured) == sorted(VARIABLES)


@pytest.mark.parametrize("design", PRESETS.values(), ids=list(PRESETS))
def test_sketch_names_all_points_and_variables_once(design: Design) -> None:
    root = ET.fromstring(sketch(design))
    texts = [each.text for each in root.iter("text")]
    points = ["a1", "a2", "a3", "b1", "b2", "b3", "b4"]
    named = [name for name in VARIABLES if name not in points]
    # b2 and b3 are points and variables.
    assert sorted(filter(None, texts)) == sorted([*points, *named, "b2", "b3", "Base", "Platform"])
    groups = [each.attrib["data-variable"] for each in root.iter("g")]
    assert sorted(groups) == sorted(VARIABLES)
    for figure in figures(design):
        xs = [x for x, _ in figure.points]
        # The figure fills its place in one direction at least.
        ys = [y for _, y in figure.points]
        assert max(max(xs) - min(xs), max(ys) - min(ys)) > 40.0
