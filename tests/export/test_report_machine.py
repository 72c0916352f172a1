"""The report of a machine: loads and precision, true to statics, and absent without one."""

from __future__ import annotations

import datetime as dt
import re
from functools import cache

import msgspec
import numpy as np
import pytest
from limited_designs import ordinary_case
from machines import FULL
from report_page import Node, read, table_of

import explorer
from explorer import Actuators, Design, Guide, Payload, Pose, Struts, Tool
from explorer.app.features.sharing.reporting import make_report
from explorer.export.pose_tables import parse_table, read_poses
from explorer.export.report.data import ReportData
from explorer.export.report.workspace import worst_payload_force
from explorer.find.check import check_requirement
from explorer.find.requirement import Requirement, decode_requirement
from explorer.measures.catalogue import CATALOGUE, measure_design, measures_in
from explorer.measures.measure import Case
from explorer.mechanism.design import JOINTS
from explorer.mechanism.machine import Triple
from explorer.motion.weights import MovingBodies
from explorer.paths.drives import TimedPath, drives_along
from explorer.statics.reactions import Reactions, limit_shares
from explorer.workspace.carried_region import carried_region
from explorer.workspace.workspace import Workspace

OPTIMAL = explorer.PRESETS["paper-optimal"]
ZERO = np.zeros(6)
POSE = Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), (-60.0, 5.0, 2.0))
TENTH: Triple = (0.1, 0.1, 0.1)
ERRORS = Actuators(error_mm=(0.05, 0.02, 0.03, 0.04, 0.01, 0.06))
BENDS = Struts(outer_mm=12.0, inner_mm=10.0)
PAYLOAD = Payload(0.6, (0.0, 0.5, 1.0), 8.0)
SINGULAR = Pose((10.0, 5.0, 9.0), (1.0, 0.0, 0.0, 0.0))


def page_of(design: Design, pose: Pose | None = None) -> Node:
    return read(make_report(design, pose, date=dt.date(2026, 3, 9)).decode())


def titles(page: Node) -> list[str]:
    return [each.text for each in page.all("h2", "h3")]


def loaded_case(seed: int, *, force: bool = True) -> Design:
    """Return an ordinary design with a random machine around it."""
    design, _ = ordinary_case(seed)
    rng = np.random.default_rng(seed)
    at = rng.uniform(-0.3, 0.3, (2, 3)) * design.reach
    metres = 1e-3 * design.unit_mm * design.reach
    return msgspec.structs.replace(
        design,
        tool=Tool(tuple(at[0].tolist()), tuple(rng.normal(size=4).tolist())),  # pyright: ignore[reportArgumentType]
        payload=Payload(
            float(rng.uniform(0.2, 2.0)),
            tuple(at[1].tolist()),  # pyright: ignore[reportArgumentType]
            float(rng.uniform(1.0, 20.0)) if force else 0.0,
        ),
        gravity=tuple(rng.normal(size=3).tolist()),
        actuators=Actuators(
            push_n=tuple(rng.uniform(50.0, 400.0, 6).tolist()),  # pyright: ignore[reportArgumentType]
            pull_n=tuple(rng.uniform(50.0, 400.0, 6).tolist()),  # pyright: ignore[reportArgumentType]
        ),
        struts=Struts(moment_nm=float(rng.uniform(50.0, 100.0) * metres)),
        guide=Guide(float(rng.uniform(100.0, 300.0)), float(rng.uniform(40.0, 100.0) * metres)),
    )


@cache
def loaded_page(seed: int) -> Node:
    return page_of(loaded_case(seed))


def reactions_at_home(design: Design) -> Reactions:
    home = design.home_pose
    weights = MovingBodies().with_payload(design)
    tool = design.tool.position
    return explorer.reactions(explorer.Configuration.at(design, home, tool), ZERO, weights)


def design_with(**parts: object) -> Design:
    return msgspec.structs.replace(OPTIMAL, tool=Tool((0.5, -0.3, 1.5)), **parts)


def section_of(page: Node, title: str) -> Node:
    """Return the section with a title."""
    (section,) = (each for each in page.all("section") if next(each.all("h2")).text == title)
    return section


@pytest.mark.parametrize("seed", range(2))
def test_report_loads_tables_hold_reactions_and_shares(seed: int) -> None:
    design = loaded_case(seed)
    page, held = loaded_page(seed), reactions_at_home(design)
    shares = limit_shares(design, held)
    push, pull = design.actuators.limits
    actuators = table_of(page, "Forces of the actuators")
    assert list(actuators) == list(JOINTS)
    for k, row in enumerate(actuators.values()):
        expected = [held.actuators[k], held.spread[k], push[k], pull[k], 100.0 * shares[k]]
        assert row.values == [float(value) for value in expected]
    metres, guide = 1e-3 * design.unit_mm, design.guide
    assert guide.force_n is not None
    assert guide.moment_nm is not None
    parts = list(table_of(page, "Struts and guide").values())
    for k in range(2):
        for place, factor, value, limit in (
            (0, metres, held.bending[k], design.struts.largest_moment),
            (2, 1.0, held.guide_force[k], guide.force_n),
            (4, metres, held.guide_moment[k], guide.moment_nm),
        ):
            index = 6 + place + k
            weight, force = factor * float(value), factor * float(held.spread[index])
            found = parts[place + k].values
            assert found == [weight, force, limit, 100.0 * float(shares[index])]
            assert f" {k + 2}" in parts[place + k].text
    worst = worst_payload_force(ReportData(design))
    assert worst.utilisation == pytest.approx(float(shares.max()), rel=1e-9)


def test_report_of_a_pose_tells_at_home_what_home_has() -> None:
    names = [name for name in measures_in("report") if "home" in CATALOGUE[name].label]
    measured = measure_design(Case(FULL), names).values
    headline = page_of(FULL, POSE).one(**{"class": "headline"})
    told = {next(each.all("dt")).text.lower(): each.values for each in headline.all("div")}
    assert {"home_tilt", "orientation_share", "home_load_share"} < {*measured}
    for name, value in measured.items():
        assert told[CATALOGUE[name].heading.lower()] == pytest.approx([value], rel=1e-12), name


def test_report_loads_volume_is_that_of_held_workspace_beside_the_whole() -> None:
    design = loaded_case(1)
    page, rotation = loaded_page(1), design.home_pose.rotation
    held = carried_region(Workspace(design, rotation))
    whole = explorer.workspace_volume(design, rotation).volume
    cubic = (0.1 * design.unit_mm) ** 3
    rows = {next(row.all("th")).text: row.values for row in page.all("tr") if any(row.all("th"))}
    assert 0.0 < held.held_volume < whole
    assert rows["whole workspace"] == [whole, whole * cubic, 100.0]
    share = 100.0 * (held.held_volume / whole)
    assert rows["holds the payload"] == [held.held_volume, held.held_volume * cubic, share]
    assert {"load-x", "load-y", "load-z"} <= {each.attributes.get("id") for each in page.all()}
    assert "grow without bound" in page.text
    commands = page.one(id="commands").text
    assert "explorer forces --design design.json --at tool" in commands
    assert "--load 0 0 0" in commands


def test_report_of_limits_or_a_payload_alone_tells_what_follows_from_it() -> None:
    limits = Actuators((100.0, 100.0, 100.0, 100.0, 100.0, 100.0))
    design = msgspec.structs.replace(OPTIMAL, actuators=limits)
    page, home = page_of(design), design.home_pose
    assert "Forces of the actuators" not in page.text
    payload = float(explorer.largest_payload(explorer.Configuration.at(design, home)))
    assert table_of(page, "Most that is held")["payload"].values == [payload]
    assert "Where the payload is held" not in titles(page)
    assert "of its limit" not in page.text
    design = msgspec.structs.replace(OPTIMAL, payload=Payload(1.0))
    page, held = page_of(design), reactions_at_home(design)
    forces = table_of(page, "Forces of the actuators")
    assert [forces[name].values for name in JOINTS] == [[float(f)] for f in held.actuators]
    assert "Most that is held" not in page.text
    assert "of its limit" not in page.text


def test_report_without_a_machine_has_neither_loads_nor_precision() -> None:
    for design in (OPTIMAL, msgspec.structs.replace(OPTIMAL, gravity=(1.0, 0.0, 0.0))):
        data = ReportData(design)
        assert not data.has_machine
        assert data.precision is None
        page = page_of(design)
        assert not {"Loads", "Precision"} & {*titles(page)}
        assert "explorer forces" not in page.text
    assert "Precision" not in titles(page_of(design_with(payload=PAYLOAD)))


def test_report_of_a_tool_alone_tells_the_tool_and_no_forces() -> None:
    turned = Pose.of_yaw_pitch_roll((0.0, 0.0, 0.0), (30.0, 20.0, 10.0)).quaternion
    page = page_of(msgspec.structs.replace(OPTIMAL, tool=Tool((1.0, 2.0, 3.0), turned)))
    rows = table_of(page, "Tool and payload")
    assert [rows[f"{axis} of the tool point"].values for axis in "xyz"] == [
        [value, value * OPTIMAL.unit_mm] for value in (1.0, 2.0, 3.0)
    ]
    angles = [rows[f"{name} of the tool"].values[0] for name in ("yaw", "pitch", "roll")]
    assert angles == pytest.approx([30.0, 20.0, 10.0])
    assert "Loads" in titles(page)
    assert "Where the payload is held" not in titles(page)
    assert "Forces of the actuators" not in page.text


def test_report_of_too_large_a_load_names_the_best_position() -> None:
    design = loaded_case(2, force=False)
    payload = msgspec.structs.replace(design.payload, mass_kg=1e4)
    design = msgspec.structs.replace(design, payload=payload)
    page = page_of(design)
    held = carried_region(Workspace(design, design.home_pose.rotation))
    assert held.best is not None
    assert held.factor is not None
    assert "Does not hold the payload" in page.text
    (note,) = (each for each in page.all("p") if "No position of the workspace" in each.text)
    assert note.values == [*held.best.tolist(), 100.0 * held.factor]


def test_report_of_a_singular_pose_says_that_nothing_holds_a_load_or_bounds_errors() -> None:
    section = section_of(page_of(loaded_case(1), SINGULAR), "Loads")
    assert "Singular pose: The payload does work in a motion" in section.text
    design = design_with(actuators=ERRORS, struts=BENDS, payload=PAYLOAD)
    section = section_of(page_of(design, SINGULAR), "Precision")
    assert "Errors are infinite here" in section.text
    assert "The deflection is infinite" in section.text


def test_report_commands_of_a_tool_place_the_tool() -> None:
    design = design_with(actuators=ERRORS, payload=PAYLOAD)
    page = page_of(design, POSE)
    at = POSE.position + POSE.rotation @ design.tool.position
    words = " ".join(repr(float(value)) for value in at)
    lines = page.one(id="commands").text.splitlines()
    told = [line for line in lines if line.startswith(("explorer forces", "explorer accuracy"))]
    assert len(told) == 2
    assert all(f"--position {words} " in line and line.endswith("--at tool") for line in told)


def test_report_of_a_path_has_its_drives_and_the_corners_that_give_them_again() -> None:
    home = OPTIMAL.home_pose
    path = TimedPath((home, Pose((12.0, 4.0, 8.0), home.quaternion)), 0.5)
    section = section_of(read(make_report(OPTIMAL, path=path).decode()), "Drives")
    rows, found = table_of(section, "Actuators along the path"), drives_along(OPTIMAL, path)
    expected = found.summary[:3]
    for joint, *values in zip(JOINTS, *expected, strict=True):
        assert rows[joint].values[:3] == pytest.approx(values)
    (corners,) = (each.text for each in section.all("pre"))
    table = parse_table("corners.csv", corners.encode(), OPTIMAL.unit_mm)
    again = read_poses(table, OPTIMAL, home.rotation)
    np.testing.assert_allclose(again.position, [pose.position for pose in path.poses])
    np.testing.assert_allclose(again.rotation, [pose.rotation for pose in path.poses], atol=1e-12)
    far = TimedPath((home, Pose((10.0, 40.0, 8.0), home.quaternion)), 0.5)
    refused = section_of(read(make_report(OPTIMAL, path=far).decode()), "Drives").text
    assert "leaves the limits" in refused


def test_report_begins_with_the_requirement_and_its_check() -> None:
    design = explorer.PRESETS["buildable"]
    needed = Requirement(name="mine", box_mm=(200.0, 150.0, 100.0), tilt_deg=15.0, hull_mm=100.0)
    page = read(make_report(design, requirement=needed).decode())
    section = section_of(page, "Requirement")
    assert next(page.all("h2")).text == "Requirement"
    assert "mine: a box of 200 × 150 × 100 mm" in section.text
    # The check and the table are of the same box.
    assert "at its centre, turned by −63° about z" in section.text
    assert "before it is turned by −63° about z" in section_of(page, "Mechanism").text
    assert "--requirement requirement.json" in page.one(id="commands").text
    again = decode_requirement(page.one(id="requirement").text.encode(), "report")
    assert again == needed
    check, rows = check_requirement(design, needed), table_of(section, "The check of the design")
    assert [*rows] == [each.words for each in check.demands]
    for each in check.demands:
        expected = [each.worst, each.limit, each.spare] if each.worst or each.limit else []
        assert rows[each.words].values == expected
        assert rows[each.words].text.endswith("missed") == (not each.kept)
    assert f"{len(check.missed)} of {len(check.demands)} demands are missed" in section.text
    assert check.missed
    assert "Requirement" not in titles(read(make_report(design).decode()))


def test_report_writes_rounding_errors_as_zero() -> None:
    tiny = Pose.of_yaw_pitch_roll((1e-16, 5.0, 9.0), (-60.0, 1.27e-14, 3e-15))
    tool = Tool((1.0, 2.0, 1e-16), tiny.quaternion)
    page = page_of(msgspec.structs.replace(OPTIMAL, tool=tool), tiny)
    tables = " ".join(each.text for each in page.all("table"))
    assert "10⁻¹⁴" not in tables
    assert "10⁻¹⁶" not in tables


def test_report_in_millimetres_has_the_lengths_of_the_other_and_no_unit_of_its_own() -> None:
    design = design_with(payload=PAYLOAD, actuators=ERRORS, struts=BENDS)
    # A unit that is no power of ten, so that no number is right by chance.
    design = msgspec.structs.replace(design, unit_mm=7.3)
    other, page = (
        read(make_report(design, POSE, in_mm=in_mm, date=dt.date(2026, 3, 9)).decode())
        for in_mm in (False, True)
    )
    assert re.findall(r"1 unit|units", page.text) == ["1 unit"]
    assert page.one(id="design").text == other.one(id="design").text
    assert page.one(id="commands").text == other.one(id="commands").text
    for section, caption, column in (
        ("Mechanism", "Design variables X", 1),
        ("Mechanism", f"Joints in {ReportData(design, pose=POSE).pose_words}, and their limits", 1),
        ("Workspace", "Volumes", 1),
    ):
        rows = table_of(section_of(other, section), caption)
        for name, row in table_of(section_of(page, section), caption).items():
            wanted = rows[name].values[column]
            assert row.values[0] == pytest.approx(wanted, rel=1e-9), name
