"""Numbers of the whole page are written alike, a name has one value, no action causes a fault."""

from __future__ import annotations

import contextlib
import re
import threading
from collections.abc import Generator, Iterator

import psutil
import pytest
from client import wait_for
from hypothesis import given, settings, strategies as st
from monkey import Monkey, explorer_with_data
from page_props import shown_by, shown_texts
from sample_states import Sample, samples
from server_clock import wait_until_drawn

from explorer.app.features.compare.feature import pin
from explorer.app.features.optimise.actions import accept, start_run
from explorer.app.features.optimise.state import Optimisation, OptimisationRequest
from explorer.app.features.paths.state import Paths
from explorer.app.server import Running
from explorer.app.state.actions import Action, Set, open_design
from explorer.app.state.moves import go_home, set_angle, set_pose, set_position
from explorer.app.state.state import State
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
    running.page.session.do(open_design(PRESETS["paper-optimal"]))
    running.page.session.do(Set("view", View()))
    assert wait_until_drawn(running.page, PATIENCE_SECONDS)


def do(running: Running, action: Action) -> None:
    """Do what is possible, but begin no search and no planning."""
    session = running.page.session
    with contextlib.suppress(ExplorerError):
        after = action.apply(session.state)
        if not Optimisation.of(after).is_on and not Paths.of(after).is_planning:
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
    do(running, set_pose(Pose.of_yaw_pitch_roll(position, angles)))
    check_numbers(running)
    do(running, go_home())
    do(running, set_position("xyz".index(axis), position[0]))
    do(running, set_angle("xyz".index(axis), angles[0]))
    check_numbers(running)


def test_numbers_of_computed_drawings_are_written_alike(running: Running) -> None:
    for path, value in (
        ("view.workspace.solid", True),
        ("view.workspace.region", "accessible"),
        ("view.workspace.cut", "y"),
        ("view.drawn_as", "prototype"),
        ("compared.pinned", (*PRESETS.values(), None)[:3]),
    ):
        do(running, Set(path, value))
    assert wait_until_drawn(running.page, PATIENCE_SECONDS)
    check_numbers(running)


FIGURE = re.compile(
    r'class="ex-figure"[^>]*><span class="ex-dim ex-small">(.*?)</span><b[^>]*>(.*?)</b>'
)
ROW = re.compile("<tr[^>]*>(.*?)</tr>")
CELL = re.compile("<td[^>]*>(.*?)</td>")
TAG = re.compile("<[^>]*>")
UNITS = re.compile(r",? (units[²³]?|[cm]m[²³]?|u[²³]?|°|%)$")
NUMBER = re.compile(r"−?[\d,]+(\.\d+)?")
# Columns of the live design: after the old one in Optimise, the first in Compare.
COLUMN = {"old": 2}
# Measures of which the page has several, in different definitions or of the same.
WATCHED = {"volume", "clearance", "nodes", "node volume", "node step", "reach", "longest leg"}


def pairs(running: Running) -> Iterator[tuple[str, str]]:
    """Yield each label with its number, of the live design, from the bar and from all tables."""
    for place, value in shown_by(running).items():
        if not isinstance(value, str) or not place.endswith(" content"):
            continue
        yield from FIGURE.findall(value)
        column = 1
        for row in ROW.findall(value):
            cells = [TAG.sub("", cell).strip() for cell in CELL.findall(row)]
            column = COLUMN.get(cells[1], column) if len(cells) > 1 else column
            if len(cells) > column:
                yield cells[0], cells[column]


def values_by_name(running: Running) -> dict[str, set[str]]:
    """Return the numbers of each watched measure, without the zeros at their ends."""
    found: dict[str, set[str]] = {}
    for label, text in pairs(running):
        name, number = UNITS.sub("", label).lower(), NUMBER.match(text)
        if number is not None and name in WATCHED:
            plain = float(number[0].replace(",", "").replace("−", "-"))
            found.setdefault(name, set()).add(f"{plain:.4g}")
    return found


def is_compared(state: State) -> bool:
    run = Optimisation.of(state).run
    return run is not None and run.comparison is not None


def test_name_has_one_value_after_an_optimum_and_after_a_turn(running: Running) -> None:
    page, session = running.page, running.page.session
    request = OptimisationRequest(objective="smallest-reach", volume=7053.0)
    session.do(Set("optimisation.request", request))
    session.do(start_run())
    wait_for(lambda: is_compared(session.state))
    for action in (
        accept(),
        pin(PRESETS["paper-initial"]),
        Set("view.workspace.solid", True),
        Set("view.drawn_as", "prototype"),
        set_position(0, 9.0),
    ):
        session.do(action)
    for turn, orientation, region in (
        (0.0, "home", "limits"),
        (35.0, "home", "accessible"),
        (0.0, "pose", "limits"),
        (0.0, "pose", "accessible"),
    ):
        session.do(set_angle(0, session.state.yaw_pitch_roll[0] + turn))
        session.do(Set("view.workspace.orientation", orientation))
        session.do(Set("view.workspace.region", region))
        assert wait_until_drawn(page, PATIENCE_SECONDS)
        found = values_by_name(running)
        assert {"volume", "clearance", "nodes", "node volume"} <= found.keys()
        several = {name: values for name, values in found.items() if len(values) > 1}
        assert several == {}, (orientation, region)
        labels = {label for label, _ in pairs(running)}
        assert ("Volume, turned" in labels) is (orientation == "pose")


# Pools of threads grow with the first actions; optimiser and planner are processes of their own.
MORE_THREADS, MORE_PROCESSES = 80, 4


# In turn the same happens in every run, with undoing what another tab has done among it; the events
# of the long run fall as they may.
@pytest.mark.parametrize(
    ("actions", "in_turn"),
    [(100, True), pytest.param(1500, False, marks=pytest.mark.long)],
    ids=("100", "1500"),
)
def test_random_actions_cause_no_fault_and_leave_what_a_new_page_would_show(
    actions: int, in_turn: bool
) -> None:
    processes, threads = len(psutil.Process().children(recursive=True)), threading.active_count()
    with explorer_with_data() as running:
        report = Monkey(running, seed=2, in_turn=in_turn).run(actions)
    assert report.actions >= actions
    assert report.faults == []
    assert report.drift == []
    assert max(report.threads) <= threads + MORE_THREADS
    assert max(report.processes) <= processes + MORE_PROCESSES
