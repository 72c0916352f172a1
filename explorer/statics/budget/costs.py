"""Costs of tolerances: how far an error of each source moves the tool, at worst over positions.

All of it is in the units of drawings: millimetres, and degrees for tilts of the guide and for turns
of the tool.
"""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError, NoAnswerError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.machine import DIMENSIONS, Tolerances
from explorer.mechanism.margins import INCIDENCES, margins
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray, IntArray, position_array
from explorer.statics.accuracy import (
    IS_TILT,
    SOURCES,
    error_by_source,
    largest_error,
    rms_of_sources,
)

PARTS: tuple[str, ...] = (
    *("cylinder 1, rod 1", "carriage 2", "cylinder 2, rod 2"),
    *("carriage 3", "cylinder 3, rod 3", "cylinder 4, rod 4"),
    *("platform" if name.startswith("b") else "base" for name in DIMENSIONS),
)
"""Parts of the prototype that carry each source, in the order of `SOURCES`."""


@dataclass(frozen=True)
class SourceCosts:
    """What errors of the sources cost in precision, at worst over positions.

    Arrays have the order of `SOURCES`. Each error is in mm, and in degrees for a tilt.

    Attributes:
        displacement: Largest displacement of the tool per error, shape (29,), in mm.
        turn: Largest turn of the tool per error, shape (29,), in degrees.
        lengths: Length that counts for a unit of error, shape (29,), in mm, see `error_lengths`.
        tolerances: Largest errors to either side, shape (29,); infinite for any.
        worst_displacement: Largest displacement within the tolerances, exact over all signs, in mm.
        worst_turn: Largest turn within them, in degrees.
        rms_displacement: Largest RMS displacement, for errors uniform within the tolerances.
        rms_turn: Largest RMS turn, likewise.
        shares: Parts of the worst displacement that each source causes where it is largest, shape
            (29,); they add up to 1, or are all 0.
        turn_shares: Parts of the worst turn likewise.
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
        """Largest displacement by each source alone within its tolerance, shape (29,), in mm."""
        return self.displacement * _finite(self.tolerances)

    @property
    def turn_within(self) -> FloatArray:
        """Largest turn by each source alone within its tolerance, shape (29,), in degrees."""
        return self.turn * _finite(self.tolerances)

    @property
    def ranking(self) -> IntArray:
        """Sources from the costliest, shape (29,): at its tolerance, then by counted length."""
        return np.lexsort([-self.displacement / self.lengths, -self.displacement_within])


def source_costs(
    design: Design, positions: ArrayLike, rotation: ArrayLike, tool: ArrayLike | None = None
) -> SourceCosts:
    """Return what the errors and tolerances of a design cost in precision over positions.

    Args:
        design: The manipulator, with the errors of its actuators and its tolerances.
        positions: Positions of b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (3, 3).
        tool: Tool point in the platform frame, shape (3,), in design units; None for b4.

    Raises:
        InputError: There is no position, one or the tool is not finite, or the rotation is not one.
        NoAnswerError: A position is singular, or singular ones lie between them.
    """
    points = position_array("positions", positions).reshape(-1, 3)
    influences = source_influences(design, points, rotation, tool)
    return costs_of(design, points, influences, stated_tolerances(design))


def costs_of(
    design: Design, positions: FloatArray, influences: FloatArray, tolerances: FloatArray
) -> SourceCosts:
    """Return the costs, given `source_influences` at positions and tolerances, shape (29,)."""
    bounds = _finite(tolerances)
    worst = largest_error(influences, bounds)
    rms = rms_of_sources(influences, bounds)
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
        lengths=error_lengths(design),
        tolerances=tolerances,
        worst_displacement=float(worst.displacement[places[0]]),
        worst_turn=float(worst.turn[places[1]]),
        rms_displacement=float(rms.displacement.max()),
        rms_turn=float(rms.turn.max()),
        shares=shares[0],
        turn_shares=shares[1],
        position=positions[places[0]],
        count=len(positions),
    )


def source_influences(
    design: Design, positions: FloatArray, rotation: ArrayLike, tool: ArrayLike | None
) -> FloatArray:
    """Return displacement (mm) and turn (degrees) of the tool per error, shape (n, 6, 29).

    Raises:
        InputError: There is no position, one or the tool is not finite, or the rotation is not one.
        NoAnswerError: A position is singular, or singular ones lie between them.
    """
    if not len(positions):
        raise InputError("costs of tolerances need at least one position; got none")
    signs = np.sign(margins(positions, rotation))
    crossed = np.flatnonzero(np.abs(signs.sum(axis=0)) < len(signs))
    by_source = error_by_source(Configuration(design, positions, rotation, tool))
    if len(crossed) or not np.isfinite(by_source).all():
        where = "; ".join(f"δ{k + 1} = 0: {INCIDENCES[k]}" for k in crossed)
        singular = (
            f"some of the {len(positions):,} positions are singular, or singular ones lie between"
            if len(positions) > 1
            else "the pose is singular"
        )
        raise NoAnswerError(
            f"errors are infinite: {singular} ({where or 'a margin vanishes to rounding'})"
        )
    rows = np.repeat([design.unit_mm, float(np.degrees(1.0))], 3)
    columns = np.where(IS_TILT, np.radians(1.0), 1.0 / design.unit_mm)
    return by_source * rows[:, None] * columns


def error_lengths(design: Design) -> FloatArray:
    """Return the length that counts for a unit of error of each source, shape (29,), in mm.

    A length counts as itself. A tilt counts as what it moves the far end of the guide: the carriage
    position of the larger magnitude that the limits of the guide allow, or, without these, a
    point at the distance of the reach.
    """
    far = max(map(abs, design.limits.guide or (0.0,))) or design.reach
    return np.where(IS_TILT, np.radians(1.0) * far * design.unit_mm, 1.0)


def stated_tolerances(design: Design) -> FloatArray:
    """Return the errors of a design's actuators and its tolerances, shape (29,), as stated."""
    given = design.tolerances
    lengths = (*design.actuators.error_mm, *given.a1, *given.a3, *given.guide)
    return np.array([*lengths, *given.guide_tilt_deg, *given.b1, *given.b2, *given.b3, *given.b4])


def with_tolerances(design: Design, tolerances: FloatArray) -> Design:
    """Return a design with other errors of its actuators and other tolerances.

    Args:
        design: The manipulator, which keeps what it states where any tolerance will do.
        tolerances: Tolerances, shape (29,), in mm and degrees; infinite for any.
    """
    values = np.where(np.isfinite(tolerances), tolerances, stated_tolerances(design)).tolist()

    def three(start: int) -> Triple:
        return values[start], values[start + 1], values[start + 2]

    error_mm = (*three(0), *three(3))
    actuators = msgspec.structs.replace(design.actuators, error_mm=error_mm)
    found = Tolerances(
        a1=three(6),
        a3=three(9),
        guide=three(12),
        guide_tilt_deg=(values[15], values[16]),
        b1=three(17),
        b2=three(20),
        b3=three(23),
        b4=three(26),
    )
    return msgspec.structs.replace(design, actuators=actuators, tolerances=found)


def _finite(tolerances: FloatArray) -> FloatArray:
    """Return tolerances with 0 in place of infinite ones, whose sources move nothing."""
    return np.where(np.isfinite(tolerances), tolerances, 0.0)
