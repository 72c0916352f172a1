"""The types of a claim of the paper and of what is measured for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

Verdict = Literal["confirmed", "confirmed within", "not confirmed", "not testable from the paper"]

VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
"""Confirmed: the measured values show it as the paper says it. Confirmed within: they show it under
a condition that the measured text states. Not confirmed: they show the contrary, or a
counterexample. Not testable: the paper does not print what a test would need."""

Figures = Mapping[str, object]


@dataclass(frozen=True)
class Measured:
    """What is measured for a claim.

    Attributes:
        text: The measured values, in sentences.
        verdict: Judgement, which follows from the values.
        figures: The values by name.
        table: Lines of a table with more of them.
    """

    text: str
    verdict: Verdict
    figures: Figures = field(default_factory=dict[str, object])
    table: tuple[str, ...] = ()


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes:
        name: Name on the command line.
        title: The claim, one sentence.
        paper: Words of the paper.
        reading: What the paper leaves open, and how it is read here; "" if nothing.
        command: Command that shows it.
        measure: Function that measures it; random cases have fixed seeds.
    """

    name: str
    title: str
    paper: str
    reading: str
    command: str
    measure: Callable[[], Measured]


@dataclass(frozen=True)
class Result:
    """A claim with what is measured for it."""

    claim: Claim
    measured: Measured
