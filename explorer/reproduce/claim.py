"""The types of a claim of the paper and of its measurement."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

Verdict = Literal["confirmed", "confirmed within", "not confirmed", "not testable from the paper"]

VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
"""Confirmed: the values show the claim as the paper states it. Confirmed within: the values show it
under the condition of the measurement. Not confirmed: the values show the contrary, or a
counterexample. Not testable: the paper does not print what a test would need."""

Values = Mapping[str, object]


@dataclass(frozen=True)
class Measurement:
    """The measurement of a claim.

    Attributes:
        text: The measured values, in sentences.
        verdict: Judgement, which follows from the values.
        values: The values by name.
        table: Lines of a table with more of them.
        condition: Condition under which the claim is confirmed; "" for the other verdicts.
    """

    text: str
    verdict: Verdict
    values: Values = field(default_factory=dict[str, object])
    table: tuple[str, ...] = ()
    condition: str = ""


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes:
        name: Name on the command line.
        title: The claim, one sentence.
        paper: Words of the paper; … marks what is left out, [] what the scan lost.
        reading: What the paper leaves open, and how it is read here; "" if nothing.
        command: Command that shows a part of it.
        measure: Function that measures it; random cases have fixed seeds.
    """

    name: str
    title: str
    paper: str
    reading: str
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
