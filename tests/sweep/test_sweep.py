"""Studies: read strictly, sampled as a function of the index, measured as the explorer measures."""

from __future__ import annotations

import json
import math
from functools import partial
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays
from limited_designs import ordinary_case
from refusals import refusal

from explorer import (
    PRESETS,
    InputError,
    Limits,
    accessible_workspace,
    leg_clearances,
    margins,
    workspace_volume,
)
from explorer.measures.catalogue import measures_in
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import DEGENERATE_RATIO, VARIABLES
from explorer.mechanism.machine import Actuators, Payload, Tool
from explorer.sweep.machine import MACHINE
from explorer.sweep.results import front, undominated_rows
from explorer.sweep.rows import Value, check_study, design_of, evaluate, samples
from explorer.sweep.study import (
    NAMES,
    STUDIES,
    Method,
    Objective,
    Sampling,
    Study,
    decode_study,
    encode_study,
    load_study,
    study_hash,
)
from explorer.workspace.least_clearance import node_measures
from explorer.workspace.limits.valid_poses import violations
from explorer.workspace.workspace import Workspace

MEASURES = measures_in("studies")
OPTIMAL = PRESETS["paper-optimal"]
# Size of a3y up to which every pose of that design is singular.
DEGENERATE = DEGENERATE_RATIO * max(map(abs, OPTIMAL.variables))
PLAIN: dict[str, Any] = {
    "schema": 1,
    "design": "paper-optimal",
    "variables": {"a3y": [4, 8], "yaw": [-80, -60], "radius": [0, 0.3]},
    "sampling": {"method": "sobol", "count": 40, "seed": 2},
    "measures": ["volume", "reach", "clearance"],
}


def decoded(**changes: Any) -> Study:
    return decode_study(json.dumps({**PLAIN, **changes}).encode(), "study.json")


def columns(study: Study, start: int, stop: int) -> dict[str, list[Value]]:
    return evaluate(encode_study(study), start, stop).columns


def sampled(method: Method, count: Any, seed: int = 0, **changes: Any) -> Study:
    return decoded(sampling={"method": method, "count": count, "seed": seed}, **changes)


def test_study_encoded_and_decoded_is_unchanged() -> None:
    study = decoded(clearance_margin=0.5)
    again = decode_study(encode_study(study), "again")
    assert again == study
    assert study_hash(again) == study_hash(study) != study_hash(decoded(chunk=65))
    assert study.base.home == OPTIMAL.home_pose
    assert [*study.variables] == ["a3y", "yaw", "radius"]
    # So it is of one that is made in Python, whose design is checked too.
    made = Study(
        design=OPTIMAL,
        variables={"b2": (1.0, 2.0)},
        sampling=Sampling(count=4),
    )
    assert decode_study(encode_study(made), "it") == made
    with pytest.raises(InputError, match="no preset"):
        Study(design="nothing", variables={"b2": (1.0, 2.0)}, sampling=Sampling(count=4))


def test_packaged_studies_can_be_run_and_no_variable_is_a_measure() -> None:
    assert not {*NAMES} & ({*MEASURES} - {"reach"})
    for name, study in STUDIES.items():
        assert load_study(name) is study
        check_study(study)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"variables": {"a4": [1, 2]}}, "no variable 'a4'; there are a3x"),
        ({"variables": {}}, "must name at least one of"),
        ({"variables": {"a3y": [4, 4]}}, "the range of a3y is empty: 4 to 4"),
        ({"variables": {"radius": [-1, 1]}}, "must not be negative"),
        ({"variables": {"payload_mass": [-1, 1]}}, "must not be negative; its range starts at -1"),
        ({"variables": {"actuator_limit": [0, 1]}}, "must be positive; its range starts at 0"),
        ({"variables": {"guide_moment": [-2, 1]}}, "must be positive; its range starts at -2"),
        ({"variables": {"reach": [0, 1]}}, "above every minimum length"),
        ({"sampling": {"method": "sobol", "count": 0}}, "sampling.count must lie within 1 to"),
        ({"sampling": {"method": "sobol", "count": 8, "seed": -1}}, "sampling.seed"),
        ({"sampling": {"method": "sobol", "count": {"a3y": 2}}}, "only a grid takes one for each"),
        ({"sampling": {"method": "grid", "count": {"a3y": 2}}}, "must name the variables"),
        ({"sampling": {"method": "grid", "count": 10_000_000}}, "the grid has 1e+21 designs"),
        ({"sampling": {"method": "latin-hypercube", "count": 2_000_000}}, "take sobol for more"),
        ({"sampling": {"method": "random", "count": 8}}, "Invalid enum value 'random'"),
        ({"measures": ["mass"]}, "no measure 'mass'; there are volume"),
        ({"measures": ["volume", "volume"]}, "may name each once"),
        ({"objectives": [{"measure": "mass", "sense": "min"}]}, "neither measured nor a variable"),
        ({"variables": {"reach": [9, 12]}, "measures": ["reach"]}, "leave it out of the measures"),
        ({"polish": {"objective": "largest-volume"}}, "polish is unknown"),
        ({"chunk": 0}, "chunk must lie within 1"),
        ({"clearance_margin": -1}, "clearance_margin must be positive"),
        ({"design": "paper"}, "no preset 'paper'"),
        *(({"name": name}, "one printable line") for name in ("two\nlines", "", "  ", "..")),
        ({"schema": 2}, "schema"),
        ({"colour": "red"}, "colour is unknown"),
    ],
)
def test_study_with_bad_field_is_refused_in_one_line(changes: dict[str, Any], words: str) -> None:
    message = refusal(partial(decoded, **changes))
    assert words in message
    assert message.startswith("study.json: ")


@pytest.mark.parametrize(
    "data", [b"", b"[]", b'{"a": NaN}', b"\xff", b"[" * 100_000, b"{}", b" " * 2_000_000]
)
def test_data_of_no_study_are_refused_in_one_line(data: bytes) -> None:
    assert refusal(decode_study, data, "study").startswith("study: ")


def test_study_without_any_valid_design_is_refused() -> None:
    flat = {"a3y": [-0.5 * DEGENERATE, 0.5 * DEGENERATE]}
    for count, words in ((64, "the"), (2**30, "256")):
        study = sampled("sobol", count, variables=flat)
        with pytest.raises(InputError, match=f"none of {words} designs all over.*degenerate"):
            check_study(study)


@pytest.mark.parametrize("method", ["grid", "sobol", "latin-hypercube"])
@pytest.mark.parametrize(("order", "many"), [(1, 2), (-1, 3), (1, 16)])
def test_study_with_few_valid_designs_is_accepted(method: Method, order: int, many: int) -> None:
    # Only near its upper end is a3y not too small.
    most = DEGENERATE / (1.0 - 0.5 / many)
    variables = [("a3y", [0.0, most]), ("b1x", [2.0, 6.0])][::order]
    study = sampled(
        method,
        {"a3y": many, "b1x": 256} if method == "grid" else 256 * many,
        variables=dict(variables),
        measures=["volume"],
    )
    check_study(study)


@pytest.mark.parametrize("method", ["sobol", "latin-hypercube", "grid"])
@given(seed=st.integers(0, 2**31 - 1), size=st.integers(5, 40), count=st.integers(1, 200))
def test_samples_by_chunks_equal_all_at_once(
    method: Method, seed: int, size: int, count: int
) -> None:
    shape = {"a3y": 7, "yaw": 1, "radius": 5} if method == "grid" else count
    study = sampled(method, shape, seed, chunk=size)
    whole = samples(study, range(study.count))
    parts = [samples(study, study.rows_of(chunk)) for chunk in range(study.chunks)]
    assert np.array_equal(np.vstack(parts), whole)
    ends = np.array(list(study.variables.values()))
    assert (whole >= ends[:, 0]).all()
    assert (whole <= ends[:, 1]).all()


def test_sobol_samples_match_scipy() -> None:
    from scipy.stats import qmc

    study = sampled("sobol", 64, 9)
    # Those of the last chunk need no others.
    large = sampled("sobol", 2**26 - 1)
    assert samples(large, large.rows_of(large.chunks - 1)).shape == (63, 3)
    ends = np.array(list(study.variables.values()))
    expected = qmc.scale(qmc.Sobol(3, rng=9).random(64), ends[:, 0], ends[:, 1])
    assert samples(study, range(64)) == pytest.approx(expected, rel=1e-15)


def test_grid_has_every_combination_once() -> None:
    study = sampled("grid", {"radius": 3, "a3y": 5, "yaw": 1})
    found = samples(study, range(study.count))
    assert study.count == 15
    expected = {
        (a3y, -70.0, radius) for a3y in (4.0, 5.0, 6.0, 7.0, 8.0) for radius in (0.0, 0.15, 0.3)
    }
    assert {tuple(row) for row in found.tolist()} == expected


def test_design_of_values_has_these_values() -> None:
    values = {"a3x": 17.0, "b2": 2.0, "yaw": -65.0, "reach": 15.0, "radius": 0.2}
    study = decoded(
        variables={
            name: [value - 1, value + 1] for name, value in values.items() if name != "radius"
        }
        | {"radius": [0, 1]},
        measures=["volume"],
    )
    design = design_of(study, values, "it")
    assert design.name == "it"
    assert dict(zip(VARIABLES, design.variables, strict=True)) == {
        **dict(zip(VARIABLES, OPTIMAL.variables, strict=True)),
        "a3x": 17.0,
        "b2": 2.0,
    }
    home = design.home_pose
    assert home.position == OPTIMAL.home_pose.position
    assert math.degrees(math.atan2(home.rotation[1, 0], home.rotation[0, 0])) == pytest.approx(-65)
    assert design.limits.leg_radii == (0.2,) * 4
    assert all(design.length_range(name)[1] == 15.0 for name in ("l1", "d2", "d4", "l4"))


def nodes_of(design: Any, rotation: Any, count: int) -> Any:
    """Return the middles of the cells of a box that is measured by sampling, not asked for."""
    from explorer.workspace.limits.region import region_of

    lows, highs = region_of(Workspace(design, rotation).limits).ends
    axes = [
        low + (high - low) * (np.arange(count) + 0.5) / count
        for low, high in zip(lows, highs, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.mark.parametrize("seed", range(4))
def test_node_measures_match_each_position(seed: int) -> None:
    design, rotation = ordinary_case(seed)
    design = design.with_limits(leg_radii=(0.3, 0.2, 0.1, 0.4))
    margin = 0.5
    found = node_measures(Workspace(design, rotation), nodes=9, clearance_margin=margin)
    nodes = nodes_of(design, rotation, 9)
    broken = violations(Configuration(design.with_limits(leg_radii=(0.0,) * 4), nodes, rotation))
    kept = nodes[[not each for each in broken]]
    assert len(kept)
    assert found.positions == pytest.approx(kept, rel=1e-12)
    distances = np.abs(margins(kept, rotation))
    clear = leg_clearances(Configuration(design, kept, rotation)).clearance
    assert found.extent == pytest.approx(np.ptp(kept, axis=0), abs=1e-12)
    assert found.margins == pytest.approx(distances.min(axis=0), rel=1e-12)
    assert found.mean_margin == pytest.approx(distances.min(axis=1).mean(), rel=1e-12)
    assert found.clear_share == (clear > 0.0).all(axis=1).mean()
    off = (distances >= margin).all(axis=1)
    expected = clear[off].min(axis=0) if off.any() else np.full(6, math.inf)
    assert found.clearances == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_measures_of_a_row_match_the_public_functions() -> None:
    study = decoded(
        measures=list(MEASURES), variables={"a3y": [5, 8], "b3": [4, 6], "radius": [0, 0.05]}
    )
    rows = columns(study, 3, 4)
    values = {name: rows[name][0] for name in study.variables}
    design = design_of(study, values)  # pyright: ignore[reportArgumentType]
    found = {name: rows[name][0] for name in MEASURES}
    home = design.home_pose
    assert rows["status"][0] == "done"
    assert found["volume"] == workspace_volume(design).volume
    assert found["reach"] == design.reach
    nodes = node_measures(Workspace(design), clearance_margin=0.05 * design.reach)
    assert found["clearance"] == min(nodes.clearances)
    assert found["clearance_24"] == nodes.clearances[4]
    assert found["margin_2"] == nodes.margins[1]
    assert found["worst_margin"] == min(nodes.margins)
    assert found["extent_z"] == nodes.extent[2]
    at_nodes = Configuration(design, nodes.positions, home.rotation).inverse_condition
    assert found["worst_inverse_condition"] == pytest.approx(at_nodes.min())
    assert found["mean_inverse_condition"] == pytest.approx(at_nodes.mean())
    at_home = Configuration(design, home.position, home.rotation).inverse_condition
    assert found["inverse_condition"] == pytest.approx(float(at_home))
    assert found["accessible_volume"] == accessible_workspace(design).accessible_volume
    # The nodes see no less than there is.
    assert isinstance(found["least_clearance"], float)
    assert found["least_clearance"] <= min(nodes.clearances) + 1e-3 * design.reach


MACHINE_RANGES = {
    "payload_mass": [0.2, 2],
    "payload_force": [1, 20],
    "actuator_limit": [50, 400],
    "strut_limit": [2, 30],
    "guide_force": [50, 400],
    "guide_moment": [2, 30],
    "tool_x": [-2, 2],
    "tool_y": [-2, 2],
    "tool_z": [0, 4],
}


def test_limits_of_a_study_replace_both_sides_of_the_design() -> None:
    own = Actuators(push_n=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0), pull_n=(9.0, 8.0, 7.0, 6.0, 5.0, 4.0))
    study = decoded(variables={"actuator_limit": [50, 400]}, measures=["volume"])
    study = msgspec.structs.replace(
        study, design=msgspec.structs.replace(study.base, actuators=own)
    )
    push, pull = design_of(study, {"actuator_limit": 70.0}).actuators.limits
    assert push.tolist() == pull.tolist() == [70.0] * 6
    assert MACHINE["actuator_limit"].value_in(study.base) == 1.0


def test_payload_of_a_study_without_a_mass_has_no_inertia() -> None:
    body = Payload(1.0, inertia_kg_mm2=(3.0, 4.0, 5.0))
    design = msgspec.structs.replace(OPTIMAL, payload=body)
    assert MACHINE["payload_mass"].with_value(design, 2.0).payload == body.with_mass(2.0)
    assert MACHINE["payload_mass"].with_value(design, 0.0).payload == Payload()


@pytest.mark.parametrize("name", [*MACHINE])
def test_machine_variable_is_read_as_it_is_set(name: str) -> None:
    design = msgspec.structs.replace(OPTIMAL, tool=Tool((1.0, 2.0, 3.0)))
    changed = MACHINE[name].with_value(design, 2.5)
    assert MACHINE[name].value_in(changed) == 2.5
    others = [other for other in MACHINE if other != name]
    assert [MACHINE[other].value_in(changed) for other in others] == [
        MACHINE[other].value_in(design) for other in others
    ]
    assert changed.variables == design.variables
    assert MACHINE[name].value_in(OPTIMAL) is None


def test_measures_of_a_machine_that_no_design_has_are_refused() -> None:
    study = decoded(measures=["volume", "home_load_share", "home_worst_error"])
    assert refusal(check_study, study) == (
        "the designs of the study have no payload or force at the tool, which is needed for load "
        "share at home; no limit of actuators, struts or guide, which is needed for load share at "
        "home; no errors of the actuators, which is needed for worst error at home"
    )
    check_study(decoded(variables=MACHINE_RANGES, measures=["home_load_share"]))


def test_row_without_a_payload_says_what_it_lacks() -> None:
    study = sampled(
        "grid", 2, variables={"payload_mass": [0, 1]}, measures=["volume", "home_largest_bending"]
    )
    rows = columns(study, 0, 2)
    assert rows["status"] == ["done"] * 2
    assert rows["home_largest_bending"][0] is None
    assert "it has no payload or force at the tool" in str(rows["reason"][0])
    assert isinstance(rows["home_largest_bending"][1], float)
    assert rows["reason"][1] == ""


def test_empty_workspace_is_a_row_with_a_reason() -> None:
    limits = Limits(box=((100.0, 100.0, 100.0), (101.0, 101.0, 101.0)))
    study = decoded(measures=list(MEASURES))
    study = msgspec.structs.replace(
        study, design=msgspec.structs.replace(study.base, limits=limits)
    )
    rows = columns(study, 0, 2)
    assert rows["status"] == ["empty workspace"] * 2
    assert "box" in str(rows["reason"][0])
    assert rows["volume"] == [0.0, 0.0]
    assert rows["accessible_volume"] == [0.0, 0.0]
    assert isinstance(rows["reach"][0], float)
    assert rows["clearance"] == rows["mean_margin"] == rows["least_clearance"] == [None, None]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"clearance_margin": 50}, "no node is so far from the singular planes"),
        ({"measures": ["least_clearance"], "clearance_margin": 50}, "no position is so far"),
        ({"measures": ["clearance_24"], "design": "joined"}, "legs 2 and 4 share a joint"),
        ({"nodes": 2, "design": "slit"}, "none of 2 nodes an axis lies in the workspace"),
    ],
)
def test_row_without_a_measure_has_a_reason(changes: dict[str, Any], words: str) -> None:
    designs = {
        "slit": msgspec.structs.replace(OPTIMAL, limits=Limits(margin=14.0)),
        "joined": OPTIMAL.with_variables([*OPTIMAL.variables[:4], 0.0, OPTIMAL.b3]),
    }
    base = designs.get(changes.pop("design", ""), OPTIMAL)
    study = decoded(variables={"a3y": [6.9, 7.1]}, **changes)
    study = msgspec.structs.replace(study, design=base)
    rows = columns(study, 0, 1)
    assert rows["status"] == ["done"]
    assert words in str(rows["reason"][0])
    assert any(rows[name] == [None] for name in study.measures)


def test_invalid_design_or_home_that_collides_is_a_row_with_a_reason() -> None:
    study = sampled("grid", 3, variables={"a3y": [-2, 2]}, measures=["volume"])
    rows = columns(study, 0, 3)
    assert rows["status"] == ["done", "invalid design", "done"]
    assert "degenerate design: a3y = 0" in str(rows["reason"][1])
    assert rows["a3y"] == [-2.0, 0.0, 2.0]
    assert rows["volume"][1] is None
    study = sampled("grid", 2, variables={"radius": [0, 3]}, measures=["accessible_volume"])
    rows = columns(study, 0, 2)
    assert rows["accessible_volume"][1] is None
    assert rows["reason"][0] == ""
    assert "legs" in str(rows["reason"][1])


@given(
    arrays(
        np.float64,
        st.tuples(st.integers(0, 40), st.integers(1, 4)),
        elements=st.integers(0, 4).map(float),
    )
)
def test_undominated_rows_match_the_definition(cost: Any) -> None:
    expected = [
        row
        for row in range(len(cost))
        if not any((other <= cost[row]).all() and (other < cost[row]).any() for other in cost)
    ]
    assert undominated_rows(cost).tolist() == expected


def test_front_has_only_complete_rows_that_are_done() -> None:
    table = {
        "volume": np.array([5.0, 9.0, np.nan, 5.0, 4.0]),
        "reach": np.array([2.0, 1.0, 0.0, 2.0, 3.0]),
        "status": np.array(["done", "failed", "done", "done", "done"], dtype=object),
    }
    objectives = (Objective("volume", "max"), Objective("reach", "min"))
    assert front(table, objectives).tolist() == [True, False, False, True, False]
    assert front(table, (Objective("reach", "max"),)).tolist() == [False] * 4 + [True]
