"""Demands over many positions: clearances over a workspace, and loads and errors over a box.

At each of many fixed positions a pair of legs must keep its clearance, or the position must lie
outside the workspace or nearer to a singular plane than where clearance is demanded. That
"or" is a smooth maximum, "at each" a smooth minimum, both by Kreisselmeier and Steinhauser
(1979) and both from below: where the bound is not negative, every position satisfies it.
A search looks between the positions afterwards.

Loads, errors and deflections are looked at in the corners of the required box, and wherever between
them they turned out to be larger. Towards a singular plane they may grow beyond all bounds, and
beyond it they would fall again. So only the places on the box's own side of all planes count; that
all of the box is there is an open `MarginDemand`.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from explorer.legs.clearance import PAIRS, joined_pairs, leg_axes, pair_rows, radii_of_pairs
from explorer.measures.box import BoxStatics
from explorer.measures.measure import longest_leg
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.cells import CellValues
from explorer.optimise.problem import SHIFTS, Problem
from explorer.optimise.search.demands import CORNERS, RESERVE, MarginDemand, Measured, SearchDemand
from explorer.optimise.search.state import SearchState
from explorer.proofs.proof import Proof, proofs_of
from explorer.proofs.statics import prove_deflection, prove_error, prove_load
from explorer.statics import slopes
from explorer.statics.reactions import LIMITED, part_limits
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


class ClearanceDemand(SearchDemand):
    """The least clearance of each pair, in design units, over some positions (k, 3)."""

    names = tuple(f"clearance of legs {first} and {second}" for first, second in PAIRS)

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
            gradients -= shares.T @ state.slack(limit, p[rows])[1]
        return Measured(least / sharp / self.clearance - RESERVE, gradients / self.clearance)

    def worst(self, state: SearchState) -> tuple[float, str]:
        """Return the least of the values that `measure` bounds from below, and its pair."""
        spare, (_, outside) = self._spare(state)[-1], self._outside(state)
        kept = np.maximum(spare, outside.max(axis=0)[:, None])
        least = kept.min(axis=0, initial=FAR * state.problem.size) / self.clearance
        pair = int(least.argmin())
        return float(least[pair]), self.names[pair]

    def look_at_unproven(self, state: SearchState) -> list[Proof]:
        """Look from now on at where pairs come nearest too, and return those not proven apart."""
        least = least_clearances(
            state.workspace,
            BETWEEN * self.clearance,
            below=self.clearance,
            margin=state.problem.demands.clearance_margin,
        )
        missed, bounds = (1.0 - each / self.clearance for each in least[:2])
        found = CellValues(missed, least.position, bounds)
        proofs = proofs_of(self.names, found, lambda _, place: (place, state.rotation))
        attained = least.position[np.isfinite(least.clearance)]
        self.positions = np.vstack([self.positions, attained])
        return [proof for proof in proofs if not proof.is_proven]

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


PARTS = LIMITED[:10]
"""The loaded parts; the moment on the guide is the bending of the strut."""

# Depth beyond a singular plane, over the size of the start, at which a box without a place on its
# side misses a demand by twice as much as on the plane.
BEYOND = 0.05

# Share by which a largest value between the nodes may exceed the one that is told.
TOLD = 1e-6

Cause = Literal["error", "deflection"]
"""The causes that displace the tool: the actuators' errors, or the design's load."""


def spare_of(share: FloatArray) -> FloatArray:
    """Return 1 − s up to a share s of 1, and 1 / s − 1 beyond, which is as smooth there.

    Shares grow beyond all bounds towards singular poses; the reciprocal vanishes linearly.
    """
    return np.asarray((1.0 - share) / np.maximum(1.0, share))


def _spare(share: FloatArray, by: FloatArray) -> Measured:
    """Return the slack of utilisations of a limit, with their derivatives (m, n)."""
    return Measured(spare_of(share), by * (-1.0 / np.maximum(1.0, share) ** 2)[:, None])


class StaticsDemand(SearchDemand):
    """A bound on a quantity of parts of the machine everywhere in the required box.

    A search looks at the corners of the box, and where more was found later. If nothing is given,
    the largest at the start is, so that the values are of unit size, and what is proven is that
    nothing is larger than what is told.
    """

    def __init__(self, start: SearchState, most: float | None, parts: Sequence[str]) -> None:
        self.side, self.parts = MarginDemand(start, is_open=True), parts
        self.most = most or _scale_of(start, self.amounts) or 1.0
        self.is_given = most is not None
        self.places = CORNERS
        self.names = (*parts,) * len(self.places)

    def measure(self, state: SearchState) -> Measured:
        """Return the slack of each part at each place, less a reserve; see `spare_of`."""
        lows, highs = np.array(state.box)
        positions = lows + self.places * (highs - lows)
        counts, parts = self.side.keeps(state, positions), range(len(self.parts))
        if not counts.any():
            return _miss_beyond_plane(state, self.side, len(self.names))
        found = self._spares(state, positions[counts])
        spare, slopes = found.values.reshape(-1, len(parts)), found.gradients
        slopes = slopes.reshape(*spare.shape, -1)
        # A place beyond a plane counts as the worst of the others.
        rows = np.tile(spare.argmin(axis=0), (len(positions), 1))
        rows[counts] = np.arange(len(spare))[:, None]
        values, gradients = spare[rows, parts], slopes[rows, parts]
        return Measured(values.ravel() - RESERVE, gradients.reshape(-1, slopes.shape[-1]))

    def look_at_unproven(self, state: SearchState) -> list[Proof]:
        """Look from now on at where something is, or may be, too large too, and return it."""
        most = self.most
        if not self.is_given:
            most = (1.0 + TOLD) * state.statics.worst(self.amounts(state.statics)) or most
        found = [proof for proof in self._prove(state, most) if not proof.is_proven]
        lows, highs = np.array(state.box)
        edges = np.where(highs > lows, highs - lows, 1.0)
        self.places = np.vstack([self.places, *((each.position - lows) / edges for each in found)])
        self.names = (*self.parts,) * len(self.places)
        return found

    @abstractmethod
    def amounts(self, box: BoxStatics) -> FloatArray:
        """Return the values that are to be at most something, at the nodes of a box."""

    @abstractmethod
    def _spares(self, state: SearchState, positions: FloatArray) -> Measured:
        """Return the slacks of m parts at k positions, k · m values."""

    @abstractmethod
    def _prove(self, state: SearchState, most: float) -> list[Proof]:
        """Return the proofs that the values are at most something."""


class LoadDemand(StaticsDemand):
    """The limits of actuators, struts and guide under the design's load, over the required box.

    The load is the payload's weight and its force of any direction. What is given is the largest
    share of a limit.
    """

    def __init__(
        self, start: SearchState, most: float | None = None, what: str = "load of"
    ) -> None:
        limits = part_limits(start.design)
        self.limited = np.flatnonzero(np.isfinite(limits).any(axis=0))
        names = [f"{what} {PARTS[part]} over the required box" for part in self.limited.tolist()]
        super().__init__(start, most, names)
        self.limits = self.most * limits

    def amounts(self, box: BoxStatics) -> FloatArray:
        """Return the utilisations of all limits."""
        return box.node_utilisations

    def _rows(self, positions: FloatArray) -> tuple[IntArray, IntArray]:
        """Return the position and the part of each value, as in `utilisation_slopes`."""
        count = len(positions)
        return np.repeat(np.arange(count), len(self.limited)), np.tile(self.limited, count)

    def _spares(self, state: SearchState, positions: FloatArray) -> Measured:
        design, rotation, parts = state.design, state.rotation, self._rows(positions)
        twists = slopes.twist_slopes(design, positions, rotation)
        share, by = slopes.utilisation_slopes(design, rotation, twists, parts, self.limits)
        return _spare(share, by @ state.rows(CHAIN))

    def _prove(self, state: SearchState, most: float) -> list[Proof]:
        return prove_load(state.design, state.box, state.rotation, most=most)


class AccelerationDemand(LoadDemand):
    """The largest acceleration from rest that each part allows, over the required box, in m/s²."""

    def __init__(self, start: SearchState, least: float) -> None:
        super().__init__(start, 1.0, "acceleration by")
        self.least = least

    def _spares(self, state: SearchState, positions: FloatArray) -> Measured:
        """Return v − 1 for accelerations of v times the least one; 1 − 1/v where v exceeds 1."""
        parts = self._rows(positions)
        value, by = slopes.acceleration_slopes(state.design, positions, state.rotation, parts)
        value, by = value / self.least, by @ state.rows(CHAIN) / self.least
        above = np.maximum(1.0, value)
        return Measured(np.minimum(1.0, value) - 1.0 / above, by / (above**2)[:, None])

    def _prove(self, state: SearchState, most: float) -> list[Proof]:
        box, rotation = state.box, state.rotation
        return prove_load(state.design, box, rotation, most=most, acceleration=self.least)


class DisplacementDemand(StaticsDemand):
    """The largest displacement of the tool by a cause over the required box, in design units."""

    def __init__(self, start: SearchState, cause: Cause, most: float | None = None) -> None:
        self.cause: Cause = cause
        super().__init__(start, most, [f"{cause} over the required box"])

    def amounts(self, box: BoxStatics) -> FloatArray:
        """Return the displacements."""
        return box.errors.displacement if self.cause == "error" else box.deflections

    def _spares(self, state: SearchState, positions: FloatArray) -> Measured:
        design, rotation = state.design, state.rotation
        twists = slopes.twist_slopes(design, positions, rotation)
        if self.cause == "error":
            largest, by = slopes.error_slopes(design, twists)
        else:
            largest, by = slopes.deflection_slopes(design, rotation, twists)
        return _spare(largest / self.most, by @ state.rows(CHAIN) / self.most)

    def _prove(self, state: SearchState, most: float) -> list[Proof]:
        prove = prove_error if self.cause == "error" else prove_deflection
        return prove(state.design, state.box, state.rotation, most)


def _miss_beyond_plane(state: SearchState, side: MarginDemand, count: int) -> Measured:
    """Return equal negative values, the less the deeper a box is beyond a singular plane."""
    value, gradient = side.measure(state)
    worst = int(value.argmin())
    slope = gradient[worst] / BEYOND
    return Measured(np.full(count, value[worst] / BEYOND - 1.0), np.tile(slope, (count, 1)))


def _scale_of(start: SearchState, values: Callable[[BoxStatics], FloatArray]) -> float:
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
