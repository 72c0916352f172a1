"""Studies on the page: brushes against brute force, picks, fronts, and small studies."""

from __future__ import annotations

import base64
import json
import math
import os
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

from explorer.app.browser.browser_facts import decode_text
from explorer.app.features.feature import Services
from explorer.app.features.studies.actions import BrushAxes, OpenStudy, PickDesign, free_axes
from explorer.app.features.studies.feature import DECODER, PlotEvent, StudiesPanel
from explorer.app.features.studies.feed import StudyDrawing, StudyFeed
from explorer.app.features.studies.figures import PlotRows, parallel, scatter, select_rows, thin_out
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
    choices_for,
    range_around,
    study_around,
    within,
)
from explorer.app.features.studies.words import status
from explorer.app.features.studies.work import StudyRunner
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Set, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.state.state import open_state
from explorer.app.widgets.buttons import Buttons
from explorer.errors import InputError
from explorer.files import extras
from explorer.measures.catalogue import measures_in
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Actuators, Guide, Payload, Struts, Tool
from explorer.sweep.machine import MACHINE
from explorer.sweep.parts import part_paths, write_part
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
    state = OpenStudy("some").apply(open_state(OPTIMAL))
    for axis, each in strokes:
        state = BrushAxes((Brush(axis, each),)).apply(state)
    last = dict(strokes)
    assert {brush.axis: brush.ranges for brush in Studies.of(state).brushes} == {
        axis: each for axis, each in last.items() if each
    }
    assert all(Studies.of(state).ranges_of(axis) == each for axis, each in last.items())
    assert Studies.of(free_axes(state).apply(state)).brushes == ()
    # A box in the scatter plot brushes two axes at once.
    every = BrushAxes(tuple(Brush(axis, each) for axis, each in strokes))
    assert Studies.of(every.apply(open_state(OPTIMAL))).brushes == Studies.of(state).brushes


@pytest.mark.parametrize(
    "wrong", [((2.0, 1.0),), ((math.nan, 1.0),), ((0.0, math.inf),), ((0.0, 1.0),) * 100]
)
def test_ranges_without_a_finite_interval_are_refused(
    wrong: tuple[tuple[float, float], ...],
) -> None:
    with pytest.raises(InputError):
        BrushAxes((Brush("volume", wrong),)).apply(open_state(OPTIMAL))


def test_study_that_is_opened_has_no_brushes_unless_it_was_open() -> None:
    state = OpenStudy("one").apply(open_state(OPTIMAL))
    state = BrushAxes((Brush("volume", ((1.0, 2.0),)),)).apply(state)
    state = Set("studies.plan", QUICK).apply(state)
    assert OpenStudy("one").apply(state) is state
    other = OpenStudy("two").apply(state)
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


@pytest.mark.parametrize(
    ("line", "event"),
    [
        ('{"study":"s","index":7}', PlotEvent(study="s", index=7)),
        (
            '{"study":"s","brushes":[{"axis":"b2","ranges":[[0,1.5]]},{"axis":"a3x","ranges":[]}]}',
            PlotEvent(study="s", brushes=(Brush("b2", ((0.0, 1.5),)), Brush("a3x", ()))),
        ),
        ("", None),
        ("null", None),
        ("\ud800", None),
        ('{"study":"s","index":-1}', None),
        ('{"study":"s","index":1.5}', None),
        ('{"study":"s","index":1,"path":"/etc"}', None),
        ('{"study":"s","brushes":[{"axis":"b2","ranges":[[0,NaN]]}]}', None),
        ('{"study":"s","brushes":[{"axis":"b2"}]}', None),
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
def feed(home: Path) -> Generator[StudyFeed]:
    feed = StudyFeed(StudyFolders(home), lambda: None)
    yield feed
    feed.stop()


def draw_study(feed: StudyFeed, studies: Studies) -> StudyDrawing:
    feed.follow(Frame(replace(open_state(OPTIMAL), studies=studies)))
    assert feed.wait_until_idle(PATIENCE)
    assert feed.problem is None
    assert feed.drawing is not None
    return feed.drawing


def unpacked(array: dict[str, str]) -> list[Any]:
    kind = {"f4": "<f4", "i4": "<i4"}[array["dtype"]]
    return np.frombuffer(base64.b64decode(array["bdata"]), dtype=kind).tolist()


def test_folders_offer_only_studies_and_no_name_leads_elsewhere(home: Path) -> None:
    folders = StudyFolders(home, (home / "some", home / "no study"))
    assert folders.by_name() == {"some": home / "some", "some (2)": home / "some"}
    for name in ("no study", "..", "../some", str(home / "some"), "some/", "", "\0"):
        with pytest.raises(InputError, match="there is no study"):
            folders.folder(name)
    assert StudyFolders(home / "nowhere").by_name() == {}
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
    volume, reach = results.columns["volume"], results.columns["reach"]
    best = results.front()
    assert sorted(drawing.front.tolist()) == np.flatnonzero(best).tolist()
    assert np.all(np.diff(volume[drawing.front]) <= 0.0)
    counts = [count for *_, count in drawing.reasons]
    assert counts == sorted(counts, reverse=True)
    assert sum(counts) == int((~done).sum()) > 0
    assert drawing.plots is not None
    assert drawing.plotted is not None
    assert (drawing.plotted.across, drawing.plotted.up) == ("volume", "reach")
    lines, points = (json.loads(plot.to_json()) for plot in drawing.plots)
    assert_lines_of(results, np.flatnonzero(done), lines)
    logarithmic = draw_study(feed, Studies(name="some", logarithmic=True)).plots
    assert logarithmic is not None
    assert_lines_of(results, np.flatnonzero(done), json.loads(logarithmic[0].to_json()))
    kinds = [json.loads(logarithmic[1].to_json())["layout"][axis]["type"] for axis in AXES]
    assert kinds == ["log" if column[done].min() > 0.0 else "linear" for column in (volume, reach)]
    only = draw_study(feed, Studies(name="some", front_only=True)).plots
    assert only is not None
    assert_lines_of(results, np.flatnonzero(best), json.loads(only[0].to_json()))
    assert points_of(json.loads(only[1].to_json())) == np.flatnonzero(best).tolist()
    marked = [trace for trace in points["data"] if "markers" in trace["mode"]]
    seen = [index for trace in marked for index in unpacked(trace["customdata"])]
    assert sorted(seen) == results.columns["index"][done].tolist()
    for trace in marked:
        rows = unpacked(trace["customdata"])
        assert unpacked(trace["x"]) == volume[rows].astype(np.float32).tolist()
        assert unpacked(trace["y"]) == reach[rows].astype(np.float32).tolist()


AXES = ("xaxis", "yaxis")


def assert_lines_of(results: Results, rows: Any, figure: dict[str, Any]) -> None:
    """Compare the values on the axes of all lines with those of rows."""
    meta: dict[str, Any] = figure["layout"]["meta"]
    heights: dict[int, Any] = {}
    for trace in figure["data"]:
        if "customdata" in trace:
            lines = np.reshape(unpacked(trace["y"]), (-1, len(meta["axes"]) + 1))
            assert np.isnan(lines[:, -1]).all()
            heights |= dict(zip(unpacked(trace["customdata"]), lines[:, :-1], strict=True))
    assert sorted(heights) == results.columns["index"][rows].tolist()
    for row in rows:
        line = heights[int(results.columns["index"][row])]
        for name, height, (low, high, is_log) in zip(meta["axes"], line, meta["ends"], strict=True):
            at = low * (high / low) ** height if is_log else low + height * (high - low)
            assert at == pytest.approx(
                results.columns[name][row], rel=1e-5, abs=1e-6 * (high - low)
            )


def test_plots_show_brushes_and_the_picked_design(feed: StudyFeed, home: Path) -> None:
    results = load_results(home / "some")
    done = results.columns["status"] == "done"
    low, high = np.quantile(results.columns["volume"][done], [0.25, 0.75]).tolist()
    picked = int(results.columns["index"][done][0])
    brushes = (Brush("volume", ((low, high),)),)
    drawing = draw_study(feed, Studies(name="some", brushes=brushes, picked=picked))
    expected = [bool(low <= each <= high) for each in results.columns["volume"]]
    assert drawing.inside.tolist() == expected
    assert drawing.plots is not None
    lines, points = (json.loads(plot.to_json()) for plot in drawing.plots)
    (bar,), meta = lines["layout"]["shapes"], lines["layout"]["meta"]
    axis = meta["axes"].index("volume")
    assert bar["x0"] < axis < bar["x1"]
    least, most, _ = meta["ends"][axis]
    ends = [least + bar[end] * (most - least) for end in ("y0", "y1")]
    assert ends == pytest.approx([low, high])
    (box,) = points["layout"]["shapes"]
    assert (box["x0"], box["x1"], box["yref"]) == (low, high, "y domain")
    assert unpacked(points["data"][-1]["customdata"]) == [picked]
    # Of the points, those left out are drawn apart from the others.
    rows = unpacked(points["data"][0]["customdata"]) + unpacked(points["data"][2]["customdata"])
    assert sorted(rows) == np.flatnonzero(done & ~np.array(expected)).tolist() != []


def test_picked_design_is_live_and_one_step_to_undo(desk: Desk, feed: StudyFeed) -> None:
    desk.session.do(OpenStudy("some"))
    drawing = draw_study(feed, Studies.of(desk.state))
    index = int(drawing.results.columns["index"][drawing.front[0]])
    design = drawing.results.design_at(index)
    before = desk.state
    desk.session.do(PickDesign(design, index=index, study="some"))
    assert (desk.state.design, Studies.of(desk.state).picked) == (design, index)
    desk.session.do(UNDO)
    assert (desk.state.design, Studies.of(desk.state)) == (before.design, Studies.of(before))
    desk.session.do(OpenStudy(None))
    desk.session.do(PickDesign(design, index=index, study="some"))
    assert desk.state.design == before.design
    assert desk.complaints == ["the study 'some' is not open any more"]


def test_plots_are_not_drawn_again_for_a_live_design_and_a_lost_study_is_reported(
    feed: StudyFeed,
) -> None:
    studies = Studies(name="some")
    drawing = draw_study(feed, studies)
    state = replace(open_state(OPTIMAL), studies=studies)
    feed.follow(Frame(SetVariable("b3", 5.0).apply(state)))
    feed.follow(Frame(Set("studies.plan", QUICK).apply(state)))
    assert feed.wait_until_idle(PATIENCE)
    assert feed.drawing is drawing
    feed.follow(Frame(replace(open_state(OPTIMAL), studies=Studies(name="gone"))))
    assert feed.wait_until_idle(PATIENCE)
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
    assert select_rows(results, results.front(), Studies(name="s")) is None


def test_measure_that_some_designs_lack_hides_no_point_that_it_is_no_axis_of() -> None:
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
    # A line needs a place on each axis; a design without one is counted.
    assert_lines_of(results, np.array([0, 2]), lines)
    assert "<b>2</b> without a line, which lack reach" in status_of(results, seen)
    # As an axis it places no design that lacks it, picked or not.
    other = select_rows(results, results.front(), replace(studies, up="reach", picked=1))
    assert other is not None
    assert points_of(scatter(other, 1, dark=False)) == [0, 2]


def test_measure_that_all_designs_lack_or_share_is_no_axis_and_hides_nothing() -> None:
    nan = math.nan
    columns = {"b2": [0.0, 1.0, 2.0, 3.0], "volume": [4.0, 2.0, 3.0, 1.0]}
    # One that is the same in all designs is none either.
    for reach in (nan, 5.0):
        results = results_of(columns | {"reach": [reach] * 4})
        seen = select_rows(results, results.front(), Studies(name="s"))
        assert seen is not None
        assert seen.axes == ("b2", "volume")
        assert points_of(scatter(seen, 1, dark=False)) == [0, 1, 2, 3]
        assert_lines_of(results, np.arange(4), parallel(seen, 1, dark=False))
        assert "without a line" not in status_of(results, seen)
    # Where no design has all axes, points are drawn and no line.
    columns |= {"volume": [4.0, 2.0, nan, nan], "reach": [nan, nan, 3.0, 1.0]}
    results = results_of(columns)
    seen = select_rows(results, results.front(), Studies(name="s", across="b2", up="reach"))
    assert seen is not None
    assert points_of(scatter(seen, 1, dark=False)) == [2, 3]
    assert_lines_of(results, np.arange(0), parallel(seen, 1, dark=True))
    assert "<b>4</b> without a line, which lack volume or reach" in status_of(results, seen)


def points_of(figure: dict[str, Any]) -> list[int]:
    """Return the designs that are points of a scatter plot, those picked once."""
    traces = [each for each in figure["data"] if "markers" in each["mode"]]
    return sorted({index for each in traces for index in unpacked(each["customdata"])})


def status_of(results: Results, seen: PlotRows) -> str:
    front = np.flatnonzero(seen.front)
    return status(StudyDrawing(seen.studies, results, front, seen.inside, seen, None, ()))


class Studio:
    """A desk, its studies and who runs them."""

    def __init__(self, desk: Desk, home: Path) -> None:
        self.desk = desk
        self.folders = StudyFolders(home)
        self.feed = StudyFeed(self.folders, lambda: None)
        self.runner = StudyRunner(desk.session, self.feed, desk.complain)


@pytest.fixture
def studio(desk: Desk, tmp_path: Path) -> Generator[Studio]:
    studio = Studio(desk, tmp_path / "studies")
    yield studio
    studio.runner.worker.stop()
    studio.feed.stop()


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in part_paths(folder)}


def test_study_that_is_refused_or_lacks_a_library_leaves_no_entry(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    runner, desk = studio.runner, studio.desk
    # A folder of another study, found only where the rows are to be computed.
    other = studio.folders.home / "paper-optimal-1"
    monkeypatch.setattr(StudyFolders, "new", lambda *_: other)  # pyright: ignore
    other.mkdir(parents=True)
    (other / "notes.txt").write_text("mine")
    runner.start(OPTIMAL, QUICK)
    assert runner.wait_until_idle(PATIENCE)
    assert "is not empty" in desk.complaints.pop()
    monkeypatch.setattr(extras, "is_missing", lambda *_: True)  # pyright: ignore
    runner.start(OPTIMAL, QUICK)
    assert desk.complaints.pop() == 'studies need the extra study: pip install ".[study]"'
    assert Studies.of(desk.state).name is None
    assert studio.folders.by_name() == {}
    assert (other / "notes.txt").read_text() == "mine"


def test_study_that_was_cancelled_is_continued_with_the_rows_it_has(studio: Studio) -> None:
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
    assert Studies.of(desk.state).name == run.name
    folder = studio.folders.folder(run.name)
    kept = bytes_of(folder)
    assert len(kept) < run.study.chunks
    runner.go_on(run.name)
    assert runner.wait_until_idle(PATIENCE)
    assert desk.complaints == []
    after = bytes_of(folder)
    assert kept.items() <= after.items()
    results = load_results(folder)
    assert results.study == run.study
    # The rows are those of the study, wherever it is computed.
    expected = evaluate(encode_study(run.study), 0, 16).columns
    for name in ("index", "a3x", "b2", "volume", "reach"):
        assert results.columns[name].tolist() == list(expected[name])
    for design in map(results.design_of_row, range(results.count)):
        for name, value, live in zip(VARIABLES, design.variables, OPTIMAL.variables, strict=True):
            low, high = results.study.variables.get(name, (live, live))
            assert low <= value <= high
    assert draw_study(studio.feed, Studies.of(desk.state)).is_complete


def test_study_that_cannot_be_is_refused_and_leaves_nothing(studio: Studio) -> None:
    studio.runner.start(OPTIMAL, StudyPlan(variables=()))
    assert studio.desk.complaints == ["choose at least one variable that varies"]
    studio.runner.go_on("nowhere")
    assert studio.desk.complaints[1:] == ["there is no study 'nowhere'; there are none yet"]
    assert studio.runner.run is None
    assert studio.folders.by_name() == {}


def test_study_whose_process_dies_is_reported_and_keeps_what_is_finished(studio: Studio) -> None:
    studio.runner.start(OPTIMAL, replace(QUICK, count=2000))

    def is_begun() -> bool:
        run = studio.runner.run
        return run is None or (run.progress is not None and run.progress.done > 0)

    # Once there is something to keep.
    wait_for(is_begun, PATIENCE)
    number = studio.runner.worker.process_id
    assert number is not None
    os.kill(number, getattr(signal, "SIGKILL", signal.SIGTERM))
    assert studio.runner.wait_until_idle(PATIENCE)
    assert any("Continue starts it again" in each for each in studio.desk.complaints)
    assert studio.runner.run is None
    name = Studies.of(studio.desk.state).name
    assert name is not None
    assert load_results(studio.folders.folder(name)).count > 0


def test_new_study_closes_the_open_one_and_shows_the_settings(
    services: Services, desk: Desk, buttons: Buttons, home: Path
) -> None:
    theme: Any = SimpleNamespace(is_dark=False)
    shared = replace(services, theme=theme)
    shared.give(study_folders, StudyFolders(home))
    panel = StudiesPanel(shared)
    desk.session.do(OpenStudy("some"))
    draw_study(panel.feed, Studies.of(desk.state))
    # Without a request the settings of a new study are not shown while one is open.
    updates = [*panel.updates(Frame(desk.state))]
    assert [v for h, n, v in updates if h is panel.form and n == "visible"] == [False]
    desk.press(buttons, "studies.new")
    updates = [*panel.updates(Frame(desk.state))]
    assert [v for h, n, v in updates if h is panel.form and n == "visible"] == [True]
    panel.feed.stop()
