"""Tolerances: what each costs in precision, and those of least effort that keep a wanted precision.

Costs are in the units of drawings: millimetres, and degrees for tilts of the guide and for turns of
the tool. The effort of a tolerance t is 1 / t, the reciprocal model of cost of tolerance
allocation: Chase, Greenwood, Loosli and Hauglund, Least Cost Tolerance Allocation for Mechanical
Assemblies with Automated Process Selection, Manufacturing Review 3(1), 1990. The least sum of
efforts is a convex problem. In a unit direction n the tool moves by up to Σ t_i |n · v_i|, which is
a linear bound; the direction of the exact worst error at the worst position is added until none
exceeds what is wanted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from explorer.errors import InputError, NoAnswerError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.machine import DIMENSIONS, Actuators, Tolerances
from explorer.mechanism.margins import INCIDENCES
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.checks import positive
from explorer.statics import accuracy
from explorer.statics.accuracy import IS_TILT, SOURCES

PARTS: tuple[str, ...] = (
    *("cylinder 1, rod 1", "carriage 2", "cylinder 2, rod 2"),
    *("carriage 3", "cylinder 3, rod 3", "cylinder 4, rod 4"),
    *("platform" if name.startswith("b") else "base" for name in DIMENSIONS[:-2]),
    *("carriage 2", "carriage 3"),
)
"""Parts of the prototype that carry each source, in the order of `SOURCES`."""


@dataclass(frozen=True)
class SourceCosts:
    """The loss of precision by errors of the sources, at worst over positions.

    Arrays of shape (31,) have the order of `SOURCES`. Errors are in mm, and in degrees for a tilt.

    Attributes:
        displacement, turn: Largest displacement (mm) and turn (degrees) of the tool per error.
        lengths: Length that counts for a unit of error, in mm, see `error_lengths`.
        tolerances: Largest errors to either side; infinite for any.
        worst_displacement, worst_turn: Largest within the tolerances, exact over all signs.
        rms_displacement, rms_turn: Largest RMS ones, for errors uniform within the tolerances.
        shares, turn_shares: Parts of the worst displacement and turn that each source causes where
            it is largest; they add up to 1, or are all 0.
        position: Position of the worst displacement, shape (3,), in design units.
        count: Number of positions.
    """

    displacement: FloatArray
    turn: FloatArray
    lengths: FloatArray
    tolerances: FloatArray
    worst_displacement: float
    worst_turn: float
    rms_displacement: float
    rms_turn: float
    shares: FloatArray
    turn_shares: FloatArray
    position: FloatArray
    count: int

    @property
    def displacement_within(self) -> FloatArray:
        """Largest displacement by each source alone within its tolerance, shape (31,), in mm."""
        return self.displacement * _finite(self.tolerances)

    @property
    def turn_within(self) -> FloatArray:
        """Largest turn by each source alone within its tolerance, shape (31,), in degrees."""
        return self.turn * _finite(self.tolerances)

    @property
    def ranking(self) -> IntArray:
        """Sources from the costliest, shape (31,): at its tolerance, then by counted length."""
        return np.lexsort([-self.displacement / self.lengths, -self.displacement_within])


def source_costs(configuration: Configuration) -> SourceCosts:
    """Return the loss of precision by a design's errors and tolerances over positions.

    The poses have one orientation; for the errors raised see `source_influences`.
    """
    c = configuration
    return costs_of(c, source_influences(c), accuracy.stated_tolerances(c.design))


def costs_of(
    configuration: Configuration, influences: FloatArray, tolerances: FloatArray
) -> SourceCosts:
    """Return the costs, given `source_influences` of a configuration and tolerances (31,)."""
    bounds = _finite(tolerances)
    worst = accuracy.largest_error(influences, bounds)
    rms = accuracy.rms_of_sources(influences, bounds)
    halves = influences.reshape(-1, 2, 3, len(SOURCES))
    alone = np.sqrt((halves**2).sum(axis=2)).max(axis=0)
    places = [int(worst.displacement.argmax()), int(worst.turn.argmax())]
    shares: list[FloatArray] = []
    for half, place in enumerate(places):
        # The worst error is the sum of the parts along its own direction.
        along = worst.vectors[place, half] @ halves[place, half]
        parts = np.abs(along) * bounds
        shares.append(parts / (parts.sum() or 1.0))
    return SourceCosts(
        displacement=alone[0],
        turn=alone[1],
        lengths=error_lengths(configuration.design),
        tolerances=tolerances,
        worst_displacement=float(worst.displacement[places[0]]),
        worst_turn=float(worst.turn[places[1]]),
        rms_displacement=float(rms.displacement.max()),
        rms_turn=float(rms.turn.max()),
        shares=shares[0],
        turn_shares=shares[1],
        position=configuration.positions[places[0]],
        count=len(influences),
    )


def source_influences(configuration: Configuration) -> FloatArray:
    """Return displacement (mm) and turn (degrees) of the tool per error, shape (n, 6, 31).

    Raises:
        InputError: There is no position.
        NoAnswerError: A position is singular, or singular ones lie between them.
    """
    c, unit_mm = configuration, configuration.design.unit_mm
    signs = np.sign(c.margins).reshape(-1, 3)
    if not len(signs):
        raise InputError("costs of tolerances need at least one position; got none")
    crossed = np.flatnonzero(np.abs(signs.sum(axis=0)) < len(signs))
    by_source = accuracy.error_by_source(c).reshape(-1, 6, len(SOURCES))
    if len(crossed) or not np.isfinite(by_source).all():
        where = "; ".join(f"δ{k + 1} = 0: {INCIDENCES[k]}" for k in crossed)
        singular = (
            f"some of the {len(signs):,} positions are singular, or singular ones lie between"
            if len(signs) > 1
            else "the pose is singular"
        )
        raise NoAnswerError(
            f"errors are infinite: {singular} ({where or 'a margin vanishes to rounding'})"
        )
    rows = np.repeat([unit_mm, float(np.degrees(1.0))], 3)
    columns = np.where(IS_TILT, np.radians(1.0), 1.0 / unit_mm)
    return by_source * rows[:, None] * columns


def error_lengths(design: Design) -> FloatArray:
    """Return the length that counts for a unit of error of each source, shape (31,), in mm.

    A length counts as itself. A tilt counts as what it moves the far end of its part. That of the
    guide is the carriage position of the larger magnitude that its limits allow, or, without
    these, a point at the distance of the reach; that of a strut is its largest length.
    """
    far = max(map(abs, design.limits.guide or (0.0,))) or design.reach
    ends = [far, far, *(design.length_range(name)[1] for name in ("d2", "d4"))]
    lengths = np.ones(len(SOURCES))
    lengths[IS_TILT] = np.radians(ends) * design.unit_mm
    return lengths


def with_tolerances(design: Design, tolerances: FloatArray) -> Design:
    """Return a design with other errors of its actuators and tolerances, (31,), in mm and degrees.

    Where they are infinite, so that any will do, the design keeps what it states.
    """
    stated = accuracy.stated_tolerances(design)
    values = iter(np.where(np.isfinite(tolerances), tolerances, stated).tolist())

    def fill(part: Actuators | Tolerances, *fields: str) -> Any:
        new = {name: tuple(next(values) for _ in getattr(part, name)) for name in fields}
        return msgspec.structs.replace(part, **new)

    actuators = fill(design.actuators, "error_mm")
    found = fill(design.tolerances, *Tolerances.__struct_fields__)
    return msgspec.structs.replace(design, actuators=actuators, tolerances=found)


def _finite(tolerances: FloatArray) -> FloatArray:
    """Return tolerances with 0 in place of infinite ones, whose sources move nothing."""
    return np.where(np.isfinite(tolerances), tolerances, 0.0)


def _solve_cuts(costs: FloatArray, cuts: list[FloatArray]) -> tuple[FloatArray, float]:
    """Return the x from 0 to 1 of least Σ c_i / x_i with all cuts a · x ≤ 1, and a lower bound.

    The costs c (m,) are positive, and the cuts a (m,) are not negative. Given a multiplier of each
    cut, the least Lagrangian is at x_i = √(c_i / s_i), or 1, with s the sum of the cuts times their
    multipliers; so it is maximised over the multipliers. It bounds the sum from below for any.
    """
    from scipy import optimize

    rows = np.array(cuts)
    # The least sum with the mean of the cuts alone.
    size = np.sqrt(costs * rows.mean(axis=0)).sum() ** 2

    def minimiser(multipliers: FloatArray) -> tuple[FloatArray, FloatArray]:
        slopes = size * multipliers @ rows
        return np.sqrt(costs / np.maximum(slopes, costs)), slopes

    def negative_dual(multipliers: FloatArray) -> tuple[float, FloatArray]:
        x, slopes = minimiser(multipliers)
        return multipliers.sum() - (costs / x + slopes * x).sum() / size, 1.0 - rows @ x

    untyped: Any = optimize
    result = untyped.minimize(
        negative_dual,
        np.full(len(rows), 1.0 / len(rows)),
        jac=True,
        method="SLSQP",
        bounds=[(0.0, None)] * len(rows),
        options={"maxiter": 500, "ftol": 1e-13},
    )
    multipliers = np.maximum(result.x, 0.0)
    return minimiser(multipliers)[0], -size * float(negative_dual(multipliers)[0])


# Share of the largest influence up to which that of a source is rounding.
NO_INFLUENCE = 1e-12
# Largest excess of the effort over its lower bound, as a share, and the most rounds.
GAP, MOST_ROUNDS = 1e-6, 100
# Room for the rounding of a sum of 31 errors, as a share of what is wanted.
ROOM = 1e-9


@dataclass(frozen=True)
class ToleranceBudget:
    """Tolerances that keep a wanted precision, with the least effort.

    Attributes:
        tolerances: Tolerances of the sources in the order of `SOURCES`, shape (31,), in mm and
            degrees, rounded down to two significant digits; those kept are as stated, and those of
            sources that move nothing are infinite.
        costs: What these tolerances cost in precision.
        effort: Sum of the reciprocals of the tolerances found, in 1/mm. A tilt counts as
            the length that it moves the far end of the guide, see `error_lengths`.
        least_effort: Lower bound of the effort of all tolerances that keep the wanted precision,
            rounded or not.
    """

    tolerances: FloatArray
    costs: SourceCosts
    effort: float
    least_effort: float

    @property
    def excess(self) -> float:
        """Effort above its lower bound, mostly by rounding, as a share of that bound."""
        return self.effort / self.least_effort - 1.0 if self.least_effort else 0.0


def tolerance_budget(
    configuration: Configuration,
    wanted: float,
    wanted_turn: float | None = None,
    *,
    keep_actuators: bool = False,
) -> ToleranceBudget:
    """Return the tolerances of least effort that keep a wanted precision at all positions.

    The worst error within them is exact for the linear model, over all combinations of signs. What
    is wanted are a largest displacement of the tool, in mm, and a largest turn, in degrees, None
    for any. The poses have one orientation. The errors of the actuators may be kept as stated.

    Raises:
        InputError: What is wanted is not positive or too large, or there is no position.
        NoAnswerError: A position is singular, or singular ones lie between them, or the errors of
            the actuators alone exceed what is wanted.
    """
    for name, value in (("displacement", wanted), ("turn", wanted_turn)):
        if value is not None:
            positive(f"the wanted {name}", value)
    influences = source_influences(configuration)
    stated = accuracy.stated_tolerances(configuration.design)
    kept = (np.arange(len(SOURCES)) < len(JOINTS)) & keep_actuators
    kept_errors = np.where(kept, stated, 0.0)
    _check_kept(costs_of(configuration, influences, kept_errors), wanted, wanted_turn)
    # Errors as shares of what is wanted; a turn that may be any is no demand.
    shares = influences / np.repeat([wanted, wanted_turn or math.inf], 3)[:, None]
    lengths = error_lengths(configuration.design)
    found, least = _allocate(shares, lengths, kept_errors, ~kept)
    tolerances = np.where(kept, stated, _round_down(found))
    efforts = 1.0 / (tolerances * lengths)[~kept]
    costs = costs_of(configuration, influences, tolerances)
    return ToleranceBudget(tolerances, costs, float(efforts.sum()), least)


def _allocate(
    shares: FloatArray, lengths: FloatArray, kept_errors: FloatArray, is_free: BoolArray
) -> tuple[FloatArray, float]:
    """Return the tolerances of least effort, shape (31,), and a lower bound of the effort.

    Shares (n, 6, 31) are displacement and turn per error, over what is wanted. Lengths (31,) count
    for a unit of error. Kept errors (31,) have a worst error below 1.
    """
    halves = shares.reshape(-1, 2, 3, len(SOURCES))
    largest = np.sqrt((halves**2).sum(axis=2)).max(axis=(0, 1))
    by_length = np.where(is_free, largest / lengths, 0.0)
    free = np.flatnonzero(by_length > NO_INFLUENCE * by_length.max())
    tolerances = np.full(len(SOURCES), np.inf)
    if not len(free):
        return tolerances, 0.0
    # A tolerance over the one at which its source alone uses up what is wanted is from 0 to 1.
    scales = 1.0 / largest[free]
    costs, cuts = 1.0 / (lengths[free] * scales), list[FloatArray]()
    bounds, best, least = kept_errors.copy(), math.inf, float(costs.sum())
    at_rest = _sizes(shares, kept_errors)[0]
    x = np.full(len(free), 1.0 / len(free))
    for _ in range(MOST_ROUNDS):
        bounds[free] = x * scales
        sizes, vectors = _sizes(shares, bounds)
        # The error is convex in the tolerances, so that this part of them is allowed.
        part = (1.0 - ROOM - at_rest) / np.maximum(sizes - at_rest, 1.0 - ROOM - at_rest)
        allowed = float(part.min()) * x
        effort = float((costs / allowed).sum())
        if effort < best:
            best, tolerances[free] = effort, allowed * scales
        if effort <= (1.0 + GAP) * least:
            break
        for half in range(2):
            place = int(sizes[:, half].argmax())
            size = sizes[place, half]
            if size > 0.0:
                along = np.abs(vectors[place, half] @ halves[place, half]) / size
                cuts.append(along[free] * scales / (1.0 - float(along @ kept_errors)))
        x, bound = _solve_cuts(costs, cuts)
        least = max(least, bound)
        if not np.isfinite(x).all():
            break  # The solver has run out of precision; the best so far keeps what is wanted.
    return tolerances, least


def _sizes(shares: FloatArray, bounds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the largest displacement and turn, shape (n, 2), and their vectors, (n, 2, 3)."""
    found = accuracy.largest_error(shares, bounds)
    return np.stack([found.displacement, found.turn], axis=1), found.vectors


def _check_kept(costs: SourceCosts, wanted: float, wanted_turn: float | None) -> None:
    """Check that errors that are kept leave room for others; else raise a NoAnswerError."""
    for worst, most, moves, unit in (
        (costs.worst_displacement, wanted, "move", " mm"),
        (costs.worst_turn, wanted_turn or math.inf, "turn", "°"),
    ):
        if worst >= most * (1.0 - 2.0 * ROOM):
            raise NoAnswerError(
                f"the errors of the actuators alone {moves} the tool by up to {worst:.4g}{unit}, "
                f"which leaves nothing of the wanted {most:.4g}{unit} (it is {worst - most:.3g}"
                f"{unit} more): allow a larger error of the tool, or let their errors change"
            )


def _round_down(values: FloatArray) -> FloatArray:
    """Return positive values with their first two significant digits; infinite ones as they are."""
    texts = (f"{value:.12e}".partition("e") for value in values.tolist())
    return np.array([float(f"{digits[:3]}{e}{exponent}") for digits, e, exponent in texts])
