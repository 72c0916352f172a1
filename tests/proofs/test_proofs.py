"""Proofs over a box: what is proven holds in random poses, and what is missed is missed there."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, strategies as st
from limited_designs import limited, ordinary_case
from long_cases import long_after
from machines import FULL, OPTIMAL, PRECISE, same_for_all
from random_searches import positions_of_box
from scipy.optimize import linprog

from explorer import Actuators, Design, InputError, actuator_forces
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Swing
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose, Triple
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion
from explorer.motion.weights import MovingBodies, payload_wrench
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.numerics.cells import CellValues, largest_values
from explorer.optimise.problem import Box
from explorer.proofs.limits import prove_limits
from explorer.proofs.proof import Proof
from explorer.proofs.statics import (
    _cell_forces,  # pyright: ignore[reportPrivateUsage]
    prove_deflection,
    prove_error,
    prove_load,
)
from explorer.statics.accuracy import actuator_errors, worst_errors
from explorer.statics.compliance import compliance_of, largest_deflection, stiffness_of
from explorer.statics.reactions import largest_accelerations, limit_shares, part_limits, reactions
from explorer.workspace.clearance_bounds import least_in_workspace
from explorer.workspace.least_clearance import least_clearances
from explorer.workspace.limits.valid_poses import Rules, poses_are_valid, violations
from explorer.workspace.workspace import Workspace

pytestmark = pytest.mark.usefixtures("warm_kernels")

POSES = 20_000


def box_about(position: FloatArray, half: FloatArray) -> Box:
    (ax, ay, az), (bx, by, bz) = (position - half).tolist(), (position + half).tolist()
    return (ax, ay, az), (bx, by, bz)


# The search over cells


def waves(rng: np.random.Generator, axes: int) -> tuple[FloatArray, FloatArray]:
    """Return three functions Σ a sin(k·x), each with its a (4,) and its k (4, axes)."""
    return rng.normal(size=(3, 4)), 3.0 * rng.normal(size=(3, 4, axes))


@pytest.mark.parametrize("axes", [1, 2, 3])
@pytest.mark.parametrize("enough", [-10.0, 1.0])
def test_largest_values_lie_between_what_is_attained_and_the_bound(
    axes: int, enough: float
) -> None:
    rng = np.random.default_rng(axes)
    size, wave = waves(rng, axes)

    def values_at(x: FloatArray) -> FloatArray:
        return (size * np.sin(np.einsum("mka,...a->...mk", wave, x))).sum(axis=-1)

    bend = (np.abs(size) * (wave * wave).sum(axis=-1)).sum(axis=-1)

    def measure(lows: FloatArray, highs: FloatArray) -> CellValues:
        middles, half = 0.5 * (lows + highs), 0.5 * (highs - lows)
        values = values_at(middles)
        cosines = size * np.cos(np.einsum("mka,na->nmk", wave, middles))
        slopes = np.abs(np.einsum("nmk,mka->nma", cosines, wave))
        bounds = values + np.einsum("nma,na->nm", slopes, half)
        bounds += 0.5 * (half * half).sum(axis=1)[:, None] * bend
        return CellValues(values, np.repeat(middles[:, None], 3, axis=1), bounds)

    lows, highs = np.full(axes, -1.0), np.ones(axes)
    found = largest_values(measure, lows, highs, enough)
    sampled = values_at(rng.uniform(lows, highs, (200_000, axes))).max(axis=0)
    assert (found.bounds >= sampled).all()
    assert found.values == pytest.approx(np.diagonal(values_at(found.places)), abs=1e-12)
    is_above = found.values > enough
    assert (found.bounds[~is_above] <= enough).all()
    excess = found.values - enough
    assert (found.bounds - enough)[is_above] == pytest.approx(excess[is_above], rel=1e-3)


def test_bound_of_a_point_is_what_was_computed() -> None:
    def measure(lows: FloatArray, highs: FloatArray) -> CellValues:
        values = lows + highs
        return CellValues(values, lows[:, None], values + np.inf)

    found = largest_values(measure, np.ones(1), np.ones(1))
    assert (found.values, found.bounds) == (2.0, np.inf)


# Limits over a box and tilts


def limits_case(seed: int) -> tuple[Design, Box, FloatArray, float]:
    """Return a design with limits of every kind but cones, and a box and tilts about its home."""
    rng = np.random.default_rng([3, seed])
    design, _ = ordinary_case(seed)
    home = design.home_pose
    half = rng.uniform(0.02, 0.6, 3) * [rng.random() < 0.9, 1.0, 1.0]
    tilt = float(rng.choice([0.0, rng.uniform(0.0, 12.0), rng.uniform(10.0, 80.0)]))
    gap = 0.9 * abs((design.b3 - design.b2) * float(home.rotation[0, 0]))
    changes = {"gap": gap if rng.random() < 0.5 else 0.0}
    return limited(design, **changes), box_about(np.array(home.position), half), home.rotation, tilt


@pytest.mark.parametrize("seed", long_after(12, range(100)))
def test_limits_are_proven_exactly_where_random_poses_keep_them(seed: int) -> None:
    design, box, rotation, tilt = limits_case(seed)
    rng = np.random.default_rng(seed)
    proofs = prove_limits(design, box, rotation, tilt)
    positions = positions_of_box(box, POSES, rng)
    tilts = tilt * np.where(rng.random(POSES) < 0.5, 1.0, np.sqrt(rng.random(POSES)))
    turns = np.column_stack([rng.uniform(0.0, 360.0, POSES), tilts, np.zeros(POSES)])
    rotations = rotation_from_tilt_torsion(turns) @ rotation
    valid = poses_are_valid(
        design, positions, rotations, rules=Rules.of(design).without_clearances()
    )
    assert not (all(proof.is_proven for proof in proofs) and not valid.all())
    for proof in proofs:
        assert proof.is_proven == (proof.missed <= 0.0)
        at = Configuration(design, proof.position[None], proof.rotation[None])
        broken = [violation.limit for violation in violations(at)[0]]
        assert any(proof.name.startswith(name) for name in broken) == (proof.missed > 0.0)
        if not proof.is_proven:
            assert proof.bound == pytest.approx(proof.missed, rel=1e-3)
        assert (proof.position >= np.array(box[0]) - 1e-12).all()
        assert (proof.position <= np.array(box[1]) + 1e-12).all()


def test_gap_is_kept_on_the_side_of_the_orientation_that_is_tilted() -> None:
    design = limited(OPTIMAL, gap=0.3, carriage_order="any", margin=None)
    rotation = np.diag([-1.0, -1.0, 1.0]) @ design.home_pose.rotation
    position = np.array([10.0, 5.0, 9.0])
    assert poses_are_valid(design, position, rotation)
    proofs = prove_limits(design, box_about(position, np.zeros(3)), rotation)
    assert all(proof.is_proven for proof in proofs)


def test_what_is_not_decided_over_a_box_is_refused() -> None:
    design, box, rotation, tilt = limits_case(0)
    with pytest.raises(InputError, match="bounds swings"):
        prove_limits(limited(design, swing=Swing(a1=30.0)), box, rotation, tilt)
    with pytest.raises(InputError, match="below 90°; got 90°"):
        prove_limits(design, box, rotation, 90.0)


# Loads, accelerations, errors and deflections


def machine(seed: int) -> tuple[Design, Box]:
    """Return a machine with everything in a random pose, and a box off the singular planes."""
    rng = np.random.default_rng([5, seed])
    turn = [-73.0, *rng.uniform(-20.0, 20.0, 2).tolist()]
    design = msgspec.structs.replace(
        FULL.with_variables((np.array(FULL.variables) * rng.uniform(0.85, 1.2, 6)).tolist()),
        home=Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), turn),
        actuators=msgspec.structs.replace(
            PRECISE.actuators, push_n=same_for_all(90.0), pull_n=FULL.actuators.pull_n
        ),
        struts=msgspec.structs.replace(PRECISE.struts, moment_nm=4.0),
    )
    return design, box_about(np.array([10.0, 5.0, 9.0]), rng.uniform(0.2, 3.0, 3))


def shares_at(design: Design, positions: FloatArray) -> FloatArray:
    at = Configuration(design, positions, design.home_pose.rotation, design.tool.position)
    return limit_shares(design, reactions(at, np.zeros(6), MovingBodies().with_payload(design)))


def largest_of_kinds(design: Design, positions: FloatArray) -> tuple[float, float, float, float]:
    """Return the largest share, the least acceleration, the worst error and the deflection."""
    rotation = design.home_pose.rotation
    at = Configuration(design, positions, rotation, design.tool.position)
    soft, weight = compliance_of(at, *stiffness_of(design)), payload_wrench(design, rotation)
    return (
        float(shares_at(design, positions).max()),
        float(largest_accelerations(at).min()),
        float(worst_errors(at, actuator_errors(design)).displacement.max()),
        float(largest_deflection(soft, weight, design.payload.force_n)[0].max()),
    )


@pytest.mark.parametrize("seed", long_after(4, range(30)))
@pytest.mark.parametrize("factor", [0.97, 1.0 + 1e-6, 1.1])
def test_statics_are_proven_exactly_where_the_largest_of_all_positions_allows(
    seed: int, factor: float
) -> None:
    design, box = machine(seed)
    rotation, rng = design.home_pose.rotation, np.random.default_rng(seed)
    positions = positions_of_box(box, POSES, rng)
    share, acceleration, error, deflection = largest_of_kinds(design, positions)
    kinds = [
        prove_load(design, box, rotation, most=factor * share),
        prove_error(design, box, rotation, factor * error),
        prove_deflection(design, box, rotation, factor * deflection),
    ]
    for proofs in kinds:
        worst = max(proof.missed for proof in proofs)
        # The corners are among the random positions, and often the worst of all.
        assert worst >= 1.0 / factor - 1.0 - 1e-12
        assert all(proof.bound >= proof.missed for proof in proofs)
        for proof in proofs:
            assert proof.is_proven == (proof.missed <= 0.0)
    worst = max(kinds[0], key=lambda proof: proof.missed)
    found = largest_of_kinds(design, worst.position[None])[0] / (factor * share) - 1.0
    assert worst.missed == pytest.approx(found, abs=1e-12)
    if acceleration > 0.0:
        moved = prove_load(design, box, rotation, acceleration=acceleration / factor)
        is_held = all(proof.is_proven for proof in moved)
        assert is_held <= (factor >= 1.0)
        if not is_held:
            worst = max(moved, key=lambda proof: proof.missed)
            least = largest_of_kinds(design, worst.position[None])[1]
            assert least < acceleration / factor


@pytest.mark.parametrize("seed", range(4))
def test_forces_over_a_cell_are_within_their_bounds_and_so_are_their_differences(seed: int) -> None:
    design, box = machine(seed)
    rotation, rng, reach = design.home_pose.rotation, np.random.default_rng(seed), design.reach
    middles = positions_of_box(box, 60, rng)
    half = 10.0 ** rng.uniform(-3.0, -1.5, (60, 3)) * reach
    found = _cell_forces(design, rotation, middles, half)
    tool, centre = design.tool.position, design.payload.centre
    weight = design.payload.weight_n * np.array(design.gravity)

    def forces(point: Triple, loads: FloatArray, p: FloatArray) -> FloatArray:
        """Return the forces (..., 6) of the actuators under each of the loads at a point."""
        wrenches = np.hstack([loads, np.zeros((len(loads), 3))])
        return np.stack(
            [actuator_forces(design, p, rotation, wrench, point) for wrench in wrenches]
        )

    step = 1e-4 * reach
    for bounds, point, loads in (
        (found.at_tool, tool, np.eye(3)),
        (found.at_payload, centre, np.eye(3)),
        (found.by_weight, centre, weight[None]),
    ):
        assert np.isfinite(bounds.size).all()
        for _ in range(8):
            p = middles + half * rng.uniform(-1.0, 1.0, middles.shape)
            here = forces(point, loads, p)
            assert (lengths_of(np.moveaxis(here, 0, -1)) <= bounds.size[:, 0] * (1.0 + 1e-9)).all()
            for axis, way in enumerate(step * np.eye(3)):
                ahead, behind = forces(point, loads, p + way), forces(point, loads, p - way)
                first = lengths_of(np.moveaxis(ahead - behind, 0, -1)) / (2.0 * step)
                second = lengths_of(np.moveaxis(ahead - 2.0 * here + behind, 0, -1)) / step**2
                noise = 1e-6 * bounds.size[:, 0] / reach
                assert (first <= bounds.first[:, axis] * (1.0 + 1e-3) + noise).all()
                assert (second <= bounds.second[:, axis] * (1.0 + 1e-2) + 1e-2 * noise).all()


@given(st.integers(0, 2**32 - 1), st.integers(0, 4))
def test_bound_by_duality_is_below_the_least_value_of_a_linear_programme(
    seed: int, count: int
) -> None:
    rng = np.random.default_rng(seed)
    value, slope, half = rng.normal(), rng.normal(size=3), rng.uniform(0.1, 2.0, 3)
    slack, slopes = rng.normal(size=count) + 0.5, rng.normal(size=(count, 3))
    slopes[rng.random((count, 3)) < 0.2] = 0.0
    x, y, z = slope.tolist()
    bound = least_in_workspace(value, (x, y, z), half, slack, slopes)
    assert bound >= value - np.abs(slope) @ half - 1e-12
    # The slacks are not negative in the workspace.
    limits: dict[str, Any] = {"A_ub": -slopes, "b_ub": slack} if count else {}
    solve: Any = linprog
    least = solve(slope, **limits, bounds=np.stack([-half, half], axis=-1))
    if least.status == 0:
        assert bound <= value + least.fun + 1e-9
        if count <= 1:
            assert bound == pytest.approx(value + least.fun, abs=1e-9)


@pytest.mark.parametrize("seed", long_after(4, range(12)))
def test_least_clearances_off_singular_planes_are_those_of_a_design_with_that_margin(
    seed: int,
) -> None:
    design, rotation = ordinary_case(seed)
    margin, tolerance, below = (share * design.reach for share in (0.05, 1e-3, 0.1))
    free = Workspace(limited(design, margin=0.0), rotation)
    found = least_clearances(free, tolerance, margin=margin)
    demanded = least_clearances(Workspace(limited(design, margin=margin), rotation), tolerance)
    assert found.clearance == pytest.approx(demanded.clearance, abs=tolerance)
    near = least_clearances(free, tolerance, margin=margin, below=below)
    is_near = np.isfinite(near.clearance)
    assert (is_near == (demanded.clearance < below)).all()
    assert near.clearance[is_near] == pytest.approx(demanded.clearance[is_near], abs=tolerance)
    for position in (found.position, near.position[is_near]):
        sizes = np.abs(margins(position, rotation))
        assert (sizes >= margin * (1.0 - 1e-6)).all()


def test_parts_without_a_limit_have_nothing_to_prove() -> None:
    design, box = machine(0)
    design = msgspec.structs.replace(design, actuators=Actuators(push_n=same_for_all(90.0)))
    names = {proof.name for proof in prove_load(design, box, design.home_pose.rotation)}
    assert len(names) == np.isfinite(part_limits(design)).any(axis=0).sum() + 2


def test_box_across_a_singular_plane_misses_every_demand_by_an_infinite_amount() -> None:
    design, _ = machine(0)
    box = ((8.0, 3.0, -1.0), (12.0, 7.0, 8.0))
    proofs: list[Proof] = [
        *prove_load(design, box, design.home_pose.rotation),
        *prove_error(design, box, design.home_pose.rotation, 1.0),
    ]
    assert all(np.isinf(proof.missed) and not proof.is_proven for proof in proofs)
