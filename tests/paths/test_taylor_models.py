"""Models bound values and rates over their interval, whatever is computed of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from explorer.numerics.arrays import FloatArray
from explorer.paths.taylor_models import (
    Model,
    Models,
    constant,
    deviation,
    inner,
    outer,
    plus,
    plus3,
    product,
    reciprocal,
    scale3,
    size_of,
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
    "outer": (lambda a, b, h: outer(a, b, h)[0], lambda a, b: np.cross(a, b)[:, 0]),
    "difference": (
        lambda a, b, h: size_of(plus3(a, scale3(-0.7, b)), h),
        lambda a, b: np.linalg.norm(a - 0.7 * b, axis=1),
    ),
    "quotient": (
        quotient,
        lambda a, b: (a * b).sum(axis=1) / (np.linalg.norm(b, axis=1) + 0.3),
    ),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("half", [0.5, 1e-3])
def test_model_of_vectors_bounds_their_values_and_rates(name: str, half: float) -> None:
    of_models, of_values = CASES[name]
    t = np.linspace(-half, half, 201)
    for seed in range(12):
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
