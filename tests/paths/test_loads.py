"""Loads along a path: shares, bounds, and planned paths that hold a demanded load."""

from __future__ import annotations

import itertools
import math
from functools import cache
from importlib.util import find_spec

import msgspec
import numpy as np
import pytest
from limited_designs import limited
from long_cases import long_after
from machines import six
from scipy.spatial.transform import Rotation
from statics_cases import LegMasses
from tool_moves import tool_move

from explorer import (
    PRESETS,
    Actuators,
    Design,
    Guide,
    InputError,
    Payload,
    Pose,
    Struts,
    Tool,
    inverse,
)
from explorer.legs.moves import StraightMoves
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Triple
from explorer.motion.weights import MovingBodies
from explorer.numerics.arrays import FloatArray
from explorer.paths.crossings import path_margins
from explorer.paths.loads import TOLERANCE, DemandedLoad, path_loads
from explorer.paths.planning import NoPathError, plan_path
from explorer.statics.reactions import limit_shares, reactions
from explorer.workspace.limits.valid_moves import moves_are_valid
from explorer.workspace.limits.valid_poses import poses_are_valid


def random_machine(design: Design, seed: int, strength: float = 1.0) -> Design:
    """Return a design near a given one with a random machine, its limits times a strength."""
    rng = np.random.default_rng(seed)
    for name, value in zip(VARIABLES, design.variables, strict=True):
        design = design.with_variable(name, value * rng.uniform(0.9, 1.1))

    def three() -> tuple[float, float, float]:
        x, y, z = rng.normal(size=3).tolist()
        return x, y, z

    def limits() -> Six:
        return six(strength * rng.uniform(50.0, 150.0, 6))

    return msgspec.structs.replace(
        design,
        unit_mm=float(rng.choice([5.0, 10.0, 40.0])),
        tool=Tool(three()),
        payload=Payload(float(rng.uniform(0.0, 5.0)), three(), float(rng.choice([0.0, 10.0]))),
        gravity=three(),
        actuators=Actuators(limits(), limits()),
        struts=Struts(moment_nm=strength * float(rng.uniform(1.0, 3.0))),
        guide=Guide(
            strength * float(rng.uniform(50.0, 150.0)), strength * float(rng.uniform(1.0, 3.0))
        ),
    )


def random_weights(design: Design, seed: int) -> MovingBodies:
    """Return weights of all bodies of a design, its payload included."""
    rng = np.random.default_rng([1, seed])

    def four() -> tuple[float, float, float, float]:
        a, b, c, d = rng.uniform(0.0, 2.0, 4).tolist()
        return a, b, c, d

    legs = LegMasses(
        carriages=four(),
        cylinders=four(),
        cylinder_centres=four(),
        rods=four(),
        rod_centres=four(),
    )
    return legs.bodies.with_payload(design).with_mass(1.0, (1.0, 2.0, 3.0))


def random_move(pose: Pose, seed: int, size: float, angle: float) -> tuple[Pose, Pose]:
    """Return two poses near a pose, by distances of about `size` and turns of about `angle`."""
    rng = np.random.default_rng([2, seed])
    first, last = (
        Pose.of(
            np.array(pose.position) + size * rng.normal(size=3),
            Rotation.from_rotvec(angle * rng.normal(size=3)).as_matrix() @ pose.rotation,
        )
        for _ in range(2)
    )
    return first, last


OPTIMAL = PRESETS["paper-optimal"]
DENSE = np.linspace(0.0, 1.0, 1001)


def dense_shares(
    design: Design,
    move: tuple[Pose, Pose],
    load: FloatArray,
    weights: MovingBodies | None,
    tool: FloatArray,
) -> FloatArray:
    """Return the shares of the limits at dense samples of a move, shape (n, 12)."""
    positions, rotations = tool_move(*move, DENSE, tool)
    given = Configuration(design, positions, rotations, design.tool.position), load
    return limit_shares(design, reactions(*given, weights or MovingBodies().with_payload(design)))


@pytest.mark.parametrize("seed", long_after(8, range(40)))
def test_path_loads_largest_share_is_that_of_dense_samples(seed: int) -> None:
    rng = np.random.default_rng([3, seed])
    design = random_machine(OPTIMAL, seed)
    weights = random_weights(design, seed) if seed % 2 else None
    tool = rng.normal(size=3) if seed % 3 else np.zeros(3)
    # Moves without a turn, without a way, and both.
    size, angle = ((1.5, 0.3), (1.5, 0.0), (0.0, 0.3), (0.05, 0.01))[seed % 4]
    move = random_move(design.home_pose, seed, size, angle)
    if path_margins(move, tool=tool).crossings:
        move = random_move(design.home_pose, seed, 0.5, 0.1)
    load = rng.normal(size=6) * np.array([20.0, 20.0, 20.0, 50.0, 50.0, 50.0])
    x, y, z = tool.tolist()
    along = path_loads(design, move, load, tool=(x, y, z), weights=weights)
    shares = dense_shares(design, move, load, weights, tool)
    most = float(shares.max())
    assert along.utilisation == pytest.approx(most, rel=1e-3)
    assert most <= along.bound <= (1.0 + TOLERANCE) * along.utilisation
    assert along.part is not None
    # The part and the place are those of the share that is told.
    there = tool_move(*move, along.place, tool)
    given = Configuration(design, *there, design.tool.position), load
    bodies = weights or MovingBodies().with_payload(design)
    here = limit_shares(design, reactions(*given, bodies))[0]
    assert here[along.part] == here.max() == pytest.approx(along.utilisation, rel=1e-10)


def test_path_loads_of_singular_path_is_infinite_at_its_first_crossing() -> None:
    design = random_machine(OPTIMAL, 1)
    home = design.home_pose
    x, y, z = home.position
    below = Pose((x + 1.0, y, -2.0 * z), home.quaternion)
    along = path_loads(design, (home, below, home), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    crossings = path_margins((home, below, home)).crossings
    assert len(crossings) >= 2
    assert along.utilisation == along.bound == math.inf
    assert along.part is None
    assert along.place == min(each.move + each.share for each in crossings)
    # A path that lies in the base plane is singular from its start.
    flat = tuple(Pose((x + each, y, 0.0), home.quaternion) for each in (0.0, 1.0))
    along = path_loads(design, flat, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert (along.utilisation, along.place) == (math.inf, 0.0)
    assert np.isinf(along.utilisations).all()
    assert along.bound == math.inf


def test_path_loads_without_limit_or_load_has_no_part() -> None:
    x, y, z = OPTIMAL.home_pose.position
    poses = OPTIMAL.home_pose, Pose((x + 1.0, y, z), OPTIMAL.home_pose.quaternion)
    along = path_loads(OPTIMAL, poses, [100.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert (along.utilisation, along.bound, along.part) == (0.0, 0.0, None)
    empty = msgspec.structs.replace(random_machine(OPTIMAL, 2), payload=OPTIMAL.payload)
    along = path_loads(empty, poses, np.zeros(6))
    assert (along.utilisation, along.part) == (0.0, None)


@pytest.mark.parametrize("load", [[1.0, 2.0], [math.nan] * 6, [math.inf] * 6])
def test_path_loads_bad_load_is_refused(load: list[float]) -> None:
    pose = OPTIMAL.home_pose
    with pytest.raises(InputError, match="load"):
        path_loads(OPTIMAL, (pose, pose), load)
    with pytest.raises(InputError, match="at least two poses"):
        path_loads(OPTIMAL, (pose,), np.zeros(6))


@pytest.mark.parametrize("seed", range(4))
def test_holds_along_is_true_below_the_bound_and_false_above_the_largest_share(seed: int) -> None:
    rng = np.random.default_rng([5, seed])
    design = random_machine(OPTIMAL, seed)
    poses = [random_move(design.home_pose, 100 * seed + k, 1.0, 0.2) for k in range(30)]
    p, r = (
        [np.array([m[k].position for m in poses]) for k in (0, 1)],
        [np.array([m[k].rotation for m in poses]) for k in (0, 1)],
    )
    moves = StraightMoves.between(p[0], r[0], p[1], r[1])
    load = rng.normal(size=6) * 10.0
    is_held = DemandedLoad.of(design, load).holds_along(moves)
    largest = [path_loads(design, move, load) for move in poses]
    assert not is_held[[np.isinf(each.utilisation) for each in largest]].any()
    assert not is_held[[each.utilisation > 1.0 + 1e-4 for each in largest]].any()
    assert is_held[[each.bound <= 1.0 for each in largest]].all()
    # Limits at which a move just holds the load, or just does not.
    index = next(k for k, each in enumerate(largest) if math.isfinite(each.utilisation))
    for factor in (1.0 + 1e-3, 1.0 - 1e-3):
        scaled = random_machine(OPTIMAL, seed, strength=factor * largest[index].utilisation)
        at_limit = DemandedLoad.of(scaled, load).holds_along(StraightMoves.along(poses[index]))
        assert at_limit == [factor > 1.0]


THICK = limited(PRESETS["paper-optimal"], leg_radii=(0.2,) * 4)
needs_ompl = pytest.mark.skipif(find_spec("ompl") is None, reason="OMPL is not installed")
Case = tuple[Design, FloatArray, MovingBodies | None, Pose, Pose]


@cache
def detours() -> tuple[Case, ...]:
    """Return ends that hold a load, between which the straight move is valid and does not."""
    found: list[Case] = []
    for seed in range(20):
        rng = np.random.default_rng([6, seed])
        design = random_machine(THICK, seed, strength=3.0)
        load = rng.normal(size=6) * 20.0
        weights = random_weights(design, seed) if seed % 2 else None
        demanded = DemandedLoad.of(design, load, weights)
        positions = rng.uniform([0, -12, 0], [20, 22, 18], (6000, 3))
        rotations = Rotation.random(6000, random_state=rng).as_matrix()
        valid = poses_are_valid(design, positions, rotations)
        held = demanded.utilisations(positions, rotations).max(axis=1) <= 1.0
        p, r = positions[valid & held][:20], rotations[valid & held][:20]
        first, last = np.triu_indices(len(p), 1)
        moves = p[first], r[first], p[last], r[last]
        is_detour = moves_are_valid(design, *moves)
        middle = StraightMoves.between(*moves).poses(
            np.arange(len(first)), np.full(len(first), 0.5)
        )
        is_detour &= demanded.utilisations(*middle).max(axis=1) > 1.05
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
        held = reactions(*given, weights or MovingBodies().with_payload(design))
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
        assert along.utilisation <= 1.0 + 1e-4
        assert along.bound <= (1.0 + TOLERANCE) * along.utilisation
        assert path_margins(poses, tool=np.array(tool)).crossings == ()


def barred() -> tuple[Design, FloatArray, Pose, Pose]:
    """Return a corridor along y in which a load bars the way.

    The force of l4 is l4 |8 F + y F| / (a3y z) for a force F along z and a moment 8 F about x,
    whatever the orientation. About y = 0 it is everywhere greater than at both ends.
    """
    (a3x, _), z = THICK.a3, 3.0
    box = (a3x - 0.5, -8.0, z - 0.2), (a3x + 0.5, 7.0, z + 0.2)
    free = (0.0, 100.0)
    wide = limited(THICK, box=box, l1=free, d2=free, d4=free, l4=free)
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
    share = float(
        DemandedLoad.of(design, 2.0 * load).utilisations(goal.position, goal.rotation).max()
    )
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
    share = float(DemandedLoad.of(design, load).utilisations(goal.position, goal.rotation).max())
    x, y, z = goal.position
    higher = Pose((x, y, z + 0.1), goal.quaternion)
    path = plan_path(design, goal, higher, load=load / share)
    assert path.poses == (goal, higher)
