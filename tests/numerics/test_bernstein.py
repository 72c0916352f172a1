"""The first negative place of a polynomial, beside the roots that NumPy finds."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from explorer.numerics.arrays import FloatArray
from explorer.numerics.bernstein import MOST_DEGREE, NOWHERE, STACK, first_negative, single_root


def values(b: FloatArray, x: FloatArray) -> FloatArray:
    """Return a polynomial of Bernstein coefficients at places."""
    n = len(b) - 1
    return np.asarray(sum(b[i] * comb(n, i) * x**i * (1.0 - x) ** (n - i) for i in range(n + 1)))


def as_polynomial(b: FloatArray) -> Polynomial:
    n = len(b) - 1
    x, one = Polynomial([0.0, 1.0]), Polynomial([1.0])
    return sum(
        (b[i] * comb(n, i) * x**i * (one - x) ** (n - i) for i in range(n + 1)), Polynomial([0.0])
    )


def coefficients(seed: int) -> FloatArray:
    random = np.random.default_rng(seed)
    return random.normal(size=int(random.integers(2, MOST_DEGREE + 2)))


def test_first_negative_place_is_the_first_falling_root() -> None:
    for b in map(coefficients, range(200)):
        found = first_negative(np.append(b, 0.0), len(b) - 1, np.zeros(STACK))
        roots = as_polynomial(b).roots()
        real = np.sort(roots[np.abs(roots.imag) < 1e-9].real)
        inside = [x for x in real if 0.0 < x < 1.0 and values(b, np.array([x + 1e-6]))[0] < 0.0]
        expected = 0.0 if b[0] < 0.0 else (*inside, NOWHERE)[0]
        assert found == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("root", [1e-9, 0.25, 0.5, 1.0 - 1e-9])
@pytest.mark.parametrize("degree", [1, 3, 8])
def test_single_root_is_found_to_rounding(root: float, degree: int) -> None:
    # (root − x) times a polynomial that is positive on [0, 1].
    line, other = np.array([root, root - 1.0]), np.ones(degree)
    b = np.zeros(degree + 1)
    for i in range(degree + 1):
        for j, k in ((0, i), (1, i - 1)):
            if 0 <= k < degree:
                b[i] += line[j] * other[k] * comb(1, j) * comb(degree - 1, k) / comb(degree, i)
    assert single_root(b, degree, np.zeros(MOST_DEGREE + 3)) == pytest.approx(root, abs=1e-14)


def test_polynomial_that_is_never_negative_has_no_such_place() -> None:
    # (x − 1/2)² + 1e-6 has a negative coefficient and no root.
    b = np.array([0.25, -0.25, 0.25]) + 1e-6
    assert first_negative(b, 2, np.zeros(STACK)) == NOWHERE
    assert first_negative(b - 2e-6, 2, np.zeros(STACK)) == pytest.approx(0.499, abs=1e-4)
