"""A loaded pose: worst directions beside sampled ones, its largest payload and force, extremes."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from machines import FULL, six
from numpy.testing import assert_allclose
from statics_cases import LegMasses

from explorer import PRESETS, Actuators, Design, Guide, Payload, Struts, Tolerances, Tool
from explorer.measures.snapshot import Snapshot
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Limits
from explorer.mechanism.pose import Pose
from explorer.motion.weights import MovingBodies
from explorer.numerics.arrays import FloatArray
from explorer.statics.loaded import LoadedPose, ToolPrecision
from explorer.statics.reactions import limit_shares, limited_parts, reactions

OPTIMAL = PRESETS["paper-optimal"]
HOME = OPTIMAL.home_pose
OWN = LegMasses(cylinders=(0.1, 0.2, 0.15, 0.1), cylinder_centres=(1.0, 1.0, 2.0, 3.0)).bodies


def limited(**changes: object) -> Design:
    """Return a design with a payload and limits of all parts, some of them changed."""
    payload = Payload(0.5, (1.0, 2.0, 3.0), 2.0)
    guide = Guide(force_n=40.0, moment_nm=5.0)
    return msgspec.structs.replace(FULL, **({"payload": payload, "guide": guide} | changes))


def loaded_poses(design: Design, count: int, seed: int = 3) -> list[LoadedPose]:
    """Return a design in random poses about home, under random loads."""
    rng = np.random.default_rng(seed)
    poses = [
        Pose.of_yaw_pitch_roll(
            rng.uniform((4, 1, 2), (16, 9, 14)), rng.uniform((-110, -20, -20), (-40, 20, 20))
        )
        for _ in range(count)
    ]
    return [LoadedPose(design, pose, six(rng.normal(size=6) * 5.0), OWN) for pose in poses]


@pytest.mark.parametrize("limits", ["all", "guide"])
def test_no_sampled_direction_uses_a_larger_share_than_the_worst(limits: str) -> None:
    none = {"actuators": Actuators(), "struts": Struts()}
    design = limited(**(none if limits == "guide" else {}))
    directions = np.random.default_rng(4).normal(size=(20_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for loaded in loaded_poses(design, 3):
        worst = loaded.worst_force(12.0)
        loads = np.tile(loaded.load, (len(directions), 1))
        loads[:, :3] += 12.0 * directions
        pose = loaded.pose
        held = reactions(
            Configuration.at(design, pose, design.tool.position), loads, loaded.weights
        )
        sampled = float(limit_shares(design, held).max())
        assert sampled <= worst.utilisation * (1.0 + 1e-12)
        assert sampled >= worst.utilisation * 0.997
        # The direction reaches it, and the part is the one that does.
        load = np.array(loaded.load) + [*(12.0 * worst.direction), 0.0, 0.0, 0.0]
        there = LoadedPose(design, pose, six(load), OWN)
        assert there.share == pytest.approx(worst.utilisation, rel=1e-12)
        assert there.worst == worst.part


def test_loaded_pose_that_weighs_no_payload_has_no_forces() -> None:
    design = limited()
    with_weight = LoadedPose(design, HOME)
    without = LoadedPose(design, HOME, weighs_payload=False)
    assert_allclose(without.reactions.actuators, 0.0, atol=1e-12)
    assert np.abs(with_weight.reactions.actuators).max() > 1.0


@pytest.mark.parametrize(
    ("design", "height", "share", "payload"),
    [(OPTIMAL, 9.0, 0.0, np.inf), (FULL, 0.0, np.inf, 0.0)],
)
def test_loaded_pose_without_limits_holds_any_load_and_a_singular_one_holds_none(
    design: Design, height: float, share: float, payload: float
) -> None:
    pose = Pose((10.0, 5.0, height), HOME.quaternion)
    loaded = LoadedPose(design, pose, (0.0, 0.0, -10.0, 0.0, 0.0, 0.0))
    worst = loaded.worst_force(10.0)
    assert loaded.is_regular == (height > 0.0)
    assert loaded.share == loaded.unit_force.utilisation == worst.utilisation == share
    assert loaded.largest_payload == payload
    assert np.isnan(worst.direction).all()


def test_load_in_a_singular_pose_moves_the_platform_unless_some_forces_hold_it() -> None:
    rng, tool = np.random.default_rng(7), (1.0, -2.0, 3.0)
    for loaded in loaded_poses(OPTIMAL, 8):
        for nearest in Snapshot(OPTIMAL, loaded.pose).nearest:
            rows = Configuration.at(OPTIMAL, nearest.pose, tool).jacobian.T
            balanced = rng.normal(size=6)
            for load, by_some in ((-rows @ balanced, True), (rng.normal(size=6), False)):
                there = LoadedPose(OPTIMAL, nearest.pose, six(load), point=tool)
                forces, _, rank, _ = np.linalg.lstsq(-rows, load, rcond=1e-9)
                # Others hold it as well: those that balance each other can be added.
                assert rank == 5
                assert np.allclose(-rows @ forces, load, atol=1e-7) == by_some
                assert there.moves_platform != by_some
    assert not LoadedPose(OPTIMAL, HOME, six(rng.normal(size=6))).moves_platform


def test_force_of_any_direction_moves_the_platform_in_a_singular_pose() -> None:
    pose = Snapshot(OPTIMAL, HOME).nearest[0].pose
    design = msgspec.structs.replace(OPTIMAL, payload=Payload(force_n=1.0))
    # The turn about the line b2b3 leaves b4 where it is.
    for tool, moves in (((0.0, 1.0, 0.0), True), ((0.0, 0.0, 0.0), False)):
        assert LoadedPose(design, pose, point=tool).moves_platform == moves


def test_parts_with_a_limit_are_those_whose_share_a_load_changes() -> None:
    load = np.array([3.0, -4.0, -10.0, 5.0, 7.0, -3.0])
    for change in ("actuators", "struts", "guide"):
        none = {"actuators": Actuators(), "struts": Struts(), "guide": Guide()}
        kept = getattr(limited(), change)
        loaded = LoadedPose(limited(**(none | {change: kept})), HOME, six(load))
        assert (limited_parts(loaded.design) == (loaded.shares > 0.0)).all()
        assert limited_parts(loaded.design).any()


ROTATION = OPTIMAL.home_pose.rotation


def with_force(force: float) -> Design:
    """Return a design with a payload that adds a force, and limits of all parts."""
    payload = msgspec.structs.replace(FULL.payload, force_n=force)
    return msgspec.structs.replace(FULL, payload=payload)


def positions(count: int) -> FloatArray:
    """Return regular positions in the mode of home, shape (count, 3)."""
    return np.random.default_rng(7).uniform((4, 1, 4), (16, 9, 14), (count, 3))


def shares(design: Design, at: FloatArray, load: FloatArray) -> FloatArray:
    """Return the shares of the limits under a load at the tool, besides the payload's weight."""
    weights = MovingBodies().with_payload(design)
    held = reactions(Configuration(design, at, ROTATION, design.tool.position), load, weights)
    return limit_shares(design, held)


def test_shares_are_the_largest_of_all_directions() -> None:
    at = positions(20)
    ours = shares(with_force(7.0), at, np.zeros(6))
    directions = np.random.default_rng(1).normal(size=(10_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    loads = np.zeros((len(directions), 1, 6))
    loads[:, 0, :3] = 7.0 * directions
    sampled = shares(with_force(0.0), at, loads).max(axis=0)
    assert (sampled <= ours * (1.0 + 1e-12)).all()
    assert_allclose(sampled, ours, rtol=2e-3)


@pytest.mark.parametrize("seed", range(40))
def test_forces_and_precision_of_extreme_designs_and_poses_are_numbers(seed: int) -> None:
    rng = np.random.default_rng(seed)
    variables = 10.0 ** rng.uniform(-3.0, 2.0) * np.array(OPTIMAL.variables)
    design = OPTIMAL.with_variables((variables * 10.0 ** rng.uniform(-2.0, 2.0, 6)).tolist())
    six = tuple((10.0 ** rng.uniform(-6.0, 6.0, 6)).tolist())
    offsets = tuple((10.0 ** rng.uniform(-6.0, 6.0, 3)).tolist())
    design = msgspec.structs.replace(
        design,
        limits=Limits(),
        home=None,
        tool=Tool(tuple((design.reach * rng.normal(size=3)).tolist())),
        payload=Payload(offsets[2], force_n=offsets[0]),
        guide=Guide(*offsets[:2]),
        actuators=Actuators(six, six[::-1], six, six),
        struts=Struts(outer_mm=offsets[0], stress_mpa=offsets[1]),
        tolerances=Tolerances(a1=offsets, b4=offsets),
    )
    position = design.reach * rng.normal(size=3) * 10.0 ** -rng.choice([0.0, 3.0, 14.0])
    turn = rng.normal(size=4) * [1.0, *rng.choice([0.0, 1.0], 2), 1.0]
    pose = Pose(tuple(position.tolist()), tuple(turn.tolist()))
    loaded = LoadedPose(design, pose, six)
    precision = ToolPrecision(loaded)
    numbers = [
        *(
            loaded.share,
            loaded.largest_payload,
            loaded.unit_force.utilisation,
            loaded.worst_force(1.0).utilisation,
        ),
        *(precision.largest_displacement, *precision.worst()[:2], *precision.rms()),
        *np.ravel(precision.deflection).tolist(),
        *np.ravel(precision.principal.displacement).tolist(),
    ]
    assert not np.isnan([float(each) for each in numbers]).any()
    shares = np.array(precision.shares)
    assert np.isnan(shares).all() or sum(shares) == pytest.approx(1.0)
    if precision.is_regular:
        assert not np.isnan(precision.ellipsoid.semi_axes).any()
        assert np.isfinite(precision.carriages).all()
