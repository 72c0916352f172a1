"""The clearance of each pair of legs over a workspace, as a demand.

At each of many fixed positions a pair of legs must keep its clearance, or the position must lie
outside the workspace or nearer to a singular plane than where clearance is demanded. That
"or" is a smooth maximum, "at each" a smooth minimum, both by Kreisselmeier and Steinhauser
(1979) and both from below: where the bound is not negative, every position satisfies it.
A search looks between the positions afterwards.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from explorer.legs.clearance import PAIRS, joined_pairs, leg_axes, pair_rows, radii_of_pairs
from explorer.measures.measure import longest_leg
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.optimise.problem import Problem
from explorer.optimise.search.demands import RESERVE, Measured
from explorer.optimise.search.state import SearchState
from explorer.workspace.least_clearance import least_clearances
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

# Tolerance of a clearance that is missed, over the demanded one.
BETWEEN = 0.1

# Names of the demands of the pairs.
NAMES = tuple(f"clearance of legs {first} and {second}" for first, second in PAIRS)
# The legs of each pair from 0.
LEGS = np.array(PAIRS) - 1
# Parameters that move the ends of legs while p stays.
PARAMETERS = (*VARIABLES, YAW)


class UnprovenClearance(NamedTuple):
    """A pair of legs that is not proven to keep its clearance everywhere in a workspace.

    Attributes:
        name: Name of its demand.
        missed: Amount that the clearance misses where the legs come nearest, over the demanded one;
            not above zero where it is kept.
        position: b4 there, shape (3,), in design units; NaN where nothing was computed.
    """

    name: str
    missed: float
    position: FloatArray


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


class ClearanceDemand:
    """The least clearance of each pair, in design units, over some positions (k, 3)."""

    def __init__(self, clearance: float, positions: FloatArray) -> None:
        self.clearance, self.positions = clearance, positions

    def measure(self, state: SearchState) -> Measured:
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
            gradients -= shares.T @ state.slack_slopes(limit, p[rows])
        return least / sharp / self.clearance - RESERVE, gradients / self.clearance

    def worst(self, state: SearchState) -> tuple[float, str]:
        """Return the least of the values that `measure` bounds from below, and its pair."""
        spare, (_, outside) = self._spare(state)[-1], self._outside(state)
        kept = np.maximum(spare, outside.max(axis=0)[:, None])
        least = kept.min(axis=0, initial=FAR * state.problem.size) / self.clearance
        pair = int(least.argmin())
        return float(least[pair]), NAMES[pair]

    def look_at_unproven(self, state: SearchState) -> list[UnprovenClearance]:
        """Look from now on at where pairs come nearest too, and return those not proven apart."""
        least = least_clearances(
            state.workspace,
            BETWEEN * self.clearance,
            below=self.clearance,
            margin=state.problem.demands.clearance_margin,
        )
        missed, bounds = (1.0 - each / self.clearance for each in least[:2])
        attained = least.position[np.isfinite(least.clearance)]
        self.positions = np.vstack([self.positions, attained])
        return [
            UnprovenClearance(NAMES[pair], float(missed[pair]), least.position[pair])
            for pair in np.flatnonzero(np.maximum(missed, bounds) > 0.0)
        ]

    def _spare(self, state: SearchState) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return axes of the legs, closest points, distances, and distances less the demanded."""
        p = self.positions
        axes = leg_axes(Configuration(state.design, p, state.rotation))
        distance, points = np.empty((len(p), 6)), np.empty((len(p), 6, 2, 3))
        pair_rows(len(p), axes, distance, points)
        spare = distance - radii_of_pairs(state.design) - self.clearance
        spare[:, joined_pairs(state.design)] = FAR * state.problem.size
        return axes, points, distance, spare

    def _outside(self, state: SearchState) -> tuple[list[BallOrCylinder | HalfSpace], FloatArray]:
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
    state: SearchState,
    axes: FloatArray,
    points: FloatArray,
    distance: FloatArray,
    weights: FloatArray,
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


def _end_motions(state: SearchState) -> FloatArray:
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
