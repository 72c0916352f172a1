"""The nearest values of demands at which a machine keeps a requirement, all other demands kept.

One demand is relaxed at a time, far enough that a machine is found, and then brought back towards
the required value as long as that machine can follow. What is told is a little farther than the
last value that was kept, so that a new search finds it too, and it is checked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import msgspec

from explorer.errors import ExplorerError
from explorer.find.answers import Relaxation
from explorer.find.requirement import MOST_TILT, Requirement

# How far demands are relaxed at first, as factors one after another.
FACTORS = (1.25, 1.6, 2.5, 4.0)
# Halvings of the way back, and the share of it that is left as room for a new search.
HALVINGS, ROOM = 5, 0.15
# Factor on the longest leg found that leaves room for a new search.
ROOM_OF_LEGS = 1.12
# Largest half-angle of a joint's cone, in degrees.
MOST_SWING = 80.0

Keeps = Callable[[Requirement, bool], float]
"""The longest leg, in mm, of a machine that keeps a requirement, infinite if none is found.

It begins with the last machine found, and lowers its legs as far as it can if it is told to."""


def nearest_values(
    requirement: Requirement, fields: Sequence[str], keeps: Keeps
) -> Iterator[Relaxation]:
    """Yield the nearest values of some fields of a requirement."""
    for field in fields:
        own = requirement.legs.longest_mm
        if field == "legs.longest_mm" and own:
            free = msgspec.structs.replace(requirement.legs, longest_mm=None)
            least = keeps(msgspec.structs.replace(requirement, legs=free), True)
            kept = missed = max(1.0, ROOM_OF_LEGS * least / own)
        else:
            kept, missed = _nearest_factor(requirement, field, keeps)
        if kept == math.inf:
            continue
        told = kept * (kept / missed) ** ROOM * (1.0 + 0.05 * min(1.0, kept - 1.0))
        found = relaxed(requirement, field, told)
        if found is not None and keeps(found, False) < math.inf:
            yield _in_words(found, field, told)


def _nearest_factor(requirement: Requirement, field: str, keeps: Keeps) -> tuple[float, float]:
    """Return the least factor on a demand that a machine keeps, and the largest that none does."""
    missed = 1.0
    for kept in FACTORS:
        if _keeps(requirement, field, kept, keeps):
            break
        missed = kept
    else:
        return math.inf, math.inf
    keeps(relaxed(requirement, field, kept) or requirement, True)
    for _ in range(HALVINGS):
        middle = math.sqrt(missed * kept)
        if _keeps(requirement, field, middle, keeps):
            kept = middle
        else:
            missed = middle
    return kept, missed


def _keeps(requirement: Requirement, field: str, factor: float, keeps: Keeps) -> bool:
    found = relaxed(requirement, field, factor)
    return found is not None and keeps(found, False) < math.inf


def relaxable_fields(requirement: Requirement) -> list[str]:
    """Return the demands that may be relaxed, those first that a user gives up most readily."""
    legs = requirement.legs
    fields = ["legs.longest_mm"] * (legs.longest_mm is not None)
    fields += ["tilt_deg"] * (requirement.tilt_deg > 0.0) + ["box_mm"]
    fields += ["legs.ratio"] * (legs.ratio is not None)
    fields += ["swing_deg"] * (requirement.swing_deg is not None)
    fields += ["legs.push_n"] * (legs.push_n is not None)
    return fields + ["legs.apart_mm"] * (legs.apart_mm > 0.0)


def relaxed(requirement: Requirement, field: str, factor: float) -> Requirement | None:
    """Return a requirement with one demand relaxed by a factor above 1; None if it cannot be.

    Values are those that a user would type, of three digits.
    """
    head, _, tail = field.partition(".")
    own = getattr(requirement, head) if not tail else getattr(requirement.legs, tail)
    try:
        if field == "box_mm":
            value = tuple(_three_digits(edge / factor, up=False) for edge in own)
            return msgspec.structs.replace(requirement, box_mm=value)
        shrinks = field in ("tilt_deg", "legs.apart_mm")
        value = _three_digits(own / factor if shrinks else own * factor, up=not shrinks)
        if (field == "swing_deg" and value > MOST_SWING) or (
            field == "tilt_deg" and value > MOST_TILT
        ):
            return None
        if not tail:
            return msgspec.structs.replace(requirement, **{field: value})
        legs = msgspec.structs.replace(requirement.legs, **{tail: value})
        if tail == "push_n" and legs.pull_n is not None:
            legs = msgspec.structs.replace(legs, pull_n=legs.pull_n * value / own)
        return msgspec.structs.replace(requirement, legs=legs)
    except ExplorerError:
        return None


def _three_digits(value: float, *, up: bool) -> float:
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    whole = math.ceil(value / step - 1e-9) if up else math.floor(value / step + 1e-9)
    return float(f"{whole * step:.6g}")


_WORDS = {
    "tilt_deg": ("tilt", "°"),
    "legs.longest_mm": ("longest leg", "mm"),
    "legs.ratio": ("ratio of the legs", ""),
    "swing_deg": ("swing", "°"),
    "legs.push_n": ("push of the actuators", "N"),
    "legs.apart_mm": ("distance of the legs", "mm"),
}


def _in_words(found: Requirement, field: str, factor: float) -> Relaxation:
    if field == "box_mm":
        edges = " × ".join(f"{edge:g}" for edge in found.box_mm)
        return Relaxation(field, 1.0 / factor, "", f"box {edges} mm", found)
    name, unit = _WORDS[field]
    head, _, tail = field.partition(".")
    value = float(getattr(found.legs, tail) if tail else getattr(found, head))
    space = "" if unit in ("", "°") else " "
    return Relaxation(field, value, unit, f"{name} {value:g}{space}{unit}", found)
