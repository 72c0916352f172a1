"""Real roots of polynomials of low degree, for compiled kernels."""

from __future__ import annotations

import math

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper

# Steps and accuracy of the roots of a polynomial on [-1, 1].
ROOT_STEPS, ROOT_ERROR = 60, 1e-15


@helper
def real_roots(a: float, b: float, c: float) -> tuple[float, float]:
    """Return the real roots of a x² + b x + c, nan in place of each missing one."""
    if a == 0.0:
        return (-c / b if b != 0.0 else math.nan), math.nan
    square = b * b - 4.0 * a * c
    if square < 0.0:
        return math.nan, math.nan
    # This form avoids cancellation.
    q = -0.5 * (b + math.copysign(math.sqrt(square), b))
    return q / a, (c / q if q != 0.0 else math.nan)


@helper
def polynomial_at(powers: FloatArray, degree: int, s: float) -> float:
    """Return a polynomial by its coefficients, the constant first."""
    value = powers[degree]
    for k in range(degree - 1, -1, -1):
        value = value * s + powers[k]
    return value


@helper
def root_between(powers: FloatArray, degree: int, low: float, high: float) -> float:
    """Return the root of a polynomial between places of distinct signs (Illinois method)."""
    at_low, at_high = polynomial_at(powers, degree, low), polynomial_at(powers, degree, high)
    root, kept = low, 0
    for _ in range(ROOT_STEPS):
        before, root = root, (low * at_high - high * at_low) / (at_high - at_low)
        value = polynomial_at(powers, degree, root)
        if value == 0.0 or abs(root - before) <= ROOT_ERROR:
            break
        # An end that stays twice counts half.
        if (value < 0.0) == (at_low < 0.0):
            low, at_low = root, value
            at_high *= 0.5 if kept == 1 else 1.0
            kept = 1
        else:
            high, at_high = root, value
            at_low *= 0.5 if kept == -1 else 1.0
            kept = -1
    return root


@helper
def write_roots(powers: FloatArray, derivative: FloatArray, roots: FloatArray) -> int:
    """Write the roots of a polynomial on [-1, 1] in order; return their count.

    Between two roots of the derivative there is one at most, so those of all derivatives are found
    one after the other, from the quadratic one on.
    """
    most, count = powers.shape[0] - 1, 0
    for degree in range(2, most + 1):
        order = most - degree
        for k in range(degree + 1):
            derivative[k] = powers[k + order]
            for j in range(1, order + 1):
                derivative[k] *= k + j
        if degree == 2:
            first, second = real_roots(derivative[2], derivative[1], derivative[0])
            for root in (min(first, second), max(first, second)):
                if -1.0 < root < 1.0:
                    roots[count] = root
                    count += 1
            continue
        low, found = -1.0, 0
        at_low = polynomial_at(derivative, degree, low)
        for i in range(count + 1):
            high = roots[i] if i < count else 1.0
            at_high = polynomial_at(derivative, degree, high)
            if (at_low < 0.0) != (at_high < 0.0):
                roots[found] = root_between(derivative, degree, low, high)
                found += 1
            low, at_low = high, at_high
        count = found
    return count
