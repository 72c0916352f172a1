"""Tolerances of least effort that keep a wanted precision, by cutting planes.

The effort of a tolerance t is 1 / t, the reciprocal model of cost of tolerance allocation: Chase,
Greenwood, Loosli and Hauglund, Least Cost Tolerance Allocation for Mechanical Assemblies with
Automated Process Selection, Manufacturing Review 3(1), 1990. The least sum of efforts is a
convex problem. In a unit direction n the tool moves by up to Σ t_i |n · v_i|, which is a linear
bound; the direction of the exact worst error at the worst position is added until none exceeds what
is wanted.
"""

from __future__ import annotations

import importlib
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import NoAnswerError
from explorer.mechanism.design import JOINTS, Design
from explorer.numerics.arrays import BoolArray, FloatArray, position_array
from explorer.numerics.checks import positive
from explorer.statics.accuracy import SOURCES, largest_error
from explorer.statics.budget.costs import (
    SourceCosts,
    costs_of,
    error_lengths,
    source_costs,
    source_influences,
    stated_tolerances,
)

# Least share of its bound that a variable is given.
LEAST = 1e-15


class Cuts:
    """Linear bounds A x ≤ 1 with A ≥ 0 of variables from 0 to 1, and the least Σ c_i / x_i.

    Args:
        costs: The costs c, shape (m,), positive.
    """

    def __init__(self, costs: FloatArray) -> None:
        self.least = float(costs.sum())
        """Lower bound of Σ c_i / x_i, from the multipliers of the bounds so far."""
        self._costs = costs
        self._rows: list[FloatArray] = []
        self._guess = np.sqrt(costs) / np.sqrt(costs).sum()

    def effort(self, x: FloatArray) -> float:
        """Return Σ c_i / x_i."""
        return float((self._costs / x).sum())

    def add(self, row: FloatArray, right: float) -> None:
        """Add the bound row · x ≤ right, with right > 0."""
        self._rows.append(row / right)

    def solve(self) -> FloatArray:
        """Return the x of least Σ c_i / x_i, shape (m,), and improve the lower bound.

        With u_i ≥ 1 / x_i, that is |(2, x_i − u_i)| ≤ x_i + u_i, the sum is linear in u. All x
        are taken over the last ones, so that they are near 1 whatever the range of the costs.
        """
        from scipy import sparse

        # The solver has no types.
        clarabel: Any = importlib.import_module("clarabel")

        m, k = len(self._costs), len(self._rows)
        costs = self._costs / self._guess
        size = float(costs.max())
        costs = costs / size
        one, none = sparse.eye_array(m), sparse.csc_array((m, m))
        # Rows x + u, 2 and x − u of all cones, then in the order of the cones.
        halves = sparse.block_array([[-one, -one], [none, none], [-one, one]], format="csr")
        order = np.arange(3 * m).reshape(3, m).T.ravel()
        rows = np.array(self._rows) * self._guess
        bounds = sparse.block_array(
            [[sparse.csr_array(rows), sparse.csr_array((k, m))], [one, none]]
        )
        matrix = sparse.vstack([bounds, halves[order]], format="csc")
        rights = np.concatenate([np.ones(k), 1.0 / self._guess, np.tile([0.0, 2.0, 0.0], m)])
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_rel = settings.tol_gap_abs = settings.tol_feas = 1e-11
        cones = [clarabel.NonnegativeConeT(k + m), *(clarabel.SecondOrderConeT(3),) * m]
        solution = clarabel.DefaultSolver(
            sparse.csc_array((2 * m, 2 * m)),
            np.concatenate([np.zeros(m), costs]),
            matrix,
            rights,
            cones,
            settings,
        ).solve()
        multipliers = np.maximum(np.array(solution.z)[: k + m], 0.0)
        # The dual function bounds the sum from below for any multipliers.
        slopes = rows.T @ multipliers[:k] + multipliers[k:]
        bound = 2.0 * np.sqrt(costs * slopes).sum() - multipliers @ rights[: k + m]
        self.least = max(self.least, size * float(bound))
        x = np.clip(np.array(solution.x)[:m] * self._guess, LEAST, 1.0)
        if np.isfinite(x).all():
            self._guess = x
        return x


# Share of the largest influence up to which that of a source is rounding.
NO_INFLUENCE = 1e-12
# Largest excess of the effort over its lower bound, as a share, and the most rounds.
GAP, MOST_ROUNDS = 1e-6, 100
# Room for the rounding of a sum of 29 errors, as a share of what is wanted.
ROOM = 1e-9


@dataclass(frozen=True)
class ToleranceBudget:
    """Tolerances that keep a wanted precision, with the least effort.

    Attributes:
        tolerances: Tolerances of the sources in the order of `SOURCES`, shape (29,), in mm and
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
    design: Design,
    positions: ArrayLike,
    rotation: ArrayLike,
    wanted: float,
    wanted_turn: float | None = None,
    *,
    tool: ArrayLike | None = None,
    keep_actuators: bool = False,
) -> ToleranceBudget:
    """Return the tolerances of least effort that keep a wanted precision at all positions.

    The worst error within them is exact for the linear model, over all combinations of signs.

    Args:
        design: The manipulator.
        positions: Positions of b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (3, 3).
        wanted: Largest displacement of the tool, in mm.
        wanted_turn: Largest turn of the tool, in degrees; None for any.
        tool: Tool point in the platform frame, shape (3,), in design units; None for b4.
        keep_actuators: Whether the errors of the actuators stay as the design states them.

    Raises:
        InputError: What is wanted is not positive or beyond 1e±6, a position or the tool is not
            finite, or the rotation is not one.
        NoAnswerError: A position is singular, or singular ones lie between them, or the errors of
            the actuators alone exceed what is wanted.
    """
    for name, value in (("displacement", wanted), ("turn", wanted_turn)):
        if value is not None:
            positive(f"the wanted {name}", value)
    points = position_array("positions", positions).reshape(-1, 3)
    influences = source_influences(design, points, rotation, tool)
    stated = stated_tolerances(design)
    kept = (np.arange(len(SOURCES)) < len(JOINTS)) & keep_actuators
    held = np.where(kept, stated, 0.0)
    _check_held(costs_of(design, points, influences, held), wanted, wanted_turn)
    # Errors as shares of what is wanted; a turn that may be any is no demand.
    shares = influences / np.repeat([wanted, wanted_turn or math.inf], 3)[:, None]
    lengths = error_lengths(design)
    found, least = _allocate(shares, lengths, held, ~kept)
    tolerances = np.where(kept, stated, _rounded_down(found))
    efforts = 1.0 / (tolerances * lengths)[~kept]
    costs = costs_of(design, points, influences, tolerances)
    return ToleranceBudget(tolerances, costs, float(efforts.sum()), least)


def costs_or_budget(
    design: Design,
    positions: ArrayLike,
    rotation: ArrayLike,
    wanted: float | None,
    wanted_turn: float | None = None,
    *,
    tool: ArrayLike | None = None,
    keep_actuators: bool = False,
) -> tuple[SourceCosts, ToleranceBudget | None]:
    """Return the costs of the tolerances of a wanted precision with these, or of those stated.

    Args:
        design: As in `tolerance_budget`, and so are all others but one.
        positions: Positions of b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (3, 3).
        wanted: Largest displacement of the tool, in mm; None for the tolerances as stated.
        wanted_turn: Largest turn of the tool, in degrees; None for any.
        tool: Tool point in the platform frame, shape (3,), in design units; None for b4.
        keep_actuators: Whether the errors of the actuators stay as the design states them.

    Raises:
        InputError: As in `tolerance_budget`.
        NoAnswerError: As in `tolerance_budget`.
    """
    given = design, positions, rotation
    if wanted is None:
        return source_costs(*given, tool), None
    found = tolerance_budget(*given, wanted, wanted_turn, tool=tool, keep_actuators=keep_actuators)
    return found.costs, found


def _allocate(
    shares: FloatArray, lengths: FloatArray, held: FloatArray, is_free: BoolArray
) -> tuple[FloatArray, float]:
    """Return the tolerances of least effort, shape (29,), and a lower bound of the effort.

    Shares (n, 6, 29) are displacement and turn per error, over what is wanted. Lengths (29,) count
    for a unit of error. Errors that are kept are `held` (29,), with a worst error below 1.
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
    cuts = Cuts(1.0 / (lengths[free] * scales))
    bounds, best = held.copy(), math.inf
    at_rest = _sizes(shares, held)[0]
    x = np.full(len(free), 1.0 / len(free))
    for _ in range(MOST_ROUNDS):
        bounds[free] = x * scales
        sizes, vectors = _sizes(shares, bounds)
        # The error is convex in the tolerances, so that this part of them is allowed.
        part = (1.0 - ROOM - at_rest) / np.maximum(sizes - at_rest, 1.0 - ROOM - at_rest)
        allowed = float(part.min()) * x
        effort = cuts.effort(allowed)
        if effort < best:
            best, tolerances[free] = effort, allowed * scales
        if effort <= (1.0 + GAP) * cuts.least:
            break
        for half in range(2):
            place = int(sizes[:, half].argmax())
            size = sizes[place, half]
            if size > 0.0:
                along = np.abs(vectors[place, half] @ halves[place, half]) / size
                cuts.add(along[free] * scales, 1.0 - float(along @ held))
        x = cuts.solve()
        if not np.isfinite(x).all():
            break  # The solver has run out of precision; the best so far keeps what is wanted.
    return tolerances, cuts.least


def _sizes(shares: FloatArray, bounds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the largest displacement and turn, shape (n, 2), and their vectors, (n, 2, 3)."""
    found = largest_error(shares, bounds)
    return np.stack([found.displacement, found.turn], axis=1), found.vectors


def _check_held(costs: SourceCosts, wanted: float, wanted_turn: float | None) -> None:
    """Check that errors that are kept leave room for others.

    Raises:
        NoAnswerError: They exceed what is wanted.
    """
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


def _rounded_down(values: FloatArray) -> FloatArray:
    """Return positive values with their first two significant digits; infinite ones as they are."""
    return np.array([_two_digits(value) for value in values.tolist()])


def _two_digits(value: float) -> float:
    if not math.isfinite(value):
        return value
    digits, _, exponent = f"{value:.12e}".partition("e")
    return float(f"{digits[:3]}e{exponent}")
