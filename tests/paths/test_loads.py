"""The largest share of a limit along a path is that of dense samples, and bounds them all."""

from __future__ import annotations

import itertools
import math

import msgspec
import numpy as np
import pytest
from loaded_designs import random_machine, random_move, random_weights
from long_cases import long_after
from tool_moves import tool_move

from explorer import PRESETS, Design, InputError, Pose, margins
from explorer.mechanism.configuration import Configuration
from explorer.numerics.arrays import FloatArray
from explorer.paths.crossings import path_margins
from explorer.paths.loads import TOLERANCE, DemandedLoad, path_loads
from explorer.statics.reactions import limit_shares, reactions
from explorer.statics.weights import Weights, design_weights

OPTIMAL = PRESETS["paper-optimal"]
DENSE = np.linspace(0.0, 1.0, 1001)


def dense_shares(
    design: Design,
    move: tuple[Pose, Pose],
    load: FloatArray,
    weights: Weights | None,
    tool: FloatArray,
) -> FloatArray:
    """Return the shares of the limits at dense samples of a move, shape (n, 12)."""
    positions, rotations = tool_move(*move, DENSE, tool)
    given = Configuration(design, positions, rotations, design.tool.position), load
    return limit_shares(design, reactions(*given, weights or design_weights(design)))


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
    size = max(1.0, most)
    assert along.largest.share == pytest.approx(most, abs=2.0 * TOLERANCE * size)
    assert most <= along.largest.bound * (1.0 + 1e-12)
    assert along.largest.bound - along.largest.share <= TOLERANCE * size
    assert along.largest.part is not None
    # The part and the place are those of the share that is told.
    there = tool_move(*move, along.largest.place, tool)
    given = Configuration(design, *there, design.tool.position), load
    here = limit_shares(design, reactions(*given, weights or design_weights(design)))[0]
    assert here[along.largest.part] == here.max() == pytest.approx(along.largest.share, rel=1e-10)


@pytest.mark.parametrize("seed", range(4))
def test_path_loads_of_moves_near_singular_poses_bound_dense_samples(seed: int) -> None:
    rng = np.random.default_rng([4, seed])
    design = random_machine(OPTIMAL, seed)
    home = design.home_pose
    x, y, _ = home.position
    # b4 dips towards the base plane, δ3 = 0, without touching it.
    low = 10.0 ** -float(rng.uniform(1.0, 4.0))
    poses = [home, Pose((x + 1.0, y, low), home.quaternion), home]
    load = rng.normal(size=6) * 20.0
    along = path_loads(design, poses, load)
    moves = [dense_shares(design, m, load, None, np.zeros(3)) for m in itertools.pairwise(poses)]
    most = max(float(each.max()) for each in moves)
    assert most <= along.largest.bound * (1.0 + 1e-12)
    assert along.largest.share >= most * (1.0 - TOLERANCE) - TOLERANCE
    assert along.largest.bound - along.largest.share <= TOLERANCE * max(1.0, most)
    assert along.largest.place == pytest.approx(1.0, abs=0.05)


def test_path_loads_samples_have_the_shares_of_their_poses() -> None:
    design = random_machine(OPTIMAL, 5)
    first, second = random_move(design.home_pose, 5, 1.0, 0.1)
    poses = (first, second, design.home_pose)
    load = np.array([3.0, -4.0, 5.0, 0.0, 1.0, 2.0])
    along = path_loads(design, poses, load, samples=11)
    assert along.poses == poses
    np.testing.assert_allclose(along.at, np.linspace(0.0, 2.0, 21), atol=1e-12)
    for at, shares in zip(along.at, along.shares, strict=True):
        move = 0 if at <= 1.0 else 1
        ends = poses[move], poses[move + 1]
        there = tool_move(*ends, at - move, np.zeros(3))
        given = Configuration(design, *there, design.tool.position), load
        expected = limit_shares(design, reactions(*given, design_weights(design)))[0]
        np.testing.assert_allclose(shares, expected, rtol=1e-9)
    assert along.shares.max() <= along.largest.share


def test_path_loads_of_singular_path_is_infinite_at_its_first_crossing() -> None:
    design = random_machine(OPTIMAL, 1)
    home = design.home_pose
    x, y, z = home.position
    below = Pose((x + 1.0, y, -2.0 * z), home.quaternion)
    along = path_loads(design, (home, below, home), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    crossings = path_margins((home, below, home)).crossings
    assert len(crossings) >= 2
    assert along.largest.share == along.largest.bound == math.inf
    assert along.largest.part is None
    assert along.largest.place == min(each.move + each.share for each in crossings)
    # A path that lies in the base plane is singular from its start.
    flat = tuple(Pose((x + each, y, 0.0), home.quaternion) for each in (0.0, 1.0))
    along = path_loads(design, flat, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert (along.largest.share, along.largest.place) == (math.inf, 0.0)
    assert np.isinf(along.shares).all()


def test_path_loads_without_limit_or_load_has_no_part() -> None:
    x, y, z = OPTIMAL.home_pose.position
    poses = OPTIMAL.home_pose, Pose((x + 1.0, y, z), OPTIMAL.home_pose.quaternion)
    along = path_loads(OPTIMAL, poses, [100.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert (along.largest.share, along.largest.bound, along.largest.part) == (0.0, 0.0, None)
    empty = msgspec.structs.replace(random_machine(OPTIMAL, 2), payload=OPTIMAL.payload)
    along = path_loads(empty, poses, np.zeros(6))
    assert (along.largest.share, along.largest.part) == (0.0, None)


@pytest.mark.parametrize("load", [[1.0, 2.0], [math.nan] * 6, [math.inf] * 6])
def test_path_loads_bad_load_is_refused(load: list[float]) -> None:
    pose = OPTIMAL.home_pose
    with pytest.raises(InputError, match="load"):
        path_loads(OPTIMAL, (pose, pose), load)
    with pytest.raises(InputError, match="at least two poses"):
        path_loads(OPTIMAL, (pose,), np.zeros(6))


@pytest.mark.parametrize("seed", range(4))
def test_holds_along_agrees_with_the_largest_share(seed: int) -> None:
    rng = np.random.default_rng([5, seed])
    design = random_machine(OPTIMAL, seed)
    moves = [random_move(design.home_pose, 100 * seed + k, 1.0, 0.2) for k in range(30)]
    demanded = DemandedLoad.of(design, rng.normal(size=6) * 10.0)
    ends = [np.array([move[k].position for move in moves]) for k in (0, 1)]
    turns = [np.array([move[k].rotation for move in moves]) for k in (0, 1)]
    given = ends[0], turns[0], ends[1], turns[1]
    bound, share, place = demanded.largest_along(*given)
    regular = np.isfinite(bound)
    assert regular.sum() > 15
    assert (share[regular] <= bound[regular]).all()
    assert ((place >= 0.0) & (place <= 1.0)).all()
    # Limits at which a move just holds the load, or just does not.
    index = int(np.flatnonzero(regular)[seed % int(regular.sum())])
    one = tuple(each[index : index + 1] for each in given)
    for factor, holds in ((1.0 + 1e-5, True), (1.0 - 1e-5, False)):
        scaled = random_machine(OPTIMAL, seed, strength=factor * float(share[index]))
        at_limit = DemandedLoad.of(scaled, demanded.load)
        assert at_limit.holds_along(one[0], one[1], one[2], one[3]) == [holds]
    crossed = np.array([bool(path_margins(move).crossings) for move in moves])
    assert not demanded.holds_along(*given)[crossed].any()
    assert (np.abs(margins(ends[0], turns[0])) > 0.0).all()
