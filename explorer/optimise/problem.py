"""Problems of optimal design: variables, objective, and demands besides the limits of the design.

A problem is a plain value that can be sent to another process or written into a file. It starts
from a design, whose own limits (the box among them) bound its workspace as always.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Literal, get_args

import msgspec
from msgspec.structs import force_setattr as _set

from explorer.errors import InputError
from explorer.measures.measure import longest_leg
from explorer.mechanism.design import DEGENERATE_RATIO, LENGTHS, VARIABLES, Design
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics import checks
from explorer.numerics.number_text import format_apart
from explorer.workspace.limits.table import bounds_angles

ObjectiveName = Literal["match-volume", "smallest-reach", "largest-volume"]

OBJECTIVES: tuple[ObjectiveName, ...] = get_args(ObjectiveName)
"""Objectives: to match the demanded volume (the paper's F = |1 − V/V′|), the shortest longest leg
for it, and the largest volume."""

YAW = "yaw"
REACH = "reach"
OPTIONAL = (YAW, REACH)
"""Variables besides the six of a design: the yaw of home in degrees, and one maximum for all four
lengths."""

SWING_LIMIT, MAXIMA = "swing", "maximum lengths"
"""The limits that keep a search from a start: bounds of the swing, or fixed maxima."""

# Least value of the reach as a variable, as a share of the start's.
LEAST_REACH = 1e-3


class DesignStartError(InputError):
    """A design from which a problem cannot start, for a limit such as `SWING_LIMIT`."""

    def __init__(self, message: str, limit: str) -> None:
        super().__init__(message)
        self.limit = limit


Box = tuple[Triple, Triple]


class Demands(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Demands besides the design's own limits; None is no demand.

    Attributes:
        volume: Exact volume of the workspace to match, or the least one, in cubed design units.
        reach: Longest leg allowed, in design units.
        clearance: Smallest clearance of each pair of legs, radii taken off, wherever in the
            workspace every margin is at least `clearance_margin`. Nearer to a singularity
            legs may have to meet: with a level platform all four lie in the base at δ3 = 0.
        clearance_margin: Least margin at which clearance is demanded, in design units.
        least: Smallest |a3y|, |b1y| and |b3 − b2|, at zero of which a design is degenerate.
    """

    volume: float | None = None
    reach: float | None = None
    clearance: float | None = None
    clearance_margin: float = 0.0
    least: float = 0.0

    def __post_init__(self) -> None:
        for field in ("volume", "reach", "clearance"):
            value = getattr(self, field)
            if value is not None:
                most = math.inf if field == "volume" else checks.MOST
                _set(self, field, checks.positive(f"the {field} demanded", value, most))
        for field in ("clearance_margin", "least"):
            value = checks.not_negative(f"the {field.replace('_', ' ')}", getattr(self, field))
            _set(self, field, value)


class Variable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One of `VARIABLES` or `OPTIONAL`, and its bounds in design units; of the yaw in degrees."""

    name: str
    low: float
    high: float

    def __post_init__(self) -> None:
        _set(self, "name", str(self.name))
        for field in ("low", "high"):
            value = checks.number(f"the {field} bound of {self.name}", getattr(self, field))
            _set(self, field, value)


class Problem(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A problem of optimal design.

    It starts from a design; what is no variable, the home pose too, stays the same in all designs.

    Raises:
        DesignStartError: A start that its limits keep from a search.
        InputError: Bounds that cross or leave the start out, numbers that are not finite or
            out of range, or an objective that lacks its volume.
    """

    start: Design
    objective: ObjectiveName
    variables: tuple[Variable, ...]
    demands: Demands = Demands()

    def __post_init__(self) -> None:
        if self.start.home is None:
            _set(self, "start", msgspec.structs.replace(self.start, home=self.start.home_pose))
        _set(self, "objective", checks.one_of("the objective", self.objective, OBJECTIVES))
        _set(self, "variables", tuple(self.variables))
        if bounds_angles(self.start):
            raise DesignStartError(
                "the volume has no gradient while joints bound the swing of legs: take these "
                "bounds out of the design to optimise it",
                SWING_LIMIT,
            )
        _check_variables(self)
        _check_demands(self)
        _check_objective(self)

    @property
    def size(self) -> float:
        """The largest variable of the start, by which lengths are scaled, in design units."""
        return max(map(abs, self.start.variables))

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the variables."""
        return tuple(variable.name for variable in self.variables)

    @property
    def start_values(self) -> tuple[float, ...]:
        """The values of the variables at the start."""
        return tuple(start_value(self.start, variable.name) for variable in self.variables)

    def design_at(self, values: Iterable[float]) -> Design:
        """Return the design with these values of the variables.

        Raises:
            DesignError: The values make a degenerate design.
        """
        return with_values(self.start, dict(zip(self.names, values, strict=True)))


def with_values(design: Design, values: Mapping[str, float]) -> Design:
    """Return a design with other values of `VARIABLES`, `YAW` and `REACH`; others change nothing.

    Raises:
        DesignError: The values make a degenerate design.
    """
    own = zip(VARIABLES, design.variables, strict=True)
    changed = design.with_variables([values.get(name, value) for name, value in own])
    if YAW in values:
        home = design.home_pose
        _, pitch, roll = home.yaw_pitch_roll
        home = Pose.of_yaw_pitch_roll(home.position, (values[YAW], pitch, roll))
        changed = msgspec.structs.replace(changed, home=home)
    if REACH in values:
        ranges = {name: (getattr(changed.limits, name)[0], values[REACH]) for name in LENGTHS}
        changed = changed.with_limits(**ranges)
    return changed


def with_box(design: Design, box: Box | None) -> Design:
    """Return a design with another box, or none; its home stays where it was."""
    return msgspec.structs.replace(design.with_limits(box=box), home=design.home_pose)


def distances_of(design: Design) -> dict[str, float]:
    """Return the signed distances at zero of which a design is degenerate, in design units."""
    return {"a3y": design.a3[1], "b1y": design.b1[1], "b3 − b2": design.b3 - design.b2}


def start_value(start: Design, name: str) -> float:
    """Return the value of a variable in a design; an InputError if there is none of the name."""
    if name in VARIABLES:
        return start.variables[VARIABLES.index(name)]
    if name == YAW:
        return start.home_pose.yaw_pitch_roll[0]
    if name == REACH:
        return longest_leg(start)
    raise InputError(f"no variable {name!r}; there are {', '.join((*VARIABLES, *OPTIONAL))}")


def longest_minimum(design: Design) -> float:
    """Return the largest of the four minimum lengths."""
    return max(design.length_range(name)[0] for name in LENGTHS)


def _check_variables(problem: Problem) -> None:
    names, start = problem.names, problem.start
    if not names:
        raise InputError("nothing may change: name at least one variable")
    if len(set(names)) < len(names):
        raise InputError(f"each variable may be named once; got {', '.join(names)}")
    for variable, value in zip(problem.variables, problem.start_values, strict=True):
        unit = "°" if variable.name == YAW else ""
        if not variable.low <= value <= variable.high:
            low, high, own = format_apart((variable.low, variable.high, value))
            if variable.low > variable.high:
                raise InputError(
                    f"the bounds of {variable.name} cross: low {low}{unit}, high {high}{unit}"
                )
            raise InputError(
                f"the start has {variable.name} = {own}{unit}, outside its bounds {low}{unit} to "
                f"{high}{unit}: widen them or start elsewhere"
            )
        least_reach = max(LEAST_REACH * value, longest_minimum(start))
        if variable.name == REACH and not variable.low >= least_reach:
            least, low = format_apart((least_reach, variable.low))
            raise InputError(
                "the reach must stay above every minimum length, so its low bound above "
                f"{least}; got {low}"
            )


def _check_demands(problem: Problem) -> None:
    demands = problem.demands
    if demands.clearance is not None and not demands.clearance_margin > 0.0:
        raise InputError(
            "clearance can be demanded only off the singular planes, where legs may have to "
            "meet: give a positive clearance margin"
        )
    for name, distance in distances_of(problem.start).items():
        # A start made of rounded numbers may lie on the bound.
        if abs(distance) < demands.least * (1.0 - DEGENERATE_RATIO):
            own, least = format_apart((abs(distance), demands.least))
            raise InputError(
                f"the start has |{name}| = {own}, below the least allowed {least}: start elsewhere "
                "or lower it"
            )


def _check_objective(problem: Problem) -> None:
    objective, names, demands = problem.objective, problem.names, problem.demands
    if objective in ("match-volume", "smallest-reach") and demands.volume is None:
        raise InputError(f"{objective} needs a volume")
    is_tied = all(getattr(problem.start.limits, name)[1] is None for name in LENGTHS)
    if objective == "smallest-reach" and not (REACH in names or is_tied):
        raise DesignStartError(
            "the design fixes maximum lengths: tie them to the reach |a3|, or let the reach change "
            "as a variable of its own",
            MAXIMA,
        )
