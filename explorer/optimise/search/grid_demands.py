"""Demands over many positions: clearances over a workspace, and loads and errors over a box.

At each of many fixed positions a pair of legs must keep its clearance, or the position must lie
outside the workspace or nearer to a singular plane than where clearance is demanded. That
"or" is a smooth maximum, "at each" a smooth minimum, both by Kreisselmeier and Steinhauser
(1979) and both from below: where the bound is not negative, every position satisfies it.
A search looks between the positions afterwards.

Loads, errors and deflections are evaluated at the nodes of a grid over the required box, see
`explorer.measures.box`. Of the nodes of each eighth of the box the worst one counts, so that
only a few values have gradients and most of them stay smooth from step to step. Towards a singular
plane they may grow beyond all bounds, and beyond it they would fall again. So only the nodes on the
box's own side of all planes count; that all of the box is there is an open `MarginDemand`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from explorer.legs.clearance import PAIRS, joined_pairs, leg_axes, pair_rows, radii_of_pairs
from explorer.measures.box import BoxStatics
from explorer.measures.measure import longest_leg
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.optimise.problem import SHIFTS, Problem
from explorer.optimise.search.demands import Demand, MarginDemand, Measured
from explorer.optimise.search.state import State
from explorer.statics import slopes
from explorer.statics.reactions import LIMITED, part_limits
from explorer.workspace.limits.constraints import YAW, BallOrCylinder, HalfSpace

# Number of first positions on each axis at which clearance is demanded; more follow where needed.
IN_SPACE, IN_SURFACE = 7, 21
# Margins with a smaller slope along z than this take a given value at no height.
STEEP = 1e-3
# Sharpness of the smooth extremes, per demanded clearance.
SHARPNESS = 60.0
# Positions of less weight than this in a smooth minimum add nothing to its gradient.
WEIGHT = 1e-12
# Cap on slacks, as a multiple of the size of the start.
FAR = 1e3

# The legs of each pair from 0.
LEGS = np.array(PAIRS) - 1
# Parameters that move the ends of legs while p stays; with the shifts, those of `twist_slopes`.
PARAMETERS = (*VARIABLES, YAW)
CHAIN = (*PARAMETERS, *SHIFTS)


def first_positions(problem: Problem, design: Design) -> FloatArray:
    """Return the positions at which clearance is demanded at first, shape (k, 3).

    They fill the box, or without one the cube of the design's reach. They lie closer in the
    surface on which a margin is the least one at which clearance is demanded: with a level platform
    the legs of a column of positions come nearest at its foot.
    """
    reach = longest_leg(design)
    lows, highs = design.limits.box or ((-reach,) * 3, (reach,) * 3)

    def grid(*counts: int) -> FloatArray:
        shares = np.indices(counts).reshape(len(counts), -1).T / (np.array(counts) - 1.0)
        start, end = np.array(lows)[: len(counts)], np.array(highs)[: len(counts)]
        return start + (end - start) * shares

    rotation, least = design.home_pose.rotation, problem.demands.clearance_margin
    columns = grid(IN_SURFACE, IN_SURFACE)
    foot = np.column_stack([columns, np.zeros(len(columns))])
    # Margins are linear in z: δ = δ at the foot + rise · z.
    at_foot = margins(foot, rotation)
    rise = margins(np.array([0.0, 0.0, 1.0]), rotation)
    groups = [grid(IN_SPACE, IN_SPACE, IN_SPACE)]
    for index in np.flatnonzero(np.abs(rise) > STEEP):
        for side in (-1.0, 1.0):
            height = (side * least - at_foot[:, index]) / rise[index]
            groups.append(np.column_stack([columns, height]))
    positions = np.vstack(groups)
    within = (positions >= np.array(lows)).all(axis=1) & (positions <= np.array(highs)).all(axis=1)
    clear = (np.abs(margins(positions, rotation)) >= least * (1.0 - 1e-9)).all(axis=1)
    return positions[within & clear]


class ClearanceDemand(Demand):
    """The least clearance of each pair, in design units, over some positions (k, 3)."""

    names = tuple(f"clearance of legs {first} and {second}" for first, second in PAIRS)

    def __init__(self, clearance: float, positions: FloatArray) -> None:
        self.clearance = clearance
        self.positions = positions

    def measure(self, state: State) -> Measured:
        """Return the bounds of the six pairs over the clearance, and their derivatives."""
        sharp, p = SHARPNESS / self.clearance, self.positions
        axes, points, distance, spare = self._spare(state)
        limits, outside = self._outside(state)
        # Shift that keeps the smooth maximum over all ways out from exceeding the true one.
        ways = math.log(len(outside) + 1.0)
        out = _log_sum(sharp * outside.T)
        kept = np.logaddexp(sharp * spare, out[:, None]) - ways
        least = -_log_sum(-kept.T)
        weights = np.exp(least - kept)
        by_distance = weights * np.exp(sharp * spare - ways - kept)
        gradients = _distance_slopes(state, axes, points, distance, by_distance)
        by_leaving = weights - by_distance
        rows = np.flatnonzero(by_leaving.max(axis=1) > WEIGHT)
        for limit, far in zip(limits, outside, strict=True):
            shares = by_leaving[rows] * np.exp(sharp * far[rows] - out[rows])[:, None]
            gradients -= shares.T @ state.slack(limit, p[rows])[1]
        return Measured(least / sharp / self.clearance, gradients / self.clearance)

    def worst(self, state: State) -> tuple[float, str]:
        """Return the least of the values that `measure` bounds from below, and its pair."""
        spare, (_, outside) = self._spare(state)[-1], self._outside(state)
        kept = np.maximum(spare, outside.max(axis=0)[:, None])
        least = kept.min(axis=0, initial=FAR * state.problem.size) / self.clearance
        pair = int(least.argmin())
        return float(least[pair]), self.names[pair]

    def _spare(self, state: State) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return axes of the legs, closest points, distances, and distances less the demanded."""
        p = self.positions
        axes = leg_axes(Configuration(state.design, p, state.rotation))
        distance, points = np.empty((len(p), 6)), np.empty((len(p), 6, 2, 3))
        pair_rows(len(p), axes, distance, points)
        spare = distance - radii_of_pairs(state.design) - self.clearance
        spare[:, joined_pairs(state.design)] = FAR * state.problem.size
        return axes, points, distance, spare

    def _outside(self, state: State) -> tuple[list[BallOrCylinder | HalfSpace], FloatArray]:
        """Return the limits that offer a way out, and how far each position is outside them."""
        # A limit that no position satisfies, such as the gap, has its own demand: as a way out
        # it would make the bound leap, from far below zero to met, where that is missed by little.
        limits = [*state.regions.values()]
        slacks = [-limit.slack(self.positions) for limit in limits]
        return limits, np.minimum(slacks, FAR * state.problem.size)


def _log_sum(values: FloatArray) -> FloatArray:
    """Return log Σ exp over the last axis."""
    most = values.max(axis=-1)
    return most + np.log(np.exp(values - most[..., None]).sum(axis=-1))


def _distance_slopes(
    state: State, axes: FloatArray, points: FloatArray, distance: FloatArray, weights: FloatArray
) -> FloatArray:
    """Return the weighted sums of the derivatives of the distances of each pair, shape (6, n).

    By the envelope theorem the closest points (k, 6, 2, 3) may keep their places on the legs.
    """
    rows, pairs = np.nonzero(weights > WEIGHT)
    points, distance = points[rows, pairs], distance[rows, pairs, None]
    apart = points[:, 0] - points[:, 1]
    normal = np.divide(apart, distance, out=np.zeros_like(apart), where=distance > 0.0)
    slopes = np.zeros((len(rows), len(PARAMETERS)))
    ends = _end_motions(state)
    for side, sign in enumerate((1.0, -1.0)):
        legs = LEGS[pairs, side]
        base, platform = axes[rows, legs, 0], axes[rows, legs, 1]
        along = platform - base
        length = np.maximum(np.einsum("ki,ki->k", along, along), 1e-300)
        share = np.einsum("ki,ki->k", points[:, side] - base, along) / length
        at = np.stack([1.0 - share, share], axis=1)
        slopes += sign * np.einsum("kj,kjqi,ki->kq", at, ends[legs], normal)
    sums = np.zeros((len(PAIRS), len(PARAMETERS)))
    np.add.at(sums, pairs, weights[rows, pairs, None] * slopes)
    return sums @ state.rows(PARAMETERS)


def _end_motions(state: State) -> FloatArray:
    """Return the derivatives of both ends of each leg by `PARAMETERS`, p held, (4, 2, 7, 3)."""
    design, r = state.design, state.rotation
    u, v = r[:, 0], r[:, 1]
    x, y, still = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.zeros(3)

    arms = np.array([r[:, :2] @ design.b1, design.b2 * u, design.b3 * u])
    b1, b2, b3 = np.cross([0.0, 0.0, 1.0], arms)
    return np.array(
        [
            [[still] * 7, [still, still, u, v, still, still, b1]],
            [[still] * 4 + [u * x, still, b2 * x], [still] * 4 + [u, still, b2]],
            [[still] * 5 + [u * x, b3 * x], [still] * 5 + [u, b3]],
            [[x, y] + [still] * 5, [still] * 7],
        ]
    )


PARTS = LIMITED[:10]
"""The loaded parts; the moment on the guide is the bending of the strut."""

EIGHTHS = 8

# Depth beyond a singular plane, over the size of the start, at which a box without a node on its
# side misses a demand by twice as much as on the plane.
BEYOND = 0.05

Cause = Literal["error", "deflection"]
"""What displaces the tool: the actuators' errors, or the design's load."""


def spare_of(share: FloatArray) -> FloatArray:
    """Return 1 − s up to a share s of 1, and 1 / s − 1 beyond, which is as smooth there.

    Shares grow beyond all bounds towards singular poses; the reciprocal vanishes linearly.
    """
    return np.asarray((1.0 - share) / np.maximum(1.0, share))


def _spare(share: FloatArray, by: FloatArray) -> Measured:
    """Return what shares of a limit leave, with their derivatives (m, n)."""
    return Measured(spare_of(share), by * (-1.0 / np.maximum(1.0, share) ** 2)[:, None])


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

    The load is the payload's weight and its force of any direction. The largest share of a limit
    allowed is that at the start if none is given, so that the values are of unit size.
    """

    def __init__(self, start: State, most: float | None = None) -> None:
        self.side = MarginDemand(start, is_open=True)
        share = _scale_of(start, lambda box: box.utilisations) or 1.0 if most is None else most
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
        shares = box.node_utilisations[:, : len(PARTS)].copy()
        # The guide takes the bending of the struts as a moment, which may be closer to its limit.
        shares[:, slopes.BENDING] = np.maximum(
            shares[:, slopes.BENDING], box.node_utilisations[:, len(PARTS) :]
        )
        positions, parts = self._worst_parts(box, shares, counts)
        twists = slopes.twist_slopes(state.design, positions, state.rotation)
        share, by = slopes.share_slopes(state.design, state.rotation, twists, parts, self.limits)
        return _spare(share, by @ state.rows(CHAIN))

    def _worst_parts(
        self, box: BoxStatics, values: FloatArray, counts: BoolArray
    ) -> tuple[FloatArray, tuple[IntArray, IntArray]]:
        """Return positions, and as in `share_slopes` each part where its value is the largest.

        It is the largest in each eighth of the box; the values have the shape (n, 10).
        """
        parts = np.flatnonzero(self.counts)
        worst = _worst_nodes(box, values[:, parts], counts).T.ravel()
        nodes, row = np.unique(worst, return_inverse=True)
        return box.positions[nodes], (row, np.repeat(parts, EIGHTHS))


class AccelerationDemand(LoadDemand):
    """The largest acceleration from rest that each part allows, over the required box, in m/s²."""

    def __init__(self, start: State, least: float) -> None:
        super().__init__(start, 1.0)
        self.least = least
        self.names = tuple(name.replace("load of", "acceleration by", 1) for name in self.names)

    def measure(self, state: State) -> Measured:
        """Return v − 1 for accelerations of v times the least one; 1 − 1/v where v exceeds 1."""
        box, counts = state.statics, self.side.keeps(state, state.statics.positions)
        if not counts.any():
            return _miss_beyond_plane(state, self.side, len(self.names))
        positions, parts = self._worst_parts(box, -box.accelerations, counts)
        value, by = slopes.acceleration_slopes(state.design, positions, state.rotation, parts)
        value, by = value / self.least, by @ state.rows(CHAIN) / self.least
        above = np.maximum(1.0, value)
        return Measured(np.minimum(1.0, value) - 1.0 / above, by / (above**2)[:, None])


class DisplacementDemand(Demand):
    """The largest displacement of the tool by a cause over the required box, in design units."""

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
        twists = slopes.twist_slopes(design, box.positions[worst], state.rotation)
        if self.cause == "error":
            largest, by = slopes.error_slopes(design, twists)
        else:
            largest, by = slopes.deflection_slopes(design, state.rotation, twists)
        return _spare(largest / self.most, by @ state.rows(CHAIN) / self.most)


def _miss_beyond_plane(state: State, side: MarginDemand, count: int) -> Measured:
    """Return equal negative values, the less the deeper a box is beyond a singular plane."""
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
