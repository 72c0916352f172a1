"""The one catalogue of the measures of a design, and their values for one design.

Compare, the optimiser, studies, the report and the command line read it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from explorer.measures.loads import loads
from explorer.measures.measure import NEEDS, Case, Measure, Place
from explorer.measures.workspace import workspace_measures
from explorer.mechanism.design import VARIABLES, Design
from explorer.numerics.computed_once import computed_once


def coordinates() -> Iterable[Measure]:
    """Yield the yaw of home and the design variables."""
    yield Measure(
        "yaw",
        "yaw of home",
        "Yaw of the orientation that the home pose has",
        lambda case: case.design.home_pose.yaw_pitch_roll[0],
        unit="°",
        places=("compare", "optimise"),
    )
    for index, name in enumerate(VARIABLES):
        yield Measure(
            name,
            name,
            f"Design variable, in the frame of the {'base' if index < 2 else 'platform'}",
            lambda case, index=index: case.design.variables[index],
            power=1,
            places=("compare",),
        )


CATALOGUE: Mapping[str, Measure] = {
    measure.name: measure
    for group in (workspace_measures(), loads(), coordinates())
    for measure in group
}
"""All measures by name, in the order in which every list has them."""


def measures_in(place: Place) -> dict[str, Measure]:
    """Return the measures that a place lists, by name in their order."""
    return {name: measure for name, measure in CATALOGUE.items() if place in measure.places}


@dataclass(frozen=True, kw_only=True)
class MeasureValues:
    """The values of measures for one design, in design units, or for a table, in millimetres.

    Attributes:
        values: By name out of `CATALOGUE`; None where there is none, as of an empty workspace.
        empty_because: The limits that empty the workspace; () if it is not empty.
        infinite: Measures whose value is infinite, as that of forces in a singular pose.
    """

    values: Mapping[str, float | None]
    empty_because: tuple[str, ...]
    infinite: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> float | None:
        """Return the value of a measure; None if there is none, or if it was not measured."""
        return self.values.get(name)

    def value(self, name: str) -> float | None:
        """Return the value of a measure, which may be infinite; None if there is none."""
        return math.inf if name in self.infinite else self.values.get(name)


@dataclass(frozen=True, kw_only=True)
class Measurements(MeasureValues):
    """The values of measures for one design.

    Attributes:
        design: The manipulator.
        nearest: The two legs that have the least clearance; None if it was not measured.
        demanded_margin: Least |δ| at which the demanded clearance counts; None without demand.
        demanded_nearest: The two legs that have the least demanded clearance, or None.
    """

    design: Design
    nearest: tuple[int, int] | None = None
    demanded_margin: float | None = None
    demanded_nearest: tuple[int, int] | None = None


def measure_design(case: Case, names: Iterable[str]) -> Measurements:
    """Return the values of measures out of `CATALOGUE` for a design.

    Measures are left out whose needs the case does not have.

    Raises:
        ExplorerError: A mesh that is needed cannot be made.
    """
    return _measure(case, tuple(names))


@computed_once
def _measure(case: Case, names: tuple[str, ...]) -> Measurements:
    values, infinite = values_of(case, names)
    return Measurements(
        design=case.design,
        values=values,
        empty_because=case.volume.empty_because,
        nearest=case.clearance[1] if "least_clearance" in values else None,
        demanded_margin=case.demanded_margin,
        demanded_nearest=case.demanded_clearance[1] if "demanded_clearance" in values else None,
        infinite=infinite,
    )


def values_of(case: Case, names: Iterable[str]) -> tuple[dict[str, float | None], tuple[str, ...]]:
    """Return the values of measures by name, None where there is none, and the infinite ones."""
    measures = [CATALOGUE[name] for name in names]
    values = {
        each.name: each.function(case)
        for each in measures
        if all(case.has(need) for need in each.needs)
    }
    infinite = tuple(name for name, value in values.items() if math.isinf(value))
    return {k: v if math.isfinite(v) else None for k, v in values.items()}, infinite


def reason_for_missing(case: Case, measurements: Measurements) -> str:
    """Return why a design lacks values, "" if it has all or an empty workspace says enough."""
    if case.volume.volume <= 0.0:
        return ""
    lacking = [name for name, value in measurements.values.items() if value is None]
    return "; ".join(filter(None, dict.fromkeys(CATALOGUE[name].reason(case) for name in lacking)))


def unmet_needs(cases: Collection[Case], names: Iterable[str]) -> str:
    """Return which needs of measures none of some cases meets, "" if each need is met by one."""
    labels: dict[str, list[str]] = {}
    for name in names:
        for need in CATALOGUE[name].needs:
            if not any(case.has(need) for case in cases):
                labels.setdefault(need, []).append(CATALOGUE[name].label)
    return "; ".join(
        f"no {NEEDS[need][0]}, which is needed for {', '.join(needing)}"
        for need, needing in labels.items()
    )
