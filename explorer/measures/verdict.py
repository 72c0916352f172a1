"""The verdict on a pose: singular, near a singularity, or clear, and by which incidence.

This is the one definition, for the page with its colours, the command line and the report. A pose
is singular if its flags have an incidence, to rounding. It is near a singularity if one of four
measures is below its warning value; all of these grow with the user's warning length:

- the margin |δ| of an incidence, below that length, at first a share of the reach (`WARN_SHARE`);
  one for all three, though δ2 is no distance but a distance times a sine;
- the distance of its nearest singular pose (`explorer.singularity.nearest`): the root-mean-square
  displacement of b1 to b4, a metric of Nawratil, below a third of that length (`DISTANCE_SHARE`),
  since the platform may turn as well as shift, so that its points move by less than the margin;
- the least turn that leads to it (`explorer.singularity.freedoms`), below 10° (`WARN_TURN`): a
  small platform is displaced little by a turn. It is no transmission angle: its sine is |δ1| or
  |δ3| over the distance of a1 and b4, whereas the share of its force with which leg 1 resists a
  turn about the line b2b3 is |δ1| / l1, and that of leg 4 about the guide |δ3| / l4;
- the inverse condition number of J, below 0.01 (`WARN_CONDITION` in `explorer.singularity.colours`,
  which the maps read too): the smallest change that makes J singular is this share of J (Eckart
  and Young). How much forces and errors grow is one over the smallest singular value instead
  (`Configuration.singular_values`). Margins and distances do not bound it: in a nearly degenerate
  design, or far from the base, it is low in every pose. It counts for the incidence with the least
  scaled margin (`explorer.mechanism.kinematics.jacobian_factors`).
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from explorer.measures.snapshot import Snapshot
from explorer.mechanism.margins import INCIDENCES
from explorer.numerics.number_text import Unit, format_number
from explorer.singularity.colours import WARN_SHARE, warning_condition
from explorer.singularity.strata import incidences

# Warning length of distances, as a share of that of margins.
DISTANCE_SHARE = 1.0 / 3.0
# Warning angle in radians at a warning length of `WARN_SHARE`.
WARN_TURN = math.radians(10.0)

Kind = Literal["singular", "near", "clear"]
Cause = Literal["distance", "turn", "condition"]
TITLES: dict[Kind, str] = {
    "singular": "Singular",
    "near": "Near a singularity",
    "clear": "Clear of singularities",
}
MEANINGS: dict[Kind, str] = {
    "singular": "The platform can still move though all actuators are locked, and no forces of "
    "the actuators hold every load.",
    "near": "A small motion makes the platform singular: forces and errors are large here.",
    "clear": "The actuators hold the platform, and no singular pose is near.",
}
"""What each verdict means, in a sentence."""


class Warnings(NamedTuple):
    """The values below which a pose counts as near a singularity.

    They are lengths of a margin and of the distance to a singular pose, in design units, the angle
    of the least turn to an incidence, in radians, and the inverse condition number of J.
    """

    margin: float
    distance: float
    turn: float
    condition: float


class Verdict(NamedTuple):
    """The nearness of a pose to a singularity.

    Attributes:
        kind: Whether the pose is singular, near a singularity, or clear of all.
        levels: Level of each incidence: the least of its measures, each over its warning value;
            0 is singular, below 1 is near.
        incidences: Numbers 1 to 3 of the incidences that hold in a singular pose; of those
            that are near, first the nearest of those with the cause; in a clear pose, of the
            nearest one.
        distance: Root-mean-square displacement of b1 to b4 to the nearest pose with the first
            of these incidences, in design units; 0 in a singular pose.
        turn: Least turn to the first of these incidences, in radians.
        condition: The inverse condition number of J, 0 to 1.
        cause: The measure that the reason quotes: in a near pose the first one below its warning
            value, for the incidence of the lowest level; otherwise the distance. It stands for a
            margin too.
    """

    kind: Kind
    levels: tuple[float, float, float]
    incidences: tuple[int, ...]
    distance: float
    turn: float
    condition: float
    cause: Cause = "distance"

    @property
    def title(self) -> str:
        """The verdict in words, such as "Near a singularity"."""
        return TITLES[self.kind]

    def reason(self, unit: Unit) -> str:
        """Return the reason, such as "2.5 mm of motion to the nearest singular pose, …"."""
        if self.kind == "singular":
            return "; ".join(f"δ{index} = 0: {INCIDENCES[index - 1]}" for index in self.incidences)
        first, away = self.incidences[0], self._away(unit)
        if self.cause == "condition":
            return (
                f"1/cond J is {format_number(self.condition, 2)}, most by δ{first}; δ{first} = 0 "
                f"is {away} away"
            )
        return f"{away} to the nearest singular pose, {INCIDENCES[first - 1]} (δ{first} = 0)"

    def brief(self, unit: Unit) -> str:
        """Return the verdict in a few words, such as "10.3 mm of motion", "7° of turning"."""
        names = " and ".join(f"δ{index} = 0" for index in self.incidences)
        if self.kind == "singular":
            return f"Singular: {names}"
        if self.cause == "condition":
            return f"1/cond J {format_number(self.condition, 2)}"
        return self._away(unit)

    def _away(self, unit: Unit) -> str:
        """Return how far the nearest singular pose is, by the turn where that is the reason."""
        if self.cause == "turn":
            return f"{format_number(math.degrees(self.turn), 2)}° of turning"
        return f"{unit.text(self.distance, 3)} of motion"


def warnings(reach: float, warn_below: float | None = None) -> Warnings:
    """Return the warning values for a reach and a warning length of margins, in design units.

    Without the latter it is a share of the reach.
    """
    default = WARN_SHARE * reach
    margin = default if warn_below is None else warn_below
    condition = warning_condition(reach, margin)
    return Warnings(margin, DISTANCE_SHARE * margin, margin / default * WARN_TURN, condition)


def verdict(snapshot: Snapshot, warn_below: float | None = None) -> Verdict:
    """Return the verdict on a pose, by a warning length of margins in design units.

    If that is None, it is a share of the reach.
    """
    warn = warnings(snapshot.design.reach, warn_below)
    holding, condition = incidences(snapshot.stratum), float(snapshot.inverse_condition)
    distances, turns = snapshot.nearest_distances, snapshot.least_turns
    worst_conditioned = snapshot.worst_conditioned

    def measures(incidence: int) -> dict[Cause, float]:
        index = incidence - 1
        size = abs(float(snapshot.margins[index]))
        levels: dict[Cause, float] = {
            "distance": min(size / warn.margin, distances[index] / warn.distance),
            "turn": turns[index] / warn.turn,
        }
        if incidence == worst_conditioned:
            levels["condition"] = condition / warn.condition
        return levels

    each = {incidence: measures(incidence) for incidence in (1, 2, 3)}
    level_1, level_2, level_3 = (
        0.0 if incidence in holding else min(each[incidence].values()) for incidence in (1, 2, 3)
    )
    levels = level_1, level_2, level_3
    if holding:
        return Verdict("singular", levels, holding, 0.0, 0.0, condition)
    named = sorted(each, key=lambda incidence: distances[incidence - 1])
    near = [incidence for incidence in named if levels[incidence - 1] < 1.0]
    kind, cause = "clear", "distance"
    if near:
        kind, cause = "near", _cause(each[min(near, key=lambda number: levels[number - 1])])
        # The nearest of those with the cause first; sorting keeps the order of the others.
        near.sort(key=lambda incidence: _cause(each[incidence]) != cause)
    named = tuple(near or named[:1])
    index = named[0] - 1
    return Verdict(kind, levels, named, distances[index], turns[index], condition, cause)


def _cause(levels: dict[Cause, float]) -> Cause:
    """Return the first measure that is below its warning value."""
    return next(cause for cause, level in levels.items() if level < 1.0)
