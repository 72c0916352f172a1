"""A loaded pose: worst directions beside many sampled ones, and its largest payload and force."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from machines import FULL, six
from numpy.testing import assert_allclose

from explorer import PRESETS, Actuators, Design, Guide, Payload, Struts, Weights
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import Pose
from explorer.statics.forces import largest_force
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import limit_shares, reactions

OPTIMAL = PRESETS["paper-optimal"]
HOME = home_pose(OPTIMAL)
OWN = Weights(cylinders=(0.1, 0.2, 0.15, 0.1), cylinder_centres=(1.0, 1.0, 2.0, 3.0))


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
            design, pose.position, pose.rotation, loads, design.tool.position, loaded.weights
        )
        sampled = float(limit_shares(design, held).max())
        assert sampled <= worst.share * (1.0 + 1e-12)
        assert sampled >= worst.share * 0.997
        # The direction reaches it, and the part is the one that does.
        load = np.array(loaded.load) + [*(12.0 * worst.direction), 0.0, 0.0, 0.0]
        there = LoadedPose(design, pose, six(load), OWN)
        assert there.share == pytest.approx(worst.share, rel=1e-12)
        assert there.worst == worst.part


def test_largest_payload_takes_a_part_to_its_limit() -> None:
    for loaded in loaded_poses(limited(), 8):
        mass = loaded.largest_payload
        if mass == 0.0:
            # The load and the other weights alone exceed a limit.
            free = LoadedPose(limited(payload=Payload(0.0, (1.0, 2.0, 3.0), 2.0)), loaded.pose,
                              loaded.load, OWN)  # fmt: skip
            assert free.share > 1.0
            continue
        design = limited(payload=Payload(mass, (1.0, 2.0, 3.0), 2.0))
        share = LoadedPose(design, loaded.pose, loaded.load, OWN).share
        assert share == pytest.approx(1.0, rel=1e-9)


def test_largest_force_takes_a_part_to_its_limit_in_its_worst_direction() -> None:
    rng = np.random.default_rng(6)
    for loaded in loaded_poses(limited(), 5):
        newton = loaded.newton
        force = 1.0 / newton.share
        # Neither load nor payload act besides.
        bare = limited(payload=Payload())
        for direction in rng.normal(size=(50, 3)):
            unit = direction / np.linalg.norm(direction)
            other = LoadedPose(bare, loaded.pose, six([*(force * unit), 0.0, 0.0, 0.0]))
            assert other.share <= 1.0 + 1e-9
        load = np.array([*(force * newton.direction), 0.0, 0.0, 0.0])
        there = LoadedPose(bare, loaded.pose, six(load))
        assert there.share == pytest.approx(1.0, rel=1e-12)
        assert there.worst == newton.part


def test_largest_force_of_actuators_alone_is_that_of_the_function() -> None:
    actuators = Actuators(push_n=(50, 50, 50, 50, 50, 50))
    design = limited(struts=Struts(), guide=Guide(), actuators=actuators)
    for loaded in loaded_poses(design, 5):
        pose, most = loaded.pose, np.full(6, 50.0)
        expected = largest_force(design, pose.position, pose.rotation, most, design.tool.position)
        assert 1.0 / loaded.newton.share == pytest.approx(float(expected), rel=1e-12)


def test_loaded_pose_that_weighs_no_payload_has_no_forces() -> None:
    design = limited()
    with_weight = LoadedPose(design, HOME)
    without = LoadedPose(design, HOME, weighs_payload=False)
    assert_allclose(without.held.actuators, 0.0, atol=1e-12)
    assert np.abs(with_weight.held.actuators).max() > 1.0


def test_loaded_pose_without_limits_uses_no_share_and_has_no_worst_direction() -> None:
    loaded = LoadedPose(OPTIMAL, HOME, (0.0, 0.0, -10.0, 0.0, 0.0, 0.0))
    assert loaded.share == 0.0
    assert np.isinf(loaded.largest_payload)
    assert loaded.newton.share == 0.0
    worst = loaded.worst_force(10.0)
    assert worst.share == 0.0
    assert np.isnan(worst.direction).all()


def test_loaded_pose_that_is_singular_holds_no_load() -> None:
    pose = Pose((10.0, 5.0, 0.0), HOME.quaternion)
    loaded = LoadedPose(limited(), pose, (0.0, 0.0, -10.0, 0.0, 0.0, 0.0))
    assert not loaded.is_regular
    assert np.isinf(loaded.share)
    assert (loaded.largest_payload, loaded.newton.share) == (0.0, np.inf)
    worst = loaded.worst_force(10.0)
    assert np.isinf(worst.share)
    assert np.isnan(worst.direction).all()


def test_parts_with_a_limit_are_those_whose_share_a_load_changes() -> None:
    load = np.array([3.0, -4.0, -10.0, 5.0, 7.0, -3.0])
    for change in ("actuators", "struts", "guide"):
        none = {"actuators": Actuators(), "struts": Struts(), "guide": Guide()}
        kept = getattr(limited(), change)
        loaded = LoadedPose(limited(**(none | {change: kept})), HOME, six(load))
        assert (loaded.limited == (loaded.shares > 0.0)).all()
        assert loaded.limited.any()
