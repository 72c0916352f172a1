"""The demands of a problem as smooth functions with their exact gradients.

Each demand is dimensionless and of about unit size: at least zero where it is met, or
exactly zero for an equality. All are measured at a `State`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np

from explorer.measures.box import box_margins, corners_of
from explorer.measures.catalogue import CATALOGUE
from explorer.mechanism.margins import SINGULAR, margins, planes_of_singularity
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion
from explorer.numerics.arrays import BoolArray, FloatArray, lengths_of
from explorer.optimise.problem import SHIFTS, distances_of
from explorer.optimise.search.state import State
from explorer.workspace.limits.constraints import YAW, BallOrCylinder, HalfSpace
from explorer.workspace.limits.table import GAP

# Tolerance of a demand that is no limit, dimensionless.
MET = 1e-8


class Measured(NamedTuple):
    """The values (m,) of m demands and their derivatives (m, n) by the n scaled variables."""

    values: FloatArray
    gradients: FloatArray


class Demand(ABC):
    """One or several conditions of one kind.

    Attributes:
        names: Name of each condition.
        is_equality: Whether the values must be zero, rather than at least zero.
        is_limit: Whether it is a limit of the design, with the tolerance of all limits.
    """

    names: tuple[str, ...] = ()
    is_equality = False
    is_limit = False

    @abstractmethod
    def measure(self, state: State) -> Measured:
        """Return the values and their derivatives."""


class VolumeDemand(Demand):
    """The volume of the workspace, exactly or at least, by its nearly linear cube root."""

    def __init__(self, volume: float, *, is_equality: bool) -> None:
        self.volume = volume
        self.is_equality = is_equality
        self.names = (f"{CATALOGUE['volume'].label} {volume:.6g}",)

    def measure(self, state: State) -> Measured:
        """Return (V / V′)^⅓ − 1."""
        root, gradient = state.volume_root(self.volume)
        return Measured(np.array([root - 1.0]), gradient[None, :])


class ReachDemand(Demand):
    """A longest leg of at most some length."""

    def __init__(self, reach: float) -> None:
        self.reach = reach
        self.names = (f"{CATALOGUE['longest_leg'].label} {reach:.6g}",)

    def measure(self, state: State) -> Measured:
        """Return 1 − reach / largest."""
        value, gradient = state.longest_leg
        return Measured(np.array([1.0 - value / self.reach]), -gradient[None, :] / self.reach)


class DegenerateDemand(Demand):
    """The distances from degenerate designs, on the side where a run starts.

    They are linear, so no step of the solver breaks them after a start that keeps them.
    """

    names = ("distance from a3y = 0", "distance from b1y = 0", "distance from b2 = b3")

    def __init__(self, least: float, start: State) -> None:
        self.least = least
        self.signs = np.sign(_distances(start))

    def measure(self, state: State) -> Measured:
        """Return sign · distance − least, over the size of the start."""
        size = state.problem.size
        rows = state.rows(("a3y", "b1y", "b3"))
        rows[2] -= state.rows(("b2",))[0]
        values = self.signs * _distances(state) - self.least
        return Measured(values / size, self.signs[:, None] * rows / size)


def _distances(state: State) -> FloatArray:
    return np.array([*distances_of(state.design).values()])


class GapDemand(Demand):
    """The smallest gap of the carriages, in the order that they have where a run starts.

    The order itself is no demand: each design keeps that of its own home pose.
    """

    is_limit = True
    names = (GAP,)

    def __init__(self, start: State) -> None:
        self.sign = 1.0 if _gap(start) >= 0.0 else -1.0

    def measure(self, state: State) -> Measured:
        """Return sign · (d3 − d1) − gap, over the size of the start."""
        size, u = state.problem.size, state.rotation[:, 0]
        span = state.design.b3 - state.design.b2
        slope = state.along({"b3": float(u[0]), "b2": -float(u[0]), YAW: -span * float(u[1])})
        value = self.sign * _gap(state) - state.design.limits.gap
        return Measured(np.array([value / size]), self.sign * slope[None, :] / size)


def _gap(state: State) -> float:
    return (state.design.b3 - state.design.b2) * float(state.rotation[0, 0])


class BoxDemand(Demand):
    """A required box within the workspace.

    A box whose corners lie within a convex limit lies within it; for a half-space the worst corner
    decides. A least length keeps the box outside a ball: there the point of the box nearest to the
    centre decides.
    """

    is_limit = True

    def __init__(self, start: State) -> None:
        # The gap is the same in every position, and demanded by `GapDemand`.
        self.counts: dict[str, int] = {}
        for limit in start.limits:
            if isinstance(limit, BallOrCylinder) and limit.inside:
                self.counts[limit.name] = 8 if limit.is_ball else 4
            elif limit.name != GAP:
                self.counts[limit.name] = 1
        named = [[name] * count for name, count in self.counts.items()]
        self.names = tuple(f"required box within {name}" for names in named for name in names)

    def measure(self, state: State) -> Measured:
        """Return the slacks of the points that decide on each limit, over the size."""
        size, n = state.problem.size, len(state.u)
        values: list[FloatArray] = []
        gradients: list[FloatArray] = []
        for name, count in self.counts.items():
            if limit := state.regions.get(name):
                value, by_u, by_p = _slack_of_box(state, limit)
                for axis, shift in enumerate(SHIFTS):
                    by_u = by_u + np.outer(by_p[:, axis], state.along({shift: 1.0}))
                values.append(value / size)
                gradients.append(by_u / size)
            else:
                # No position keeps this limit.
                values.append(np.full(count, -1.0))
                gradients.append(np.zeros((count, n)))
        return Measured(np.concatenate(values), np.vstack(gradients))


def _slack_of_box(
    state: State, limit: BallOrCylinder | HalfSpace
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what `State.slack` does at the deciding points of the required box."""
    corners = corners_of(state.box)
    if isinstance(limit, HalfSpace):
        worst = int((corners @ limit.normal).argmax())
        return state.slack(limit, corners[worst : worst + 1])
    if limit.inside:
        # To a cylinder along x both ends along x are the same.
        return state.slack(limit, corners if limit.is_ball else corners[::2])
    lows, highs = np.array(state.box)
    centre = limit.centre.copy()
    if not limit.is_ball:
        centre[0] = 0.5 * (lows[0] + highs[0])
    return state.slack(limit, np.clip(centre, lows, highs)[None, :])


class TiltDemand(Demand):
    """The required box within the workspace of one tilted orientation.

    The azimuth, in degrees, turns with the yaw of home, so that a change of the yaw turns the
    orientation about the base's z-axis, and its limits have the derivatives that they have at home.
    """

    is_limit = True

    def __init__(self, start: State, azimuth: float, tilt: float) -> None:
        self.turn: FloatArray = rotation_from_tilt_torsion((azimuth, tilt, 0.0))
        self.box, self.gap = BoxDemand(start.turn(self.turn)), GapDemand(start)
        where = f", tilted by {tilt:g}° towards {azimuth:g}° from home's yaw"
        self.names = tuple(f"{name}{where}" for name in (*self.box.names, *self.gap.names))

    def measure(self, state: State) -> Measured:
        """Return the slacks of the box and of the gap of the carriages."""
        tilted = state.turn(self.turn)
        (box, box_slopes), (gap, gap_slopes) = self.box.measure(tilted), self.gap.measure(tilted)
        return Measured(np.concatenate([box, gap]), np.vstack([box_slopes, gap_slopes]))


class MarginDemand(Demand):
    """The margins over a required box, on one side of each singular plane.

    Margins are linear in p, so that the corners of the box have the worst one. The side is that
    of home; where the limits demand no margin, the one with most of the box where a run starts.

    If the demand is open, a box on a plane misses it, however large its tolerance.
    """

    names = tuple(f"margin δ{i} over the required box" for i in (1, 2, 3))

    def __init__(self, start: State, *, is_open: bool = False) -> None:
        self.is_open = is_open
        self._signs: FloatArray | None = None
        if start.design.limits.margin is None:
            middle = planes_of_singularity(start.rotation) @ np.mean(start.box, axis=0)
            self._signs = np.where(middle == 0.0, start.design.home_signs, np.sign(middle))

    def measure(self, state: State) -> Measured:
        """Return sign · δ at the corner that is worst for each δ, over the size of the start."""
        corners, r, size = corners_of(state.box), state.rotation, state.problem.size
        signs = self._signs_at(state)
        u, normal, slopes = r[:, 0], r[:, 2], planes_of_singularity(r)
        at = signs[:, None] * (slopes @ corners.T)
        worst = at.argmin(axis=1)
        # Turning about the base's z-axis moves x to y and y to −x.
        turns = np.array([[normal[1], -normal[0], 0.0], [0.0, 0.0, u[0]], [0.0, 0.0, 0.0]])
        gradients = np.einsum("ia,ia->i", turns, corners[worst])[:, None] * state.along({YAW: 1.0})
        gradients = gradients + slopes @ np.array([state.along({shift: 1.0}) for shift in SHIFTS])
        values: FloatArray = at.min(axis=1) / size
        if self.is_open:
            is_clear = (values > 0.0) & (box_margins(state.box, r) > 0.0)
            values = np.where(is_clear, values, np.minimum(values, 0.0) - 2.0 * MET)
        return Measured(values, signs[:, None] * gradients / size)

    def keeps(self, state: State, positions: FloatArray) -> BoolArray:
        """Return whether positions (n, 3) are on the side of all planes, shape (n,)."""
        least = SINGULAR * lengths_of(positions)
        signed = self._signs_at(state) * margins(positions, state.rotation)
        return np.asarray((signed > least[:, None]).all(axis=1))

    def _signs_at(self, state: State) -> FloatArray:
        return np.array(state.design.home_signs) if self._signs is None else self._signs
