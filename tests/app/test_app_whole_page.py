"""How numbers are written on the page, whatever is done: no minus zero, one way for thousands."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Generator

import pytest
from hypothesis import given, settings, strategies as st
from monkey import explorer_with_data
from page_props import shown_texts
from sample_states import Sample, samples

from explorer.app.server import Running
from explorer.app.state.action import Action
from explorer.app.state.actions import GoHome, Open, Set, SetAngle, SetPose, SetPosition
from explorer.app.state.view import View
from explorer.errors import ExplorerError
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose

PATIENCE_SECONDS = 120.0
# Each example draws the whole page several times.
few = settings(max_examples=settings().max_examples // 5)
MINUS_ZERO = re.compile(r"(?<![\w.])[-−]0(\.0+)?(?![\d.])")
EXPONENT = re.compile(r"\d[eE][+-]?\d")
NO_COMMAS = re.compile(r"(?<![\d.,])(\d{5,}|\d{4,}\.\d)")
# No measure of a mechanism of some units is so small, but for the error of one.
ROUNDING = re.compile(r"(?<!± )(?<![\d.])[\d.]+ × 10⁻(¹[³⁴⁵⁶⁷⁸⁹]|[²³⁴⁵⁶⁷⁸⁹][⁰¹²³⁴⁵⁶⁷⁸⁹])")
# What rounding leaves, of either sign, and lengths that are short without being rounding.
SHORT = st.sampled_from([-7.5e-16, -0.0, 0.0, 3e-17, -4e-13, 1e-5, -1e-5, -0.0004, 5.0])
Triple = tuple[float, float, float]


@pytest.fixture(scope="module")
def running() -> Generator[Running]:
    with explorer_with_data() as made:
        yield made


@pytest.fixture(autouse=True)
def _at_first(running: Running) -> None:  # pyright: ignore[reportUnusedFunction]
    running.page.session.do(Open(PRESETS["paper-optimal"]))
    running.page.session.do(Set("view", View()))
    assert running.page.wait_until_drawn(PATIENCE_SECONDS)


def do(running: Running, action: Action) -> None:
    """Do what is possible, but begin no search and no planning."""
    session = running.page.session
    with contextlib.suppress(ExplorerError):
        after = action.apply(session.state)
        if not after.optimisation.is_on and not after.paths.is_planning:
            session.do(action)
            assert session.wait_until_idle()


def check_numbers(running: Running) -> None:
    for place, text in shown_texts(running):
        for pattern in (MINUS_ZERO, EXPONENT, NO_COMMAS, ROUNDING):
            assert not pattern.search(text), f"{place}: {text}"


@few
@given(samples(10))
def test_numbers_of_all_texts_are_written_alike_after_random_actions(
    running: Running, actions: list[Sample]
) -> None:
    for make, index, share in actions:
        do(running, make(running.page.session.state, index, share))
        check_numbers(running)


@few
@given(st.tuples(SHORT, SHORT, SHORT), st.tuples(SHORT, SHORT, SHORT), st.sampled_from("xyz"))
def test_rounding_is_zero_in_all_texts(
    running: Running, position: Triple, angles: Triple, axis: str
) -> None:
    do(running, SetPose(Pose.of_yaw_pitch_roll(position, angles)))
    check_numbers(running)
    do(running, GoHome())
    do(running, SetPosition("xyz".index(axis), position[0]))
    do(running, SetAngle("xyz".index(axis), angles[0]))
    check_numbers(running)


def test_numbers_of_computed_drawings_are_written_alike(running: Running) -> None:
    for path, value in (
        ("view.workspace.solid", True),
        ("view.workspace.region", "accessible"),
        ("view.workspace.cut", "y"),
        ("view.radius_curve", True),
        ("view.drawn_as", "prototype"),
        ("compared.pinned", (*PRESETS.values(), None)[:3]),
    ):
        do(running, Set(path, value))
    assert running.page.wait_until_drawn(PATIENCE_SECONDS)
    check_numbers(running)
