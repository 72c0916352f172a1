"""The folds of the pose as the page shows and sets them, in degrees and with the signs of the mode.

A fold of 0 or 180° is a wall between two assembly modes. There it has the sign of the present one:
180° in a mode with a positive margin is −180° in its neighbour with a negative one.
"""

from __future__ import annotations

import math
from dataclasses import replace

from explorer.app.state.actions import action
from explorer.app.state.moves import angle_text, move_to
from explorer.app.state.parts import with_value
from explorer.app.state.state import Folds, GivenFolds, State
from explorer.errors import InputError
from explorer.mechanism.folds import FOLDS, pose_of_folds, to_folds
from explorer.mechanism.margins import MODE_BITS, signs_of
from explorer.numerics.number_text import format_apart, format_number

HALF_TURN = 180.0
# Degrees from 0 or 180 up to which a fold is flat but for rounding.
FLAT = 1e-9
# Index of φ1.
FIRST_FOLD = FOLDS.index("φ1")


def _fold_words(after: State, index: int, value: float) -> str:
    if index > 0:
        return f"{FOLDS[index]} = {angle_text(value)}"
    return f"{FOLDS[0]} = {after.unit.text(value, 6, size=after.design.reach)}"


@action(_fold_words)
def set_fold(state: State, index: int, value: float) -> State:
    """Set one coordinate of the folds, by its index in `FOLDS`; the other five stay.

    r is in design units, the others are in degrees. A fold that is set flat stays in its mode.

    Raises:
        InputError: The coordinate is beyond its range.
    """
    least = -HALF_TURN if index >= FIRST_FOLD else 0.0
    if index > 0 and not least <= value <= HALF_TURN:
        low, high, given = format_apart((least, HALF_TURN, value), 6, format_number)
        raise InputError(f"{FOLDS[index]} must be {low}° to {high}°; got {given}°")
    folds = with_value(folds_of(state), str(index), value)
    pose, mode = pose_of_folds(folds), state.mode
    if index >= FIRST_FOLD and abs(value) not in {0.0, HALF_TURN}:
        bit = int(MODE_BITS[index - FIRST_FOLD])
        mode = mode | bit if value > 0.0 else mode & ~bit
    return replace(move_to(state, pose), mode=mode, set_folds=GivenFolds(folds, pose))


def folds_of(state: State) -> Folds:
    """Return r in design units and β, ε, φ1, φ2, φ3 in degrees, as the user set them if known.

    Where an angle or r vanishes, the pose does not determine all six.
    """
    given = state.set_folds
    if given is not None and given.pose == state.pose:
        r, beta, epsilon, phi1, phi2, phi3 = given.folds
    else:
        r, *angles = to_folds(state.pose.position, state.pose.rotation).tolist()
        beta, epsilon, phi1, phi2, phi3 = map(math.degrees, angles)
    first, second, third = signs_of(state.mode)
    phi1, phi2, phi3 = (_with_sign(phi1, first), _with_sign(phi2, second), _with_sign(phi3, third))
    return r, beta, epsilon, phi1, phi2, phi3


def _with_sign(fold: float, sign: int) -> float:
    """Return a fold in degrees; a flat one has the sign of its margin."""
    wall = HALF_TURN if abs(fold) > 0.5 * HALF_TURN else 0.0
    if fold * sign > 0.0 or abs(abs(fold) - wall) > FLAT:
        return fold
    # Zero is not negative.
    return sign * wall + 0.0
