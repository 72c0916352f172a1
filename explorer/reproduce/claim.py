"""A claim of the paper and its measurement, and the random cases on which claims are tried."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.mechanism.design import Design
from explorer.mechanism.folds import from_folds, to_folds
from explorer.numerics.arrays import BoolArray, FloatArray

# Columns of the folds.
R, BETA, EPSILON, PHI1, PHI2, PHI3 = range(6)

Verdict = Literal["confirmed", "confirmed within", "not confirmed", "not testable from the paper"]
"""Confirmed: the values show the claim as the paper states it. Confirmed within: the values show it
under the condition of the measurement. Not confirmed: the values show the contrary, or a
counterexample. Not testable: the paper does not print what a test would need."""

Values = Mapping[str, object]


@dataclass(frozen=True)
class Measurement:
    """The measurement of a claim.

    Attributes:
        verdict: Judgement, which follows from the values.
        words: Further values, or the same in words, by their names in the sentences of the claim.
        values: The values by name.
        table: Lines of a table with more of them.
        condition: Condition under which the claim is confirmed; "" for the other verdicts.
        text: The measured values, in sentences.
    """

    verdict: Verdict
    words: Values
    values: Values
    table: tuple[str, ...] = ()
    condition: str = ""
    text: str = ""


def judge(
    is_so: bool, words: Values, values: Values, table: Sequence[str] = (), condition: str = ""
) -> Measurement:
    """Return a measurement that confirms a claim, or does so under a condition that is not ""."""
    if is_so:
        return Measurement("confirmed", words, values, tuple(table))
    verdict = "confirmed within" if condition else "not confirmed"
    return Measurement(verdict, words, values, tuple(table), condition)


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes:
        name: Name on the command line.
        title: The claim, one sentence.
        paper: Words of the paper; … marks what is left out, [] what the scan lost.
        reading: What the paper leaves open, and how it is read here; "" if nothing.
        found: Sentences on the measured values, a format string of the words of a measurement.
        command: Command that shows a part of it.
        measure: Function that measures it; random cases have fixed seeds.
    """

    name: str
    title: str
    paper: str
    reading: str
    found: str
    command: str
    measure: Callable[[], Measurement]


@dataclass(frozen=True)
class Result:
    """A claim with its measurement."""

    claim: Claim
    measurement: Measurement


def below(value: float, bound: float) -> str:
    """Return an error in words that are the same on every machine, while it is below a bound."""
    text = f"less than {bound:.0e}" if value < bound else f"{value:.0e}"
    return text.replace("e-0", "e-")


def random_design(random: np.random.Generator) -> Design:
    """Return a design that is far from degenerate."""
    a3 = random.uniform(6.0, 14.0, 2) * random.choice((-1.0, 1.0), 2)
    b1 = random.uniform(2.0, 5.0, 2) * random.choice((-1.0, 1.0), 2)
    b2, gap = float(random.uniform(-2.0, 2.0)), float(random.uniform(1.5, 4.0))
    return Design(
        a3=(float(a3[0]), float(a3[1])), b1=(float(b1[0]), float(b1[1])), b2=b2, b3=b2 + gap
    )


def random_poses(
    random: np.random.Generator, count: int, size: float
) -> tuple[FloatArray, FloatArray]:
    """Return positions (count, 3) within a cube of half the edge `size`, and any rotations."""
    rotations = Rotation.random(count, rng=random).as_matrix()
    return random.uniform(-size, size, (count, 3)), np.asarray(rotations, dtype=np.float64)


def random_folds(random: np.random.Generator, free: BoolArray) -> FloatArray:
    """Return folds (n, 6), far from flat where they are free and zero elsewhere."""
    folds = random.uniform(0.3, 2.8, free.shape)
    folds[:, PHI1:] *= random.choice((-1.0, 1.0), (len(folds), 3))
    return np.where(free, folds, 0.0)


def flatten(
    positions: FloatArray, rotations: FloatArray, column: int
) -> tuple[FloatArray, FloatArray]:
    """Return poses with one fold flat, at 0 in one half of them and at π in the other."""
    folds = to_folds(positions, rotations)
    folds[:, column] = np.where(np.arange(len(folds)) % 2, np.pi, 0.0)
    return from_folds(folds)
