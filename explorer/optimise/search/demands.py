"""The demands of a problem as smooth functions with their exact gradients.

Each demand is dimensionless and of about unit size: at least zero where it is met, or
exactly zero for an equality. All are measured at a `SearchState`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.measures.box import box_margins, corners_of
from explorer.measures.catalogue import CATALOGUE
from explorer.mechanism.margins import SINGULAR, margins, planes_of_singularity
from explorer.numerics.arrays import BoolArray, FloatArray, dot, lengths_of
from explorer.optimise.problem import SHIFTS, distances_of
from explorer.optimise.search.state import NOWHERE, SearchState
from explorer.proofs.limits import AXES_OF_LEGS, BoxLimits, End, prove_limits, tilted_rotations
from explorer.proofs.proof import Proof
from explorer.workspace.limits import quantities
from explorer.workspace.limits.constraints import YAW, apex_of, line_of
from explorer.workspace.limits.table import GAP

# Tolerance of a demand that is no limit, dimensionless.
MET = 1e-8
# What a demand over many poses must have to spare in those of them that a search looks at, so that
# their neighbours keep it too; dimensionless, and larger than the tolerance.
RESERVE = 3e-8
CORNERS = corners_of(((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)))
"""The corners of a box as shares of its edges, shape (8, 3)."""


class Measured(NamedTuple):
    """The values (m,) of m demands and their derivatives (m, n) by the n scaled variables."""

    values: FloatArray
    gradients: FloatArray


class SearchDemand(ABC):
    """One or several conditions of one kind.

    Attributes:
        names: Name of each condition.
        is_equality: Whether the values must be zero, rather than at least zero.
        is_limit: Whether it is a limit of the design, with the tolerance of all limits.
        places: Places in the required box at which statics are evaluated, shape (k, 3).
    """

    names: tuple[str, ...] = ()
    is_equality = False
    is_limit = False
    places = NOWHERE

    @abstractmethod
    def measure(self, state: SearchState) -> Measured:
        """Return the values and their derivatives."""

    def look_at_unproven(self, state: SearchState) -> list[Proof]:
        """Look from now on at the poses of what is not proven at a state too, and return it."""
        del state
        return []


class VolumeDemand(SearchDemand):
    """The volume of the workspace, exactly or at least, by its nearly linear cube root."""

    def __init__(self, volume: float, *, is_equality: bool) -> None:
        self.volume, self.is_equality = volume, is_equality
        self.names = (CATALOGUE["volume"].label,)

    def measure(self, state: SearchState) -> Measured:
        """Return (V / V′)^⅓ − 1."""
        root, gradient = state.volume_root(self.volume)
        return Measured(np.array([root - 1.0]), gradient[None, :])


class ReachDemand(SearchDemand):
    """A longest leg of at most some length."""

    def __init__(self, reach: float) -> None:
        self.reach = reach
        self.names = (CATALOGUE["longest_leg"].label,)

    def measure(self, state: SearchState) -> Measured:
        """Return 1 − reach / largest."""
        value, gradient = state.longest_leg
        return Measured(np.array([1.0 - value / self.reach]), -gradient[None, :] / self.reach)


class DegenerateDemand(SearchDemand):
    """The distances from degenerate designs, on the side where a run starts.

    They are linear, so no step of the solver breaks them after a start that keeps them.
    """

    names = ("distance from a3y = 0", "distance from b1y = 0", "distance from b2 = b3")

    def __init__(self, least: float, start: SearchState) -> None:
        self.least = least
        self.signs = np.sign(_distances(start))

    def measure(self, state: SearchState) -> Measured:
        """Return sign · distance − least, over the size of the start."""
        size = state.problem.size
        rows = state.rows(("a3y", "b1y", "b3"))
        rows[2] -= state.rows(("b2",))[0]
        values = self.signs * _distances(state) - self.least
        return Measured(values / size, self.signs[:, None] * rows / size)


def _distances(state: SearchState) -> FloatArray:
    return np.array([*distances_of(state.design).values()])


class GapDemand(SearchDemand):
    """The smallest gap of the carriages, in the order that they have where a run starts.

    The order itself is no demand: each design keeps that of its own home pose.
    """

    is_limit = True
    names = (GAP,)

    def __init__(self, start: SearchState) -> None:
        self.sign = 1.0 if _gap(start) >= 0.0 else -1.0

    def measure(self, state: SearchState) -> Measured:
        """Return sign · (d3 − d1) − gap, over the size of the start."""
        size, u = state.problem.size, state.rotation[:, 0]
        span = state.design.b3 - state.design.b2
        slope = state.along({"b3": float(u[0]), "b2": -float(u[0]), YAW: -span * float(u[1])})
        value = self.sign * _gap(state) - state.design.limits.gap
        return Measured(np.array([value / size]), self.sign * slope[None, :] / size)


def _gap(state: SearchState) -> float:
    return (state.design.b3 - state.design.b2) * float(state.rotation[0, 0])


class CheckedTilt(NamedTuple):
    """A tilt at which a limit over a box is looked at, angles in degrees.

    Attributes:
        corner: Corner of the box, (3,) of 0 and 1, where more than one of them may be the worst.
        azimuth: Azimuth from home's yaw.
        tilt: Tilt.
        window: Half of the window about the azimuth in which the worst one counts.
    """

    corner: FloatArray
    azimuth: float = 0.0
    tilt: float = 0.0
    window: float = 0.0


class BoxDemand(SearchDemand):
    """A required box within the workspace, at home's orientation and at all tilts up to one.

    A box whose corners lie within a convex limit lies within it; for a half-space the worst corner
    decides. A least length keeps the box outside a ball: there the point of the box nearest to the
    centre decides.

    A search looks at the worst azimuth of the whole tilt in each of `SECTORS`, and, once a limit
    was missed, about the tilt where it was. Azimuths turn with the yaw of home, so that a change of
    the yaw turns all orientations about the base's z-axis.
    """

    is_limit = True

    def __init__(self, start: SearchState, tilt: float | None) -> None:
        self.tilt = tilt
        over = BoxLimits(start.design, start.box, start.rotation)
        self.looks: dict[str, list[CheckedTilt]] = {}
        for end in over.ends:
            # At home's orientation `GapDemand` demands what is the same in every position.
            is_of_carriages = end.quantity == quantities.ORDER
            self.looks[end.name] = [] if is_of_carriages else [*map(CheckedTilt, _corners(end))]
            for sector in range(SECTORS if tilt is not None and over.rate(end) > 0.0 else 0):
                self._look(end, 360.0 * sector / SECTORS, tilt or 0.0, 180.0 / SECTORS)
        self._name()

    def _look(self, end: End, azimuth: float, tilt: float, window: float) -> None:
        self.looks[end.name] += [CheckedTilt(each, azimuth, tilt, window) for each in _corners(end)]

    def _name(self) -> None:
        self.names = tuple(
            f"required box within {name}" + (f", tilted by {look.tilt:.6g}°" if look.tilt else "")
            for name, looks in self.looks.items()
            for look in looks
        )

    def measure(self, state: SearchState) -> Measured:
        """Return the slacks that are looked at, over the size; with a tilt, less a reserve."""
        over, size = BoxLimits(state.design, state.box, state.rotation), state.problem.size
        ends = {end.name: end for end in over.ends}
        measured = [
            _slacks_of(over, ends[name], looks, state)
            for name, looks in self.looks.items()
            if looks
        ]
        values, gradients = zip(*measured, strict=True)
        reserve = 0.0 if self.tilt is None else RESERVE
        return Measured(np.concatenate(values) / size - reserve, np.vstack(gradients) / size)

    def look_at_unproven(self, state: SearchState) -> list[Proof]:
        """Look from now on at the tilts where limits are missed or not proven, and return these."""
        if self.tilt is None:
            return []
        over = BoxLimits(state.design, state.box, state.rotation)
        ends = {end.name: end for end in over.ends}
        proofs = prove_limits(state.design, state.box, state.rotation, self.tilt)
        found = [proof for proof in proofs if not proof.is_proven]
        for proof in found:
            azimuth, tilt = proof.place.tolist()
            self._look(ends[proof.name], azimuth - state.yaw, tilt, WINDOW)
        self._name()
        return found


# Sectors of azimuths in which a search looks at the worst one, and half of the window about one
# that was missed, in degrees.
SECTORS, WINDOW = 4, 15.0
# Number of azimuths tried in a window, and distances of three through which parabolas lead to the
# worst one, over the distance of those.
TRIED, NEARER = 9, (1.0, 0.25, 0.06, 0.004)


# Quantities whose gradient by the position turns with the platform.
TURNING = (quantities.DELTA1, quantities.DELTA2)


def _corners(end: End) -> FloatArray:
    """Return the corners of a box, of 0 and 1, to look at for an end of a limit, (c, 3).

    There is one if the worst position is the same, or moves smoothly, while azimuths change.
    """
    if end.is_shortest or end.quantity not in (*range(quantities.L1, quantities.ANGLE), *TURNING):
        return CORNERS[:1]
    # To the legs on the guide, and for δ2, both ends along x are the same.
    is_along = end.quantity not in (quantities.D2, quantities.D4, quantities.DELTA2)
    return CORNERS if is_along else CORNERS[::2]


def _slacks_of(over: BoxLimits, end: End, looks: list[CheckedTilt], state: SearchState) -> Measured:
    """Return the slacks of an end of a limit at k looks, and their derivatives."""
    corners = over.lows + np.array([look.corner for look in looks]) * (over.highs - over.lows)
    tilts = np.array([(state.yaw + look.azimuth, look.tilt) for look in looks])
    windows = np.array([look.window for look in looks])

    def decide(steps: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return orientations and positions at steps of the azimuths (k, m), and the slacks."""
        offsets = np.stack(np.broadcast_arrays(steps, 0.0), axis=-1)
        r = tilted_rotations(state.rotation, tilts[:, None] + offsets)
        p = corners[:, None] if len(_corners(end)) > 1 else over.worst(end, r)
        return r, p, over.slacks(end, r, p)

    if windows.any():
        steps = windows[:, None] * np.linspace(-1.0, 1.0, TRIED)
        least = decide(steps)[2].argmin(axis=1)
        tilts[:, 0] += steps[np.arange(len(looks)), least]
        for share in NEARER:
            step = share * 2.0 * windows / (TRIED - 1)
            before, at, after = decide(step[:, None] * [-1.0, 0.0, 1.0])[2].T
            bend, rise = before - 2.0 * at + after, 0.5 * (before - after)
            shift = np.divide(rise, bend, out=np.sign(rise), where=bend > 0.0)
            tilts[:, 0] += step * np.clip(shift, -1.0, 1.0)
    r, p, slack = (each[:, 0] for each in decide([[0.0]]))
    if end.leg is None:
        by_position, _, rates = line_of(state.design, r, end.quantity)
        by = {name: dot(rate[:, :3], p) + rate[:, 3] for name, rate in rates.items()}
    else:
        apex, rates = apex_of(state.design, r, end.leg)
        leg = (p - apex) * AXES_OF_LEGS[end.leg]
        by_position = leg / np.maximum(lengths_of(leg), 1e-300)[:, None]
        by = {name: -dot(by_position, rate) for name, rate in rates.items()}
    change = by_position @ state.rows(SHIFTS)
    for name, values in by.items():
        change += np.outer(values, state.along({name: 1.0}))
    return Measured(slack, end.side * (state.along(end.bound.rates) - change))


class MarginDemand(SearchDemand):
    """The margins over a required box, on one side of each singular plane.

    Margins are linear in p, so that the corners of the box have the worst one. The side is that
    of home; where the limits demand no margin, the one with most of the box where a run starts.

    If the demand is open, a box on a plane misses it, however large its tolerance.
    """

    names = tuple(f"margin δ{i} over the required box" for i in (1, 2, 3))

    def __init__(self, start: SearchState, *, is_open: bool = False) -> None:
        self.is_open = is_open
        self._signs: FloatArray | None = None
        if start.design.limits.margin is None:
            middle = planes_of_singularity(start.rotation) @ np.mean(start.box, axis=0)
            self._signs = np.where(middle == 0.0, start.design.home_signs, np.sign(middle))

    def measure(self, state: SearchState) -> Measured:
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

    def keeps(self, state: SearchState, positions: FloatArray) -> BoolArray:
        """Return whether positions (n, 3) are on the side of all planes, shape (n,)."""
        least = SINGULAR * lengths_of(positions)
        signed = self._signs_at(state) * margins(positions, state.rotation)
        return np.asarray((signed > least[:, None]).all(axis=1))

    def _signs_at(self, state: SearchState) -> FloatArray:
        return np.array(state.design.home_signs) if self._signs is None else self._signs
