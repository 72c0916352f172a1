"""Studies on the page: brushes against brute force, picks, fronts, and small studies."""

from __future__ import annotations

import base64
import itertools
import json
import math
import os
import re
import signal
import time
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from desk import Desk
from hypothesis import given, strategies as st

from explorer.app.features.feature import Services
from explorer.app.features.studies.actions import (
    MOST_RANGES,
    BrushAxis,
    BrushBox,
    ClearBrushes,
    OpenStudy,
    PickDesign,
)
from explorer.app.features.studies.feed import Request, StudyDrawing, StudyFeed, reasons
from explorer.app.features.studies.figures import PAPER, pack, parallel, scatter
from explorer.app.features.studies.panel import StudiesPanel
from explorer.app.features.studies.plot_events import Boxed, Brushed, Picked, event_of
from explorer.app.features.studies.plot_rows import PlotRows, default_axes, select_rows, thin_out
from explorer.app.features.studies.runner import Run, StudyRunner
from explorer.app.features.studies.words import acts, head, legend, status
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Set, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.state.studies import (
    Brush,
    Studies,
    StudyPlan,
    choices_for,
    range_around,
    study_around,
    within,
)
from explorer.app.storage.study_folders import StudyFolders, check_given, keep_study, study_in
from explorer.app.widgets.buttons import Buttons
from explorer.errors import InputError
from explorer.measures.catalogue import measures_in
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.mechanism.machine import Actuators, Guide, Payload, Struts, Tool
from explorer.sweep.machine import MACHINE
from explorer.sweep.parts import part_paths, write_part
from explorer.sweep.results import Results, load_results
from explorer.sweep.rows import evaluate
from explorer.sweep.run import Progress
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
def test_a_row_is_within_the_brushes_if_each_of_them_has_it_in_some_range(
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
def test_an_axis_has_the_ranges_that_it_was_given_last(
    strokes: list[tuple[str, tuple[tuple[float, float], ...]]],
) -> None:
    state = OpenStudy("some").apply(opened(OPTIMAL))
    for axis, each in strokes:
        state = BrushAxis(axis, each).apply(state)
    last = dict(strokes)
    assert {brush.axis: brush.ranges for brush in state.studies.brushes} == {
        axis: each for axis, each in last.items() if each
    }
    assert all(state.studies.ranges_of(axis) == each for axis, each in last.items())
    assert ClearBrushes().apply(state).studies.brushes == ()


def test_a_box_brushes_both_its_axes_and_frees_them_again() -> None:
    state = BrushAxis("b2", ((0.0, 1.0),)).apply(opened(OPTIMAL))
    boxed = BrushBox("volume", "reach", ((1.0, 2.0), (3.0, 4.0))).apply(state).studies
    assert boxed.ranges_of("volume") == ((1.0, 2.0),)
    assert boxed.ranges_of("reach") == ((3.0, 4.0),)
    assert boxed.ranges_of("b2") == ((0.0, 1.0),)
    freed = BrushBox("volume", "reach", None)
    assert [each.axis for each in freed.apply(state).studies.brushes] == ["b2"]


@pytest.mark.parametrize(
    "given_ranges",
    [((2.0, 1.0),), ((math.nan, 1.0),), ((0.0, math.inf),), ((0.0, 1.0),) * (MOST_RANGES + 1)],
)
def test_ranges_that_are_none_are_refused(given_ranges: tuple[tuple[float, float], ...]) -> None:
    with pytest.raises(InputError):
        BrushAxis("volume", given_ranges).apply(opened(OPTIMAL))


def test_another_study_begins_without_brushes_and_the_same_keeps_them() -> None:
    state = OpenStudy("one").apply(opened(OPTIMAL))
    state = BrushAxis("volume", ((1.0, 2.0),)).apply(state)
    state = Set("studies.plan", QUICK).apply(state)
    assert OpenStudy("one").apply(state) is state
    other = OpenStudy("two").apply(state)
    assert other.studies == Studies(name="two", plan=QUICK)


@given(st.lists(st.booleans(), min_size=1, max_size=80).map(np.array), st.integers(2, 30))
def test_of_too_many_rows_those_to_keep_stay_first(keep: Any, most: int) -> None:
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
def test_a_range_lies_around_the_live_design(
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
    elif name in MACHINE_VALUES and not name.startswith("tool"):
        value = MACHINE_VALUES[name]
        assert 0.0 < low < high
        assert (low + high) / 2.0 == pytest.approx(value)
        assert high - low == pytest.approx(2.0 * value * percent / 100.0)
    elif name == "yaw":
        assert high - low == pytest.approx(2.0 * percent / 100.0 * 90.0)
    elif value is not None:
        assert (low + high) / 2.0 == pytest.approx(value, abs=1e-9)
        span = max(abs(value), 0.05 * design.reach) * percent / 100.0
        assert high - low == pytest.approx(2.0 * span)
        # What is well off zero does not come to it.
        assert abs(value) < 0.05 * design.reach or low * high > 0.0
    else:
        assert 0.0 < low < high


@given(
    st.lists(
        st.one_of(
            st.sampled_from(NAMES).map(lambda name: ("variable", name)),
            st.sampled_from([*measures_in("studies")]).map(lambda name: ("measure", name)),
        ),
        max_size=30,
    )
)
def test_a_wish_makes_a_study_or_says_what_is_missing(turns: list[tuple[str, str]]) -> None:
    plan = StudyPlan()
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


def test_a_design_is_offered_what_its_machine_has() -> None:
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


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        (
            StudyPlan(variables=("payload_mass",)),
            "the design has no payload mass that could vary",
        ),
        (
            StudyPlan(measures=("volume", "home_largest_bending"), objectives=()),
            "the design has no payload or force at the tool, which is needed for largest bending",
        ),
    ],
)
def test_a_plan_of_a_machine_that_is_not_there_is_refused(plan: StudyPlan, words: str) -> None:
    with pytest.raises(InputError, match=words):
        study_around(OPTIMAL, plan, "s")
    assert study_around(LOADED, plan, "s").base == msgspec.structs.replace(
        LOADED, home=home_pose(LOADED)
    )


def test_a_measure_is_measured_then_large_then_small_then_left_out() -> None:
    plan, name = StudyPlan(), "extent_x"
    senses: list[object] = []
    for _ in range(4):
        plan = plan.with_measure_advanced(name)
        senses.append((name in plan.measures, plan.sense_of(name)))
    assert senses == [(True, None), (True, "max"), (True, "min"), (False, None)]
    assert plan == StudyPlan()


@pytest.mark.parametrize(
    ("line", "event"),
    [
        (
            '{"do":"pick","study":"s","index":7}',
            Picked(study="s", index=7),
        ),
        (
            '{"do":"brush","study":"s","axis":"b2","ranges":[[0,1.5]]}',
            Brushed(study="s", axis="b2", ranges=((0.0, 1.5),)),
        ),
        (
            '{"do":"box","study":"s","axes":["b2","volume"],"box":null}',
            Boxed(study="s", axes=("b2", "volume"), box=None),
        ),
    ],
)
def test_what_the_script_says_is_understood(line: str, event: object) -> None:
    assert event_of(line) == event


@pytest.mark.parametrize(
    "line",
    [
        "",
        "{}",
        "null",
        "\ud800",
        '{"do":"pick","study":"s","index":-1}',
        '{"do":"pick","study":"s","index":1.5}',
        '{"do":"pick","study":"s","index":"1"}',
        '{"do":"pick","study":"s","index":1,"path":"/etc"}',
        '{"do":"open","study":"s"}',
        '{"do":"brush","study":"s","axis":"b2","ranges":[[0,NaN]]}',
        '{"do":"brush","study":"s","axis":"b2","ranges":[[0]]}',
        '{"do":"box","study":"s","axes":["b2"],"box":null}',
        '{"do":"pick","study":"%s","index":1}' % ("s" * 300),
        "[" * 2000,
    ],
)
def test_what_it_does_not_say_is_dropped(line: str) -> None:
    assert event_of(line) is None


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
def feed(home: Path) -> Generator[StudyFeed]:
    made = StudyFeed(StudyFolders(home), lambda: None)
    yield made
    made.stop()


def drawn(feed: StudyFeed, studies: Studies) -> StudyDrawing:
    feed.follow(Frame(_with(opened(OPTIMAL), studies)))
    assert feed.wait_until_idle(PATIENCE)
    assert feed.problem is None
    assert feed.drawing is not None
    return feed.drawing


def _with(state: State, studies: Studies) -> State:
    return replace(state, studies=studies)


def unpacked(array: dict[str, str]) -> list[Any]:
    kind = {"f4": "<f4", "i4": "<i4"}[array["dtype"]]
    return np.frombuffer(base64.b64decode(array["bdata"]), dtype=kind).tolist()


def test_only_folders_of_studies_are_offered_and_no_name_leads_elsewhere(home: Path) -> None:
    folders = StudyFolders(home, (home / "some", home / "no study"))
    assert folders.by_name() == {"some": home / "some", "some (2)": home / "some"}
    for name in ("no study", "..", "../some", str(home / "some"), "some/", "", "\0"):
        with pytest.raises(InputError, match="there is no study"):
            folders.folder(name)
    assert StudyFolders(home / "nowhere").by_name() == {}


def test_new_folders_have_plain_names_of_their_own(tmp_path: Path) -> None:
    folders = StudyFolders(tmp_path / "studies")
    for name, slug in (("é «one»/..", "e-one"), ("", "study"), ("日本", "study")):
        folder = folders.new(name)
        assert folder.parent == folders.home
        assert folder.name.startswith(slug)
        keep_study(folder, study_around(OPTIMAL, QUICK, folder.name))
        assert study_in(folder).name == folder.name
    assert len(folders.by_name()) == 3


def test_what_is_drawn_is_what_was_computed(feed: StudyFeed, home: Path) -> None:
    results = load_results(home / "some")
    assert set(results.columns["status"]) == {"done", "empty workspace"}
    drawing = drawn(feed, Studies(name="some"))
    assert (drawing.results.count, drawing.is_complete) == (12, False)
    done = results.columns["status"] == "done"
    # By hand: better in one respect and worse in none.
    volume, reach = results.columns["volume"], results.columns["reach"]
    best = [
        bool(done[i])
        and not any(
            done[j]
            and volume[j] >= volume[i]
            and reach[j] <= reach[i]
            and (volume[j] > volume[i] or reach[j] < reach[i])
            for j in range(12)
        )
        for i in range(12)
    ]
    assert sorted(drawing.front.tolist()) == np.flatnonzero(best).tolist()
    assert np.all(np.diff(volume[drawing.front]) <= 0.0)
    assert drawing.reasons
    assert sum(count for *_, count in drawing.reasons) == int((~done).sum())
    assert drawing.plots is not None
    lines, points = (json.loads(plot.to_json()) for plot in drawing.plots)
    for dimension in lines["data"][0]["dimensions"]:
        column = results.columns[dimension["name"]][done]
        assert unpacked(dimension["values"]) == column.astype(np.float32).tolist()
    marked = [trace for trace in points["data"] if trace["mode"] == "markers"]
    seen = [index for trace in marked for index in unpacked(trace["customdata"])]
    assert sorted(seen) == results.columns["index"][done].tolist()
    for trace in marked:
        rows = unpacked(trace["customdata"])
        assert unpacked(trace["x"]) == volume[rows].astype(np.float32).tolist()
        assert unpacked(trace["y"]) == reach[rows].astype(np.float32).tolist()


@pytest.mark.parametrize("dark", [False, True])
def test_greater_stands_out_more_on_either_page(feed: StudyFeed, dark: bool) -> None:
    drawing = drawn(feed, Studies(name="some"))
    assert drawing.plotted is not None
    points: Any = scatter(drawing.plotted, 1, dark=dark)
    scale = [colour for _, colour in points["data"][1]["marker"]["colorscale"]]
    paper = _light(PAPER[dark])
    apart = [abs(_light(colour) - paper) for colour in scale]
    assert apart == sorted(apart)
    assert min(apart) > 0.1
    # The legend shows the same, by the theme of each browser.
    assert all(colour in legend(drawing) for colour in scale)


def _light(colour: str) -> float:
    red, green, blue = (int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def test_brushes_and_picks_are_drawn_by_the_server(feed: StudyFeed, home: Path) -> None:
    results = load_results(home / "some")
    done = results.columns["status"] == "done"
    low, high = np.quantile(results.columns["volume"][done], [0.25, 0.75]).tolist()
    picked = int(results.columns["index"][done][0])
    brushes = (Brush("volume", ((low, high),)),)
    drawing = drawn(feed, Studies(name="some", brushes=brushes, picked=picked))
    expected = [bool(low <= each <= high) for each in results.columns["volume"]]
    assert drawing.inside.tolist() == expected
    assert drawing.plots is not None
    lines, points = (json.loads(plot.to_json()) for plot in drawing.plots)
    constrained = {
        each["name"]: each.get("constraintrange") for each in lines["data"][0]["dimensions"]
    }
    assert constrained.pop("volume") == [[low, high]]
    assert not any(constrained.values())
    (box,) = points["layout"]["shapes"]
    assert (box["x0"], box["x1"], box["yref"]) == (low, high, "y domain")
    assert unpacked(points["data"][-1]["customdata"]) == [picked]
    # Of the points, those left out are drawn apart from the others.
    left_out = [*points["data"][0]["customdata"], *points["data"][2]["customdata"]]
    assert left_out
    rows = unpacked(points["data"][0]["customdata"]) + unpacked(points["data"][2]["customdata"])
    assert sorted(rows) == np.flatnonzero(done & ~np.array(expected)).tolist()


def test_along_the_front_every_design_is_passed_once(feed: StudyFeed) -> None:
    drawing = drawn(feed, Studies(name="some"))
    indices = drawing.results.columns["index"][drawing.front].tolist()
    walked = [drawing.beside(None, 1)]
    while (after := drawing.beside(walked[-1], 1)) is not None:
        walked.append(after)
    assert walked == indices
    back = [walked[-1]]
    while (before := drawing.beside(back[-1], -1)) is not None:
        back.append(before)
    assert back == indices[::-1]


def test_a_picked_design_is_live_and_one_step_to_undo(desk: Desk, feed: StudyFeed) -> None:
    desk.session.do(OpenStudy("some"))
    drawing = drawn(feed, desk.state.studies)
    index = int(drawing.results.columns["index"][drawing.front[0]])
    design = drawing.results.design_of_row(drawing.row_of(index))
    before = desk.state
    desk.session.do(PickDesign(design, index=index, study="some"))
    assert (desk.state.design, desk.state.studies.picked) == (design, index)
    desk.session.travel(UNDO)
    assert (desk.state.design, desk.state.studies) == (before.design, before.studies)
    desk.session.do(OpenStudy(None))
    desk.session.do(PickDesign(design, index=index, study="some"))
    assert desk.state.design == before.design
    assert desk.complaints == ["the study 'some' is not open any more"]


def test_nothing_is_drawn_anew_while_a_hand_is_on_a_slider(feed: StudyFeed) -> None:
    studies = Studies(name="some")
    drawing = drawn(feed, studies)
    state = _with(opened(OPTIMAL), studies)
    for step in range(5):
        state = SetVariable("b3", 5.0 + 0.1 * step).apply(state)
        feed.follow(Frame(state))
    # A change of the plan changes no plot either.
    feed.follow(Frame(Set("studies.plan", QUICK).apply(state)))
    assert feed.wait_until_idle(PATIENCE)
    assert feed.drawing is drawing


def test_a_study_that_is_gone_is_told(feed: StudyFeed) -> None:
    feed.follow(Frame(_with(opened(OPTIMAL), Studies(name="gone"))))
    assert feed.wait_until_idle(PATIENCE)
    assert feed.problem == "there is no study 'gone'; there are some"
    assert feed.drawing is None
    feed.follow(Frame(opened(OPTIMAL)))
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


def test_what_is_the_same_in_all_designs_has_no_axis() -> None:
    columns = {"b2": [0.0, 1.0, 2.0], "volume": [1.0, 2.0, 3.0], "reach": [5.0, 5.0, 5.0]}
    results = results_of(columns, objectives=(Objective("reach", "min"),))
    seen = select_rows(results, results.front(), Studies(name="s"))
    assert seen is not None
    assert seen.axes == ("b2", "volume")
    assert (seen.across, seen.up) == ("volume", "b2")
    assert default_axes(results.study, seen.axes) == ("volume", "b2")


@pytest.mark.parametrize("volumes", [[1.0], [1.0, 1.0], [1.0, math.nan], [math.nan, math.nan]])
def test_too_few_designs_are_not_drawn(volumes: list[float]) -> None:
    columns = {"b2": [0.5, 1.5][: len(volumes)], "volume": volumes, "reach": [2.0] * len(volumes)}
    results = results_of(columns)
    assert select_rows(results, results.front(), Studies(name="s")) is None


def test_a_measure_that_some_designs_lack_hides_no_point_that_it_is_no_axis_of() -> None:
    columns = {"b2": [0.0, 1.0, 2.0, 3.0], "volume": [4.0, 2.0, 3.0, 1.0]}
    columns["reach"] = [4.0, math.nan, 3.0, math.nan]
    wanted = (Objective("volume", "max"),)
    results = results_of(columns, objectives=wanted)
    studies = Studies(name="s", across="volume", up="b2", colour="reach")
    seen = select_rows(results, results.front(), studies)
    assert seen is not None
    assert seen.axes == ("b2", "volume", "reach")
    assert points_of(scatter(seen, 1, dark=False)) == [0, 1, 2, 3]
    lines = parallel(seen, 1, dark=False)
    # A line needs a place on each axis; what has none is told of.
    assert lines["layout"]["meta"]["designs"] == [0, 2]
    for dimension in lines["data"][0]["dimensions"]:
        assert unpacked(dimension["values"]) == [columns[dimension["name"]][k] for k in (0, 2)]
    assert "<b>2</b> without a line, which lack reach" in status_of(results, seen)
    # As an axis it places no design that lacks it, picked or not.
    other = select_rows(results, results.front(), replace(studies, up="reach", picked=1))
    assert other is not None
    assert points_of(scatter(other, 1, dark=False)) == [0, 2]


def test_a_measure_that_all_designs_lack_is_no_axis_and_hides_nothing() -> None:
    columns = {"b2": [0.0, 1.0, 2.0], "volume": [4.0, 2.0, 3.0], "reach": [math.nan] * 3}
    results = results_of(columns)
    seen = select_rows(results, results.front(), Studies(name="s"))
    assert seen is not None
    assert seen.axes == ("b2", "volume")
    assert points_of(scatter(seen, 1, dark=False)) == [0, 1, 2]
    assert parallel(seen, 1, dark=False)["layout"]["meta"]["designs"] == [0, 1, 2]
    assert "without a line" not in status_of(results, seen)


def test_where_no_design_has_all_axes_points_are_drawn_and_no_line() -> None:
    nan = math.nan
    columns = {"b2": [0.0, 1.0, 2.0, 3.0], "volume": [4.0, 2.0, nan, nan]}
    columns["reach"] = [nan, nan, 3.0, 1.0]
    results = results_of(columns)
    seen = select_rows(results, results.front(), Studies(name="s"))
    assert seen is not None
    assert points_of(scatter(seen, 1, dark=False)) == []
    assert parallel(seen, 1, dark=True)["layout"]["meta"]["designs"] == []
    other = select_rows(results, results.front(), Studies(name="s", across="b2", up="reach"))
    assert other is not None
    assert points_of(scatter(other, 1, dark=False)) == [2, 3]
    assert "<b>4</b> without a line, which lack volume or reach" in status_of(results, other)


def points_of(figure: dict[str, Any]) -> list[int]:
    """Return the designs that are points of a scatter plot, those picked once."""
    traces = [each for each in figure["data"] if each["mode"] == "markers"]
    return sorted({index for each in traces for index in unpacked(each["customdata"])})


def status_of(results: Results, seen: PlotRows) -> str:
    request = Request(seen.studies, 1, dark=False)
    return status(
        StudyDrawing(request, results, np.flatnonzero(seen.front), seen.inside, seen, None, ())
    )


def test_the_front_of_the_two_objectives_shown_is_a_line() -> None:
    columns = {"b2": [0.0, 1.0, 2.0, 3.0], "volume": [4.0, 2.0, 3.0, 1.0]}
    columns["reach"] = [4.0, 2.0, 3.0, 5.0]
    wanted = (Objective("volume", "max"), Objective("reach", "min"))
    results = results_of(columns, objectives=wanted)
    seen = select_rows(results, results.front(), Studies(name="s"))
    assert seen is not None
    (line,) = [t for t in scatter(seen, 1, dark=False)["data"] if t["mode"] == "lines"]
    assert unpacked(line["x"]) == [2.0, 3.0, 4.0]
    other = select_rows(results, results.front(), Studies(name="s", across="b2"))
    assert other is not None
    assert all(t["mode"] == "markers" for t in scatter(other, 1, dark=True)["data"])
    assert parallel(other, 2, dark=True)["data"][0]["uirevision"] == 2


def test_numbers_come_through_packed() -> None:
    numbers = np.array([0.0, -1.5, 3.25e7])
    assert unpacked(pack(numbers)) == numbers.tolist()
    assert unpacked(pack(np.array([1, 2**31 - 1]), "i4")) == [1, 2**31 - 1]


def test_reasons_are_counted_the_most_frequent_first() -> None:
    columns = {"b2": [0.0] * 4, "volume": [1.0] * 4, "reach": [1.0] * 4}
    results = results_of(columns)
    results.columns["status"][:3] = ["failed", "empty workspace", "failed"]
    results.columns["reason"][:3] = ["why", "emptied by l1", "why"]
    assert reasons(results) == (("failed", "why", 2), ("empty workspace", "emptied by l1", 1))


class Studio:
    """A desk, its studies and who runs them."""

    def __init__(self, desk: Desk, home: Path) -> None:
        self.desk = desk
        self.folders = StudyFolders(home)
        self.feed = StudyFeed(self.folders, lambda: None)
        self.runner = StudyRunner(
            desk.session, self.feed, lambda message, _: desk.complaints.append(message)
        )


@pytest.fixture
def studio(desk: Desk, tmp_path: Path) -> Generator[Studio]:
    made = Studio(desk, tmp_path / "studies")
    yield made
    made.runner.stop()
    made.feed.stop()


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in part_paths(folder)}


def test_a_small_study_is_cancelled_and_gone_on_with(studio: Studio) -> None:
    runner, desk = studio.runner, studio.desk
    runner.start(OPTIMAL, QUICK)
    run = runner.run
    assert run is not None
    # Only one at a time.
    runner.start(OPTIMAL, QUICK)
    assert "is being computed" in desk.complaints.pop()
    runner.cancel()
    assert runner.wait_until_idle(PATIENCE)
    assert desk.complaints == []
    assert desk.state.studies.name == run.name
    folder = studio.folders.folder(run.name)
    kept = bytes_of(folder)
    assert len(kept) < run.study.chunks
    runner.go_on(run.name)
    assert runner.wait_until_idle(PATIENCE)
    assert desk.complaints == []
    after = bytes_of(folder)
    assert kept.items() <= after.items()
    results = load_results(folder)
    assert results.columns["index"].tolist() == [*range(16)]
    assert results.study == run.study
    # The rows are those of the study, wherever it is computed.
    expected = evaluate(encode_study(run.study), 0, 16).columns
    for name in ("a3x", "b2", "volume", "reach"):
        assert results.columns[name].tolist() == expected[name]
    assert_varied_around(results, OPTIMAL)
    drawing = drawn(studio.feed, desk.state.studies)
    assert drawing.is_complete


def assert_varied_around(results: Results, design: Design) -> None:
    base = dict(zip(VARIABLES, design.variables, strict=True))
    for row, name in itertools.product(range(results.count), VARIABLES):
        found = dict(zip(VARIABLES, results.design_of_row(row).variables, strict=True))[name]
        if name in QUICK.variables:
            low, high = results.study.variables[name]
            assert low <= found <= high
        else:
            assert found == base[name]


def test_a_study_that_cannot_be_is_refused_and_leaves_nothing(studio: Studio) -> None:
    studio.runner.start(OPTIMAL, StudyPlan(variables=()))
    assert studio.desk.complaints == ["choose at least one variable that varies"]
    studio.runner.go_on("nowhere")
    assert studio.desk.complaints[1:] == ["there is no study 'nowhere'; there are none yet"]
    assert studio.runner.run is None
    assert studio.folders.by_name() == {}


def test_a_process_that_dies_is_told_and_what_is_finished_is_kept(studio: Studio) -> None:
    studio.runner.start(OPTIMAL, StudyPlan(count=2000))
    # Once there is something to keep.
    while (run := studio.runner.run) is not None and not (run.progress and run.progress.done):
        time.sleep(0.02)
    number = studio.runner.worker.process_id
    assert number is not None
    os.kill(number, getattr(signal, "SIGKILL", signal.SIGTERM))
    assert studio.runner.wait_until_idle(PATIENCE)
    assert any("Continue starts it again" in each for each in studio.desk.complaints)
    assert studio.runner.run is None
    name = studio.desk.state.studies.name
    assert name is not None
    assert load_results(studio.folders.folder(name)).count > 0


@pytest.fixture
def panel(services: Services, home: Path) -> Generator[StudiesPanel]:
    theme: Any = SimpleNamespace(is_dark=False)
    used = replace(services, studies=StudyFolders(home), theme=theme)
    yield StudiesPanel(used)
    used.stop()


def markup_of(panel: StudiesPanel, desk: Desk) -> tuple[bool, str]:
    """Return whether the settings of a new study are shown, and all markup of the panel."""
    assert panel.feed.wait_until_idle(PATIENCE)
    updates = [*panel.updates(Frame(desk.state))]
    assert panel.feed.wait_until_idle(PATIENCE)
    updates += panel.updates(Frame(desk.state))
    shown: list[Any] = [v for h, n, v in updates if h is panel.form and n == "visible"]
    words = "".join(str(value) for _, name, value in updates if name == "content")
    return shown[-1], words


def test_settings_are_shown_while_no_study_is_open_and_when_they_are_asked_for(
    panel: StudiesPanel, desk: Desk, buttons: Buttons
) -> None:
    is_form, words = markup_of(panel, desk)
    assert is_form
    assert "Start study" in words
    assert "256</b> designs around <b>paper-optimal" in words
    desk.session.do(OpenStudy("some"))
    is_form, words = markup_of(panel, desk)
    assert not is_form
    assert "12</b> of 16 designs" in words
    assert "objectives: volume ↑, reach ↓ · varied: a3x, b2 · 1 unit (u) = 10 mm" in words
    assert {"studies.continue", "studies.new"} <= pressed(words)
    desk.press(buttons, "studies.new", "on")
    is_form, words = markup_of(panel, desk)
    assert is_form
    assert {"studies.start", "studies.new"} <= pressed(words)
    assert "studies.continue" not in pressed(words)
    desk.press(buttons, "studies.new", "off")
    assert not markup_of(panel, desk)[0]
    desk.session.do(OpenStudy(None))
    assert markup_of(panel, desk)[0]


def test_next_and_previous_go_along_the_front(
    panel: StudiesPanel, desk: Desk, buttons: Buttons
) -> None:
    desk.session.do(OpenStudy("some"))
    markup_of(panel, desk)
    drawing = panel.feed.drawing
    assert drawing is not None
    front = drawing.results.columns["index"][drawing.front].tolist()
    walked: list[int | None] = []
    for step in [1] * len(front) + [-1]:
        desk.press(buttons, "studies.along", step)
        walked.append(desk.state.studies.picked)
    # At the end it stays.
    assert walked == [*front, front[-2]]


def pressed(words: str) -> set[str]:
    """Return the names of the buttons in some markup."""
    return set(re.findall('data-press="([^"]*)"', words))


@pytest.mark.parametrize("done", [0, 96, 256])
def test_progress_of_a_study_is_told_with_a_bar_and_no_count_of_its_rows(
    feed: StudyFeed, done: int
) -> None:
    drawing = drawn(feed, Studies(name="some"))
    run = Run("some", drawing.study, Progress(256, done, 0, {}, 10.0))
    words = head(drawing, run, None, "x")
    assert f"some: <b>{done}</b> of 256 designs" in words
    assert f"--share:{100.0 * done / 256:.2f}%" in words
    assert run.share == done / 256
    assert "12</b> of 16" not in words
    # Another study that is open meanwhile has its own.
    assert "12</b> of 16" in head(drawing, replace(run, name="other"), None, "x")
    assert pressed(acts(is_new=False, is_open=True, is_complete=False, run=run)) == {
        "studies.cancel",
    }


def test_a_folder_that_is_named_and_holds_no_study_is_refused(home: Path) -> None:
    check_given([home / "some"])
    for folder in (home / "no study", home / "nowhere"):
        with pytest.raises(InputError, match="holds no results of a study"):
            check_given([folder])
