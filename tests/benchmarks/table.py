"""The table: what was measured, the target, and what a user would take instead."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

NOTHING = "–"


class Row(NamedTuple):
    """One line of the table, in words."""

    what: str
    reached: str
    target: str = NOTHING
    beside: str = NOTHING
    """What a user would take instead, measured in the same run, and the ratio."""


HEAD = Row("what", "reached", "target", "beside")


def as_text(rows: Sequence[Row]) -> str:
    """Return the table in aligned columns."""
    lines = [HEAD, *rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(HEAD))]
    lines.insert(1, Row(*("-" * width for width in widths)))
    return "\n".join(
        "  ".join(f"{cell:{width}}" for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


def seconds(value: float) -> str:
    """Return a duration with three significant digits in the unit that suits it."""
    for unit, factor in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= factor:
            return f"{_three(value / factor)} {unit}"
    return f"{value * 1e9:.0f} ns"


def per_second(rate: float) -> str:
    """Return a rate with three significant digits."""
    return f"{_three(rate / 1e6)} million/s" if rate >= 1e6 else f"{_three(rate)}/s"


def times(ratio: float) -> str:
    """Return how many times better ours is."""
    return f"×{_three(ratio)}"


def _three(value: float) -> str:
    """Return three significant digits, and thousands in full."""
    if value >= 1000.0:
        return f"{value:,.0f}"
    digits = f"{value:.3g}"
    return f"{float(digits):g}"
