"""The report's section on precision: true to statics, and absent of an ideal design."""

from __future__ import annotations

import datetime as dt

import msgspec
import numpy as np
import pytest
from report_page import Node, read, table_of

import explorer
from explorer import Actuators, Design, Payload, Pose, Struts, Tolerances, Tool
from explorer.app.features.sharing.reporting import make_report
from explorer.export.report.data import gather_report_data
from explorer.mechanism.machine import Triple
from explorer.numerics.arrays import FloatArray
from explorer.statics.compliance import stiffness_of
from explorer.statics.weights import payload_wrench

OPTIMAL = explorer.PRESETS["paper-optimal"]
POSE = Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), (-60.0, 5.0, 2.0))
TENTH: Triple = (0.1, 0.1, 0.1)
ERRORS = Actuators(error_mm=(0.05, 0.02, 0.03, 0.04, 0.01, 0.06))
SOFT = Actuators(stiffness_n_mm=(900.0, 1100.0, 700.0, 1300.0, 800.0, 1000.0))
BENDS = Struts(outer_mm=12.0, inner_mm=10.0)
TOLERANCES = Tolerances(TENTH, TENTH, TENTH, (0.2, 0.05), TENTH, TENTH, TENTH, TENTH)
PAYLOAD = Payload(0.6, (0.0, 0.5, 1.0), 8.0)


def design_with(**parts: object) -> Design:
    return msgspec.structs.replace(OPTIMAL, tool=Tool((0.5, -0.3, 1.5)), **parts)


def section_of(design: Design, pose: Pose | None = POSE) -> Node | None:
    """Return the section on precision of a report, or None."""
    page = read(make_report(design, pose, date=dt.date(2026, 3, 9)).decode())
    found = [each for each in page.all("section") if next(each.all("h2")).text == "Precision"]
    return found[0] if found else None


def precise_section(design: Design, pose: Pose | None = POSE) -> Node:
    section = section_of(design, pose)
    assert section is not None
    return section


def given(design: Design) -> tuple[Design, Triple, FloatArray]:
    return design, POSE.position, POSE.rotation


def test_report_of_an_ideal_design_has_no_precision() -> None:
    for design in (OPTIMAL, design_with(payload=PAYLOAD)):
        assert gather_report_data(design).precision is None
        assert section_of(design, None) is None


def test_report_precision_tells_the_errors_of_the_pose_and_ranks_their_sources() -> None:
    design = design_with(actuators=ERRORS, tolerances=TOLERANCES)
    section, tool = precise_section(design), design.tool.position
    by = explorer.pose_error_by_source(*given(design), tool)
    bounds = explorer.source_errors(design)
    rows = table_of(section, "Errors of the tool")
    for name, part in (
        ("actuators", slice(6)),
        ("dimensions", slice(6, 29)),
        ("all", slice(29)),
    ):
        worst = explorer.largest_error(by[:, part], bounds[part])
        rms = explorer.rms_of_sources(by[:, part], bounds[part])
        moved = [float(each.displacement) * design.unit_mm for each in (worst, rms)]
        turned = [float(np.degrees(each.turn)) for each in (worst, rms)]
        assert rows[name].values == pytest.approx([*moved, *turned], rel=1e-12)
    alone = np.linalg.norm((by * bounds)[:3], axis=0) * design.unit_mm
    ranked = table_of(section, "The largest 10 of 29")
    assert list(ranked) == [explorer.SOURCES[k] for k in np.argsort(-alone)[:10]]
    for name, row in ranked.items():
        bound, moved, _ = row.values
        index = explorer.SOURCES.index(name)
        assert moved == pytest.approx(alone[index], rel=1e-12)
        size = np.degrees(bounds[index]) if "tilt" in name else bounds[index] * design.unit_mm
        assert bound == pytest.approx(size, rel=1e-12)
        (bar,) = row.all("rect")
        expected = 100.0 * alone[index] / alone.max()
        assert float(bar.attributes["width"]) == pytest.approx(expected, abs=0.01)
    assert "Compliance" not in section.text


def test_report_precision_of_actuators_alone_lists_no_dimension() -> None:
    section = precise_section(design_with(actuators=ERRORS))
    assert list(table_of(section, "Errors of the tool")) == ["actuators"]
    assert len(table_of(section, "Sources of errors")) == 6


@pytest.mark.parametrize("payload", [PAYLOAD, Payload(0.6, (0.0, 0.5, 1.0)), Payload(force_n=8.0)])
def test_report_precision_tells_what_the_payload_bends(payload: Payload) -> None:
    design = design_with(actuators=SOFT, struts=BENDS, payload=payload)
    section, tool = precise_section(design), design.tool.position
    soft = explorer.compliance(*given(design), *stiffness_of(design), tool)
    principal = explorer.principal_compliances(soft)
    rows = [row.values for row in section.all("tr") if "mm/N" in row.text]
    found = [values for values in rows if len(values) == 4]
    assert [values[0] for values in found] == pytest.approx(
        (principal.displacement * design.unit_mm).tolist()
    )
    assert found[0][1:] == pytest.approx(principal.force_directions[0].tolist())
    # No direction of the force moves the tool farther than that of the report.
    weight = payload_wrench(design, POSE.rotation)
    units = np.random.default_rng(2).normal(size=(20_000, 3))
    units /= np.linalg.norm(units, axis=1, keepdims=True)
    loads = np.tile(weight, (len(units), 1))
    loads[:, :3] += payload.force_n * units
    sampled = np.linalg.norm((loads @ soft)[:, :3], axis=1).max() * design.unit_mm
    deflection = table_of(section, "Deflection")
    size, *vector = deflection["displacement"].values
    assert np.linalg.norm(vector) == pytest.approx(size, rel=1e-12)
    assert sampled <= size * (1.0 + 1e-9)
    assert size == pytest.approx(sampled, rel=1e-3)
    load = weight.copy()
    if payload.force_n:
        load[:3] += payload.force_n * np.array(deflection["direction of the force"].values)
    assert vector == pytest.approx((soft @ load)[:3] * design.unit_mm, rel=1e-9)
    shares = explorer.compliance_shares(*given(design), load, *stiffness_of(design), tool)
    told = [row.values[0] for name, row in deflection.items() if name.startswith("share")]
    assert told == pytest.approx([100.0 * float(share) for share in shares], rel=1e-9)


def test_report_precision_of_a_singular_pose_says_so() -> None:
    level = Pose((10.0, 5.0, 9.0), (1.0, 0.0, 0.0, 0.0))
    design = design_with(actuators=ERRORS, struts=BENDS, payload=PAYLOAD)
    section = precise_section(design, level)
    assert "nothing bounds the errors" in section.text
    assert not list(section.all("table"))


def test_report_commands_of_a_tool_place_the_tool() -> None:
    design = design_with(actuators=ERRORS, payload=PAYLOAD)
    page = read(make_report(design, POSE, date=dt.date(2026, 3, 9)).decode())
    at = POSE.position + POSE.rotation @ design.tool.position
    words = " ".join(repr(float(value)) for value in at)
    lines = page.one(id="commands").text.splitlines()
    told = [line for line in lines if line.startswith(("explorer forces", "explorer accuracy"))]
    assert len(told) == 2
    assert all(f"--position {words} " in line and line.endswith("--at tool") for line in told)
