"""Models bound values and rates over their interval, whatever is computed of them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from explorer.numerics.arrays import FloatArray
from explorer.paths.taylor_models import (
    Model,
    Models,
    constant,
    constants,
    deviation,
    inner,
    minor,
    outer,
    plus,
    plus3,
    product,
    reciprocal,
    scale,
    scale3,
    size_of,
    times3,
    turning,
)

AXES = np.eye(3)


class Turning:
    """A random vector that moves straight and turns, as a model and as numbers."""

    def __init__(self, seed: int, half: float) -> None:
        rng = np.random.default_rng(seed)
        self.half = half
        self.at, self.step, self.arm = rng.normal(size=(3, 3)) * (2.0, 1.0, 1.0)
        axis = rng.normal(size=3) if seed % 4 else AXES[seed % 3]
        self.axis, self.angle = axis / np.linalg.norm(axis), float(rng.uniform(0.0, 3.0))

    @property
    def model(self) -> Models:
        """The models at the middle of the interval."""
        a, n = (tuple(each.tolist()) for each in (self.arm, self.axis))
        arm = turning((a[0], a[1], a[2]), (n[0], n[1], n[2]), self.angle, self.half)
        line = tuple((x, v, 0.0) for x, v in zip(self.at.tolist(), self.step.tolist(), strict=True))
        return plus3(arm, (line[0], line[1], line[2]))

    def values(self, t: FloatArray) -> FloatArray:
        """Return the vector at times from the middle, shape (n, 3)."""
        n, a = self.axis, self.arm
        c, s = np.cos(self.angle * t)[:, None], np.sin(self.angle * t)[:, None]
        turned = c * a + s * np.cross(n, a) + (1.0 - c) * (n @ a) * n
        return self.at + t[:, None] * self.step + turned


def quotient(a: Models, b: Models, half: float) -> Model:
    length = plus(size_of(b, half), constant(0.3))
    return product(inner(a, b, half), reciprocal(length, half), half)


CASES: dict[
    str,
    tuple[
        Callable[[Models, Models, float], Model],
        Callable[[FloatArray, FloatArray], FloatArray],
    ],
] = {
    "component": (lambda a, _, __: a[1], lambda a, _: a[:, 1]),
    "inner": (inner, lambda a, b: (a * b).sum(axis=1)),
    "outer": (lambda a, b, h: outer(a, b, h)[0], lambda a, b: np.cross(a, b)[:, 0]),
    "minor": (
        lambda a, b, h: minor(a, b, 0, 2, h),
        lambda a, b: a[:, 0] * b[:, 2] - a[:, 2] * b[:, 0],
    ),
    "size": (lambda a, _, h: size_of(a, h), lambda a, _: np.linalg.norm(a, axis=1)),
    "difference": (
        lambda a, b, h: size_of(plus3(a, scale3(-0.7, b)), h),
        lambda a, b: np.linalg.norm(a - 0.7 * b, axis=1),
    ),
    "quotient": (
        quotient,
        lambda a, b: (a * b).sum(axis=1) / (np.linalg.norm(b, axis=1) + 0.3),
    ),
    "times": (
        lambda a, b, h: scale(-2.0, times3(a[0], b, h)[2]),
        lambda a, b: -2.0 * a[:, 0] * b[:, 2],
    ),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("half", [0.5, 0.1, 1e-3])
def test_model_of_vectors_bounds_their_values_and_rates(name: str, half: float) -> None:
    of_models, of_values = CASES[name]
    t = np.linspace(-half, half, 201)
    for seed in range(60):
        a, b = Turning(seed, half), Turning(1000 + seed, half)
        model = of_models(a.model, b.model, half)
        values = of_values(a.values(t), b.values(t))
        size = 1e-12 * (1.0 + float(np.abs(values).max()))
        assert model[0] == pytest.approx(values[100], abs=size)
        assert np.abs(values - model[0]).max() <= deviation(model, half) + size
        # Differences are rates somewhere between their ends.
        rates = np.diff(values) / np.diff(t)
        rounding = 1e-12 / (t[1] - t[0])
        assert np.abs(rates - model[1]).max() <= model[2] + rounding


def test_reciprocal_model_bounds_values_and_rates_near_zero() -> None:
    for seed in range(200):
        rng = np.random.default_rng(seed)
        half = float(rng.uniform(0.01, 1.0))
        line = float(rng.choice([-1.0, 1.0])) * half * float(rng.uniform(1.001, 3.0))
        t = np.linspace(-half, half, 401)
        model = reciprocal((line, 1.0, 0.0), half)
        values = 1.0 / (line + t)
        assert model[0] == pytest.approx(values[200], rel=1e-12)
        # The bounds are attained.
        most = 1.0 + 1e-12
        assert np.abs(values - model[0]).max() <= most * deviation(model, half)
        assert np.abs(-values * values - model[1]).max() <= most * model[2]


def test_size_model_of_vector_that_vanishes_bounds_it() -> None:
    still = constants((0.0, 0.0, 0.0))
    assert size_of(still, 0.5) == (0.0, 0.0, 0.0)
    moving = ((0.0, 3.0, 0.1), (0.0, -4.0, 0.0), (0.0, 0.0, 0.0))
    assert size_of(moving, 0.5) == pytest.approx((0.0, 0.0, 5.1))
    t = np.linspace(-0.5, 0.5, 1001)
    passing = ((0.1, 1.0, 0.0), (0.02, 0.0, 0.0), (0.0, 0.0, 0.0))
    model = size_of(passing, 0.5)
    values = np.hypot(0.1 + t, 0.02)
    assert np.abs(values - model[0]).max() <= deviation(model, 0.5)
    assert np.abs((0.1 + t) / values - model[1]).max() <= model[2]


def test_error_of_models_falls_with_the_square_of_the_interval() -> None:
    errors: list[float] = []
    for half in (0.1, 0.01, 0.001):
        a, b = Turning(3, half), Turning(4, half)
        model = quotient(a.model, b.model, half)
        errors.append(half * model[2])
    assert errors[1] < 0.015 * errors[0]
    assert errors[2] < 0.0105 * errors[1]
    assert math.isfinite(errors[0])
