"""The measures of the catalogue, against the functions that compute them, samples and laws."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from limited_designs import limited, ordinary_case, scaled_design, troubled_case
from machines import PRECISE

from explorer.legs.clearance import PAIRS, leg_clearances
from explorer.measures.catalogue import CATALOGUE, Measurements, measure_design, measures_in
from explorer.measures.measure import Case
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import LENGTHS, Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.optimise.defaults import make_problem
from explorer.optimise.outcome import GOALS
from explorer.optimise.problem import OBJECTIVES, YAW, ObjectiveName
from explorer.optimise.search.model import SearchModel, reported_objective
from explorer.workspace.extremes import extent_of, least_margins
from explorer.workspace.least_clearance import least_clearances
from explorer.workspace.slices.volume import workspace_volume
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]
EXTREMES = [*(f"exact_extent_{axis}" for axis in "xyz"), "least_margin"]
CASES = (OPTIMAL, *(ordinary_case(seed)[0] for seed in range(2)))
each_case = pytest.mark.parametrize("design", CASES, ids=range(len(CASES)))


def compared(design: Design) -> Measurements:
    """Return the measures that Compare lists."""
    return measure_design(Case(design), measures_in("compare"))


def test_measures_at_a_pose_are_of_its_orientation_but_those_of_home_are_not() -> None:
    pose = Pose.of_yaw_pitch_roll((9.0, 4.0, 8.0), (-60.0, 5.0, 2.0))
    compare, report = measures_in("compare"), measures_in("report")
    names = dict.fromkeys((*compare, *report, "worst_margin", "accessible_volume"))
    of_home = [name for name in names if "home" in CATALOGUE[name].label]
    assert {"orientation_share", "home_tilt", "home_load_share", "yaw"} < {*of_home}
    turned = msgspec.structs.replace(PRECISE, home=pose)
    assert turned.home_pose == pose
    at_pose = measure_design(Case(PRECISE, pose=pose), names)
    assert at_pose["volume"] == workspace_volume(PRECISE, pose.rotation).volume
    elsewhere = [name for name in names if name not in (*of_home, "accessible_volume")]
    own = measure_design(Case(turned), elsewhere)
    assert own.values == pytest.approx({name: at_pose[name] for name in own.values}, rel=1e-12)
    at_home = measure_design(Case(PRECISE), of_home)
    assert all(at_home[name] == pytest.approx(at_pose[name], rel=1e-12) for name in of_home)


def test_extremes_of_separate_parts_are_those_of_each_part() -> None:
    design = limited(OPTIMAL, margin=None, box=((0.0, -12.0, -3.0), (20.0, 22.0, 18.0)))
    r = design.home_pose.rotation
    assert np.array(extent_of(Workspace(design, r))) == pytest.approx(
        np.array(design.limits.box), abs=1e-9
    )
    least = least_margins(Workspace(design, r))
    assert least is not None
    assert least.tolist() == [0.0, 0.0, 0.0]
    # At a yaw |δ2| is |z sin(yaw)|, the others are |z|.
    height = 0.5 / abs(r[1, 0])
    expected = np.array([height, 0.5, height])
    assert least_margins(Workspace(limited(design, margin=0.5), r)) == pytest.approx(expected)


@pytest.mark.parametrize("seed", range(8))
def test_least_clearance_alone_equals_that_of_all_pairs(seed: int) -> None:
    design, rotation = ordinary_case(seed) if seed % 2 else troubled_case(seed)
    radii = np.random.default_rng(seed).uniform(0.0, 0.05, 4) * design.reach
    design, tolerance = limited(design, leg_radii=tuple(radii.tolist())), 1e-3 * design.reach
    full = least_clearances(Workspace(design, rotation), tolerance)
    least = least_clearances(Workspace(design, rotation), tolerance, only_least=True)
    one, other = float(full.clearance.min()), float(least.clearance.min())
    if math.isinf(one):
        assert math.isinf(other)
        return
    assert other == pytest.approx(one, abs=1.001 * tolerance)
    assert (least.bound <= full.clearance + 1e-12 * design.reach).all()
    pair = int(least.clearance.argmin())
    r = design.home_pose.rotation if rotation is None else rotation
    own = leg_clearances(Configuration(design, least.position[pair], r))
    assert own.clearance[pair] == pytest.approx(other, abs=2e-9 * design.reach)


def test_clearance_beyond_counts_off_singular_planes_only() -> None:
    case = Case(OPTIMAL, margin=0.05 * OPTIMAL.reach)
    clearance, pair = case.clearance
    assert Case(OPTIMAL).clearance == case.clearance
    full = least_clearances(Workspace(limited(OPTIMAL, margin=case.margin)))
    assert clearance == pytest.approx(full.clearance.min(), abs=1e-3 * OPTIMAL.reach)
    assert pair == PAIRS[int(full.clearance.argmin())]
    assert np.isnan(Case(OPTIMAL, margin=100.0).clearance[0])


@pytest.mark.parametrize("factor", [1e-6, 1e3])
def test_measures_of_scaled_design_have_their_power_of_length(factor: float) -> None:
    design = ordinary_case(0)[0]
    one, other = compared(design), compared(scaled_design(design, factor))
    for name, small in one.values.items():
        measure, large = CATALOGUE[name], other[name]
        assert small is not None
        # A grid may have a node more or less where one lies on the surface.
        near = 1e-6 if name not in ("node_count", "node_volume") else 0.02
        tiny = 1e-9 * design.reach * factor**measure.power
        assert large == pytest.approx(small * factor**measure.power, rel=near, abs=tiny), name


@pytest.mark.parametrize("seed", range(8))
def test_measures_of_troubled_designs_are_finite_or_none(seed: int) -> None:
    found = compared(troubled_case(seed)[0])
    assert bool(found["volume"]) != bool(found.empty_because)
    assert all(value is None or math.isfinite(value) for value in found.values.values())
    if not found["volume"]:
        assert found["mean_inverse_condition"] is found["clear_share"] is None


def test_measures_of_empty_workspace_are_none_with_reasons() -> None:
    found = compared(limited(OPTIMAL, l1=(1.0, 2.0), l4=(1.0, 2.0)))
    assert found["volume"] == 0.0
    assert {"l1 maximum", "l4 maximum"} & {*found.empty_because}
    for name in (*EXTREMES, "mean_margin", "least_clearance"):
        assert found[name] is None


def test_margins_of_parallel_lines_at_home_are_zero() -> None:
    home = Pose(OPTIMAL.home_pose.position, (1.0, 0.0, 0.0, 0.0))
    found = compared(msgspec.structs.replace(limited(OPTIMAL, margin=None), home=home))
    assert found["home_margin"] == found["least_margin"] == found["mean_margin"] == 0.0
    assert found["inverse_condition"] == pytest.approx(0.0, abs=1e-12)
    assert found["volume"]


def test_measures_of_too_fine_grid_lack_nodes_only() -> None:
    found = compared(msgspec.structs.replace(OPTIMAL, node_step=1e-4))
    assert found["node_count"] is found["node_volume"] is found["node_step"] is None
    assert found["volume"] == workspace_volume(OPTIMAL).volume
    assert found["exact_extent_x"] is not None


def test_reach_and_longest_leg_are_two_measures_where_lengths_are_fixed() -> None:
    design = ordinary_case(1)[0]
    labels = [measure.label for measure in CATALOGUE.values()]
    assert len({*labels}) == len(labels)
    reach, longest = CATALOGUE["reach"], CATALOGUE["longest_leg"]
    fixed = [getattr(design.limits, name)[1] or 0.0 for name in LENGTHS]
    assert reach.function(Case(design)) == np.hypot(*design.a3)
    assert longest.function(Case(design)) == max(fixed) != reach.function(Case(design))
    tied = limited(design, **dict.fromkeys(LENGTHS, (0.0, None)))
    assert longest.function(Case(tied)) == reach.function(Case(tied)) == design.reach


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_objective_of_a_search_is_the_measure_that_it_is_named_after(
    objective: ObjectiveName,
) -> None:
    design = ordinary_case(0)[0]
    if objective == "smallest-reach":
        design = limited(design, **dict.fromkeys(LENGTHS, (0.0, None)))
    problem = make_problem(design, objective, volume=5.0, free=(YAW,))
    model = SearchModel(problem, problem.start_values)
    state = model.at(model.start).state
    value = CATALOGUE[GOALS[objective]].function(Case(state.design))
    expected = abs(1.0 - value / 5.0) if objective == "match-volume" else value
    assert reported_objective(problem, state) == pytest.approx(expected, rel=1e-9)
