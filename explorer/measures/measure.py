"""The type of a measure of a design: its words, unit, sense, cost, function and gradient."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, get_args

from explorer.measures.case import Case

Place = Literal["compare", "optimise", "studies", "workspace", "report"]
"""Where a measure is listed: Compare, the optimiser's tables, a study's measures, the command
`explorer workspace`, or the report."""

Sense = Literal["more", "less"]
Unit = Literal["", "°", "share", "N m", "kg", "mm/N"]
Cost = Literal["low", "high"]
Need = Literal[
    "box",
    "demanded_margin",
    "is_loaded",
    "is_limited",
    "limits_actuators",
    "has_errors",
    "is_elastic",
]

NEED_WORDS: Mapping[Need, str] = MappingProxyType(
    {
        "box": "required box",
        "demanded_margin": "demanded clearance",
        "is_loaded": "payload or force at the tool",
        "is_limited": "limit of actuators, struts or guide",
        "limits_actuators": "limit of the actuators",
        "has_errors": "errors of the actuators",
        "is_elastic": "stiffness of actuators or struts",
    }
)
"""Words for what measures need, without an article."""

COMPARE: frozenset[Place] = frozenset({"compare"})
OPTIMISE: frozenset[Place] = frozenset({"optimise"})
STUDIES: frozenset[Place] = frozenset({"studies"})
WORKSPACE: frozenset[Place] = frozenset({"workspace"})
REPORT: frozenset[Place] = frozenset({"report"})
EVERYWHERE: frozenset[Place] = frozenset(get_args(Place))
POWERS = {1: "", 2: "²", 3: "³"}


@dataclass(frozen=True)
class Measure:
    """A measure of a design.

    Attributes:
        name: Key of the measure: its column in a study, its name in Python and in JSON.
        label: Name of the measure on the page and in the tables of the command line.
        hint: Meaning, one sentence.
        function: Value of a case; NaN where there is none.
        title: Name among several volumes of the workspace; the label if empty.
        power: Exponent of length in the unit; 3 for a volume.
        unit: Unit of a measure without length; a share is from 0 to 1.
        sense: Whether more or less of it is better; None if neither is.
        cost: "high" if it takes far longer than the exact volume.
        is_whole: Whether it is a count.
        names: Names of the whole numbers from 1, if it is one of several things.
        gradient: Partial derivatives by the name of the parameter, as in
            `explorer.workspace.slices.volume.Volume`; None if there is no closed form.
        needs: Attributes of the case that the measure needs, see `Case.has`.
        reason: Why a workspace that is not empty lacks the value; "" if nothing is known.
        places: Where it is listed.
    """

    name: str
    label: str
    hint: str
    function: Callable[[Case], float]
    title: str = ""
    power: int = 0
    unit: Unit = ""
    sense: Sense | None = None
    cost: Cost = "low"
    is_whole: bool = False
    names: tuple[str, ...] = ()
    gradient: Callable[[Case], Mapping[str, float]] | None = None
    needs: tuple[Need, ...] = ()
    reason: Callable[[Case], str] = lambda _: ""
    places: frozenset[Place] = EVERYWHERE

    @property
    def heading(self) -> str:
        """The title, or the label of a measure that has none."""
        return self.title or self.label

    def unit_in(self, length: str) -> str:
        """Return the unit, "" for a plain number or a share.

        Args:
            length: Unit of lengths, such as "mm".
        """
        if self.power:
            return f"{length}{POWERS[self.power]}"
        return "" if self.unit == "share" else self.unit
