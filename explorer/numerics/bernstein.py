"""The first place where a polynomial on [0, 1] turns negative, by its Bernstein coefficients.

A polynomial is nowhere below its least Bernstein coefficient, so a piece whose coefficients are
not negative needs no further work; others are halved. A piece whose coefficients change their
sign once has one root, which Newton's method finds. See R. T. Farouki, "The Bernstein polynomial
basis: a centennial retrospective", Computer Aided Geometric Design 29 (2012).
"""

from __future__ import annotations

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper

MOST_DEGREE = 8
# Number of times that a piece is halved; then it is as narrow as rounding allows.
MOST_HALVINGS = 46
# Shape of the scratch array of `first_negative`: a piece per row, its coefficients, its low end
# and its width.
STACK = (MOST_HALVINGS + 3, MOST_DEGREE + 3)
LOW_END, WIDTH = MOST_DEGREE + 1, MOST_DEGREE + 2
# Value that means that there is no such place.
NOWHERE = 2.0
# Width of a bracket at which a root is found, and the number of steps that always suffice.
ROOT_WIDTH, ROOT_STEPS = 1e-15, 80


@helper
def keep_left(b: FloatArray, degree: int, end: float) -> None:
    """Replace the coefficients of a polynomial on [0, 1] by those of its part on [0, end]."""
    for level in range(1, degree + 1):
        for i in range(degree, level - 1, -1):
            b[i] = (1.0 - end) * b[i - 1] + end * b[i]


@helper
def keep_right(b: FloatArray, degree: int, start: float) -> None:
    """Replace the coefficients of a polynomial on [0, 1] by those of its part on [start, 1]."""
    for level in range(1, degree + 1):
        for i in range(degree - level + 1):
            b[i] = (1.0 - start) * b[i] + start * b[i + 1]


@helper
def is_negative_nowhere(b: FloatArray, degree: int) -> bool:
    """Return whether no coefficient is negative, so that the polynomial is not either."""
    i = 0
    while i <= degree and b[i] >= 0.0:
        i += 1
    return i > degree


@helper
def single_root(b: FloatArray, degree: int, scratch: FloatArray) -> float:
    """Return the root of a polynomial that falls below zero once between 0 and 1."""
    low, high = 0.0, 1.0
    x = b[0] / (b[0] - b[degree])
    for _ in range(ROOT_STEPS):
        for i in range(degree + 1):
            scratch[i] = b[i]
        for level in range(1, degree):
            for i in range(degree - level + 1):
                scratch[i] += x * (scratch[i + 1] - scratch[i])
        rise = scratch[1] - scratch[0]
        value, slope = scratch[0] + x * rise, degree * rise
        if value >= 0.0:
            low = x
        else:
            high = x
        following = x - value / slope if slope != 0.0 else low
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - x) <= ROOT_WIDTH or high - low <= ROOT_WIDTH:
            return following
        x = following
    return x


@helper
def first_negative(b: FloatArray, degree: int, stack: FloatArray) -> float:
    """Return the first place in [0, 1] beyond which a polynomial is negative, or `NOWHERE`.

    Where it touches zero to rounding, it may count as negative or not. The stack is working space
    of the shape `STACK`.
    """
    for i in range(degree + 1):
        stack[0, i] = b[i]
    stack[0, LOW_END], stack[0, WIDTH] = 0.0, 1.0
    top = 0
    narrowest = 0.5**MOST_HALVINGS
    while top >= 0:
        piece = stack[top]
        if is_negative_nowhere(piece, degree):
            top -= 1
            continue
        if not piece[0] >= 0.0 or piece[WIDTH] <= narrowest:
            return piece[LOW_END]
        changes = 0
        for i in range(degree):
            if (piece[i] >= 0.0) != (piece[i + 1] >= 0.0):
                changes += 1
        if changes == 1:
            root = single_root(piece, degree, stack[top + 1])
            return piece[LOW_END] + root * piece[WIDTH]
        half = stack[top + 1]
        for i in range(degree + 1):
            half[i] = piece[i]
        half[WIDTH] = piece[WIDTH] = 0.5 * piece[WIDTH]
        half[LOW_END] = piece[LOW_END]
        piece[LOW_END] += piece[WIDTH]
        # The left half comes first.
        keep_right(piece, degree, 0.5)
        keep_left(half, degree, 0.5)
        top += 1
    return NOWHERE
