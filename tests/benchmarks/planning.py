"""Lines in the folds and paths between random poses of one mode, beside straight moves."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds
from benchmarks.timing import Spread, best_of, elapsed
from explorer import Pose, inverse, margins, to_folds
from explorer.mechanism.margins import mode_of, signs_of
from explorer.numerics.compiled import warm
from explorer.paths.planning import NoPathError, plan_path
from explorer.paths.search import Proofs
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.limits.quantities import DELTA1, DELTA2, DELTA3, QUANTITY
from explorer.workspace.limits.valid_moves import moves_are_valid
from explorer.workspace.limits.valid_poses import Rules, poses_are_valid

MARGINS = (DELTA1, DELTA2, DELTA3)
LINES, PAIRS, MODE = 10_000, 8_805, 5
# Standard deviation of positions, in design units.
SPREAD = 10.0
PATHS, SECONDS = 100, 2.0
RADIUS = 0.2
THICK = with_radius(DESIGN, RADIUS)
LOWS, HIGHS = [0.0, -12.0, 0.0], [20.0, 22.0, 18.0]
SHORT = {"LINES": 50, "PAIRS": 20, "PATHS": 2}


def random_pairs() -> Iterator[tuple[Pose, Pose]]:
    """Yield pairs of valid poses, anywhere in the box and of any orientation."""
    rng = np.random.default_rng(1)
    while True:
        positions = rng.uniform(LOWS, HIGHS, (2000, 3))
        rotations = Rotation.random(2000, random_state=rng).as_matrix()
        valid = poses_are_valid(THICK, positions, rotations)
        poses = [Pose.of(p, r) for p, r in zip(positions[valid], rotations[valid], strict=True)]
        yield from zip(poses[::2], poses[1::2], strict=False)


def lines_of_a_mode() -> Iterator[Row]:
    """Yield the row of lines between random poses of one mode, within no other limit."""
    rng = np.random.default_rng(0)
    position = SPREAD * rng.normal(size=(24 * LINES, 3))
    rotation = Rotation.random(24 * LINES, random_state=rng).as_matrix()
    mode = np.flatnonzero(mode_of(margins(position, rotation)) == MODE)[: 2 * LINES]
    p, r = position[mode], rotation[mode]
    rules = free_rules(signs_of(MODE))
    proofs = Proofs(DESIGN, rules)
    ends = list(zip(*np.split(to_folds(p, r), 2), strict=True))
    found = [proofs.prove_line(*each) is not None for each in ends]
    took = best_of(3, lambda: [proofs.prove_line(*each) for each in ends]) / LINES
    straight = moves_are_valid(DESIGN, p[:LINES], r[:LINES], p[LINES:], r[LINES:], rules=rules)
    yield Row(
        f"lines in the folds between {LINES:,} pairs of one mode, no limit but the margins",
        f"{sum(found):,} proven, {seconds(took)} each",
        f"{LINES:,}, 1 ms",
        f"straight moves: {int(straight.sum()):,} valid",
    )


def lines_within_limits() -> Iterator[Row]:
    """Yield the row of lines between random poses within all limits of the optimum."""
    rng, pairs = np.random.default_rng(1), 0
    proofs = Proofs(DESIGN, Rules.of(DESIGN))
    found = straight = 0
    while pairs < PAIRS:
        p = rng.uniform(LOWS, HIGHS, (100_000, 3))
        r = Rotation.random(len(p), random_state=rng).as_matrix()
        valid = poses_are_valid(DESIGN, p, r)
        p, r = (x[valid][: 2 * (valid.sum() // 2)] for x in (p, r))
        d1, d3 = inverse(DESIGN, p, r)[:, [1, 3]].T
        order = np.sign([d1, d3, d3 - d1])
        half = len(p) // 2
        # Legs 1, 2 and 3 cannot pass each other on the guide.
        same = np.flatnonzero((order[:, :half] == order[:, half:]).all(axis=0))[: PAIRS - pairs]
        pairs += len(same)
        ends = p[same], r[same], p[same + half], r[same + half]
        straight += int(moves_are_valid(DESIGN, *ends, rules=proofs.rules).sum())
        lines = zip(to_folds(*ends[:2]), to_folds(*ends[2:]), strict=True)
        found += sum(proofs.prove_line(*line) is not None for line in lines)
    yield Row(
        f"such lines between {PAIRS:,} pairs within all limits of the optimum",
        f"{100.0 * found / PAIRS:.1f} % need no search",
        "95 %",
        f"straight moves: {100.0 * straight / PAIRS:.1f} % valid",
    )


def free_rules(signs: tuple[int, int, int]) -> Rules:
    """Return rules that demand the signs of a mode and nothing else."""
    rules = Rules.of(DESIGN, signs, 0).without_clearances().tighten(0.0, 0.0)
    return Rules(rules.row, rules.demands[np.isin(rules.demands[:, QUANTITY], MARGINS)])


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    yield from lines_of_a_mode()
    yield from lines_within_limits()
    solved: list[float] = []
    apart = late = 0
    for start, goal in random_pairs():
        if len(solved) + late == PATHS:
            break
        try:
            took = elapsed(functools.partial(plan_path, THICK, start, goal, seconds=SECONDS))
        except NoPathError as error:
            # Proved to have none, so that no time would help.
            apart += error.reason == "other order"
            late += error.reason == "out of time"
        else:
            if took <= SECONDS:
                solved.append(took)
            else:
                late += 1
    spread = Spread.of(solved)
    yield Row(
        f"paths between random poses of one mode, radius {RADIUS}, within {SECONDS:g} s each",
        f"{len(solved)} of {PATHS} ({apart} more pairs proved to have none)",
        "95 of 100",
    )
    yield Row(
        "such a path found, proved and smoothed: median, 95 of 100, longest",
        f"{seconds(spread.p50)}, {seconds(spread.p95)}, {seconds(spread.longest)}",
    )
