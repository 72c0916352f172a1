"""The budget of tolerances: exact costs, the least effort by another solver, extreme designs."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refusal
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation
from statics_cases import random_poses

from explorer import PRESETS, Actuators, Design, NoAnswerError, Tolerances
from explorer.measures.box import positions_over
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import (
    SOURCES,
    error_by_source,
    largest_error,
    rms_of_sources,
    source_errors,
)
from explorer.statics.budget import (
    IS_TILT,
    error_lengths,
    source_costs,
    source_influences,
    tolerance_budget,
    with_tolerances,
)

OPTIMAL = PRESETS["paper-optimal"]
HOME = OPTIMAL.home_pose
TOOL = (0.5, -0.3, 1.5)
BOX: tuple[Triple, Triple] = (8.0, 3.0, 7.0), (12.0, 7.0, 11.0)
EACH: Triple = (0.1, 0.2, 0.15)
STATED = msgspec.structs.replace(
    OPTIMAL,
    actuators=Actuators(error_mm=(0.01, 0.02, 0.01, 0.02, 0.01, 0.03)),
    tolerances=Tolerances(EACH, EACH, EACH, (0.1, 0.05), EACH, EACH, EACH, EACH),
)


def box_positions() -> FloatArray:
    return positions_over(OPTIMAL, "box", HOME, BOX)


def as_errors(design: Design, tolerances: FloatArray) -> FloatArray:
    """Return tolerances in mm and degrees as errors in design units and radians."""
    finite = np.where(np.isfinite(tolerances), tolerances, 0.0)
    return np.where(IS_TILT, np.radians(finite), finite / design.unit_mm)


def test_costs_are_those_of_the_worst_position_in_mm_and_degrees() -> None:
    positions = box_positions()
    costs = source_costs(Configuration(STATED, positions, HOME.rotation, TOOL))
    by_source = error_by_source(Configuration(STATED, positions, HOME.rotation, TOOL))
    bounds = source_errors(STATED)
    worst, rms = largest_error(by_source, bounds), rms_of_sources(by_source, bounds)
    place = int(worst.displacement.argmax())
    assert costs.worst_displacement == pytest.approx(10.0 * float(worst.displacement.max()))
    assert costs.worst_turn == pytest.approx(float(np.degrees(worst.turn.max())))
    assert costs.rms_displacement == pytest.approx(10.0 * float(rms.displacement.max()))
    assert costs.rms_turn == pytest.approx(float(np.degrees(rms.turn.max())))
    assert_allclose(costs.position, positions[place])
    # Each error alone, as the design states it.
    moved = 10.0 * np.linalg.norm(by_source[:, :3] * bounds, axis=1).max(axis=0)
    turned = np.degrees(np.linalg.norm(by_source[:, 3:] * bounds, axis=1).max(axis=0))
    assert_allclose(costs.displacement_within, moved, rtol=1e-12)
    assert_allclose(costs.turn_within, turned, rtol=1e-12)
    assert costs.shares.sum() == pytest.approx(1.0)
    assert costs.turn_shares.sum() == pytest.approx(1.0)
    # The part of a source is what the worst error lacks along its own direction without it.
    along = worst.vectors[place, 0] / worst.displacement[place]
    part = np.abs(along @ by_source[place, :3]) * bounds * 10.0
    assert_allclose(costs.shares * costs.worst_displacement, part, rtol=1e-9)
    ranked = costs.displacement_within[costs.ranking]
    assert (np.diff(ranked) <= 0.0).all()
    assert sorted(costs.ranking) == list(range(31))
    ideal = source_costs(Configuration(OPTIMAL, positions, HOME.rotation, TOOL))
    assert (ideal.worst_displacement, ideal.worst_turn, ideal.rms_turn) == (0.0, 0.0, 0.0)
    assert not ideal.shares.any()
    assert not ideal.displacement_within.any()
    assert_allclose(ideal.displacement, costs.displacement)
    by_length = (ideal.displacement / ideal.lengths)[ideal.ranking]
    assert (np.diff(by_length) <= 0.0).all()


@pytest.mark.parametrize(("wanted_turn", "keep"), [(None, False), (0.1, True), (0.005, False)])
def test_found_tolerances_keep_what_is_wanted_for_all_errors(
    wanted_turn: float | None, keep: bool
) -> None:
    design = msgspec.structs.replace(
        STATED, actuators=Actuators(error_mm=(1e-4, 2e-4, 1e-4, 2e-4, 1e-4, 3e-4))
    )
    positions = box_positions()
    given = design, positions, HOME.rotation
    found = tolerance_budget(Configuration(*given, TOOL), 0.05, wanted_turn, keep_actuators=keep)
    by_source = error_by_source(Configuration(*given, TOOL))
    bounds = as_errors(design, found.tolerances)
    worst = largest_error(by_source, bounds)
    displacement, turn = 10.0 * worst.displacement.max(), np.degrees(worst.turn.max())
    assert displacement <= 0.05
    assert wanted_turn is None or turn <= wanted_turn
    # What is wanted is used up but for the rounding to two digits.
    assert max(displacement / 0.05, turn / (wanted_turn or np.inf)) > 0.9
    assert found.costs.worst_displacement == pytest.approx(float(displacement))
    signs = np.sign(np.random.default_rng(5).normal(size=(500, 31)))
    moved = np.einsum("nij,cj->nci", by_source, signs * bounds)
    assert 10.0 * np.linalg.norm(moved[..., :3], axis=-1).max() <= 0.05
    assert found.effort >= found.least_effort > 0.0
    assert 0.0 <= found.excess < 0.1
    if keep:
        assert_allclose(found.tolerances[:6], design.actuators.error_mm)
    # Two digits each.
    for value in found.tolerances[6 * keep :].tolist():
        assert float(f"{value:.1e}") == value


def vertices_of(vectors: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return the signs of sums that are farthest in a direction, each once but for its opposite."""
    directions = rng.normal(size=(20_000, 3))
    signs = np.where(directions @ vectors >= 0.0, 1.0, -1.0)
    signs *= signs[:, :1]
    return np.unique(signs, axis=0)


def least_by_slsqp(
    shares: FloatArray, lengths: FloatArray, signs: list[FloatArray], start: FloatArray
) -> float:
    """Return the least Σ 1 / (t_i length_i) with |Σ ± t_i v_i| ≤ 1, by SLSQP over log t."""
    sums = np.concatenate(
        [
            each[:, None, :] * half
            for each, half in zip(signs, (shares[:3], shares[3:]), strict=True)
        ]
    )

    def effort(x: FloatArray) -> tuple[float, FloatArray]:
        values = np.exp(-x) / lengths / scale
        return float(values.sum()), -values

    def room(x: FloatArray) -> FloatArray:
        return 1.0 - ((sums @ np.exp(x)) ** 2).sum(axis=1)

    def room_slopes(x: FloatArray) -> FloatArray:
        t = np.exp(x)
        return -2.0 * np.einsum("ki,kij->kj", sums @ t, sums) * t

    scale = float((1.0 / (start * lengths)).sum())
    rooms: Any = {"type": "ineq", "fun": room, "jac": room_slopes}
    options: Any = {"maxiter": 500, "ftol": 1e-12}
    begin = np.log(0.5 * start)
    solved = minimize(effort, begin, jac=True, method="SLSQP", constraints=rooms, options=options)
    assert solved.success, solved.message
    assert room(solved.x).min() > -1e-7
    return scale * float(solved.fun)


@pytest.mark.parametrize(("seed", "wanted_turn"), [(0, None), (1, 0.05)])
def test_least_effort_is_that_of_slsqp_over_all_vertices(
    seed: int, wanted_turn: float | None
) -> None:
    positions, rotations = random_poses(OPTIMAL, 3, seed)
    given = OPTIMAL, positions[:1], rotations[0]
    found = tolerance_budget(Configuration(*given, TOOL), 0.05, wanted_turn)
    influences = source_influences(Configuration(*given, TOOL))[0]
    shares = influences / np.repeat([0.05, wanted_turn or np.inf], 3)[:, None]
    rng = np.random.default_rng(seed)
    signs = [vertices_of(half, rng) for half in (influences[:3], influences[3:])]
    if wanted_turn is None:
        signs[1] = signs[1][:0]
    least = least_by_slsqp(shares, error_lengths(OPTIMAL), signs, found.tolerances)
    assert found.least_effort == pytest.approx(least, rel=1e-4)


def test_no_other_tolerances_over_the_box_take_less_effort() -> None:
    positions = box_positions()
    found = tolerance_budget(Configuration(OPTIMAL, positions, HOME.rotation), 0.05, 0.05)
    shares = source_influences(Configuration(OPTIMAL, positions, HOME.rotation))
    shares = shares / np.repeat([0.05, 0.05], 3)[:, None]
    lengths, rng = error_lengths(OPTIMAL), np.random.default_rng(1)
    least: list[float] = []
    for size in np.repeat([1e-4, 1e-3, 1e-2, 0.1, 1.0], 4):
        tried = found.tolerances * np.exp(size * rng.normal(size=31))
        worst = largest_error(shares, tried)
        tried /= max(worst.displacement.max(), worst.turn.max())
        least.append(float((1.0 / (tried * lengths)).sum()))
    assert min(least) >= found.least_effort


@pytest.mark.parametrize(("unit", "larger"), [(1e-4, 1.0), (1e4, 1.0), (1.0, 1e-4), (1.0, 100.0)])
def test_tolerances_grow_with_the_machine_and_do_not_depend_on_its_unit(
    unit: float, larger: float
) -> None:
    design = msgspec.structs.replace(
        OPTIMAL.with_variables([unit * value for value in OPTIMAL.variables]),
        unit_mm=larger * OPTIMAL.unit_mm / unit,
        home=None,
    )
    positions = box_positions()
    at = Configuration(design, unit * positions, HOME.rotation)
    found = tolerance_budget(at, 0.05 * larger, 0.05)
    expected = tolerance_budget(Configuration(OPTIMAL, positions, HOME.rotation), 0.05, 0.05)
    sizes = np.where(IS_TILT, 1.0, larger)
    assert_allclose(found.tolerances, expected.tolerances * sizes, rtol=0.1)
    assert found.least_effort == pytest.approx(expected.least_effort / larger, rel=2e-6)


@pytest.mark.parametrize("seed", range(6))
def test_effort_is_near_its_lower_bound_for_any_design_in_any_pose(seed: int) -> None:
    rng = np.random.default_rng(seed)
    variables = 10.0 * rng.normal(size=6) * np.power(10.0, rng.uniform(-3.0, 0.0, 6))
    design = msgspec.structs.replace(OPTIMAL.with_variables(variables.tolist()), home=None)
    rotation = Rotation.random(random_state=rng).as_matrix()
    # Many of these are near a singular plane.
    position = design.reach * rng.normal(size=(1, 3)) * np.power(10.0, rng.uniform(-8.0, 1.0, 3))
    wanted, turn = 10.0 ** rng.uniform(-6.0, 6.0, 2)
    at = Configuration(design, position, rotation)
    found = tolerance_budget(at, wanted, turn if seed % 2 else None)
    assert found.costs.worst_displacement <= wanted
    assert seed % 2 == 0 or found.costs.worst_turn <= turn
    # Rounding down to two digits takes less than a tenth of each tolerance.
    assert 0.0 < found.excess < 0.11


def test_source_that_moves_nothing_takes_any_tolerance() -> None:
    # Leg 4 is perpendicular to an offset of a3 along y.
    position = np.array([[10.0, OPTIMAL.a3[1], 9.0]])
    found = tolerance_budget(Configuration(STATED, position, HOME.rotation), 0.05)
    any_one = np.flatnonzero(np.isinf(found.tolerances))
    # Without a wanted turn those of leg 1, which b4 does not depend on, are free too.
    leg_1 = ("l1", "a1x", "a1y", "a1z", "b1x", "b1y", "b1z")
    assert {SOURCES[index] for index in any_one} == {"a3y", *leg_1}
    kept = with_tolerances(STATED, found.tolerances)
    assert kept.tolerances.a3[1] == STATED.tolerances.a3[1]
    assert np.isfinite(found.effort)
    assert {*found.costs.ranking[-8:]} == {*any_one}
    worst = source_costs(Configuration(kept, position, HOME.rotation)).worst_displacement
    assert 0.045 < worst <= 0.05


def test_errors_of_kept_actuators_beyond_what_is_wanted_are_refused() -> None:
    given = STATED, box_positions(), HOME.rotation
    of_actuators = msgspec.structs.replace(STATED, tolerances=Tolerances())
    alone = source_costs(Configuration(of_actuators, *given[1:])).worst_displacement
    with pytest.raises(NoAnswerError, match=rf"up to {alone:.4g} mm.*{alone - 0.05:.3g} mm more"):
        tolerance_budget(Configuration(*given), 0.05, keep_actuators=True)
    with pytest.raises(NoAnswerError, match="turn the tool by up to"):
        tolerance_budget(Configuration(*given), 10.0, 0.001, keep_actuators=True)
    # A little more than the actuators' own part leaves a little for the dimensions.
    found = tolerance_budget(Configuration(*given), alone * (1.0 + 1e-6), keep_actuators=True)
    assert found.costs.worst_displacement <= alone * (1.0 + 1e-6)
    assert (found.tolerances > 0.0).all()
    # Exact actuators that are kept cost nothing.
    exact = msgspec.structs.replace(STATED, actuators=Actuators()), *given[1:]
    kept = tolerance_budget(Configuration(*exact), 0.05, keep_actuators=True)
    assert not kept.tolerances[:6].any()
    assert kept.effort < tolerance_budget(Configuration(*exact), 0.05).effort


def test_positions_about_a_singularity_have_no_budget() -> None:
    for z in (0.0, -1.0):
        positions = [[10.0, 5.0, 9.0], [10.0, 5.0, z]]
        words = "of the 2 positions .*δ3 = 0: b4 on the base plane"
        with pytest.raises(NoAnswerError, match=words):
            source_costs(Configuration(STATED, positions, HOME.rotation))
        with pytest.raises(NoAnswerError, match=words):
            tolerance_budget(Configuration(STATED, positions, HOME.rotation), 1.0)
    with pytest.raises(NoAnswerError, match="the pose is singular"):
        source_costs(Configuration(STATED, [10.0, 5.0, 0.0], HOME.rotation))
    near = [[10.0, 5.0, 1e-9]]
    found = tolerance_budget(Configuration(STATED, near, HOME.rotation), 0.05)
    assert found.costs.worst_displacement <= 0.05


@pytest.mark.parametrize("wanted", [0.0, -1.0, np.nan, np.inf, 1e-300, 1e308])
def test_unusable_wanted_precision_is_refused(wanted: float) -> None:
    given = Configuration.at(OPTIMAL, HOME)
    message = refusal(tolerance_budget, given, wanted)
    assert "displacement must" in message
    message = refusal(tolerance_budget, given, 1.0, wanted)
    assert "turn must" in message
    none = Configuration(OPTIMAL, np.empty((0, 3)), HOME.rotation)
    assert "at least one" in refusal(source_costs, none)


def test_budget_over_the_workspace_holds_at_its_nodes() -> None:
    design = OPTIMAL.with_limits(margin=2.0)
    positions = positions_over(design, "workspace", HOME, None)
    found = tolerance_budget(Configuration(design, positions, HOME.rotation), 0.1)
    assert len(positions) > 100
    assert 0.09 < found.costs.worst_displacement <= 0.1
    empty = design.with_limits(margin=1e3)
    with pytest.raises(NoAnswerError, match="no position"):
        positions_over(empty, "workspace", HOME, None)
    assert "need a box" in refusal(positions_over, design, "box", HOME, None)
