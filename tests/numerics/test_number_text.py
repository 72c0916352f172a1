"""Numbers as text: no rounding errors, no zero with a minus sign."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, strategies as st

from explorer.app.features.singularity.actions import GoToSingularity
from explorer.app.features.singularity.distance import distance_table
from explorer.app.features.singularity.jog_panel import travel_marks
from explorer.app.features.singularity.panel import measures_table, summary
from explorer.app.state.frame import Frame
from explorer.app.state.state import opened
from explorer.app.widgets.markup import fitted, share, signed
from explorer.cli.commands.singularity import Singularity
from explorer.cli.output import degrees, figures
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.numerics.number_text import drop_rounding, format_ascii, format_fixed, format_number

NEGATIVE_ZERO = re.compile(r"(?<![\d.])[-−]0(\.0*)?(?![\d.e])")


@given(st.floats(-1e6, 1e6), st.floats(1e-20, 1e20), st.integers(1, 8))
def test_number_text_of_zero_has_no_sign(value: float, size: float, digits: int) -> None:
    for text in (
        format_fixed(value, digits),
        format_ascii(value, digits, size=size),
        signed(value, digits),
        format_number(value, digits, size=size),
        fitted(value, size, digits),
        *figures([value, size]),
        *degrees([value]),
    ):
        assert not NEGATIVE_ZERO.fullmatch(text.rstrip("°"))


@given(st.floats(1e-20, 1e20), st.floats(-1.0, 1.0))
def test_number_text_of_rounding_reads_zero_in_every_unit(size: float, share: float) -> None:
    rounding = 1e-15 * share * size
    assert format_number(rounding, size=size) == "0"
    assert drop_rounding(rounding, size) == 0.0
    assert float(figures([size, rounding])[1]) == 0.0
    assert float(fitted(rounding, size, 5)) == 0.0


@given(st.floats(1e-20, 1e20))
def test_number_text_of_small_number_above_rounding_is_kept(size: float) -> None:
    assert format_number(1e-9 * size, size=size) != "0"
    assert format_number(1e-30 * size) != "0"
    assert share(1.651e-9) == "1.65e−09"


@pytest.mark.parametrize("incidence", [1, 2, 3])
def test_panels_at_a_singular_pose_show_no_rounding(incidence: int) -> None:
    start = Pose.of_yaw_pitch_roll((14.0, -2.0, 6.0), (-40.0, 10.0, 20.0))
    state = GoToSingularity(incidence).apply(opened(PRESETS["paper-optimal"], start))
    frame = Frame(state)
    marks = " ".join(text for index in range(6) for _, text in travel_marks(frame, index))
    for html in (summary(frame), distance_table(frame), measures_table(frame), marks):
        shown = re.sub("<[^>]*>", " ", html)
        assert not re.search(r"e[-−](1[3-9]|[2-9]\d)", shown)
        assert not NEGATIVE_ZERO.search(shown)


def test_command_at_a_singular_pose_shows_no_rounding(capsys: pytest.CaptureFixture[str]) -> None:
    pose = GoToSingularity(2).apply(opened(PRESETS["paper-optimal"])).pose
    Singularity(position=pose.position, quaternion=pose.quaternion).run()
    text = capsys.readouterr().out
    assert not re.search(r"e-(1[3-9]|[2-9]\d)", text)
    assert not NEGATIVE_ZERO.search(text)
