"""The nearest position that holds a load, beside dense random positions."""

from __future__ import annotations

import json
from typing import Any

import msgspec
import numpy as np
import pytest
from long_cases import long_after
from reference import read_reference

from explorer import PRESETS, Actuators, Limits, Payload, Struts, Tool
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design_file import decode_design
from explorer.mechanism.margins import margins, mode_of, signs_of
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import limit_shares, reactions
from explorer.workspace.limits.valid_poses import Rules, poses_are_valid
from explorer.workspace.nearest_carrying import nearest_carrying_pose

OPTIMAL = PRESETS["paper-optimal"]
HOME = OPTIMAL.home_pose
LIMITED = msgspec.structs.replace(
    OPTIMAL,
    tool=Tool((1.0, -1.0, 2.0)),
    payload=Payload(2.0, (1.0, 2.0, 3.0), 5.0),
    actuators=Actuators(push_n=(60, 60, 60, 60, 60, 60)),
    struts=Struts(moment_nm=3.0),
)
LOAD = (0.0, 0.0, -10.0, 0.0, 0.0, 0.0)


def distances_held(loaded: LoadedPose, positions: FloatArray) -> FloatArray:
    """Return the distances of those positions that hold the load in the mode of the pose."""
    design, pose = loaded.design, loaded.pose
    rules = Rules.of(design, signs_of(int(mode_of(margins(pose.position, pose.rotation)))))
    kept = positions[poses_are_valid(design, positions, pose.rotation, rules=rules)]
    tool, weights = design.tool.position, loaded.weights
    held = reactions(Configuration(design, kept, pose.rotation, tool), loaded.load, weights)
    kept = kept[(limit_shares(design, held) <= 1.0).all(axis=1)]
    return np.linalg.norm(kept - np.array(pose.position), axis=1)


def check_none_is_nearer(loaded: LoadedPose) -> None:
    """Check that a position is found and that no random position that holds is nearer."""
    assert loaded.share > 1.0
    found = nearest_carrying_pose(loaded)
    assert found is not None
    assert found.quaternion == loaded.pose.quaternion
    distance = float(np.linalg.norm(np.subtract(found.position, loaded.pose.position)))
    assert len(distances_held(loaded, np.array([found.position]))) == 1
    rng = np.random.default_rng(5)
    ball = rng.normal(size=(20_000, 3))
    radii = distance * rng.uniform(size=len(ball)) ** (1 / 3)
    ball *= (radii / np.linalg.norm(ball, axis=1))[:, None]
    nearer = distances_held(loaded, np.array(loaded.pose.position) + ball)
    assert (nearer >= distance - 1e-5 * loaded.design.reach).all()


@pytest.mark.parametrize(
    "at", long_after(2, [(10.0, 5.0, 9.0), (12, -3, 5), (10.0, 5.0, 2.0), (4.0, 2.0, 3.0)])
)
def test_no_random_position_that_holds_the_load_is_nearer(at: tuple[float, float, float]) -> None:
    check_none_is_nearer(LoadedPose(LIMITED, Pose(at, HOME.quaternion), LOAD))


def test_small_part_far_from_the_pose_is_found() -> None:
    case = read_reference("held")["nearest"]
    design = decode_design(json.dumps(case["design"]).encode(), "the reference")
    pose = Pose.of(case["start"], np.array(case["rotation"]))
    loaded = LoadedPose(design, pose, tuple(case["load"]))
    check_none_is_nearer(loaded)
    found = nearest_carrying_pose(loaded)
    assert found is not None
    far = np.linalg.norm(np.subtract(case["holds_at"], case["start"]))
    assert np.linalg.norm(np.subtract(found.position, case["start"])) <= far


@pytest.mark.parametrize("margin", [None, 0.5])
def test_mode_of_the_pose_counts_in_another_mode_than_home(margin: float | None) -> None:
    design = msgspec.structs.replace(LIMITED, limits=Limits(margin=margin))
    pose = Pose((10.0, 5.0, -2.0), HOME.quaternion)
    check_none_is_nearer(LoadedPose(design, pose, LOAD))


def test_a_position_that_holds_the_load_is_its_own_nearest() -> None:
    loaded = LoadedPose(OPTIMAL, HOME, LOAD)
    found = nearest_carrying_pose(loaded)
    assert found is not None
    assert found.position == pytest.approx(HOME.position, abs=1e-12)


@pytest.mark.parametrize(
    "change",
    [
        {"actuators": Actuators(push_n=(0.1, 0.1, 0.1, 0.1, 0.1, 0.1))},
        {"limits": Limits(box=((90.0, 90.0, 90.0), (91.0, 91.0, 91.0)))},
    ],
)
def test_none_is_found_where_limits_or_actuators_leave_none(change: dict[str, Any]) -> None:
    assert (
        nearest_carrying_pose(LoadedPose(msgspec.structs.replace(LIMITED, **change), HOME, LOAD))
        is None
    )


def test_from_a_singular_pose_it_is_in_the_mode_of_home() -> None:
    loaded = LoadedPose(
        LIMITED, Pose((10.0, 5.0, 0.0), HOME.quaternion), (0.0, 0.0, -1.0, 0.0, 0.0, 0.0)
    )
    found = nearest_carrying_pose(loaded)
    assert found is not None
    signs = np.sign(margins(found.position, found.rotation))
    assert signs.tolist() == np.sign(margins(HOME.position, HOME.rotation)).tolist()
