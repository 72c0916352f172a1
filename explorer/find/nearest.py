"""The nearest values of demands at which a machine keeps a requirement, all other demands kept.

One demand at a time is left out, and missed as little as a machine can that keeps all others. What
is told leaves some room, so that a new search finds a machine too: one from nothing, with another
seed, has to find it in half of the usual time.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import msgspec
import numpy as np

from explorer.errors import ExplorerError
from explorer.find import machine_values as m
from explorer.find.answers import FoundDesigns, Relaxation
from explorer.find.bound import impossible_demands
from explorer.find.candidates import best_first, candidates
from explorer.find.certificate import Certificate, certify, lengths_over
from explorer.find.check import is_kept
from explorer.find.demands import every_demand
from explorer.find.find import (
    BLOCK_UNITS,
    CELLS,
    PATIENCE,
    UNITS_PER_SECOND,
    Search,
    find_designs,
)
from explorer.find.improvement import GROWING, RELAXED
from explorer.find.requirement import Requirement
from explorer.find.terms import Terms
from explorer.mechanism.design import Design
from explorer.numerics import checks
from explorer.numerics.arrays import FloatArray
from explorer.optimise.search.sqp import Stop

# Factor on a demand at which a machine is certified, and factors with room for a new search.
CLOSE, ROOMS = 1.005, (1.03, 1.1, 1.3)
# Candidates of each block that are improved, and machines of which the first one is the best.
STARTS, ENOUGH = 3, 3
# Seconds of a new search for what is told.
SECONDS_AGAIN = 5.0
# Factors on the tilt and the box from which they grow.
SMALL = {"tilt_deg": 0.3, "box_mm": 0.5}
# Largest half-angle of a joint's cone, in degrees.
MOST_SWING = 80.0


def nearest_values(
    requirement: Requirement,
    *,
    seconds: float = 30.0,
    seed: int = 0,
    stop: Callable[[], bool] | None = None,
) -> Iterator[Relaxation]:
    """Yield the nearest values of the demands of a requirement, each as soon as it is found.

    Args:
        requirement: A requirement that no machine keeps, or for which none was found.
        seconds: Time of the search on a usual core.
        seed: Seed of the random machines.
        stop: Called some hundred times a second; True ends the search.

    Raises:
        InputError: A number is out of range.
    """
    checks.whole("seed", seed, 0, 2**31 - 1)
    left = UNITS_PER_SECOND * checks.positive("seconds", seconds)
    known = list[FloatArray]()
    fields = [
        field
        for field in relaxable_fields(requirement)
        if not impossible_demands(_leave_out(requirement, field))
    ]
    ends, terms = time.perf_counter() + PATIENCE * seconds, Terms.of(requirement)
    for index, field in enumerate(fields):
        share = left / (len(fields) - index)
        search = _Nearest(terms, (), share, ends, stop or (lambda: False), seed, field=field)
        told = search.nearest(known)
        left -= search.done
        if told is not None:
            yield told
        if search.is_cancelled:
            return


def find_or_relax(
    requirement: Requirement,
    *,
    watch: Callable[[FoundDesigns], None],
    stop: Callable[[], bool],
    count: int = 4,
    seconds: float = 10.0,
    seed: int = 0,
    design: Design | None = None,
) -> FoundDesigns:
    """Search for designs as `find_designs` does, and for nearest values if there are none.

    The latter takes three times as long. The refusal is watched at once, and then every nearest
    value as soon as it is found.
    """
    found = find_designs(
        requirement, count=count, seconds=seconds, seed=seed, design=design, watch=watch, stop=stop
    )
    if found.status in ("impossible", "none"):
        watch(found)
        for each in nearest_values(requirement, seconds=3.0 * seconds, seed=seed, stop=stop):
            found = replace(found, nearest=(*found.nearest, each))
            watch(found)
    return found


@dataclass
class _Nearest(Search):
    """The search for the nearest value of one field, with the factor of the last machine on it."""

    field: str = ""
    factor: float = 1.0

    def nearest(self, known: list[FloatArray]) -> Relaxation | None:
        """Return the nearest value, and add its machine to the known ones; None if there is none.

        The known machines keep all demands but one, and are tried first.
        """
        found: list[tuple[float, FloatArray]] = []
        with contextlib.suppress(Stop):
            for x in self._openings(known):
                machine = self.improve(x, self.field)
                found += [] if machine is None else [(self.factor, machine.x)]
                if len(found) == (1 if known else ENOUGH):
                    break
        if not found:
            return None
        factor, x = min(found, key=lambda each: each[0])
        known.append(x)
        return self._relaxation(factor)

    def _relaxation(self, factor: float) -> Relaxation | None:
        """Return a value with as little room as a new search needs; None if it finds nothing."""
        for room in ROOMS:
            asked = relax(self.terms.requirement, self.field, factor * room)
            if asked is None:
                return None
            if impossible_demands(asked):
                continue
            units, kinds, seed = UNITS_PER_SECOND * SECONDS_AGAIN, (asked.prefer,), self.seed + 1
            new = Search(Terms.of(asked), kinds, units, self.ends, self.stop, seed, math.inf)
            new.run(None, lambda: None)
            new.finish()
            self.done += new.done
            self.is_cancelled |= new.is_cancelled
            if new.best:
                return _in_words(asked, self.terms.requirement, self.field)
        return None

    def _openings(self, known: list[FloatArray]) -> Iterator[FloatArray]:
        """Yield machines that may miss the demand by far, without an end."""
        size = SMALL.get(self.field, 1.0)

        def reset(x: FloatArray) -> FloatArray:
            x = x.copy()
            x[m.TILT], x[m.SIZE] = 1.0, 1.0
            if self.field in GROWING:
                x[GROWING[self.field]] = size
            return x

        yield from map(reset, known[::-1])
        easy = _leave_out(self.terms.requirement, self.field)
        for x, missed, large in candidates(Terms.of(easy), self.seed):
            self.spend(BLOCK_UNITS)
            order = best_first(missed, large)[:STARTS]
            for row in x[order]:
                yield reset(_scale(row, size) if self.field == "box_mm" else row)

    def certify(self, x: FloatArray, poses: FloatArray) -> tuple[Certificate, bool]:
        """Return the certificate of a machine against the value that it asks for with some room.

        Whether it keeps all demands comes second.
        """
        self.factor = self._factor(x, poses)
        asked = relax(self.terms.requirement, self.field, max(1.0, self.factor) * CLOSE)
        scales = np.array([1.0, 1.0, 1.0, 1.0, x[m.TILT]])
        moved = _scale(x, 1.0 / x[m.SIZE])
        moved[m.TILT] = moved[m.SIZE] = 1.0
        own = self.terms if asked is None else Terms.of(asked)
        found = certify(moved, own, cells=CELLS, poses=poses * scales, is_quick=True)
        return replace(found, poses=found.poses / scales), is_kept(moved, own, found)

    def _factor(self, x: FloatArray, poses: FloatArray) -> float:
        """Return the factor on the demand that a machine asks for in poses."""
        terms, field = self.terms, self.field
        if field in GROWING:
            return float(1.0 / x[GROWING[field]])
        own = _value(terms.requirement, field)
        if field in ("legs.ratio", "legs.longest_mm"):
            shortest, longest = lengths_over(x, terms, poses).T
            used = longest / shortest if field == "legs.ratio" else terms.scale_mm * longest
            return float(used.max() / own)
        demand = next(each for each in every_demand(terms) if each.name == RELAXED[field])
        at = terms.values(x, poses)
        if demand.tell:
            return float(np.max(demand.tell(at)) / own)
        value = float(demand.told(demand.missed_rows(at).max()))
        return (own / value if value > 0.0 else math.inf) if demand.is_least else value / own


def _scale(x: FloatArray, factor: float) -> FloatArray:
    """Return a machine with its lengths times a factor."""
    x = x.copy()
    x[: m.BOX_YAW] *= factor
    x[m.TX : m.TILT] *= factor
    return x


def _leave_out(requirement: Requirement, field: str) -> Requirement:
    """Return a requirement without one demand, or with a small tilt or box."""
    if field in SMALL:
        return relax(requirement, field, 1.0 / SMALL[field]) or requirement
    return _with(requirement, field, 0.0 if field == "legs.apart_mm" else None)


def _value(requirement: Requirement, field: str) -> Any:
    return attrgetter(field)(requirement)


def _with(requirement: Requirement, field: str, value: Any) -> Requirement:
    """Return a requirement with another value of a field; the limits of pull follow those of push.

    Raises:
        ExplorerError: The value is not allowed.
    """
    _, _, of_legs = field.partition(".")
    if not of_legs:
        return msgspec.structs.replace(requirement, **{field: value})
    changed = {of_legs: value}
    pull = requirement.legs.pull_n
    if field == "legs.push_n" and pull is not None:
        changed["pull_n"] = value and pull * value / _value(requirement, field)
    legs = msgspec.structs.replace(requirement.legs, **changed)
    return msgspec.structs.replace(requirement, legs=legs)


def relaxable_fields(requirement: Requirement) -> list[str]:
    """Return the demands that may be relaxed, those first that a user gives up most readily."""
    terms = Terms.of(requirement)
    names = {each.name for each in every_demand(terms)}
    fields = (field for field in _WORDS if field not in RELAXED or RELAXED[field] in names)
    return [field for field in fields if _value(requirement, field)]


def relax(requirement: Requirement, field: str, factor: float) -> Requirement | None:
    """Return a requirement with one demand relaxed by a factor above 1; None if it cannot be.

    Values are those that a user would type, of three digits.
    """
    own = _value(requirement, field)
    if not math.isfinite(factor):
        return None
    if field == "box_mm":
        value = tuple(_three_digits(edge / factor, up=False) for edge in own)
    else:
        shrinks = field in ("tilt_deg", "legs.apart_mm", "transmission")
        value = _three_digits(own / factor if shrinks else own * factor, up=not shrinks)
        if field == "swing_deg" and value > MOST_SWING:
            return None
    try:
        return _with(requirement, field, value)
    except ExplorerError:
        return None


def _three_digits(value: float, *, up: bool) -> float:
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    whole = math.ceil(value / step - 1e-9) if up else math.floor(value / step + 1e-9)
    return float(f"{whole * step:.6g}")


_WORDS = {
    "legs.longest_mm": ("longest leg", "mm"),
    "tilt_deg": ("tilt", "°"),
    "box_mm": ("box", "mm"),
    "legs.ratio": ("ratio of the legs", ""),
    "swing_deg": ("swing", "°"),
    "legs.push_n": ("push of the actuators", "N"),
    "legs.apart_mm": ("distance of the legs", "mm"),
    "legs.speed_mm_s": ("speed of the actuators", "mm/s"),
    "transmission": ("transmission index", ""),
    "error_mm": ("error", "mm"),
    "deflection_mm": ("deflection", "mm"),
}


def _in_words(found: Requirement, own: Requirement, field: str) -> Relaxation:
    if field == "box_mm":
        edges = " × ".join(f"{edge:g}" for edge in found.box_mm)
        factor = found.box_mm[0] / own.box_mm[0]
        return Relaxation(field, factor, "", f"box {edges} mm", found)
    (name, unit), value = _WORDS[field], _value(found, field)
    space = "" if unit in ("", "°") else " "
    return Relaxation(field, value, unit, f"{name} {value:g}{space}{unit}", found)
