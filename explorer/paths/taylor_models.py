"""Bounds over an interval of a variable, by Taylor models of first order.

A model holds the value and the rate of a quantity at the middle of an interval, and the most by
which its rate differs from that anywhere in the interval. Half the interval bounds the value, with
an error that falls with the square of the interval. See K. Makino and M. Berz, "Taylor models and
other validated functional inclusion methods" (2003). Rounding is not bounded.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from explorer.numerics.compiled import helper
from explorer.numerics.vectors import Vector

Model: TypeAlias = tuple[float, float, float]
"""The value, the rate, and the most by which the rate differs within the interval."""
Models: TypeAlias = tuple[Model, Model, Model]
"""A vector of models."""


@helper
def deviation(a: Model, half: float) -> float:
    """Return the most by which a quantity differs from its value at the middle."""
    return half * (abs(a[1]) + a[2])


@helper
def constant(x: float) -> Model:
    """Return the model of a number."""
    return (x, 0.0, 0.0)


@helper
def plus(a: Model, b: Model) -> Model:
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@helper
def scale(k: float, a: Model) -> Model:
    """Return k a."""
    return (k * a[0], k * a[1], abs(k) * a[2])


@helper
def product(a: Model, b: Model, half: float) -> Model:
    """Return a b."""
    by_a, by_b = deviation(a, half), deviation(b, half)
    error = abs(a[1]) * by_b + a[2] * (abs(b[0]) + by_b)
    error += abs(b[1]) * by_a + b[2] * (abs(a[0]) + by_a)
    return (a[0] * b[0], a[0] * b[1] + a[1] * b[0], error)


@helper
def reciprocal(a: Model, half: float) -> Model:
    """Return 1 / a; a may not vanish in the interval."""
    by = deviation(a, half)
    size, least = abs(a[0]), abs(a[0]) - by
    # |1 / a² − 1 / v²| is at most `by` (1 / (a v²) + 1 / (a² v)) for positive a and v.
    change = by * (1.0 / (least * size * size) + 1.0 / (least * least * size))
    rate = -a[1] / (a[0] * a[0])
    return (1.0 / a[0], rate, a[2] / (least * least) + abs(a[1]) * change)


@helper
def constants(a: Vector) -> Models:
    """Return the models of a constant vector."""
    return (constant(a[0]), constant(a[1]), constant(a[2]))


@helper
def plus3(a: Models, b: Models) -> Models:
    """Return a + b."""
    return (plus(a[0], b[0]), plus(a[1], b[1]), plus(a[2], b[2]))


@helper
def scale3(k: float, a: Models) -> Models:
    """Return k a for a number k."""
    return (scale(k, a[0]), scale(k, a[1]), scale(k, a[2]))


@helper
def times3(k: Model, a: Models, half: float) -> Models:
    """Return k a for a model k."""
    return (product(k, a[0], half), product(k, a[1], half), product(k, a[2], half))


@helper
def inner(a: Models, b: Models, half: float) -> Model:
    """Return a · b."""
    x, y = product(a[0], b[0], half), product(a[1], b[1], half)
    return plus(plus(x, y), product(a[2], b[2], half))


@helper
def minor(a: Models, b: Models, i: int, j: int, half: float) -> Model:
    """Return a_i b_j − a_j b_i."""
    return plus(product(a[i], b[j], half), scale(-1.0, product(a[j], b[i], half)))


@helper
def outer(a: Models, b: Models, half: float) -> Models:
    """Return a × b."""
    return (minor(a, b, 1, 2, half), minor(a, b, 2, 0, half), minor(a, b, 0, 1, half))


@helper
def size_of(a: Models, half: float) -> Model:
    """Return the length |a|, which may vanish."""
    value = math.sqrt(a[0][0] ** 2 + a[1][0] ** 2 + a[2][0] ** 2)
    speed = math.sqrt(a[0][1] ** 2 + a[1][1] ** 2 + a[2][1] ** 2)
    error = math.sqrt(a[0][2] ** 2 + a[1][2] ** 2 + a[2][2] ** 2)
    if value == 0.0:
        return (0.0, 0.0, speed + error)
    rate = (a[0][0] * a[0][1] + a[1][0] * a[1][1] + a[2][0] * a[2][1]) / value
    # Unit vectors of a and b differ by 2 |a − b| / (|a| + |b|) at most, and by no more than 2.
    by = half * (speed + error)
    turn = min(2.0, 2.0 * by / (value + max(0.0, value - by)))
    return (value, rate, error + turn * speed)


@helper
def turning(a: Vector, axis: Vector, angle: float, half: float) -> Models:
    """Return a vector that is `a` at the middle and turns about a unit axis by `angle` per unit."""
    x, y = axis[1] * a[2] - axis[2] * a[1], axis[2] * a[0] - axis[0] * a[2]
    z = axis[0] * a[1] - axis[1] * a[0]
    # A component of the part across the axis is an oscillation.
    curvature = half * angle * angle * math.sqrt(x * x + y * y + z * z)
    return (
        (a[0], angle * x, curvature * math.sqrt(max(0.0, 1.0 - axis[0] ** 2))),
        (a[1], angle * y, curvature * math.sqrt(max(0.0, 1.0 - axis[1] ** 2))),
        (a[2], angle * z, curvature * math.sqrt(max(0.0, 1.0 - axis[2] ** 2))),
    )
