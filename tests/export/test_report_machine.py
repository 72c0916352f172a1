"""The report of a machine: loads and precision, true to statics, and absent without one."""

from __future__ import annotations

import datetime as dt
from functools import cache

import msgspec
import numpy as np
import pytest
from limited_designs import ordinary_case
from report_page import Node, read, table_of

import explorer
from explorer import Actuators, Design, Guide, Payload, Pose, Struts, Tolerances, Tool
from explorer.app.features.sharing.reporting import make_report
from explorer.export.report.data import gather_report_data
from explorer.export.report.loads import worst_payload_force
from explorer.mechanism.design import JOINTS
from explorer.mechanism.machine import Triple
from explorer.numerics.arrays import FloatArray
from explorer.statics.compliance import (
    compliance_shares,
    largest_deflection,
    principal_compliances,
    stiffness_of,
)
from explorer.statics.error_sources import (
    SOURCES,
    error_by_source,
    largest_error,
    rms_of_sources,
    source_errors,
)
from explorer.statics.reactions import PART_NAMES, Reactions, limit_shares
from explorer.statics.weights import design_weights, payload_wrench
from explorer.workspace.held import held_workspace

OPTIMAL = explorer.PRESETS["paper-optimal"]
ZERO = np.zeros(6)
POSE = Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), (-60.0, 5.0, 2.0))
TENTH: Triple = (0.1, 0.1, 0.1)
ERRORS = Actuators(error_mm=(0.05, 0.02, 0.03, 0.04, 0.01, 0.06))
SOFT = Actuators(stiffness_n_mm=(900.0, 1100.0, 700.0, 1300.0, 800.0, 1000.0))
BENDS = Struts(outer_mm=12.0, inner_mm=10.0)
TOLERANCES = Tolerances(TENTH, TENTH, TENTH, (0.2, 0.05), TENTH, TENTH, TENTH, TENTH)
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
    weights = design_weights(design)
    tool = design.tool.position
    return explorer.reactions(explorer.Configuration.at(design, home, tool), ZERO, weights)


def design_with(**parts: object) -> Design:
    return msgspec.structs.replace(OPTIMAL, tool=Tool((0.5, -0.3, 1.5)), **parts)


def section_of(page: Node, title: str) -> Node:
    """Return the section with a title."""
    (section,) = (each for each in page.all("section") if next(each.all("h2")).text == title)
    return section


def precision_of(design: Design) -> Node:
    """Return the section on precision of a report at the pose of these tests."""
    return section_of(page_of(design, POSE), "Precision")


def given(design: Design) -> tuple[Design, Triple, FloatArray]:
    return design, POSE.position, POSE.rotation


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
    worst = worst_payload_force(gather_report_data(design))
    assert worst.share == pytest.approx(float(shares.max()), rel=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_report_loads_largest_payload_and_force_are_those_of_statics(seed: int) -> None:
    design = loaded_case(seed)
    loaded = gather_report_data(design).loaded
    rows = table_of(loaded_page(seed), "Most that is held")
    assert rows["payload"].values == [loaded.largest_payload]
    assert rows["force in every direction"].values == [1.0 / loaded.newton.share]
    direction = rows["its worst direction"]
    assert direction.values == pytest.approx(loaded.newton.direction.tolist())
    assert PART_NAMES[loaded.newton.part] in rows["force in every direction"].text


def test_report_loads_volume_is_that_of_held_workspace_beside_the_whole() -> None:
    design = loaded_case(1)
    page, rotation = loaded_page(1), design.home_pose.rotation
    held = held_workspace(design, rotation)
    whole = explorer.workspace_volume(design, rotation).volume
    cubic = (0.1 * design.unit_mm) ** 3
    rows = {next(row.all("th")).text: row.values for row in page.all("tr") if any(row.all("th"))}
    assert 0.0 < held.held_volume < whole
    assert rows["whole workspace"] == [whole, whole * cubic, 100.0]
    share = 100.0 * (held.held_volume / whole)
    assert rows["holds the payload"] == [held.held_volume, held.held_volume * cubic, share]
    assert {"load-x", "load-y", "load-z"} <= {each.attributes.get("id") for each in page.all()}
    assert "grows without bound" in page.text
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
        data = gather_report_data(design)
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
    held = held_workspace(design, design.home_pose.rotation)
    assert held.best is not None
    assert held.factor is not None
    assert "Does not hold the payload" in page.text
    (note,) = (each for each in page.all("p") if "No position of the workspace" in each.text)
    assert note.values == [*held.best.tolist(), 100.0 * held.factor]


def test_report_of_a_singular_pose_says_that_nothing_holds_a_load_or_bounds_errors() -> None:
    section = section_of(page_of(loaded_case(1), SINGULAR), "Loads")
    assert "Singular pose: The forces are infinite." in section.text
    design = design_with(actuators=ERRORS, struts=BENDS, payload=PAYLOAD)
    section = section_of(page_of(design, SINGULAR), "Precision")
    assert "Errors are infinite here" in section.text
    assert "The deflection is infinite" in section.text


def test_report_precision_tells_the_errors_of_the_pose_and_ranks_their_sources() -> None:
    design = design_with(actuators=ERRORS, tolerances=TOLERANCES)
    section, tool = precision_of(design), design.tool.position
    by = error_by_source(explorer.Configuration(*given(design), tool))
    bounds = source_errors(design)
    rows = table_of(section, "Errors of the tool")
    for name, part in (("actuators", slice(6)), ("dimensions", slice(6, 29)), ("all", slice(29))):
        worst = largest_error(by[:, part], bounds[part])
        rms = rms_of_sources(by[:, part], bounds[part])
        for kind, each in (("worst", worst), ("RMS", rms)):
            moved = float(each.displacement) * design.unit_mm
            turned = float(np.degrees(each.turn))
            values = rows[f"{name}, {kind}"].values
            assert values == pytest.approx([moved, turned], rel=1e-12)
    alone = np.linalg.norm((by * bounds)[:3], axis=0) * design.unit_mm
    ranked = table_of(section, "By source")
    assert list(ranked) == [SOURCES[k] for k in np.argsort(-alone)[: len(ranked)]]
    assert f"{29 - len(ranked)} more" in section.text
    for name, row in ranked.items():
        bound, moved, _ = row.values
        index = SOURCES.index(name)
        assert moved == pytest.approx(alone[index], rel=1e-12)
        size = np.degrees(bounds[index]) if "tilt" in name else bounds[index] * design.unit_mm
        assert bound == pytest.approx(size, rel=1e-12)
        (bar,) = row.all("rect")
        expected = 100.0 * alone[index] / alone.max()
        assert float(bar.attributes["width"]) == pytest.approx(expected, abs=0.01)
    assert "Compliance" not in section.text


@pytest.mark.parametrize("payload", [PAYLOAD, Payload(0.6, (0.0, 0.5, 1.0)), Payload(force_n=8.0)])
def test_report_precision_tells_what_the_payload_bends(payload: Payload) -> None:
    design = design_with(actuators=SOFT, struts=BENDS, payload=payload)
    section, tool = precision_of(design), design.tool.position
    soft = explorer.compliance(*given(design), *stiffness_of(design), tool)
    principal = principal_compliances(soft)
    rows = [row.values for row in section.all("tr") if "mm/N" in row.text]
    found = [values for values in rows if len(values) == 4]
    assert [values[3] for values in found] == pytest.approx(
        (principal.displacement * design.unit_mm).tolist()
    )
    assert found[0][:3] == pytest.approx(principal.force_directions[0].tolist())
    weight = payload_wrench(design, POSE.rotation)
    deflection = table_of(section, "Deflection")
    size, *vector = deflection["displacement"].values
    assert np.linalg.norm(vector) == pytest.approx(size, rel=1e-12)
    largest, _ = largest_deflection(soft, weight, payload.force_n)
    assert size == pytest.approx(float(largest) * design.unit_mm, rel=1e-9)
    load = weight.copy()
    if payload.force_n:
        load[:3] += payload.force_n * np.array(
            deflection["direction of the payload's force"].values
        )
    assert vector == pytest.approx((soft @ load)[:3] * design.unit_mm, rel=1e-9)
    poses = explorer.Configuration(*given(design), tool)
    shares = compliance_shares(poses, load, *stiffness_of(design))
    told = [row.values[0] for row in table_of(section, "Work of the load").values()]
    assert told == pytest.approx([100.0 * float(share) for share in shares], rel=1e-9)


def test_report_commands_of_a_tool_place_the_tool() -> None:
    design = design_with(actuators=ERRORS, payload=PAYLOAD)
    page = page_of(design, POSE)
    at = POSE.position + POSE.rotation @ design.tool.position
    words = " ".join(repr(float(value)) for value in at)
    lines = page.one(id="commands").text.splitlines()
    told = [line for line in lines if line.startswith(("explorer forces", "explorer accuracy"))]
    assert len(told) == 2
    assert all(f"--position {words} " in line and line.endswith("--at tool") for line in told)
