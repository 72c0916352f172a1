"""Answers to a requirement: the check of a design, and the designs that a search found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

from explorer.find.requirement import Requirement
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose


class DemandCheck(NamedTuple):
    """One demand of a requirement, checked for a design.

    Attributes:
        name: Name of the demand, such as "force".
        item: What has the worst value, such as "d1"; "" for the design as a whole.
        kept: Whether it is kept in every pose that was looked at.
        worst: Worst value that was found, in `unit`; infinite where a pose is singular.
        limit: Limit of that value.
        spare: What is left to the limit, in `unit`; negative where the demand is missed.
        unit: "mm", "°", "N", "s" or "" for a number.
        pose: The pose with the worst value; None where the demand is on the design as a whole.
        proven: Whether no pose of the box at any of the tilts misses it.
        remark: Clause on what was checked, such as "no violation in 20000 poses", or "".
    """

    name: str
    item: str
    kept: bool
    worst: float
    limit: float
    spare: float
    unit: str
    pose: Pose | None
    proven: bool
    remark: str = ""

    @property
    def words(self) -> str:
        """The name with what has the worst value."""
        return f"{self.name} ({self.item})" if self.item else self.name


@dataclass(frozen=True)
class RequirementCheck:
    """A design checked against a requirement.

    Attributes:
        demands: The demands in a fixed order.
        poses: Number of random poses for the demands that are not proven; 0 if all are.
    """

    demands: tuple[DemandCheck, ...]
    poses: int

    @property
    def kept(self) -> bool:
        """Whether all demands are kept."""
        return all(demand.kept for demand in self.demands)

    @property
    def proven(self) -> bool:
        """Whether all demands are proven."""
        return all(demand.proven for demand in self.demands)

    @property
    def missed(self) -> tuple[DemandCheck, ...]:
        """The demands that are missed."""
        return tuple(demand for demand in self.demands if not demand.kept)


@dataclass(frozen=True)
class FoundDesign:
    """A design that keeps a requirement.

    Attributes:
        design: The design, with the limits and the machine that the requirement asks for, home at
            the centre of the box, and the box as its `required_box`.
        check: Its check.
        kind: What it was searched for, one of `explorer.find.requirement.PREFERENCES`.
        longest_mm: Longest leg over the box and the tilts, in millimetres.
        utilisation: Largest utilisation of an actuator; 0 without a limit or a load.
        force_per_newton: Largest force of an actuator for a force of 1 N at the tool.
        clearance_mm: Least distance between the surfaces of two legs, in millimetres.
        transmission: Least transmission index.
        error_mm: Largest displacement of the tool by the actuators' errors, in millimetres.

    Forces, clearance, transmission and error are the worst over the poses that were looked at, to
    compare machines by; the check tells what is demanded of them.
    """

    design: Design
    check: RequirementCheck
    kind: str
    longest_mm: float
    utilisation: float
    force_per_newton: float
    clearance_mm: float
    transmission: float
    error_mm: float


class Relaxation(NamedTuple):
    """A demand with a value within reach: a new search kept it, with all other demands.

    Attributes:
        demand: Field of the requirement, such as "tilt_deg", "box_mm" or "legs.longest_mm".
        value: The value; for the box the factor on its edges.
        unit: Unit of the value, "" for the factor.
        words: The value in words, such as "tilt 12.8°" or "box 186 × 140 × 93 mm".
        requirement: The requirement with that value.
    """

    demand: str
    value: float
    unit: str
    words: str
    requirement: Requirement


@dataclass(frozen=True)
class FoundDesigns:
    """The answer of a search.

    Attributes:
        designs: The designs found, the preferred one first; none if none was found.
        bound_mm: Length below which no machine has its longest leg; 0 if nothing is known, and
            infinite if no machine keeps the requirement.
        impossible: Clauses on demands that no machine keeps, proven; () if there are none.
        binding: Names of the demands that bind the best design; () without one.
        nearest: The nearest values, as far as `nearest_values` was asked for them.
        status: "found", "none" (searched in vain), "impossible" or "cancelled".
    """

    designs: tuple[FoundDesign, ...]
    bound_mm: float
    impossible: tuple[str, ...] = ()
    binding: tuple[str, ...] = ()
    nearest: tuple[Relaxation, ...] = ()
    status: Literal["found", "none", "impossible", "cancelled"] = "found"
