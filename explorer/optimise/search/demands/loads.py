"""Loads, errors and deflections of the tool over the required box, as demands with exact gradients.

They are evaluated at the nodes of a grid over the box, see `explorer.measures.statics`. Of the
nodes of each eighth of the box the worst one counts, so that only a few values have gradients and
most of them stay smooth from step to step.

Towards a singular plane they may grow beyond all bounds, and beyond it they would fall again. So
only the nodes on the box's own side of all planes count; that all of the box is there is a demand
of its own, an open `MarginDemand`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal

import numpy as np

from explorer.measures.statics import BoxStatics
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.optimise.problem import SHIFTS, ObjectiveName
from explorer.optimise.search.demands.geometry import Demand, MarginDemand, Measured
from explorer.optimise.search.state import State
from explorer.statics.reactions import LIMITED, part_limits
from explorer.statics.slopes import (
    BENDING,
    deflection_slopes,
    error_slopes,
    share_slopes,
    twist_slopes,
)
from explorer.workspace.limits.constraints import YAW

CHAIN = (*VARIABLES, YAW, *SHIFTS)
"""The parameters of the chain rule that are those of `twist_slopes`, in their order."""

PARTS = LIMITED[:10]
"""The loaded parts; the moment on the guide is the bending of the strut."""

EIGHTHS = 8

# Depth beyond a singular plane, over the size of the start, at which a box without a node on its
# side misses a demand by twice as much as on the plane.
BEYOND = 0.05

Cause = Literal["error", "deflection"]
"""What displaces the tool: the actuators' errors, or the design's load."""

CAUSES: Mapping[ObjectiveName, Cause] = {
    "smallest-error": "error",
    "smallest-deflection": "deflection",
}
"""The causes of the displacements that objectives are about."""


def spare_of(share: FloatArray) -> FloatArray:
    """Return 1 − s up to a share s of 1, and 1 / s − 1 beyond, which is as smooth there.

    Shares grow beyond all bounds towards singular poses; the reciprocal vanishes linearly.
    """
    return np.asarray((1.0 - share) / np.maximum(1.0, share))


def _spare_slope(share: FloatArray) -> FloatArray:
    return np.asarray(-1.0 / np.maximum(1.0, share) ** 2)


def _worst_nodes(box: BoxStatics, values: FloatArray, counts: BoolArray) -> IntArray:
    """Return the node with the largest of values (n, m) in each eighth of a box, shape (8, m).

    At least one node counts.
    """
    middle = np.mean(box.box, axis=0)
    eighths = (box.positions > middle) @ np.array([4, 2, 1])
    rows: list[IntArray] = []
    for eighth in range(EIGHTHS):
        # A box without depth along an axis has empty eighths.
        members = np.flatnonzero(counts & (eighths == eighth))
        members = members if len(members) else np.flatnonzero(counts)
        rows.append(members[values[members].argmax(axis=0)])
    return np.array(rows)


class LoadDemand(Demand):
    """The limits of actuators, struts and guide under the design's load, over the required box.

    The load is the payload's weight and its force of any direction. The limits are those of the
    design at the start of a run, which no variable changes.

    Args:
        start: The problem where a run starts.
        most: Largest share of a limit allowed; None for that at the start, so that the values are
            of unit size whatever the load.
    """

    def __init__(self, start: State, most: float | None = None) -> None:
        self.side = MarginDemand(start, is_open=True)
        share = _scale_of(start, lambda box: box.shares) or 1.0 if most is None else most
        self.limits = share * part_limits(start.design)
        self.counts: BoolArray = np.asarray(np.isfinite(self.limits).any(axis=0))
        self.names = tuple(
            f"load of {part} over the required box"
            for part, counts in zip(PARTS, self.counts, strict=True)
            if counts
            for _ in range(EIGHTHS)
        )

    def measure(self, state: State) -> Measured:
        """Return what the largest shares of each part leave, see `spare_of`."""
        box, counts = state.statics, self.side.keeps(state, state.statics.positions)
        if not counts.any():
            return _miss_beyond_plane(state, self.side, len(self.names))
        shares, parts = box.node_shares[:, : len(PARTS)].copy(), np.flatnonzero(self.counts)
        # The guide takes the bending of the struts as a moment, which may be closer to its limit.
        shares[:, BENDING] = np.maximum(shares[:, BENDING], box.node_shares[:, len(PARTS) :])
        worst = _worst_nodes(box, shares[:, parts], counts).T.ravel()
        part = np.repeat(parts, EIGHTHS)
        nodes, row = np.unique(worst, return_inverse=True)
        slopes = twist_slopes(state.design, box.positions[nodes], state.rotation)
        share, by = share_slopes(state.design, state.rotation, slopes, (row, part), self.limits)
        return Measured(spare_of(share), _spare_slope(share)[:, None] * by @ state.rows(CHAIN))


class DisplacementDemand(Demand):
    """The largest displacement of the tool by a cause, over the required box.

    Args:
        start: The problem where a run starts.
        cause: Cause: the errors of the actuators, or the deflection under the design's load.
        most: Largest displacement allowed, in design units.
    """

    def __init__(self, start: State, cause: Cause, most: float | None = None) -> None:
        self.side = MarginDemand(start, is_open=True)
        self.cause: Cause = cause
        self.most = most or _scale_of(start, lambda box: _displacements(box, cause))
        self.names = (f"{cause} over the required box",) * EIGHTHS

    def measure(self, state: State) -> Measured:
        """Return what the largest displacements leave, see `spare_of`."""
        box, design = state.statics, state.design
        counts = self.side.keeps(state, box.positions)
        if not counts.any():
            return _miss_beyond_plane(state, self.side, len(self.names))
        worst = _worst_nodes(box, _displacements(box, self.cause)[:, None], counts)[:, 0]
        slopes = twist_slopes(design, box.positions[worst], state.rotation)
        if self.cause == "error":
            largest, by = error_slopes(design, slopes)
        else:
            largest, by = deflection_slopes(design, state.rotation, slopes)
        share = largest / self.most
        gradient = by @ state.rows(CHAIN) / self.most
        return Measured(spare_of(share), _spare_slope(share)[:, None] * gradient)


def _miss_beyond_plane(state: State, side: MarginDemand, count: int) -> Measured:
    """Return the values of demands on a box without a node on its side of all planes.

    They are equal and negative, the more so the deeper the box is beyond a plane.
    """
    value, gradient = side.measure(state)
    worst = int(value.argmin())
    slope = gradient[worst] / BEYOND
    return Measured(np.full(count, value[worst] / BEYOND - 1.0), np.tile(slope, (count, 1)))


def _scale_of(start: State, values: Callable[[BoxStatics], FloatArray]) -> float:
    """Return the scale of a demand: the largest of values over the required box.

    If that is infinite, it is the value at the node, or at home, farthest from singular planes.
    """
    box = start.statics
    if not box.is_regular:
        places = np.vstack([box.positions, start.design.home_pose.position])
        least = np.abs(margins(places, start.rotation)).min(axis=1)
        x, y, z = places[least.argmax()].tolist()
        box = BoxStatics(start.design, ((x, y, z), (x, y, z)), start.rotation)
    return float(values(box).max()) if box.is_regular else start.problem.size


def _displacements(box: BoxStatics, cause: Cause) -> FloatArray:
    return box.errors.displacement if cause == "error" else box.deflections
