"""What people read of the columns of a study: words and units."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from explorer.optimise.problem import REACH, YAW
from explorer.sweep.measures import MEASURES
from explorer.sweep.rows import SAMPLE
from explorer.sweep.study import RADIUS

_WORDS: Mapping[str, str] = MappingProxyType(
    {
        YAW: "yaw of the platform",
        REACH: "the largest length of all four actuators",
        RADIUS: "radius of all four legs",
        "index": "number of the design",
        "objective": "what the search was for",
        "iterations": "steps of the search",
        "converged": "whether the search met all demands",
        "status": "what became of the design",
        "reason": "why it is not done, or not whole",
    }
)


def words_of(column: str) -> str:
    """Return what a column holds, in words."""
    if column.startswith(SAMPLE):
        return f"{words_of(column.removeprefix(SAMPLE))}, where the search started"
    if column in MEASURES and column not in _WORDS:
        return MEASURES[column].words
    return _WORDS.get(column, f"design variable {column}")


def unit_of(column: str) -> str:
    """Return the unit of a column: "u" for design units, "u³", "°", or "" for none."""
    name = column.removeprefix(SAMPLE)
    if name == YAW:
        return "°"
    if name in MEASURES:
        return MEASURES[name].unit
    return "" if name in _WORDS and name not in (REACH, RADIUS) else "u"
