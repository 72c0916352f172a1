"""The position from which an accessible workspace is computed, checked before it is used."""

from __future__ import annotations

import numpy as np

from explorer.errors import InputError
from explorer.legs.clearance import PAIRS, leg_clearances
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.numerics.descent import descend
from explorer.workspace.accessible.nodes import make_cell_grid
from explorer.workspace.limits.constraints import constraints, slacks
from explorer.workspace.limits.region import box_of
from explorer.workspace.limits.valid_poses import violations

# Search for the nearest valid position: cells on each axis, number of the nearest nodes from
# which a descent starts, and clearance over the reach.
CELLS = 40
STARTS = 6
CLEAR = 1e-6


class StartError(InputError):
    """A start that breaks a limit or at which legs collide.

    Attributes:
        nearest: Nearest valid position at the same orientation, shape (3,); None if there
            is none.
    """

    def __init__(self, message: str, nearest: FloatArray | None) -> None:
        super().__init__(message)
        self.nearest = nearest


def check_start(design: Design, rotation: FloatArray, position: FloatArray) -> None:
    """Raise a `StartError` unless a position (3,) keeps the limits and no legs collide there.

    Its message names the limits or the pairs of legs, and the nearest valid position.
    """
    faults = start_faults(design, rotation, position)
    if not faults:
        return
    refusal = f"no position is accessible from {_text_of(position)}: {'; '.join(faults)}"
    nearest = nearest_clear_position(design, rotation, position)
    remedy = "no valid position is found at this orientation"
    if nearest is not None:
        remedy = f"the nearest valid position at this orientation is {_text_of(nearest)}"
    raise StartError(f"{refusal}; {remedy}", nearest)


def start_faults(design: Design, rotation: FloatArray, position: FloatArray) -> list[str]:
    """Return the limits that a position breaks and the pairs of legs that touch there."""
    configuration = Configuration(design, position, rotation)
    (broken,) = violations(configuration)
    clearance = leg_clearances(configuration).clearance
    faults = [str(violation) for violation in broken]
    for (i, j), depth in zip(PAIRS, (-clearance).tolist(), strict=True):
        if depth >= 0.0:
            manner = f"overlap by {depth:.4g}" if depth > 0.0 else "cross"
            faults.append(f"legs {i} and {j} {manner}")
    return faults


def _text_of(position: FloatArray) -> str:
    return "(" + ", ".join(f"{x:.6g}" for x in position) + ")"


def nearest_clear_position(
    design: Design, rotation: FloatArray, position: FloatArray
) -> FloatArray | None:
    """Return the nearest position within the limits at which no legs collide, shape (3,).

    It is the best of the local optima near the nearest free nodes of a grid; None if no node
    of the grid is free.
    """
    limits = constraints(design, rotation)
    box = box_of(limits)
    if box is None:
        return None
    nodes = make_cell_grid(*box, CELLS).positions.reshape(-1, 3)
    nodes = nodes[(slacks(limits, nodes) >= 0.0).all(axis=-1)]
    nodes = nodes[
        (leg_clearances(Configuration(design, nodes, rotation)).clearance > 0.0).all(axis=-1)
    ]
    if not len(nodes):
        return None
    reach = design.reach
    nodes = nodes[np.linalg.norm(nodes - position, axis=1).argsort()[:STARTS]]

    def slacks_at(p: FloatArray) -> FloatArray:
        clearance = leg_clearances(Configuration(design, p * reach, rotation)).clearance / reach
        spare: FloatArray = np.asarray(np.minimum(clearance, 1.0), dtype=np.float64) - CLEAR
        return np.concatenate([slacks(limits, p * reach) / reach, spare])

    def squared_distance(p: FloatArray) -> tuple[float, FloatArray]:
        away = p - position / reach
        return float(away @ away), 2.0 * away

    best = nodes[0]
    for node in nodes:
        optimum = descend(squared_distance, slacks_at, node / reach)
        if optimum is None:
            continue
        candidate = optimum * reach
        nearer = np.linalg.norm(candidate - position) < np.linalg.norm(best - position)
        if nearer and not start_faults(design, rotation, candidate):
            best = candidate
    return best
