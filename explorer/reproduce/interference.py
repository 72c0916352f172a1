"""The claim on leg interference: the 4-4 beside its 6-4 twin, for a range of places of a2."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from explorer.legs.clearance import PAIRS, leg_clearances
from explorer.legs.interference import step_overlaps
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.reproduce.claim import Measured, Verdict
from explorer.reproduce.six_legs import six_four_twin
from explorer.workspace.limits.constraints import constraints, satisfies

OPTIMAL = PRESETS["paper-optimal"]
ROTATION = home_pose(OPTIMAL).rotation
A2X = (5.0, 10.0, 15.0, 20.0)
"""Positions of a2 at which the twin is measured, in design units."""

STEP, LOWEST = 1.0, 2.0
MOVES = (0.5, 1.0)
"""Lengths of the steps along x, y and z whose swept tetrahedra are tested, in design units."""

RADII = (0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8)


@dataclass(frozen=True)
class Interference:
    """How the legs of a mechanism stand in each other's way over a workspace.

    Attributes:
        name: Name of the mechanism.
        least: Least clearance of thin legs at any node, in design units.
        median: Median over the nodes of the least clearance of thin legs.
        clearer: Share of the nodes at which it is clearer than the 4-4; None for the 4-4 itself.
        steps: Shares of the steps from nodes along x, y and z on which legs collide by the paper's
            test of swept tetrahedra, by the length of the steps, as in `MOVES`.
        free: Shares of the nodes without a collision, by the radius of all legs, as in `RADII`.
    """

    name: str
    least: float
    median: float
    clearer: float | None
    steps: tuple[float, ...]
    free: tuple[float, ...]


def interference() -> Measured:
    """Compare clearances and swept steps of the 4-4 and its 6-4 twin over a workspace."""
    nodes = _nodes()
    pairs = leg_clearances(OPTIMAL, nodes, ROTATION).clearance
    four = pairs.min(axis=1)

    def collides(start: FloatArray, end: FloatArray) -> BoolArray:
        swept = step_overlaps(OPTIMAL, start, ROTATION, end, ROTATION)
        return np.asarray(swept.reshape(len(swept), -1).any(axis=1))

    ours = _interference("4-4", nodes, four, collides)
    twins: list[Interference] = []
    for a2x in A2X:
        twin = six_four_twin(OPTIMAL, a2x)
        six = twin.clearances(nodes, ROTATION).min(axis=1)
        twins.append(
            _interference(
                twin.name,
                nodes,
                six,
                lambda start, end, twin=twin: twin.step_overlaps(start, end, ROTATION),
                float((six > four).mean()),
            )
        )
    closest = float(pairs[:, PAIRS.index((2, 3))].max())
    return Measured(
        _words(len(nodes), ours, twins, closest),
        _verdict(ours, twins),
        {
            "nodes": len(nodes),
            "radii": RADII,
            "mechanisms": [asdict(each) for each in (ours, *twins)],
        },
        tuple(_table((ours, *twins))),
    )


def _interference(
    name: str,
    nodes: FloatArray,
    clearance: FloatArray,
    collides: Callable[[FloatArray, FloatArray], BoolArray],
    clearer: float | None = None,
) -> Interference:
    """Measure a mechanism with a least clearance at each node, shape (n,)."""
    return Interference(
        name,
        float(clearance.min()),
        float(np.median(clearance)),
        clearer,
        tuple(_share_of_steps(nodes, collides, length) for length in MOVES),
        tuple(float((clearance > 2.0 * radius).mean()) for radius in RADII),
    )


def _share_of_steps(
    nodes: FloatArray, collides: Callable[[FloatArray, FloatArray], BoolArray], length: float
) -> float:
    """Return the share of steps of a length along x, y and z on which legs collide."""
    found: list[BoolArray] = []
    for axis in np.eye(3):
        ends = nodes + length * axis
        within = _within(ends)
        found.append(collides(nodes[within], ends[within]))
    return float(np.concatenate(found).mean())


def _verdict(ours: Interference, twins: Sequence[Interference]) -> Verdict:
    """Judge: confirmed if the 4-4 is better in each way, within if it is in some."""
    better = (
        all(ours.least > twin.least for twin in twins),
        all(a < b for twin in twins for a, b in zip(ours.steps, twin.steps, strict=True)),
        all((twin.clearer or 0.0) < 0.5 for twin in twins),
    )
    if all(better):
        return "confirmed"
    return "confirmed within" if any(better) else "not confirmed"


def _words(nodes: int, ours: Interference, twins: Sequence[Interference], closest: float) -> str:
    least = [twin.least for twin in twins]
    clearer = [twin.clearer or 0.0 for twin in twins]
    never = [radius for radius, share in zip(RADII, ours.free, strict=True) if share == 1.0]
    more = [
        f"{radius:g}"
        for k, radius in enumerate(RADII)
        if all(ours.free[k] > twin.free[k] for twin in twins)
    ]
    text = (
        f"At {nodes} nodes of the optimum's workspace with z ≥ {LOWEST:g}, for a2x from "
        f"{A2X[0]:g} to {A2X[-1]:g}: the least clearance of thin legs is {ours.least:.3f} units "
        f"for the 4-4 and {min(least):.3f} to {max(least):.3f} for the 6-4. Yet at "
        f"{min(clearer):.0%} to {max(clearer):.0%} of the nodes the 6-4 is the clearer one, since "
        f"legs 2 and 3 of the 4-4 stand at most {closest:.3f} apart everywhere. Legs with radii up "
        f"to {max(never, default=0.0):g} collide nowhere in the 4-4."
    )
    if more:
        text += (
            " It has more positions free of collisions than every twin for radii of "
            f"{', '.join(more)}, not for the others tried."
        )
    steps = "; ".join(
        f"{ours.steps[k]:.1%} at a length of {length:g} ({_range([t.steps[k] for t in twins])} "
        "for the 6-4)"
        for k, length in enumerate(MOVES)
    )
    return (
        f"{text} By the paper's test of swept tetrahedra legs collide on these shares of the steps "
        f"along x, y and z: {steps}. On a step along x that is longer than their distance, legs 2 "
        "and 3 sweep over each other's place, though at different times, so that the answer "
        "depends on the step, which the paper does not print."
    )


def _range(shares: Sequence[float]) -> str:
    return f"{min(shares):.1%} to {max(shares):.1%}"


def _table(mechanisms: Sequence[Interference]) -> list[str]:
    moves = "".join(f"{f'step {length:g}':>10}" for length in MOVES)
    lines = [f"{'':14}{'least':>8}{'median':>8}{'clearer':>9}{moves}"]
    for each in mechanisms:
        clearer = "" if each.clearer is None else f"{each.clearer:.1%}"
        steps = "".join(f"{share:10.1%}" for share in each.steps)
        lines.append(f"{each.name:14}{each.least:8.3f}{each.median:8.3f}{clearer:>9}{steps}")
    lines.append("share of nodes without a collision, by the radius of all legs")
    lines.append(f"{'':14}" + "".join(f"{radius:8g}" for radius in RADII))
    lines += [
        f"{each.name:14}" + "".join(f"{share:8.1%}" for share in each.free) for each in mechanisms
    ]
    return lines


def _nodes() -> FloatArray:
    """Return the nodes of a grid in the workspace of the optimum, off the base plane, (n, 3)."""
    reach = OPTIMAL.reach
    lows, highs = OPTIMAL.limits.box or ((-reach,) * 3, (reach,) * 3)
    axes = [np.arange(low, high + 0.5 * STEP, STEP) for low, high in zip(lows, highs, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    grid = grid[grid[:, 2] >= LOWEST]
    return grid[_within(grid)]


def _within(positions: FloatArray) -> BoolArray:
    return np.asarray(satisfies(OPTIMAL, constraints(OPTIMAL, ROTATION), positions).all(axis=-1))
