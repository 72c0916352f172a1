"""Clearance over a workspace as one smooth bound for each pair of legs, with its gradient.

At each of many fixed positions the pair must keep its clearance, or the position must lie
outside the workspace or nearer to a singular plane than where clearance is demanded. That
"or" is a smooth maximum, "at each" a smooth minimum, both by Kreisselmeier and Steinhauser
(1979) and both from below: where the bound is not negative, every position keeps to it.
Between the positions `explorer.optimise.search.crossings` looks afterwards.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.legs.clearance import PAIRS, joined_pairs, leg_axes, pair_rows, radii_of_pairs
from explorer.numerics.arrays import FloatArray
from explorer.optimise.search.demands import Measured
from explorer.optimise.search.state import State
from explorer.workspace.limits.constraints import YAW, BallOrCylinder, HalfSpace

# Sharpness of the smooth extremes, over the clearance demanded.
SHARPNESS = 60.0
# Positions of less weight than this in a smooth minimum add nothing to its gradient.
WEIGHT = 1e-12
# Farther out than this multiple of the size of the start does not matter.
FAR = 1e3


class ClearanceDemand:
    """The least clearance of each pair over some positions.

    Args:
        clearance: To keep.
        positions: Shape (k, 3).
    """

    is_equality = False
    is_limit = False
    names = tuple(f"clearance of legs {first} and {second}" for first, second in PAIRS)

    def __init__(self, clearance: float, positions: FloatArray) -> None:
        self.clearance = clearance
        self.positions = positions

    def measure(self, state: State) -> Measured:
        """Return the bounds of the six pairs over the clearance, and their derivatives."""
        sharp = SHARPNESS / self.clearance
        p = self.positions
        distance, points, axes = self._distances(state)
        # Infinite where a limit can never be kept, or where two legs share a joint.
        most = FAR * state.problem.size
        outside = np.minimum(self._outside(state), most)
        spare = distance - radii_of_pairs(state.design) - self.clearance
        spare[:, joined_pairs(state.design)] = most
        # One for each way out, so that the smooth maximum is no larger than the true one.
        ways = math.log(outside.shape[1] + 1.0)
        out = _log_sum(sharp * outside)
        kept = np.logaddexp(sharp * spare, out[:, None]) - ways
        least = -_log_sum(-kept.T)
        weights = np.exp(least - kept)
        by_distance = weights * np.exp(sharp * spare - ways - kept)
        gradients = np.zeros((len(PAIRS), len(state.u)))
        for pair in range(len(PAIRS)):
            rows = np.flatnonzero(by_distance[:, pair] > WEIGHT)
            slopes = _distance_slopes(
                state, pair, axes[rows], points[rows, pair], distance[rows, pair]
            )
            gradients[pair] += by_distance[rows, pair] @ slopes
        by_leaving = weights - by_distance
        rows = np.flatnonzero(by_leaving.max(axis=1) > WEIGHT)
        shares = np.exp(sharp * outside[rows] - out[rows, None])
        for index, slopes in enumerate(self._outside_slopes(state, p[rows])):
            gradients += (by_leaving[rows] * shares[:, index, None]).T @ slopes
        scale = self.clearance
        return Measured(least / sharp / scale, gradients / scale)

    def _distances(self, state: State) -> tuple[FloatArray, FloatArray, FloatArray]:
        axes = leg_axes(state.design, self.positions, state.rotation)
        count = len(axes)
        distance, points = np.empty((count, 6)), np.empty((count, 6, 2, 3))
        pair_rows(count, axes, distance, points)
        return distance, points, axes

    def _outside(self, state: State) -> FloatArray:
        """Return how far positions are outside each limit, shape (k, w)."""
        return np.column_stack([-limit.slack(self.positions) for limit in state.limits])

    def _outside_slopes(self, state: State, p: FloatArray) -> list[FloatArray]:
        """Return the derivatives of `_outside`, w of shape (k, n)."""
        slopes: list[FloatArray] = []
        for limit in state.limits:
            if isinstance(limit, BallOrCylinder | HalfSpace):
                slopes.append(-state.slack(limit, p)[1])
            else:
                slopes.append(np.zeros((len(p), len(state.u))))
        return slopes


def _log_sum(values: FloatArray) -> FloatArray:
    """Return log Σ exp over the last axis."""
    most = values.max(axis=-1)
    return most + np.log(np.exp(values - most[..., None]).sum(axis=-1))


def _distance_slopes(
    state: State, pair: int, axes: FloatArray, points: FloatArray, distance: FloatArray
) -> FloatArray:
    """Return the derivatives of the distance of a pair, shape (k, n).

    By the envelope theorem the closest points may be held on their legs meanwhile.

    Args:
        state: Where.
        pair: Index into `PAIRS`.
        axes: Of the four legs, shape (k, 4, 2, 3).
        points: The closest points, shape (k, 2, 3).
        distance: Between them, shape (k,).
    """
    apart = points[:, 0] - points[:, 1]
    normal = np.divide(
        apart, distance[:, None], out=np.zeros_like(apart), where=distance[:, None] > 0.0
    )
    slopes = np.zeros((len(points), len(state.u)))
    for side, leg in enumerate(PAIRS[pair]):
        base, platform = axes[:, leg - 1, 0], axes[:, leg - 1, 1]
        along = platform - base
        length = np.maximum(np.einsum("ki,ki->k", along, along), 1e-300)
        share = np.einsum("ki,ki->k", points[:, side] - base, along) / length
        for name, (of_base, of_platform) in _motions(state)[leg - 1].items():
            moving = (1.0 - share) * (normal @ of_base) + share * (normal @ of_platform)
            slopes += np.outer(moving if side == 0 else -moving, state.along({name: 1.0}))
    return slopes


def _motions(state: State) -> tuple[dict[str, tuple[FloatArray, FloatArray]], ...]:
    """Return how the base and platform ends of each leg move with each parameter, p held."""
    design, r = state.design, state.rotation
    u, v = r[:, 0], r[:, 1]
    arm = design.b1[0] * u + design.b1[1] * v
    x, y, still = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.zeros(3)

    def turned(vector: FloatArray) -> FloatArray:
        return np.array([-vector[1], vector[0], 0.0])

    def on_guide(vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        return vector * x, vector

    return (
        {"b1x": (still, u), "b1y": (still, v), YAW: (still, turned(arm))},
        {"b2": on_guide(u), YAW: on_guide(design.b2 * turned(u))},
        {"b3": on_guide(u), YAW: on_guide(design.b3 * turned(u))},
        {"a3x": (x, still), "a3y": (y, still)},
    )
