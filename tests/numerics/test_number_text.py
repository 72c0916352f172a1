"""Numbers as text: no rounding errors, no zero with a minus sign."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given, strategies as st

from explorer.app.features.singularity.feature import distance_table, measures_table, summary
from explorer.app.features.singularity.work import go_to_singularity
from explorer.app.state.frame import Frame
from explorer.app.state.state import open_state
from explorer.cli.commands.kinematics import SingularityCommand
from explorer.cli.output import degrees, figures
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.numerics.number_text import (
    Unit,
    drop_rounding,
    format_apart,
    format_ascii,
    format_column,
    format_decimals,
    format_fitted,
    format_number,
    snap_to_decimals,
)

NEGATIVE_ZERO = re.compile(r"(?<![\d.])[-−]0(\.0*)?(?![\d.e])")


@given(st.floats(-1e6, 1e6), st.floats(1e-20, 1e20), st.integers(1, 8))
def test_number_text_of_zero_has_no_sign(value: float, size: float, digits: int) -> None:
    for text in (
        format_ascii(value, digits, size=size),
        format_decimals(value, digits),
        format_number(value, digits, size=size),
        format_fitted(value, size, digits),
        *figures([value, size]),
        *degrees([value]),
    ):
        assert not NEGATIVE_ZERO.fullmatch(text.rstrip("°"))


@given(st.floats(1e-20, 1e20), st.floats(-1.0, 1.0))
def test_number_text_of_rounding_reads_zero_and_of_small_numbers_above_it_does_not(
    size: float, part: float
) -> None:
    rounding = 1e-15 * part * size
    assert format_number(rounding, size=size) == "0"
    assert drop_rounding(rounding, size) == 0.0
    assert float(figures([size, rounding])[1]) == 0.0
    assert read(format_fitted(rounding, size, 5)) == 0.0
    in_column = format_column([size, rounding], 3, size=size)[1]
    assert read(in_column) == 0.0
    assert not NEGATIVE_ZERO.fullmatch(in_column)
    assert format_number(1e-9 * size, size=size) != "0"
    assert format_number(1e-30 * size) != "0"
    assert format_fitted(1.651e-9, 1.0, 5) == "1.65 × 10⁻⁹"


@given(st.integers(-(10**6), 10**6), st.floats(-1e-13, 1e-13))
def test_number_snaps_to_decimals_across_rounding_alone(hundredths: int, error: float) -> None:
    typed = hundredths / 100
    assert snap_to_decimals(typed + error, 2, 1e4) == typed
    assert snap_to_decimals(typed + 1e-6, 2, 1e4) == typed + 1e-6


@pytest.mark.parametrize("incidence", [1, 2, 3])
def test_page_and_command_at_a_singular_pose_show_no_rounding(
    incidence: int, capsys: pytest.CaptureFixture[str]
) -> None:
    start = Pose.of_yaw_pitch_roll((14.0, -2.0, 6.0), (-40.0, 10.0, 20.0))
    frame = Frame(go_to_singularity(incidence).apply(open_state(PRESETS["paper-optimal"], start)))
    pose = frame.state.pose
    SingularityCommand(position=pose.position, quaternion=pose.quaternion).run()
    html = (summary(frame), distance_table(frame), measures_table(frame))
    for text in (*html, capsys.readouterr().out):
        plain = re.sub("<[^>]*>", " ", text)
        assert not re.search(r"e[-−](1[3-9]|[2-9]\d)", plain)
        assert not NEGATIVE_ZERO.search(plain)


numbers = st.tuples(st.floats(-10.0, 10.0), st.integers(-15, 15)).map(
    lambda parts: parts[0] * 10.0 ** parts[1]
)
"""Numbers of thirty decades, and zeros of both signs."""

SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


def read(text: str) -> float:
    """Return the number that a text for people stands for."""
    mantissa, _, power = text.replace(",", "").replace("−", "-").partition(" × 10")
    return float(mantissa) * 10.0 ** int(power.translate(SUPERSCRIPTS) or 0)


@given(numbers, st.integers(1, 8))
def test_number_text_for_people_is_the_number_to_its_digits(value: float, digits: int) -> None:
    text = format_number(value, digits)
    assert abs(read(text) - value) <= 0.5001 * 10.0 ** (1 - digits) * abs(value)
    assert not NEGATIVE_ZERO.fullmatch(text)
    assert "e" not in text
    assert "-" not in text
    # Thousands are separated, and there are no zeros at the end of decimals.
    whole, _, decimals = text.partition(" ×")[0].lstrip("−").partition(".")
    assert re.fullmatch(r"\d{1,3}(,\d{3})*", whole)
    assert not decimals.endswith("0")


@given(numbers, st.floats(-1e-3, 1e-3), st.integers(1, 8), st.sampled_from([1.0, 25.4, 0.1]))
def test_numbers_apart_read_differently_and_have_no_more_digits_than_that_takes(
    value: float, part: float, digits: int, factor: float
) -> None:
    pair = value, value + part * abs(value)
    for write in (format_ascii, format_number, Unit("mm", factor).text):
        first, second = format_apart(pair, digits, write)
        if abs(pair[0] - pair[1]) > 1e-15 * abs(value):
            assert first != second
        plain = [write(each, digits) for each in pair]
        if plain[0] != plain[1]:
            assert [first, second] == plain
    assert format_apart((value, value), digits) == [format_ascii(value, digits)] * 2


@given(numbers, st.integers(0, 8), st.booleans())
def test_decimals_for_people_are_as_many_as_asked_for(
    value: float, decimals: int, plus: bool
) -> None:
    text = format_decimals(value, decimals, signed=plus)
    assert abs(read(text) - value) <= 0.5001 * 10.0**-decimals + 1e-12 * abs(value)
    assert len(text.partition(".")[2]) == decimals
    assert not NEGATIVE_ZERO.fullmatch(text)
    assert text.startswith("+") == (plus and read(text) > 0.0)
    assert text.startswith("−") == (read(text) < 0.0)


@given(st.lists(numbers, min_size=1, max_size=8), st.integers(1, 6))
def test_column_has_equal_decimals_and_the_digits_of_its_largest_number(
    values: list[float], digits: int
) -> None:
    largest = max(map(abs, values))
    texts = format_column([*values, math.inf], digits)
    assert texts.pop() == "infinite"
    for value, text in zip(values, texts, strict=True):
        assert abs(read(text) - value) <= 0.5001 * 10.0 ** (1 - digits) * largest
    if largest == 0.0 or 1e-4 <= largest < 1e9:
        assert len({len(text.partition(".")[2]) for text in texts}) == 1


def test_number_text_of_what_is_not_finite_is_a_word() -> None:
    for value, word in ((math.inf, "infinite"), (-math.inf, "−infinite"), (math.nan, "–")):
        assert format_number(value) == word
        assert format_decimals(value, 3) == word
    assert format_number(math.inf, infinite="never") == "never"
