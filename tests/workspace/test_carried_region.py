"""The part of a workspace that holds a load, beside positions drawn at random one by one."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from typing import Any

import msgspec
import numpy as np
import pytest
from long_cases import long_after
from machines import FULL, PRESS, six
from reference import read_reference
from scipy.spatial.transform import Rotation

from explorer import (
    PRESETS,
    Actuators,
    Design,
    Guide,
    InputError,
    Limits,
    Payload,
    Pose,
    Struts,
    Tool,
    reactions,
    workspace_solid,
)
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design_file import decode_design
from explorer.mechanism.margins import margins, mode_of, signs_of
from explorer.motion.weights import MovingBodies
from explorer.numerics.arrays import FloatArray
from explorer.statics.load_cases import largest_shares as shares_of_case, load_case
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import PART_NAMES, limit_shares
from explorer.workspace.carried_region import carried_region
from explorer.workspace.limits.constraints import slacks
from explorer.workspace.limits.valid_poses import Rules, poses_are_valid
from explorer.workspace.nearest_carrying import nearest_carrying_pose
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]
REFERENCE: list[dict[str, Any]] = read_reference("held")["held"]
# Those of thin sheets need many cells.
SHEETS_LAST = sorted(REFERENCE, key=lambda case: "sheet" in case["name"])
LOAD = (4.0, -3.0, -6.0, 5.0, 10.0, -5.0)
CASES = {
    "bending": msgspec.structs.replace(
        OPTIMAL, payload=Payload(force_n=10.0), struts=Struts(moment_nm=5.0)
    ),
    "actuators": msgspec.structs.replace(
        OPTIMAL,
        payload=Payload(2.0, (1.0, 2.0, 3.0)),
        actuators=Actuators(push_n=(60, 50, 40, 50, 45, 70), pull_n=(30, 40, 50, 60, 70, 80)),
    ),
    "all parts": FULL,
    "strong": msgspec.structs.replace(
        OPTIMAL, payload=Payload(1.0), actuators=Actuators(push_n=(1e3, 1e3, 1e3, 1e3, 1e3, 1e3))
    ),
}


def largest_shares(
    design: Design, at: FloatArray, load: Iterable[float], rotation: FloatArray | None = None
) -> FloatArray:
    """Return the largest share of a limit at positions (n, 3), in home's orientation if none."""
    r = design.home_pose.rotation if rotation is None else rotation
    weights = MovingBodies().with_payload(design)
    held = reactions(Configuration(design, at, r, design.tool.position), np.array(load), weights)
    return np.asarray(limit_shares(design, held).max(axis=1))


@pytest.mark.parametrize("case", long_after(2, SHEETS_LAST), ids=lambda case: str(case["name"]))
def test_volume_is_that_of_reference_cases(case: dict[str, Any]) -> None:
    design = decode_design(json.dumps(case["design"]).encode(), "the reference")
    part = carried_region(Workspace(design, case["rotation"]), tuple(case["load"]))
    assert part.volume == pytest.approx(case["volume"], rel=1e-3)
    error = 3.0 * case["error"] + 0.005 * case["held_volume"]
    assert part.held_volume == pytest.approx(case["held_volume"], abs=error)


@pytest.mark.parametrize("seed", long_after(5, range(20)))
def test_volume_at_any_orientation_is_that_of_positions_in_the_mode_of_home(seed: int) -> None:
    """In every fifth case only a force acts at b4, for which some forces are bounded."""
    rng = np.random.default_rng(seed)
    load = rng.normal(size=6) * (5.0, 5.0, 5.0, 10.0, 10.0, 10.0)
    design = msgspec.structs.replace(
        OPTIMAL, actuators=Actuators(push_n=six(rng.uniform(30.0, 100.0, 6)))
    )
    if seed % 5:
        design = list(CASES.values())[seed % 5 - 1]
    else:
        load[3:] = 0.0
    design = design.with_limits(margin=0.0)
    home, rotation, whole = OPTIMAL.home_pose, np.eye(3), None
    while whole is None or whole.volume < 100.0:
        turn = Rotation.from_rotvec(rng.normal(size=3) * 0.4).as_matrix()
        rotation = turn @ OPTIMAL.home_pose.rotation
        if seed % 3 == 0:
            home = Pose.of(home.position, rotation)
        design = msgspec.structs.replace(design, home=home)
        whole = workspace_solid(design, rotation)
    part = carried_region(Workspace(design, rotation), tuple(load.tolist()))
    at = rng.uniform(whole.vertices.min(axis=0), whole.vertices.max(axis=0), (400_000, 3))
    signs = np.sign(margins(home.position, home.rotation))
    at = at[(np.sign(margins(at, rotation)) == signs).all(axis=1)]
    at = at[Workspace(design, rotation).satisfies(at).all(axis=1)]
    assert len(at) > 10_000
    share = float((largest_shares(design, at, load, rotation) <= 1.0).mean())
    sampling = 3.0 * math.sqrt(share * (1.0 - share) / len(at))
    assert part.held_volume / part.volume == pytest.approx(share, abs=sampling + 0.005 * share)
    assert part.solid.is_empty or part.solid.is_watertight
    assert len(set(part.solid.limits)) == len(part.solid.limits)


@pytest.mark.parametrize("name", ["bending", "all parts"])
def test_new_faces_lie_where_a_part_takes_its_limit(name: str) -> None:
    design = CASES[name]
    solid = carried_region(Workspace(design)).solid
    # A force of any direction alone asks as much of pull as of push, and has one face.
    assert len(solid.faces) < 25_000
    parts = [index for index, limit in enumerate(solid.limits) if limit in PART_NAMES]
    limits_of_corner = np.zeros((len(solid.vertices), len(solid.limits)), dtype=np.bool_)
    for corners in solid.faces.T:
        limits_of_corner[corners, solid.limit_of_face] = True
    single = limits_of_corner.sum(axis=1) == 1
    within = np.flatnonzero(single & limits_of_corner[:, parts].any(axis=1))
    assert len(within) > 100
    shares = largest_shares(design, solid.vertices[within], (0.0,) * 6)
    assert np.quantile(np.abs(shares - 1.0), 0.99) < 1e-6
    # Beside a singular plane faces may cut short what is thinner than a cell.
    assert np.abs(shares - 1.0).max() < 0.01


# The design file of the manual's page on loads: no limits of lengths, and a rounded home.
COUNT = 300_000
UNBOUNDED = msgspec.structs.replace(
    PRESS, home=Pose((10.0, 5.0, 9.0), (0.80334, 0.0, 0.0, -0.59552)), limits=Limits()
)


@pytest.mark.parametrize(
    ("force", "error"),
    [
        (200.0, 0.005),
        *(pytest.param(*case, marks=pytest.mark.long) for case in ((40.0, 0.005), (250.0, 0.03))),
    ],
)
def test_thin_and_long_parts_are_found_whole(force: float, error: float) -> None:
    """The volume is that of random positions, and only limits and parts bound it."""
    load = (0.0, 0.0, -force, 0.0, 0.0, 0.0)
    part = carried_region(Workspace(UNBOUNDED), load=load)
    signed = msgspec.structs.replace(UNBOUNDED, limits=Limits(margin=0.0))
    rotation = UNBOUNDED.home_pose.rotation
    limits = Workspace(signed, rotation).limits
    whole = workspace_solid(signed, rotation)
    lows, highs = whole.vertices.min(axis=0), whole.vertices.max(axis=0)
    at = np.random.default_rng(7).uniform(lows, highs, (COUNT, 3))
    at = at[(slacks(limits, at) >= 0.0).all(axis=-1)]
    is_held = shares_of_case(load_case(signed, rotation, np.array(load)), rotation, at)[0] <= 1.0
    box = math.prod((highs - lows).tolist())
    share = int(is_held.sum()) / COUNT
    sampling = box * math.sqrt(share * (1.0 - share) / COUNT)
    assert part.held_volume == pytest.approx(box * share, abs=error * box * share + 3.0 * sampling)
    limit_names = {limit.name for limit in limits}
    assert set(part.solid.limits) <= limit_names | set(PART_NAMES)
    assert part.solid.is_watertight
    used = np.unique(part.solid.limit_of_face)
    assert (used >= 0).all()
    assert (used < len(part.solid.limits)).all()
    # Every position that was drawn and holds the load lies within the extent of the mesh.
    margin = 0.02 * (highs - lows)
    ends = part.solid.vertices.min(axis=0) - margin, part.solid.vertices.max(axis=0) + margin
    assert ((at[is_held] >= ends[0]) & (at[is_held] <= ends[1])).all()


@pytest.mark.parametrize("moment", [3.0, 5.0])
def test_faces_have_the_name_of_the_smaller_limit_of_the_moment(moment: float) -> None:
    design = msgspec.structs.replace(CASES["bending"], guide=Guide(moment_nm=moment))
    solid = carried_region(Workspace(design)).solid
    used = {solid.limits[int(index)] for index in np.unique(solid.limit_of_face)}
    is_of_guide = moment == 3.0
    names = PART_NAMES[10:] if is_of_guide else PART_NAMES[6:8]
    others = PART_NAMES[6:8] if is_of_guide else PART_NAMES[10:]
    assert used & set(names)
    assert not used & set(others)
    assert not set(solid.limits) & set(others)


def test_load_that_nothing_holds_names_the_part() -> None:
    design = msgspec.structs.replace(
        OPTIMAL, payload=Payload(500.0), actuators=Actuators(push_n=(1.0, 1.0, 1.0, 1.0, 1.0, 1.0))
    )
    part = carried_region(Workspace(design))
    assert part.held_volume == 0.0
    assert part.solid.is_empty
    assert part.solid.empty_because[0] in PART_NAMES


@pytest.mark.long
def test_without_limits_the_whole_holds_any_load() -> None:
    part = carried_region(Workspace(OPTIMAL), load=LOAD)
    assert part.held_volume == pytest.approx(part.volume, rel=1e-12)


def test_bad_input_is_refused() -> None:
    with pytest.raises(InputError, match="load"):
        carried_region(Workspace(OPTIMAL), load=(np.nan,) * 6)


HOME = OPTIMAL.home_pose
LIMITED = msgspec.structs.replace(
    OPTIMAL,
    tool=Tool((1.0, -1.0, 2.0)),
    payload=Payload(2.0, (1.0, 2.0, 3.0), 5.0),
    actuators=Actuators(push_n=(60, 60, 60, 60, 60, 60)),
    struts=Struts(moment_nm=3.0),
)
PUSH = (0.0, 0.0, -10.0, 0.0, 0.0, 0.0)


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
    check_none_is_nearer(LoadedPose(LIMITED, Pose(at, HOME.quaternion), PUSH))


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
    check_none_is_nearer(LoadedPose(design, pose, PUSH))


def test_a_position_that_holds_the_load_is_its_own_nearest() -> None:
    loaded = LoadedPose(OPTIMAL, HOME, PUSH)
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
        nearest_carrying_pose(LoadedPose(msgspec.structs.replace(LIMITED, **change), HOME, PUSH))
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
