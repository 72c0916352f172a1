"""The report: well-formed, alone, true to the functions that everything else uses."""

from __future__ import annotations

import datetime as dt
import hashlib
import math
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import example, given, strategies as st
from limited_designs import limited, ordinary_case, troubled_case
from report_page import Node, read, table_of

import explorer
from explorer import Design, ExplorerError, Pose, __version__
from explorer.app.features.sharing.reporting import make_report
from explorer.export.drawings.markup import as_html, element, number
from explorer.export.drawings.mechanism import ViewName, fit_view
from explorer.export.drawings.slices import Slices
from explorer.export.report.data import ReportData
from explorer.export.report.document import report_html
from explorer.legs.clearance import PAIRS, pair_name
from explorer.mechanism.design import JOINTS, VARIABLES, Swing
from explorer.mechanism.design_file import decode_design, encode_design
from explorer.numerics.number_text import format_number
from explorer.optimise.defaults import make_problem, paper_problem
from explorer.optimise.outcome import Record, Settings, record_of
from explorer.optimise.solver import optimise_design
from explorer.prototype.assembly import bill_of_materials, make_prototype
from explorer.singularity.ellipsoids import performance, singularity_free_ball
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.accessible.workspace import accessible_workspace
from explorer.workspace.least_clearance import least_clearances
from explorer.workspace.slices.volume import node_count_of
from explorer.workspace.solids.solid import convex_hull
from explorer.workspace.solids.solids import workspace_solid
from explorer.workspace.workspace import Workspace

OPTIMAL = explorer.PRESETS["paper-optimal"]
DAY = dt.date(2026, 3, 9)
HOSTILE = (
    '<script>alert(1)</script><img src=x onerror="alert(2)">x" onload="alert(1)" y=\'',
    "</title></style></pre>--> & &lt; ' \" ]]> <!--",
)


def page_of(design: Design, pose: Pose | None = None, record: Record | None = None) -> Node:
    """Return a report as it is read, once it is known to be in order."""
    return in_order(make_report(design, pose, record=record, date=DAY).decode())


def in_order(html: str) -> Node:
    """Return a report that is read, and that needs nothing else and says only what is finite."""
    page = read(html)
    names = {each.tag for each in page.all()}
    assert names.isdisjoint({"script", "link", "iframe", "object", "embed", "form", "base", "img"})
    ids = [each.attributes["id"] for each in page.all() if "id" in each.attributes]
    assert len(set(ids)) == len(ids)
    for each in page.all():
        for name, value in each.attributes.items():
            assert not name.startswith("on")
            assert name not in {"src", "href", "action", "style"}
            for target in re.findall(r"url\(([^)]*)\)", value):
                assert target.removeprefix("#") in ids
            if each.tag in {"path", "line", "rect", "circle", "text", "g", "svg"}:
                assert "nan" not in value
                assert not re.search(r"\binf", value)
    (style,) = page.all("style")
    assert "url(" not in style.text
    assert "@import" not in style.text
    assert set(re.findall(r"https?://[^\s\"<]*", html)) <= {"http://www.w3.org/2000/svg"}
    return page


@cache
def paper_page() -> Node:
    return page_of(OPTIMAL)


@cache
def ordinary_page(seed: int) -> Node:
    return page_of(ordinary_case(seed)[0])


@cache
def paper_record() -> Record:
    """The record of the paper's problem; a search is the same each time."""
    return record_of(optimise_design(paper_problem()), Settings())


def test_report_title_block_names_design_unit_and_hash() -> None:
    page = paper_page()
    assert [each.text for each in page.all("h1")] == ["paper-optimal"]
    assert next(page.all("title")).text == "paper-optimal – design report"
    assert next(page.all("time")).text == "2026-03-09"
    block = page.one(**{"class": "particulars"})
    assert "1 unit = 10 mm" in block.text
    assert __version__ in block.text
    data = page.one(id="design").text.encode()
    assert data == encode_design(OPTIMAL)
    assert decode_design(data, "report") == OPTIMAL
    assert page.one(id="design-hash").text == hashlib.sha256(data).hexdigest()
    assert hashlib.sha256(data).hexdigest()[:16] in block.text
    sections = ["Mechanism", "Workspace", "Singularities", "Legs", "Prototype"]
    assert [each.text for each in page.all("h2")] == [*sections, "How to reproduce it"]


def test_report_equal_input_differs_in_date_only() -> None:
    first, later = (make_report(OPTIMAL, date=DAY + dt.timedelta(days=k)) for k in range(2))
    assert later != first
    assert later.replace(b"2026-03-10", b"2026-03-09") == first


@pytest.mark.parametrize("seed", range(2))
def test_report_mechanism_tables_hold_design_and_joints(seed: int) -> None:
    design, _ = ordinary_case(seed)
    page, unit = ordinary_page(seed), design.unit_mm
    home = design.home_pose
    variables = table_of(page, "Design variables")
    for row, name, value in zip(variables.values(), VARIABLES, design.variables, strict=False):
        assert row.text.startswith(name)
        assert row.values == [value, value * unit]
    assert variables["|a3| reach"].values == [design.reach, design.reach * unit]
    pose = table_of(page, "Home pose")
    for axis, value in zip("xyz", home.position, strict=True):
        assert pose[f"{axis} of b4"].values == [value, value * unit]
    for axis, value in zip("wxyz", home.quaternion, strict=True):
        assert pose[f"quaternion {axis}"].values == [value]
    joints = explorer.inverse(design, home.position, home.rotation).tolist()
    for row, name, value in zip(table_of(page, "Joints in").values(), JOINTS, joints, strict=True):
        ends = design.limits.guide if name in ("d1", "d3") else design.length_range(name)
        assert ends is not None
        assert row.text.startswith(name)
        assert row.values == [value, value * unit, ends[0] * unit, ends[1] * unit]


@pytest.mark.parametrize("seed", range(2))
def test_report_workspace_tables_hold_public_measures(seed: int) -> None:
    design, _ = ordinary_case(seed)
    rotation = design.home_pose.rotation
    page, cubic = ordinary_page(seed), (0.1 * design.unit_mm) ** 3
    volume = explorer.workspace_volume(design, rotation)
    nodes = node_count_of(Workspace(design, rotation))
    solid = workspace_solid(design, rotation)
    rows = table_of(page, "Volumes")
    assert rows["exact volume"].values == [volume.volume, volume.volume * cubic]
    expected = [nodes.volume, nodes.volume * cubic, nodes.count, nodes.step]
    assert rows["node volume"].values == expected
    hull = convex_hull(solid).volume
    assert rows["convex hull"].values == [hull, hull * cubic]
    gradient = {name: row.values for name, row in table_of(page, "Gradient of the volume").items()}
    assert gradient == {name: [rate] for name, rate in volume.gradient.items()}
    assert nodes.extent is not None
    extent, unit = table_of(page, "Extent of"), design.unit_mm
    for axis, low, high in zip("xyz", *nodes.extent, strict=True):
        assert extent[axis].values == [low, high, low * unit, high * unit]
    shares = [row.values[0] for row in table_of(page, "Limits that bound it").values()]
    assert sum(shares) == pytest.approx(100.0)
    assert shares == sorted(shares, reverse=True)


@pytest.mark.parametrize("seed", range(2))
def test_report_singularity_and_leg_tables_hold_snapshot(seed: int) -> None:
    design, _ = ordinary_case(seed)
    home = design.home_pose
    page, unit, snapshot = ordinary_page(seed), design.unit_mm, explorer.evaluate(design, home)
    margins = table_of(page, "Margins")
    for k in range(3):
        margin, volume = float(snapshot.margins[k]), float(snapshot.volumes[k])
        away, turn = snapshot.nearest_distances[k], math.degrees(snapshot.least_turns[k])
        row = margins[f"δ{k + 1}"].values
        assert row == pytest.approx([margin, margin * unit, away * unit, turn], rel=1e-12)
        assert table_of(page, "Tetrahedra")[f"δ{k + 1}"].values == [volume]
    measures = table_of(page, "Conditioning")
    assert measures["det J"].values == [snapshot.determinant]
    assert measures["1/cond J"].values == [snapshot.inverse_condition]
    assert measures["min |δ| / reach"].values == [snapshot.proximity]
    assert snapshot.mode_words in measures["assembly mode"].text
    around = table_of(page, "Around the pose")
    radius = singularity_free_ball(home).radius
    ball = around["singularity-free radius"]
    assert ball.values == [radius * unit]
    certified = min(each.bound for each in snapshot.nearest)
    regular = around["regular within"]
    assert regular.values == [certified * unit]
    nearest = table_of(page, "Nearest singular poses")
    for each in snapshot.nearest:
        found = nearest[f"δ{each.incidence} = 0"].values
        assert found[:3] == [*each.pose.position]
    gains = performance(design, home).translation.gain.tolist()
    speeds = table_of(page, "Speed of b4")
    assert [row.values[3] for row in speeds.values()] == gains
    least = least_clearances(Workspace(design, home.rotation)).clearance
    here = table_of(page, "Clearance here")
    lows = table_of(page, "Least clearance in the workspace")
    clearances = snapshot.clearances.clearance.tolist()
    for pair, clearance, low in zip(PAIRS, clearances, least.tolist(), strict=True):
        name = pair_name(pair)
        assert here[name].values[1:3] == [clearance, clearance * unit]
        assert lows[name].values[:2] == [low, low * unit]


def test_report_thick_legs_give_accessible_volume() -> None:
    design = with_radius(OPTIMAL, 0.2)
    page, found = page_of(design), accessible_workspace(design)
    row = table_of(page, "Volumes")["accessible"].values
    assert row[0] == found.accessible_volume
    assert row[2:] == [found.accessible_node_count, found.node_count]
    assert "collide in the workspace" in page.text
    assert "--interference" in page.one(id="commands").text


def test_report_home_in_collision_gives_reason_for_no_accessible_volume() -> None:
    design = with_radius(OPTIMAL, 0.4)
    page = page_of(design)
    assert "accessible" not in table_of(page, "Volumes")
    assert "no position is accessible from (10, 5, 9): legs 2 and 3 overlap" in page.text


def test_report_bill_is_that_of_the_prototype() -> None:
    bill = bill_of_materials(make_prototype(OPTIMAL), 1240.0)
    rows = table_of(paper_page(), "Bill of parts")
    assert list(rows) == [item.name for item in bill.items]
    for row, item in zip(rows.values(), bill.items, strict=True):
        assert row.values == [*item.size, item.volume / 1000.0, item.mass * 1000.0]
    for row, each in zip(table_of(paper_page(), "Actuators").values(), bill.actuators, strict=True):
        assert row.values == [*each.stroke, *each.required, each.diameter, each.mass * 1000.0]


def test_report_search_section_holds_the_record() -> None:
    record = paper_record()
    page = page_of(record.design, record=record)
    rows = table_of(page, "The search")
    run = record.runs[record.chosen]
    assert rows["iterations"].values == [run.iterations]
    assert rows["seed"].values == [record.settings.seed]
    assert rows["demanded volume, units³"].values == [record.problem.demands.volume]
    best = next(step for step in record.history if step.number == run.best)
    assert rows["F"].values == [best.objective]
    assert rows["volume, units³"].values == [best.volume]
    changes = table_of(page, "The design")
    start, end = record.problem.start.variables, record.design.variables
    for name, before, after in zip(VARIABLES, start, end, strict=True):
        assert changes[name].values == [before, after, after - before]
    curves = [each for each in page.all("path") if each.attributes.get("class") == "curve"]
    steps = [step for step in record.history if step.run == record.chosen]
    assert len(curves) == 3
    for curve in curves:
        assert len(re.findall(r"[ML]", curve.attributes["d"])) == len(steps)
    assert "not the one" not in page.text
    assert "explorer optimise --repeat record.json" in page.one(id="commands").text
    other = page_of(OPTIMAL, record=record)
    assert "not the one that this search found" in " ".join(other.text.split())


def test_report_tells_the_required_box_and_the_yaw_that_a_search_found() -> None:
    box = ((8.0, 4.0, 6.0), (12.0, 8.0, 10.0))
    start = msgspec.structs.replace(OPTIMAL, required_box=box)
    problem = make_problem(start, "smallest-reach", free=["yaw"])
    outcome = optimise_design(problem, iterations=30)
    page = page_of(outcome.design, record=record_of(outcome, Settings()))
    rows = table_of(page, "Required box")
    for axis, low, high in zip("xyz", *box, strict=True):
        assert rows[axis].values == [low, high, 10.0 * low, 10.0 * high]
    yaws = table_of(page, "The design")["yaw of home, °"].values
    assert yaws[:2] == [problem.start_values[-1], outcome.best.values[-1]]


@pytest.mark.parametrize("name", HOSTILE)
def test_report_hostile_name_stays_text(name: str) -> None:
    design = msgspec.structs.replace(OPTIMAL, name=name)
    page = page_of(design)
    plain = paper_page()
    assert next(page.all("h1")).text == name
    assert next(page.all("title")).text == f"{name} – design report"
    assert decode_design(page.one(id="design").text.encode(), "report") == design
    # The elements are those of any other name, but that it is no preset.
    tags = [each.tag for each in page.all() if each.tag != "code"]
    assert tags == [each.tag for each in plain.all() if each.tag != "code"]


@given(st.text(), st.text())
def test_element_any_text_reads_back_as_text(inside: str, attribute: str) -> None:
    made = element("p", inside, element("b", inside), inside, title=attribute)
    root = read(f"<!DOCTYPE html>\n{as_html(element('html', made))}")
    (p,) = root.all("p")
    (b,) = root.all("b")
    assert len(list(root.all())) == 3
    if inside.isprintable():
        assert (p.text, b.text) == (3 * inside, inside)
    if attribute.isprintable():
        assert p.attributes["title"] == attribute


@example(1000.0)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_number_any_value_reads_back_in_full_beside_its_text(value: float) -> None:
    made = number(value)
    assert float(made.attrib["value"]) == value
    assert made.text == format_number(value, 6)


def test_report_empty_workspace_gives_reason() -> None:
    level = Pose((10.0, 5.0, 9.0), (1.0, 0.0, 0.0, 0.0))
    page = page_of(OPTIMAL, level)
    assert "The workspace is empty at this orientation because of margin δ2" in page.text
    assert "Singular: δ2 = 0: lines a1a2 and b2b3 meeting" in page.text
    assert "∞" in page.text
    commands = page.one(id="commands").text
    assert "--position 10.0 5.0 9.0 --quaternion 1.0 0.0 0.0 0.0" in commands


def test_report_singular_home_says_so() -> None:
    home = Pose.of_yaw_pitch_roll((10.0, 5.0, 0.0), (-73.1, 0.0, 0.0))
    page = page_of(msgspec.structs.replace(OPTIMAL, home=home))
    assert "Singular: δ1 = 0: a1 on the platform plane" in page.text
    assert table_of(page, "Conditioning")["det J"].values == [0.0]


def test_report_missing_values_give_reasons_in_their_place() -> None:
    fine = page_of(msgspec.structs.replace(OPTIMAL, node_step=1e-6))
    assert "are counted" in table_of(fine, "Volumes")["node volume"].text
    tight = ReportData(limited(OPTIMAL, leg_radii=(0.5, 0.5, 0.5, 0.5)))
    assert isinstance(tight.bill, ExplorerError)
    page = in_order(report_html(tight, DAY))
    assert "Its parts cannot be made" in page.text
    # Nor are there commands that would only tell so again.
    assert isinstance(tight.accessible, ExplorerError)
    commands = page.one(id="commands").text
    assert "export mechanism" not in commands
    assert "--interference" not in commands


def test_report_swing_limits_are_drawn_from_a_grid() -> None:
    page = page_of(limited(OPTIMAL, swing=Swing(a1=30.0, b4=50.0)))
    assert "the outlines are those of a fine grid" in page.text
    limits = table_of(page, "Limits in force")
    assert "at most 30°" in limits["swing a1"].text
    assert "exact to rounding" not in page.text
    assert any("clip-path" in each.attributes for each in page.all("g"))


@pytest.mark.parametrize("seed", [3, 14])
def test_report_troubled_designs_have_one(seed: int) -> None:
    design, _ = troubled_case(seed)
    page = page_of(design)
    assert decode_design(page.one(id="design").text.encode(), "report") == design


@pytest.mark.parametrize("name", ["top", "front", "side", "isometric"])
def test_fit_view_random_points_lie_in_the_frame_upright(name: ViewName) -> None:
    rng = np.random.default_rng(4)
    points = rng.normal(size=(40, 3)) * rng.uniform(0.1, 10.0, 3)
    view = fit_view(name, points, (10.0, 20.0, 310.0, 220.0))
    flat = view.to(points)
    assert (flat.min(axis=0) >= [10.0 - 1e-9, 20.0 - 1e-9]).all()
    assert (flat.max(axis=0) <= [310.0 + 1e-9, 220.0 + 1e-9]).all()
    assert np.allclose(view.axes @ view.axes.T, np.eye(3))
    assert np.linalg.det(view.axes) == pytest.approx(1.0)
    up = {"top": 1, "front": 2, "side": 2, "isometric": 2}[name]
    off = view.to(np.eye(3)[up]) - view.to(np.zeros(3))
    assert off[1] < 0.0
    assert abs(off[0]) < 1e-9


def test_slice_bands_hold_the_positions_of_their_margins() -> None:
    """Each polygon of a band holds the positions with such margins, and no others."""
    home = OPTIMAL.home_pose
    solid = workspace_solid(OPTIMAL, home.rotation)
    extent = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    slices = Slices.of(Workspace(OPTIMAL, home.rotation), extent)
    rng = np.random.default_rng(1)
    level, index = 5.0, 5
    points = rng.uniform(slices.lows, slices.highs, (400, 3))
    points[:, 1] = level
    polygons = list(slices.beyond("y", level)(slices.bands.edges[index]))
    least = np.abs(explorer.margins(points, home.rotation)).min(axis=-1)
    for point, margin in zip(points[:, [0, 2]], least.tolist(), strict=True):
        within = any(_holds(polygon, point) for polygon in polygons)
        assert within == (margin >= slices.bands.levels[index])


def _holds(polygon: Any, point: Any) -> bool:
    off, along = point - polygon, np.roll(polygon, -1, axis=0) - polygon
    turn = along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0]
    return bool((turn >= 0.0).all() or (turn <= 0.0).all())


def test_make_report_loads_neither_viser_nor_playwright() -> None:
    code = (
        "import sys; from explorer import PRESETS; "
        "from explorer.app.features.sharing.reporting import make_report; "
        "make_report(PRESETS['paper-initial']); "
        "print(sorted({n.partition('.')[0] for n in sys.modules} & {'viser', 'playwright'}))"
    )
    folder = Path(explorer.__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd=folder
    )
    assert done.stdout.strip() == "[]"
