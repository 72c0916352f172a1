"""Studies on the page: brushes against brute force, picks, fronts, and small studies."""

from __future__ import annotations

import math
import os
import re
import signal
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from client import wait_for
from desk import Desk
from hypothesis import given, strategies as st
from services import StubJobs

from explorer.app.features.feature import Services
from explorer.app.features.studies import work
from explorer.app.features.studies.feature import DECODER, PlotEvent, StudiesPanel
from explorer.app.features.studies.feed import StudyDrawing, StudyFeed
from explorer.app.features.studies.figures import (
    LEFT_OUT,
    PICKED,
    SIDE,
    PlotName,
    PlotRows,
    brushes_in,
    lines_html,
    path_of,
    points_html,
    reading_of,
    row_at,
    select_rows,
    thin_out,
    ticks_of,
)
from explorer.app.features.studies.folders import (
    StudyFolders,
    check_given,
    keep_study,
    study_folders,
    study_in,
)
from explorer.app.features.studies.state import (
    Brush,
    Studies,
    StudyPlan,
    brush_axes,
    choices_for,
    free_axes,
    open_study,
    pick_design,
    range_around,
    study_around,
    within,
)
from explorer.app.features.studies.words import status
from explorer.app.features.studies.work import StudyRunner
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.parts import with_value
from explorer.app.state.state import open_state
from explorer.app.widgets.buttons import Buttons
from explorer.errors import InputError
from explorer.files import extras
from explorer.jobs.jobs import Jobs, LongJob
from explorer.measures.catalogue import measures_in
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Actuators, Guide, Payload, Struts, Tool
from explorer.numerics.number_text import UNITS, Unit
from explorer.page.browser.browser_facts import decode_text
from explorer.sweep.machine import MACHINE
from explorer.sweep.parts import claim, write_part
from explorer.sweep.results import Results, load_results
from explorer.sweep.rows import evaluate
from explorer.sweep.study import NAMES, Objective, Sampling, Study, encode_study

OPTIMAL = PRESETS["paper-optimal"]
QUICK = StudyPlan(
    count=16,
    percent=30.0,
    variables=("a3x", "b2"),
    measures=("volume", "reach"),
    objectives=(("volume", "max"), ("reach", "min")),
)
PATIENCE = 120.0

values = st.one_of(st.floats(-2.0, 2.0), st.sampled_from([-1.0, 0.0, 1.0, math.nan]))
ends = st.one_of(st.floats(-2.0, 2.0), st.sampled_from([-1.0, 0.0, 1.0]))
ranges = st.lists(
    st.tuples(ends, ends).map(lambda pair: (min(pair), max(pair))), min_size=1, max_size=3
).map(tuple)
brushings = st.dictionaries(st.sampled_from("abcx"), ranges, max_size=3).map(
    lambda found: tuple(Brush(axis, each) for axis, each in found.items())
)


@given(st.lists(st.tuples(values, values, values), max_size=12), brushings)
def test_row_is_within_brushes_if_each_of_them_has_it_in_some_range(
    rows: list[tuple[float, float, float]], brushes: tuple[Brush, ...]
) -> None:
    columns: dict[str, Any] = {"index": np.arange(len(rows))}
    columns |= {name: np.array([row[k] for row in rows]) for k, name in enumerate("abc")}
    expected = [
        all(
            brush.axis == "x"
            or any(low <= columns[brush.axis][k] <= high for low, high in brush.ranges)
            for brush in brushes
        )
        for k in range(len(rows))
    ]
    assert within(columns, brushes).tolist() == expected


@given(st.lists(st.tuples(st.sampled_from("abc"), st.one_of(st.just(()), ranges)), max_size=8))
def test_axis_has_the_ranges_that_it_was_given_last(
    strokes: list[tuple[str, tuple[tuple[float, float], ...]]],
) -> None:
    state = open_study("some").apply(open_state(OPTIMAL))
    for axis, each in strokes:
        state = brush_axes((Brush(axis, each),)).apply(state)
    last = dict(strokes)
    assert {brush.axis: brush.ranges for brush in Studies.of(state).brushes} == {
        axis: each for axis, each in last.items() if each
    }
    assert all(Studies.of(state).ranges_of(axis) == each for axis, each in last.items())
    assert Studies.of(free_axes(state).apply(state)).brushes == ()
    # A box in the scatter plot brushes two axes at once.
    every = brush_axes(tuple(Brush(axis, each) for axis, each in strokes))
    assert Studies.of(every.apply(open_state(OPTIMAL))).brushes == Studies.of(state).brushes


@pytest.mark.parametrize(
    "wrong", [((2.0, 1.0),), ((math.nan, 1.0),), ((0.0, math.inf),), ((0.0, 1.0),) * 100]
)
def test_ranges_without_a_finite_interval_are_refused(
    wrong: tuple[tuple[float, float], ...],
) -> None:
    with pytest.raises(InputError):
        brush_axes((Brush("volume", wrong),)).apply(open_state(OPTIMAL))


def test_study_that_is_opened_has_no_brushes_unless_it_was_open() -> None:
    state = open_study("one").apply(open_state(OPTIMAL))
    state = brush_axes((Brush("volume", ((1.0, 2.0),)),)).apply(state)
    state = Set("studies.plan", QUICK).apply(state)
    assert open_study("one").apply(state) is state
    other = open_study("two").apply(state)
    assert Studies.of(other) == Studies(name="two", plan=QUICK)


@given(st.lists(st.booleans(), min_size=1, max_size=80).map(np.array), st.integers(2, 30))
def test_too_many_rows_are_thinned_out_to_those_to_keep_first(keep: Any, most: int) -> None:
    rows = np.arange(len(keep)) * 3
    found = thin_out(rows, keep, most)
    assert len(found) == min(most, len(rows))
    assert np.all(np.diff(found) > 0)
    assert np.isin(found, rows).all()
    if keep.sum() <= most:
        assert np.isin(rows[keep], found).all()
    else:
        assert keep[found // 3].all()


LOADED = msgspec.structs.replace(
    OPTIMAL,
    tool=Tool((1.0, 0.0, 2.0)),
    payload=Payload(0.5, force_n=3.0),
    actuators=Actuators(
        (150.0, 90.0, 150.0, 200.0, 150.0, 150.0),
        (120.0, 200.0, 120.0, 200.0, 80.0, 120.0),
        (0.1, 0.1, 0.1, 0.1, 0.1, 0.1),
    ),
    struts=Struts(moment_nm=6.0, outer_mm=8.0),
    guide=Guide(200.0, 7.0),
)
"""A design with every part of a machine."""
MACHINE_VALUES = {
    "payload_mass": 0.5,
    "payload_force": 3.0,
    "actuator_limit": 80.0,
    "strut_limit": 6.0,
    "guide_force": 200.0,
    "guide_moment": 7.0,
    "tool_x": 1.0,
    "tool_y": 0.0,
    "tool_z": 2.0,
}


@given(
    st.sampled_from(NAMES),
    st.floats(1.0, 95.0),
    st.lists(st.floats(-20.0, 20.0), min_size=6, max_size=6),
)
def test_range_of_a_study_lies_around_the_live_design(
    name: str, percent: float, variables: list[float]
) -> None:
    try:
        design = LOADED.with_variables(variables)
    except InputError:
        return
    low, high = range_around(design, name, percent)
    values: dict[str, float] = dict(zip(VARIABLES, design.variables, strict=True))
    value = (values | MACHINE_VALUES).get(name)
    if name == "radius":
        assert low == 0.0 < high
    elif name == "yaw":
        assert high - low == pytest.approx(2.0 * percent / 100.0 * 90.0)
    elif value is None:
        assert 0.0 < low < high
    else:
        has_sign = name in MACHINE_VALUES and not name.startswith("tool")
        least = 0.0 if has_sign else 0.05 * design.reach
        assert (low + high) / 2.0 == pytest.approx(value, abs=1e-9)
        assert high - low == pytest.approx(2.0 * max(abs(value), least) * percent / 100.0)
        # What is well off zero does not come to it.
        assert abs(value) < least or low * high > 0.0


@given(
    st.lists(
        st.one_of(
            st.sampled_from(NAMES).map(lambda name: ("variable", name)),
            st.sampled_from([*measures_in("studies")]).map(lambda name: ("measure", name)),
        ),
        max_size=30,
    )
)
def test_plan_makes_a_study_or_is_refused_with_what_is_missing(
    turns: list[tuple[str, str]],
) -> None:
    plan = StudyPlan()
    senses: list[object] = []
    for _ in range(4):
        plan = plan.with_measure_advanced("extent_x")
        senses.append(("extent_x" in plan.measures, dict(plan.objectives).get("extent_x")))
    assert senses == [(True, None), (True, "max"), (True, "min"), (False, None)]
    assert plan == StudyPlan()
    for what, name in turns:
        turn = plan.with_variable_toggled if what == "variable" else plan.with_measure_advanced
        plan = turn(name)
        assert {each for each, _ in plan.objectives} <= {*plan.measures}
    measured = {*plan.measures} - {*plan.variables}
    if not plan.variables or not measured:
        with pytest.raises(InputError, match="choose at least one"):
            study_around(LOADED, plan, "s")
        return
    study = study_around(LOADED, plan, "s")
    assert {*study.variables} == {*plan.variables}
    assert {*study.measures} == measured
    assert study.chunks <= 41


def test_plan_offers_what_the_machine_of_the_design_has_and_refuses_the_rest() -> None:
    plan = StudyPlan()
    variables, measures = choices_for(OPTIMAL, plan)
    assert variables == [name for name in NAMES if name not in MACHINE]
    assert not {*measures} & {"home_load_share", "home_worst_error", "held_volume"}
    assert choices_for(LOADED, plan) == ([*NAMES], [*measures_in("studies")])
    # What a plan has can be left out again.
    plan = plan.with_variable_toggled("payload_mass").with_measure_advanced("held_volume")
    variables, measures = choices_for(OPTIMAL, plan)
    assert "payload_mass" in variables
    assert "held_volume" in measures
    for plan, words in (
        (
            StudyPlan(variables=("payload_mass",)),
            "the design has no payload mass that could vary",
        ),
        (
            StudyPlan(measures=("volume", "home_largest_bending"), objectives=()),
            "the design has no payload or force at the tool, which is needed for largest bending",
        ),
    ):
        with pytest.raises(InputError, match=words):
            study_around(OPTIMAL, plan, "s")
        expected = msgspec.structs.replace(LOADED, home=LOADED.home_pose)
        assert study_around(LOADED, plan, "s").base == expected


PICK = '{"study":"s","plot":"lines","act":"pick","start":[0,0],"end":[0.5,1],"size":[9,9]}'


@pytest.mark.parametrize(
    ("line", "event"),
    [
        (
            PICK,
            PlotEvent(study="s", plot="lines", act="pick", start=(0, 0), end=(0.5, 1), size=(9, 9)),
        ),
        ("", None),
        ("null", None),
        ("\ud800", None),
        (PICK.replace("0.5", "1.5"), None),
        (PICK.replace("0.5", "NaN"), None),
        (PICK.replace("[9,9]", "[9,0]"), None),
        (PICK.replace("pick", "open"), None),
        (PICK.replace("{", '{"path":"/etc",'), None),
        ("[" * 2000, None),
    ],
)
def test_message_of_the_script_is_understood_or_ignored(line: str, event: object) -> None:
    assert decode_text(line, DECODER) == event


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of studies with one of 16 designs, the last four of which are missing."""
    home = tmp_path_factory.mktemp("studies")
    study = Study(
        name="Some",
        # So high that a short reach leaves nothing of the workspace.
        design=msgspec.structs.replace(
            OPTIMAL,
            limits=msgspec.structs.replace(OPTIMAL.limits, box=((0, -12, 10), (20, 22, 18))),
        ),
        variables={"a3x": (0.5, 20.0), "b2": (-4.0, 4.9)},
        sampling=Sampling(count=16),
        measures=("volume", "reach", "worst_margin"),
        objectives=(Objective("volume", "max"), Objective("reach", "min")),
        chunk=4,
    )
    folder = home / "some"
    folder.mkdir()
    for chunk in range(3):
        rows = evaluate(encode_study(study), chunk * 4, chunk * 4 + 4)
        write_part(folder, study, chunk, [rows])
    (home / "no study").mkdir()
    (home / "a file.txt").write_text("nothing")
    return home


@pytest.fixture
def jobs() -> Generator[StubJobs]:
    jobs = StubJobs(at_once=True)
    yield jobs
    jobs.stop()


@pytest.fixture
def feed(home: Path, jobs: StubJobs) -> StudyFeed:
    return StudyFeed(StudyFolders(home), jobs, lambda: None)


def draw_study(feed: StudyFeed, studies: Studies, jobs: Jobs | None = None) -> StudyDrawing:
    """Return the drawing of a study, by jobs that start no process if none are given."""
    feed.follow(Frame(with_value(open_state(OPTIMAL), "studies", studies)))
    assert jobs is None or jobs.wait_until_idle(PATIENCE)
    assert feed.problem is None
    assert feed.drawing is not None
    return feed.drawing


def designs_in(html: str) -> list[str]:
    """Return the paths of the designs of a plot, one for each, in any order."""
    drawn = re.findall('<path(?: class="front")? style="[^"]*" d="([^"]*)"', html)
    return sorted(f"M{each}" for path in drawn for each in path.split("M")[1:])


def assert_designs(plotted: PlotRows, plot: PlotName, rows: Any, html: str) -> None:
    """Compare the designs of a plot with rows, and their places with the values of the rows."""
    assert plotted.rows[plot].tolist() == np.asarray(rows).tolist()
    places = plotted.places(plot, plotted.rows[plot])
    assert designs_in(html) == sorted(path_of(each[None]) for each in places)
    along = places[:, 0].T if plot == "points" else places[:, :, 1].T
    for name, there in zip(plotted.axes_of(plot), along, strict=True):
        assert np.all((there > 0.0) & (there < 1.0))
        found = [plotted.value_at(name, place) for place in there.tolist()]
        assert found == pytest.approx(plotted.column(name)[rows].tolist(), rel=1e-9, abs=1e-9)


def test_folders_offer_only_studies_and_no_name_leads_elsewhere(home: Path) -> None:
    folders = StudyFolders(home, (home / "some", home / "no study"))
    assert folders.by_name() == {"some": home / "some", "some (2)": home / "some"}
    for name in ("no study", "..", "../some", str(home / "some"), "some/", "", "\0"):
        with pytest.raises(InputError, match="there is no study"):
            folders.folder(name)
    assert StudyFolders(home / "nowhere").by_name() == {}
    # A folder has a name of its own even where the path to it has none.
    (home / "some" / "within").mkdir()
    beside = StudyFolders(home / "nowhere", (home / "some" / "within" / "..",))
    assert [*beside.by_name()] == ["some"]
    check_given([home / "some"])
    for folder in (home / "no study", home / "nowhere"):
        with pytest.raises(InputError, match="holds no results of a study"):
            check_given([folder])


def test_new_folders_have_plain_names_of_their_own(tmp_path: Path) -> None:
    folders = StudyFolders(tmp_path / "studies")
    for name, slug in (("é «one»/..", "e-one"), ("", "study"), ("日本", "study")):
        folder = folders.new(name)
        assert folder.parent == folders.home
        assert folder.name.startswith(slug)
        keep_study(folder, study_around(OPTIMAL, QUICK, folder.name))
        assert study_in(folder).name == folder.name
    assert len(folders.by_name()) == 3


def test_plots_hold_what_was_computed(feed: StudyFeed, home: Path) -> None:
    results = load_results(home / "some")
    assert set(results.columns["status"]) == {"done", "empty workspace"}
    drawing = draw_study(feed, Studies(name="some"))
    assert (drawing.results.count, drawing.is_complete) == (12, False)
    done = results.columns["status"] == "done"
    volume, best = results.columns["volume"], results.front()
    assert sorted(drawing.front.tolist()) == np.flatnonzero(best).tolist()
    assert np.all(np.diff(volume[drawing.front]) <= 0.0)
    counts = [count for *_, count in drawing.reasons]
    assert counts == sorted(counts, reverse=True)
    assert sum(counts) == int((~done).sum()) > 0
    assert drawing.plotted is not None
    assert (drawing.plotted.across, drawing.plotted.up) == ("volume", "reach")
    for studies, rows in (
        (Studies(name="some"), np.flatnonzero(done)),
        (Studies(name="some", logarithmic=True), np.flatnonzero(done)),
        (Studies(name="some", front_only=True), np.flatnonzero(best)),
    ):
        drawing = draw_study(feed, studies)
        assert drawing.plotted is not None
        for plot, html in zip(PLOTS, drawing.plots, strict=True):
            assert_designs(drawing.plotted, plot, rows, html)
        for name, column in (("volume", volume), ("a3x", results.columns["a3x"])):
            is_log = studies.logarithmic and bool(column[rows].min() > 0.0)
            assert drawing.plotted.is_logarithmic(name) == is_log
            low, high = column[rows].min(), column[rows].max()
            ticks = ticks_of(drawing.plotted, name)
            assert 2 <= len(ticks) <= 12
            assert np.all((ticks >= low) & (ticks <= high) & (np.diff(ticks, prepend=-1.0) > 0.0))


PLOTS: tuple[PlotName, ...] = ("lines", "points")


def test_plots_show_brushes_and_the_picked_design(feed: StudyFeed, home: Path) -> None:
    results = load_results(home / "some")
    done = results.columns["status"] == "done"
    low, high = np.quantile(results.columns["volume"][done], [0.25, 0.75]).tolist()
    picked = int(results.columns["index"][done][0])
    brushes = (Brush("volume", ((low, high),)),)
    drawing = draw_study(feed, Studies(name="some", brushes=brushes, picked=picked))
    expected = [bool(low <= each <= high) for each in results.columns["volume"]]
    assert drawing.inside.tolist() == expected
    plotted = drawing.plotted
    assert plotted is not None
    for plot, html in zip(PLOTS, drawing.plots, strict=True):
        place = plotted.places(plot, plotted.picked)
        assert f'class="picked" style="stroke:{PICKED}" d="{path_of(place)}"' in html
        # Those left out are drawn apart from the others.
        (left_out,) = re.findall(f'style="stroke:{re.escape(LEFT_OUT)}" d="([^"]*)"', html)
        rows = np.flatnonzero(done & ~np.array(expected))
        assert left_out.count("M") == len(rows) > 0
        (box,) = re.findall(BOX, html)
        x, top, width, height = (float(each) / SIDE for each in box)
        if plot == "points":
            assert (top, height) == (0.0, 1.0)
            ends = x, x + width
        else:
            middle = plotted.middles()[plotted.axes.index("volume")]
            assert x < middle < x + width
            ends = 1.0 - top - height, 1.0 - top
        found = [plotted.value_at("volume", end) for end in ends]
        assert found == pytest.approx([low, high], rel=1e-3)


BOX = r'<rect class="brush" x="(\d+)" y="(\d+)" width="(\d+)" height="(\d+)">'


def test_place_on_a_plot_has_the_nearest_design_and_the_axes_there(
    feed: StudyFeed, home: Path
) -> None:
    """A place beside a design is on it; a box brushes what a person sees in it."""
    results, size = load_results(home / "some"), (700.0, 250.0)
    plotted = draw_study(feed, Studies(name="some", logarithmic=True)).plotted
    assert plotted is not None
    for plot in PLOTS:
        for row in plotted.rows[plot].tolist():
            places = plotted.places(plot, np.array([row]))[0]
            place = places[0] if plot == "points" else 0.7 * places[1] + 0.3 * places[2]
            found = row_at(plotted, plot, tuple(place + 0.2 / np.array(size)), size)
            # Another design may be as near.
            others = plotted.places(plot, plotted.rows[plot])
            assert found is not None
            words, path = reading_of(plotted, plot, found)
            assert words.startswith(f"Design {results.columns['index'][found]}: ")
            assert path == path_of(plotted.places(plot, np.array([found])))
            if plot == "points":
                away = np.linalg.norm((others[:, 0] - place) * size, axis=1)
                assert away[plotted.rows[plot] == found] < 1.0
    assert row_at(plotted, "points", (0.0, 0.0), size) is None
    assert reading_of(plotted, "points", None) == ("", "")
    brushes = brushes_in(plotted, "points", (0.8, 0.9), (0.3, 0.1))
    assert [each.axis for each in brushes] == ["volume", "reach"]
    inside = within(results.columns, tuple(brushes))
    for row in plotted.rows["points"].tolist():
        x, y = plotted.places("points", np.array([row]))[0, 0]
        assert inside[row] == (0.3 <= x <= 0.8 and 0.1 <= y <= 0.9)
    # Beside an axis a box is that of the nearest one; over several, of these.
    middles = plotted.middles()
    beside = middles[1] + 0.1 * (middles[2] - middles[1])
    (brush,) = brushes_in(plotted, "lines", (beside, 0.2), (beside, 0.7))
    assert brush.axis == plotted.axes[1]
    assert [plotted.place_of(brush.axis, np.array(each)) for each in brush.ranges[0]] == (
        pytest.approx([0.2, 0.7])
    )
    brushes = brushes_in(plotted, "lines", (middles[0], 0.2), (middles[2], 0.7))
    assert [each.axis for each in brushes] == [*plotted.axes[:3]]


def test_picked_design_is_live_and_one_step_to_undo(desk: Desk, feed: StudyFeed) -> None:
    desk.session.do(open_study("some"))
    drawing = draw_study(feed, Studies.of(desk.state))
    index = int(drawing.results.columns["index"][drawing.front[0]])
    design = drawing.results.design_at(index)
    before = desk.state
    desk.session.do(pick_design(design, index=index, study="some"))
    assert (desk.state.design, Studies.of(desk.state).picked) == (design, index)
    desk.session.do(UNDO)
    assert (desk.state.design, Studies.of(desk.state)) == (before.design, Studies.of(before))
    desk.session.do(open_study(None))
    desk.session.do(pick_design(design, index=index, study="some"))
    assert desk.state.design == before.design
    assert desk.complaints == ["the study 'some' is not open any more"]


def test_plots_are_not_drawn_again_for_a_live_design_and_a_lost_study_is_reported(
    feed: StudyFeed,
) -> None:
    studies = Studies(name="some")
    drawing = draw_study(feed, studies)
    state = with_value(open_state(OPTIMAL), "studies", studies)
    feed.follow(Frame(set_variable("b3", 5.0).apply(state)))
    feed.follow(Frame(Set("studies.plan", QUICK).apply(state)))
    assert feed.drawing is drawing
    feed.follow(Frame(with_value(open_state(OPTIMAL), "studies", Studies(name="gone"))))
    assert feed.problem == "there is no study 'gone'; there are some"
    assert feed.drawing is None
    feed.follow(Frame(open_state(OPTIMAL)))
    assert feed.problem is None


def results_of(columns: dict[str, list[Any]], **more: Any) -> Results:
    study = Study(
        design=OPTIMAL,
        variables={"b2": (-4.0, 4.0)},
        sampling=Sampling(count=len(columns["b2"])),
        measures=("volume", "reach"),
        **more,
    )
    count = len(columns["b2"])
    found: dict[str, Any] = {name: np.array(each) for name, each in columns.items()}
    found |= {"index": np.arange(count), "status": np.array(["done"] * count, dtype=object)}
    return Results(study, found | {"reason": np.array([""] * count, dtype=object)})


@pytest.mark.parametrize("volumes", [[1.0], [1.0, 1.0], [1.0, math.nan], [math.nan, math.nan]])
def test_designs_too_few_for_a_plot_are_not_drawn(volumes: list[float]) -> None:
    columns = {"b2": [0.5, 1.5][: len(volumes)], "volume": volumes, "reach": [2.0] * len(volumes)}
    results = results_of(columns)
    assert select_rows(results, UNITS, results.front(), Studies(name="s")) is None


def test_measure_that_some_designs_lack_hides_no_point_that_it_is_no_axis_of() -> None:
    columns = {"b2": [0.0, 1.0, 2.0, 3.0], "volume": [4.0, 2.0, 3.0, 1.0]}
    columns["reach"] = [4.0, math.nan, 3.0, math.nan]
    wanted = (Objective("volume", "max"),)
    results = results_of(columns, objectives=wanted)
    studies = Studies(name="s", across="volume", up="b2", colour="reach")
    seen = select_rows(results, UNITS, results.front(), studies)
    assert seen is not None
    assert seen.axes == ("b2", "volume", "reach")
    assert_designs(seen, "points", [0, 1, 2, 3], points_html(seen))
    # A line needs a place on each axis; a design without one is counted.
    assert_designs(seen, "lines", [0, 2], lines_html(seen))
    drawing = drawing_of(results, seen)
    assert drawing.is_complete
    assert "<b>2</b> without a line, which lack reach" in status(drawing)
    # As an axis it places no design that lacks it, picked or not.
    other = select_rows(results, UNITS, results.front(), replace(studies, up="reach", picked=1))
    assert other is not None
    assert_designs(other, "points", [0, 2], points_html(other))


def test_measure_that_all_designs_lack_or_share_is_no_axis_and_hides_nothing() -> None:
    nan = math.nan
    columns = {"b2": [0.0, 1.0, 2.0, 3.0], "volume": [4.0, 2.0, 3.0, 1.0]}
    # One that is the same in all designs is none either.
    for reach in (nan, 5.0):
        results = results_of(columns | {"reach": [reach] * 4})
        seen = select_rows(results, UNITS, results.front(), Studies(name="s"))
        assert seen is not None
        assert seen.axes == ("b2", "volume")
        assert_designs(seen, "points", [0, 1, 2, 3], points_html(seen))
        assert_designs(seen, "lines", [0, 1, 2, 3], lines_html(seen))
        assert "without a line" not in status(drawing_of(results, seen))
    # Where no design has all axes, points are drawn and no line.
    columns |= {"volume": [4.0, 2.0, nan, nan], "reach": [nan, nan, 3.0, 1.0]}
    results = results_of(columns)
    seen = select_rows(results, UNITS, results.front(), Studies(name="s", across="b2", up="reach"))
    assert seen is not None
    assert_designs(seen, "points", [2, 3], points_html(seen))
    assert seen.rows["lines"].tolist() == [] == designs_in(lines_html(seen))
    assert "<b>4</b> without a line, which lack volume or reach" in status(
        drawing_of(results, seen)
    )


@pytest.mark.parametrize(
    ("lengths", "volumes"), [(UNITS, Unit("units³", 1.0)), (Unit("mm", 25.0), Unit("cm³", 2.5**3))]
)
def test_study_is_written_in_the_unit_of_lengths(lengths: Unit, volumes: Unit) -> None:
    results = results_of({"b2": [1.0, 2.0, 3.0], "volume": [4.0, 2.0, 3.0], "reach": [5.0] * 3})
    seen = select_rows(
        results, lengths, results.front(), Studies(name="s", across="b2", up="volume")
    )
    assert seen is not None
    for name, unit in {"b2": lengths, "volume": volumes}.items():
        assert f"{name} [{unit.name}]" in points_html(seen)
        # Values beside an axis are round in its unit, at the places of what they say.
        for tick in ticks_of(seen, name) * unit.factor:
            assert float(f"{tick:.3g}") == pytest.approx(tick, rel=1e-12)
            assert f">{unit.number(tick / unit.factor)}<" in points_html(seen)
    row = int(np.argmax(results.columns["volume"]))
    words, _ = reading_of(seen, "lines", row)
    assert volumes.text(4.0) in words
    assert lengths.text(1.0) in words


def drawing_of(results: Results, seen: PlotRows) -> StudyDrawing:
    front = np.flatnonzero(seen.front)
    return StudyDrawing(seen.studies, results, UNITS, front, seen.inside, seen, ("", ""), ())


class Studio:
    """A desk, its studies and who runs them."""

    def __init__(self, desk: Desk, home: Path, jobs: Jobs) -> None:
        self.desk = desk
        self.folders = StudyFolders(home)
        self.jobs = jobs
        services: Any = SimpleNamespace(
            session=desk.session,
            jobs=jobs,
            complain=desk.complain,
            get={study_folders: self.folders}.get,
        )
        self.runner = StudyRunner(services)
        self.feed = self.runner.feed

    def wait_until_idle(self) -> None:
        """Wait until no study is computed."""
        assert self.jobs.wait_until_idle(PATIENCE, "study")
        assert self.runner.run is None


@pytest.fixture
def studio(desk: Desk, tmp_path: Path) -> Generator[Studio]:
    studio = Studio(desk, tmp_path / "studies", Jobs(lambda _: None))
    yield studio
    studio.jobs.stop()


def test_study_that_is_refused_or_lacks_a_library_leaves_no_entry(
    desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = StubJobs()
    studio = Studio(desk, tmp_path / "studies", jobs)
    runner = studio.runner
    # A folder of another study, found only where the rows are to be computed.
    other = studio.folders.home / "paper-optimal-1"
    monkeypatch.setattr(StudyFolders, "new", lambda *_: other)  # pyright: ignore
    other.mkdir(parents=True)
    (other / "notes.txt").write_text("mine")
    runner.start(OPTIMAL, QUICK)
    with pytest.raises(InputError) as refusal, claim(other, jobs.orders[0].request):
        pass
    jobs.orders[0].failed(str(refusal.value))
    assert "is not empty" in desk.complaints.pop()
    monkeypatch.setattr(extras, "is_missing", lambda *_: True)  # pyright: ignore
    runner.start(OPTIMAL, QUICK)
    assert desk.complaints.pop() == 'studies need the extra study: pip install ".[study]"'
    assert Studies.of(desk.state).name is None
    assert studio.folders.by_name() == {}
    assert (other / "notes.txt").read_text() == "mine"


def test_study_that_is_cancelled_is_told_of_nobody_and_stays_open_to_be_continued(
    desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = StubJobs()
    runner = Studio(desk, tmp_path / "studies", jobs).runner
    cancelled: list[float] = []
    monkeypatch.setattr(LongJob, "cancel", lambda _, patience: cancelled.append(patience))  # pyright: ignore
    runner.start(OPTIMAL, QUICK)
    run = runner.run
    assert run is not None
    # Only one at a time.
    runner.start(OPTIMAL, QUICK)
    assert "is being computed" in desk.complaints.pop()
    for _ in range(2):
        runner.cancel()
    assert cancelled == [work.PATIENCE]
    # Its process may have been ended by force.
    jobs.orders[0].failed(work.DIED)
    assert runner.run is None
    runner.go_on(run.name)
    first, second = jobs.orders
    assert (second.task, second.request) == (first.task, first.request)
    assert desk.complaints == []
    assert Studies.of(desk.state).name == run.name


def test_study_whose_process_dies_is_reported_and_keeps_the_rows_it_has(studio: Studio) -> None:
    runner, desk = studio.runner, studio.desk

    def is_under_way() -> bool:
        run = runner.run
        return run is None or (run.progress is not None and run.progress.done > 0)

    runner.start(OPTIMAL, replace(QUICK, count=160))
    run = runner.run
    assert run is not None
    # Once there is something to keep.
    wait_for(is_under_way, PATIENCE)
    number = studio.jobs.process_ids("study")[0]
    os.kill(number, getattr(signal, "SIGKILL", signal.SIGTERM))
    studio.wait_until_idle()
    assert any("Continue the study" in each for each in desk.complaints)
    results = load_results(studio.folders.folder(run.name))
    assert 0 < results.count < 160
    assert results.study == run.study
    # The rows are those of the study, wherever it is computed.
    expected = evaluate(encode_study(run.study), 0, 4).columns
    rows = np.argsort(results.columns["index"])[:4]
    for name in ("index", "a3x", "b2", "volume", "reach"):
        assert results.columns[name][rows].tolist() == list(expected[name])
    for design in map(results.design_of_row, range(results.count)):
        for name, value, live in zip(VARIABLES, design.variables, OPTIMAL.variables, strict=True):
            low, high = results.study.variables.get(name, (live, live))
            assert low <= value <= high
    assert not draw_study(studio.feed, Studies.of(desk.state), studio.jobs).is_complete


def test_study_that_cannot_be_is_refused_and_leaves_nothing(studio: Studio) -> None:
    studio.runner.start(OPTIMAL, StudyPlan(variables=()))
    assert studio.desk.complaints == ["choose at least one variable that varies"]
    studio.runner.go_on("nowhere")
    assert studio.desk.complaints[1:] == ["there is no study 'nowhere'; there are none yet"]
    assert studio.runner.run is None
    assert studio.folders.by_name() == {}


def test_new_study_closes_the_open_one_and_shows_the_settings(
    services: Services, desk: Desk, buttons: Buttons, home: Path
) -> None:
    services.shared[study_folders] = StudyFolders(home)
    panel = StudiesPanel(services)
    desk.session.do(open_study("some"))
    # Without a request the settings of a new study are not shown while one is open.
    updates = [*panel.updates(Frame(desk.state))]
    assert [v for h, n, v in updates if h is panel.form and n == "visible"] == [False]
    desk.press(buttons, "studies.new")
    updates = [*panel.updates(Frame(desk.state))]
    assert [v for h, n, v in updates if h is panel.form and n == "visible"] == [True]
