"""The report's page of loads: true to statics, and absent without a machine."""

from __future__ import annotations

import datetime as dt
from functools import cache

import msgspec
import numpy as np
import pytest
from limited_designs import ordinary_case
from report_page import Node, read, table_of

import explorer
from explorer import Actuators, Design, Guide, Payload, Pose, Struts, Tool
from explorer.app.features.sharing.reporting import make_report
from explorer.export.report.data import gather_report_data
from explorer.export.report.loads import ReportLoads
from explorer.measures.case import Case
from explorer.mechanism.design import JOINTS
from explorer.numerics.arrays import FloatArray
from explorer.statics.reactions import LIMITED, PART_NAMES
from explorer.statics.weights import design_weights
from explorer.workspace.held import held_workspace

OPTIMAL = explorer.PRESETS["paper-optimal"]
ZERO = np.zeros(6)


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


def reactions_at_home(design: Design) -> explorer.Reactions:
    home = explorer.home_pose(design)
    weights = design_weights(design)
    tool = design.tool.position
    return explorer.reactions(design, home.position, home.rotation, ZERO, tool, weights)


@pytest.mark.parametrize("seed", range(2))
def test_report_loads_tables_hold_reactions_and_shares(seed: int) -> None:
    design = loaded_case(seed)
    page, held = loaded_page(seed), reactions_at_home(design)
    shares = explorer.limit_shares(design, held)
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
            # The share is that of the row's own numbers.
            assert found[3] == pytest.approx(100.0 * (weight + force) / limit, rel=1e-12)
            assert f" {k + 2}" in parts[place + k].text


@pytest.mark.parametrize("seed", range(2))
def test_report_loads_largest_payload_and_force_are_those_of_statics(seed: int) -> None:
    design = loaded_case(seed)
    home = explorer.home_pose(design)
    given = design, home.position, home.rotation
    tool = design.tool.position
    rows = table_of(loaded_page(seed), "Most that is held")
    payload = explorer.largest_payload(*given, tool=tool)
    assert rows["payload"].values == [float(payload)]
    # In its worst direction the force takes a part to its limit, without a payload.
    force = rows["force in every direction"].values[0]
    direction = np.array(rows["its worst direction"].values)
    bare = msgspec.structs.replace(design, payload=Payload())
    held = explorer.reactions(*given, [*(force * direction), 0.0, 0.0, 0.0], tool)
    shares = explorer.limit_shares(bare, held._replace(spread=np.zeros(12)))
    assert shares.max() == pytest.approx(1.0, rel=1e-9)
    assert PART_NAMES[int(shares.argmax())] in rows["its worst direction"].text
    # The actuators alone hold no less.
    most = explorer.largest_force(*given, np.minimum(*design.actuators.limits), tool)
    assert force <= float(most) * (1.0 + 1e-12)


@pytest.mark.parametrize("seed", range(2))
def test_worst_payload_force_uses_the_share_of_any_direction(seed: int) -> None:
    design = loaded_case(seed)
    loads = ReportLoads(Case(design))
    worst = loads.worst_payload_force
    assert worst.share == pytest.approx(loads.loaded.share, rel=1e-9)
    # No sampled direction asks more, and the nearest of many asks nearly as much.
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(20_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    force = design.payload.force_n
    plain = msgspec.structs.replace(
        design, payload=msgspec.structs.replace(design.payload, force_n=0.0)
    )
    shares = _shares_under(plain, force * directions)
    assert shares.max() <= worst.share * (1.0 + 1e-9)
    assert shares.max() == pytest.approx(worst.share, rel=0.01)
    here = _shares_under(plain, force * worst.direction[None])[0]
    assert here.max() == pytest.approx(worst.share, rel=1e-9)
    assert LIMITED[int(here.argmax())] == LIMITED[worst.part]


def _shares_under(design: Design, forces: FloatArray) -> FloatArray:
    """Return the shares of limits at home under forces (n, 3) at the tool, shape (n, 12)."""
    home, load = explorer.home_pose(design), np.zeros((len(forces), 6))
    load[:, :3] = forces
    tool, weights = design.tool.position, design_weights(design)
    held = explorer.reactions(design, home.position, home.rotation, load, tool, weights)
    return explorer.limit_shares(design, held)


def test_report_loads_volume_is_that_of_held_workspace_beside_the_whole() -> None:
    design = loaded_case(1)
    page, rotation = loaded_page(1), explorer.home_pose(design).rotation
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
    page, home = page_of(design), explorer.home_pose(design)
    assert table_of(page, "Forces of the actuators")["d1"].values == [100.0, 100.0]
    payload = float(explorer.largest_payload(design, home.position, home.rotation))
    assert table_of(page, "Most that is held")["payload"].values == [payload]
    assert "Where the payload is held" not in titles(page)
    assert "share of its limit" not in page.text
    design = msgspec.structs.replace(OPTIMAL, payload=Payload(1.0))
    page, held = page_of(design), reactions_at_home(design)
    forces = table_of(page, "Forces of the actuators")
    assert [forces[name].values for name in JOINTS] == [[float(f)] for f in held.actuators]
    assert "Most that is held" not in page.text
    assert "share of its limit" not in page.text


def test_report_without_a_machine_has_no_loads() -> None:
    for design in (OPTIMAL, msgspec.structs.replace(OPTIMAL, gravity=(1.0, 0.0, 0.0))):
        assert gather_report_data(design).loads is None
        page = page_of(design)
        assert "Loads" not in titles(page)
        assert "explorer forces" not in page.text


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
    held = held_workspace(design, explorer.home_pose(design).rotation)
    assert held.best is not None
    assert held.factor is not None
    assert "The payload is not held in its" in page.text
    (note,) = (each for each in page.all("p") if "No position of the workspace" in each.text)
    assert note.values == [*held.best.tolist(), 100.0 * held.factor]


def test_report_of_a_singular_pose_says_that_nothing_holds_a_load() -> None:
    design = loaded_case(1)
    level = Pose((10.0, 5.0, 9.0), (1.0, 0.0, 0.0, 0.0))
    page = page_of(design, level)
    assert not ReportLoads(Case(design, pose=level)).loaded.is_regular
    assert "no finite forces hold a load" in page.text
    (section,) = (each for each in page.all("section") if next(each.all("h2")).text == "Loads")
    assert "infinite" not in section.text
