"""The largest share of a limit along a path is that of dense samples, and its bound holds."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from loaded_designs import random_machine, random_move, random_weights
from long_cases import long_after
from tool_moves import tool_move

from explorer import PRESETS, Design, InputError, Pose
from explorer.legs.moves import StraightMoves
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
    assert along.share == pytest.approx(most, rel=1e-3)
    assert most <= along.bound <= (1.0 + TOLERANCE) * along.share
    assert along.part is not None
    # The part and the place are those of the share that is told.
    there = tool_move(*move, along.place, tool)
    given = Configuration(design, *there, design.tool.position), load
    here = limit_shares(design, reactions(*given, weights or design_weights(design)))[0]
    assert here[along.part] == here.max() == pytest.approx(along.share, rel=1e-10)


def test_path_loads_of_singular_path_is_infinite_at_its_first_crossing() -> None:
    design = random_machine(OPTIMAL, 1)
    home = design.home_pose
    x, y, z = home.position
    below = Pose((x + 1.0, y, -2.0 * z), home.quaternion)
    along = path_loads(design, (home, below, home), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    crossings = path_margins((home, below, home)).crossings
    assert len(crossings) >= 2
    assert along.share == along.bound == math.inf
    assert along.part is None
    assert along.place == min(each.move + each.share for each in crossings)
    # A path that lies in the base plane is singular from its start.
    flat = tuple(Pose((x + each, y, 0.0), home.quaternion) for each in (0.0, 1.0))
    along = path_loads(design, flat, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert (along.share, along.place) == (math.inf, 0.0)
    assert np.isinf(along.shares).all()
    assert along.bound == math.inf


def test_path_loads_without_limit_or_load_has_no_part() -> None:
    x, y, z = OPTIMAL.home_pose.position
    poses = OPTIMAL.home_pose, Pose((x + 1.0, y, z), OPTIMAL.home_pose.quaternion)
    along = path_loads(OPTIMAL, poses, [100.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert (along.share, along.bound, along.part) == (0.0, 0.0, None)
    empty = msgspec.structs.replace(random_machine(OPTIMAL, 2), payload=OPTIMAL.payload)
    along = path_loads(empty, poses, np.zeros(6))
    assert (along.share, along.part) == (0.0, None)


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
    assert not is_held[[np.isinf(each.share) for each in largest]].any()
    assert not is_held[[each.share > 1.0 + 1e-4 for each in largest]].any()
    assert is_held[[each.bound <= 1.0 for each in largest]].all()
    # Limits at which a move just holds the load, or just does not.
    index = next(k for k, each in enumerate(largest) if math.isfinite(each.share))
    for factor in (1.0 + 1e-3, 1.0 - 1e-3):
        scaled = random_machine(OPTIMAL, seed, strength=factor * largest[index].share)
        at_limit = DemandedLoad.of(scaled, load).holds_along(StraightMoves.along(poses[index]))
        assert at_limit == [factor > 1.0]
