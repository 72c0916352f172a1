"""Planned paths hold a demanded load, by a detour if the straight move does not."""

from __future__ import annotations

import itertools
from functools import cache
from importlib.util import find_spec

import msgspec
import numpy as np
import pytest
from limited_designs import limited
from loaded_designs import random_machine, random_weights
from long_cases import long_after
from scipy.spatial.transform import Rotation
from tool_moves import tool_move

from explorer import PRESETS, Actuators, Design, InputError, Pose, inverse
from explorer.legs.moves import StraightMoves
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray
from explorer.paths.crossings import path_margins
from explorer.paths.loads import TOLERANCE, DemandedLoad, path_loads
from explorer.paths.planning import NoPathError, plan_path
from explorer.statics.reactions import limit_shares, reactions
from explorer.statics.weights import Weights, design_weights
from explorer.workspace.limits.valid_moves import moves_are_valid
from explorer.workspace.limits.valid_poses import poses_are_valid

OPTIMAL = limited(PRESETS["paper-optimal"], leg_radii=(0.2,) * 4)
needs_ompl = pytest.mark.skipif(find_spec("ompl") is None, reason="OMPL is not installed")
Case = tuple[Design, FloatArray, Weights | None, Pose, Pose]


@cache
def detours() -> tuple[Case, ...]:
    """Return ends that hold a load, between which the straight move is valid and does not."""
    found: list[Case] = []
    for seed in range(20):
        rng = np.random.default_rng([6, seed])
        design = random_machine(OPTIMAL, seed, strength=3.0)
        load = rng.normal(size=6) * 20.0
        weights = random_weights(design, seed) if seed % 2 else None
        demanded = DemandedLoad.of(design, load, weights)
        positions = rng.uniform([0, -12, 0], [20, 22, 18], (6000, 3))
        rotations = Rotation.random(6000, random_state=rng).as_matrix()
        valid = poses_are_valid(design, positions, rotations)
        held = demanded.shares(positions, rotations).max(axis=1) <= 1.0
        p, r = positions[valid & held][:20], rotations[valid & held][:20]
        first, last = np.triu_indices(len(p), 1)
        moves = p[first], r[first], p[last], r[last]
        is_detour = moves_are_valid(design, *moves)
        middle = StraightMoves.between(*moves).poses(
            np.arange(len(first)), np.full(len(first), 0.5)
        )
        is_detour &= demanded.shares(*middle).max(axis=1) > 1.05
        for a, b in list(zip(first[is_detour], last[is_detour], strict=True))[:1]:
            found.append((design, load, weights, Pose.of(p[a], r[a]), Pose.of(p[b], r[b])))
    return tuple(found[:6])


def densest(case: Case, poses: tuple[Pose, ...], at: Triple = (0.0, 0.0, 0.0)) -> float:
    """Return the largest share of dense samples of a path, all of them valid."""
    design, load, weights, _, _ = case
    most = 0.0
    tool = np.array(at)
    for start, end in itertools.pairwise(poses):
        positions, rotations = tool_move(start, end, np.linspace(0.0, 1.0, 300), tool)
        assert poses_are_valid(design, positions, rotations).all()
        given = Configuration(design, positions, rotations, design.tool.position), load
        held = reactions(*given, weights or design_weights(design))
        most = max(most, float(limit_shares(design, held).max()))
    return most


@needs_ompl
@pytest.mark.parametrize("index", long_after(2, range(6)))
def test_plan_path_with_load_holds_it_all_along_by_a_detour(index: int) -> None:
    """One of the moves is that of a tool."""
    tool = (1.0, -0.5, 2.0) if index == 1 else (0.0, 0.0, 0.0)
    case = detours()[index]
    design, load, weights, start, goal = case
    assert densest(case, (start, goal)) > 1.04
    path = plan_path(design, start, goal, load=load, weights=weights, tool=tool, seconds=60.0)
    assert len(path.poses) > 2
    assert (path.poses[0], path.poses[-1]) == (start, goal)
    for poses in (path.poses, path.unsmoothed):
        assert densest(case, poses, tool) <= 1.0 + 1e-4
        along = path_loads(design, poses, load, weights=weights, tool=tool)
        assert along.share <= 1.0 + 1e-4
        assert along.bound <= (1.0 + TOLERANCE) * along.share
        assert path_margins(poses, tool=np.array(tool)).crossings == ()


def barred() -> tuple[Design, FloatArray, Pose, Pose]:
    """Return a corridor along y in which a load bars the way.

    The force of l4 is l4 |8 F + y F| / (a3y z) for a force F along z and a moment 8 F about x,
    whatever the orientation. About y = 0 it is everywhere greater than at both ends.
    """
    (a3x, _), z = OPTIMAL.a3, 3.0
    box = (a3x - 0.5, -8.0, z - 0.2), (a3x + 0.5, 7.0, z + 0.2)
    free = (0.0, 100.0)
    wide = limited(OPTIMAL, box=box, l1=free, d2=free, d4=free, l4=free)
    actuators = Actuators((1e6, 1e6, 1e6, 1e6, 1e6, 25.0))
    design = msgspec.structs.replace(wide, actuators=actuators)
    rotation = Rotation.from_euler("ZYX", (-70.0, 20.0, 30.0), degrees=True).as_matrix()
    ends = [Pose.of((a3x, y, z), rotation) for y in (-7.0, 6.3)]
    return design, np.array([0.0, 0.0, 10.0, 80.0, 0.0, 0.0]), ends[0], ends[1]


@needs_ompl
def test_plan_path_with_load_that_bars_the_way_finds_none() -> None:
    design, load, start, goal = barred()
    # Every way passes the plane y = 0, where no pose holds the load.
    x, z = np.meshgrid(design.a3[0] + np.linspace(-0.5, 0.5, 21), [2.8, 3.2])
    across = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    l4 = inverse(design, across, np.eye(3))[:, 5]
    assert (l4 * 80.0 / (design.a3[1] * across[:, 2]) > 25.0).all()
    assert len(plan_path(design, start, goal, seconds=60.0).poses) >= 2
    with pytest.raises(NoPathError, match=r"no path that holds the load was found") as caught:
        plan_path(design, start, goal, load=load, seconds=1.0)
    assert caught.value.reason == "out of time"


def test_plan_path_end_that_does_not_hold_the_load_names_part_and_share() -> None:
    design, load, start, goal = barred()
    share = float(DemandedLoad.of(design, 2.0 * load).shares(goal.position, goal.rotation).max())
    assert share > 1.0
    words = f"actuator l4 at {100.0 * share:.4g} % of its limit"
    with pytest.raises(InputError, match=f"the goal does not hold the load: {words}"):
        plan_path(design, start, goal, load=2.0 * load)
    with pytest.raises(InputError, match="the start does not hold the load"):
        plan_path(design, goal, start, load=2.0 * load)
    # A share that exceeds the limit by little is not told as 100 %.
    slightly = 2.0 * load / share * 1.00001
    with pytest.raises(InputError, match=r"at 100\.001 % of its limit"):
        plan_path(design, start, goal, load=slightly)


def test_plan_path_end_on_the_limit_is_held() -> None:
    design, load, _, goal = barred()
    share = float(DemandedLoad.of(design, load).shares(goal.position, goal.rotation).max())
    x, y, z = goal.position
    higher = Pose((x, y, z + 0.1), goal.quaternion)
    path = plan_path(design, goal, higher, load=load / share)
    assert path.poses == (goal, higher)
