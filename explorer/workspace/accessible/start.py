"""Whether a position can be started from, and if not, which one nearby can."""

from __future__ import annotations

import numpy as np

from explorer.errors import InputError
from explorer.legs.clearance import PAIRS, leg_clearances
from explorer.mechanism.design import Design
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.numerics.descent import descend
from explorer.workspace.accessible.nodes import middles_over
from explorer.workspace.limits.broken import violations
from explorer.workspace.limits.constraints import Never, constraints, home_signs, slacks
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.volume import bounds

# Of the nearest position without trouble: cells an axis that are looked at, the nearest of
# which are descended from, and what counts as clear, a share of the reach.
CELLS = 40
STARTS = 6
CLEAR = 1e-6


class StartError(InputError):
    """A position from which nothing can be reached.

    Attributes:
        nearest: The nearest position without trouble at the same orientation, shape (3,);
            None if there is none.
    """

    def __init__(self, message: str, nearest: FloatArray | None) -> None:
        super().__init__(message)
        self.nearest = nearest


def check_start(design: Design, rotation: FloatArray, position: FloatArray) -> None:
    """Raise a `StartError` if a position, that of the home pose say, cannot be used.

    It names the limits or pairs of legs, and the nearest position where all is well.
    """
    trouble = troubles(design, rotation, position)
    if not trouble:
        return
    text = f"nothing can be reached from {_shown(position)}: {'; '.join(trouble)}"
    nearest = nearest_clear_position(design, rotation, position)
    if nearest is None:
        raise StartError(f"{text}; at this orientation no other position is better", None)
    raise StartError(
        f"{text}; the nearest position without trouble at this orientation is {_shown(nearest)}",
        nearest,
    )


def troubles(design: Design, rotation: FloatArray, position: FloatArray) -> list[str]:
    joints, kappa = inverse(design, position, rotation), margins(position, rotation)
    broken = violations(design, position, rotation, joints, kappa, home_signs(design))
    clearance = leg_clearances(design, position, rotation).clearance
    touching = np.flatnonzero(clearance <= 0.0)
    pairs = [(PAIRS[pair], -float(clearance[pair])) for pair in touching]
    return [
        *map(str, broken),
        *(
            f"legs {i} and {j} overlap by {depth:.4g}" if depth > 0.0 else f"legs {i} and {j} cross"
            for (i, j), depth in pairs
        ),
    ]


def _shown(position: FloatArray) -> str:
    return "(" + ", ".join(f"{x:.6g}" for x in position) + ")"


def nearest_clear_position(
    design: Design, rotation: FloatArray, position: FloatArray
) -> FloatArray | None:
    """Return the nearest position within the limits where no legs collide, shape (3,).

    The best of what descends from nearby nodes of a grid, so to the grid's step a global
    one. None if no node of the grid is clear.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3).
        position: Shape (3,).
    """
    limits = constraints(design, rotation)
    lows, highs = bounds(region_of(limits))
    if any(isinstance(each, Never) for each in limits) or not (lows < highs).all():
        return None
    nodes = middles_over(lows, highs, CELLS).positions.reshape(-1, 3)
    nodes = nodes[(slacks(limits, nodes) >= 0.0).all(axis=-1)]
    nodes = nodes[(leg_clearances(design, nodes, rotation).clearance > 0.0).all(axis=-1)]
    if not len(nodes):
        return None
    reach = design.reach
    nodes = nodes[np.linalg.norm(nodes - position, axis=1).argsort()[:STARTS]]

    def kept(p: FloatArray) -> FloatArray:
        clearance = leg_clearances(design, p * reach, rotation).clearance / reach
        room: FloatArray = np.asarray(np.minimum(clearance, 1.0), dtype=np.float64) - CLEAR
        return np.concatenate([slacks(limits, p * reach) / reach, room])

    def off(p: FloatArray) -> tuple[float, FloatArray]:
        away = p - position / reach
        return float(away @ away), 2.0 * away

    best = nodes[0]
    for node in nodes:
        found = descend(off, kept, node / reach)
        if found is None:
            continue
        at = found * reach
        nearer = np.linalg.norm(at - position) < np.linalg.norm(best - position)
        if nearer and not troubles(design, rotation, at):
            best = at
    return best
