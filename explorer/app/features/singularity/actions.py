"""What can be done about singularities: go to one, and move one margin alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

from explorer.app.state.action import Action, changes
from explorer.app.state.actions import moved
from explorer.app.state.jog import jogged
from explorer.app.state.state import State
from explorer.app.state.view import SingularView
from explorer.errors import InputError
from explorer.mechanism.margins import INCIDENCES
from explorer.mechanism.pose import Pose
from explorer.numerics.number_text import format_ascii
from explorer.singularity.bruhat import Stratum, codimension, describe_stratum
from explorer.singularity.nearest import nearest_singularities
from explorer.singularity.nearest_stratum import nearest_in_stratum, seen_stratum
from explorer.singularity.uncoupled import UNCOUPLED


@dataclass(frozen=True)
class SetSingularView(Action):
    """Change how singularities are shown."""

    view: SingularView

    def apply(self, state: State) -> State:
        """Return the next state."""
        return replace(state, view=replace(state.view, singular=self.view))

    def describe(self, before: State, after: State) -> str:
        """Return what the step did."""
        return changes("View", before.view.singular, after.view.singular)


@dataclass(frozen=True)
class Jog(Action):
    """Take one of the six uncoupled motions to an amount from where it began.

    Attributes:
        motion: Its index in `UNCOUPLED`.
        amount: In design units of a translation, in degrees of a rotation.
    """

    motion: int
    amount: float

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: no such motion, or an amount that is not finite.
        """
        jog = jogged(self.motion, jog_start(state, self.motion), self.amount)
        return replace(moved(state, jog.pose), jog=jog)

    def words(self) -> str:
        """Return what the action does."""
        motion = UNCOUPLED[self.motion]
        unit = "°" if motion.kind == "rotation" else ""
        return f"δ{motion.incidence} alone, by {format_ascii(self.amount, 4)}{unit}"


def jog_start(state: State, motion: int) -> Pose:
    """Return where a motion begins: where it began if it is in use, else here."""
    jog = state.jog_in_use
    return jog.start if jog is not None and jog.motion == motion else state.pose


@dataclass(frozen=True)
class GoToStratum(Action):
    """Move to the nearest pose in a stratum of codimension one or more."""

    stratum: Stratum

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: no such stratum, the generic one, or one that is left only by an
                arbitrarily small way: the pose is in it, or between it and deeper ones.
        """
        asked = tuple(self.stratum)
        found = nearest_in_stratum(state.design, state.pose, asked)
        if codimension(asked) == 0:
            raise InputError(
                "generic poses are as near as one likes to any pose; choose a singular stratum, "
                "or move any margin off zero"
            )
        here = seen_stratum(state.design, state.pose)
        if here == asked:
            raise InputError(
                f"the pose lies in {name_of(asked)} already: {describe_stratum(asked)}"
            )
        if found.distance == 0.0:
            raise InputError(
                f"the pose lies in {name_of(here)}, which {name_of(asked)} borders on: its poses "
                "are as near as one likes, and none is the nearest; move a margin off zero"
            )
        return moved(state, found.pose)

    def words(self) -> str:
        """Return what the action does."""
        return f"Go to stratum {name_of(self.stratum)}"


@dataclass(frozen=True)
class GoToSingularity(Action):
    """Move to the nearest pose with one of the three incidences, 1 to 3; None: the nearest."""

    incidence: int | None

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: the pose has that incidence already.
        """
        found = nearest_singularities(state.design, state.pose)
        nearest = (
            min(found, key=lambda each: each.distance)
            if self.incidence is None
            else found[self.incidence - 1]
        )
        if nearest.distance == 0.0:
            index = nearest.incidence
            raise InputError(f"the pose has δ{index} = 0 already: {INCIDENCES[index - 1]}")
        return moved(state, nearest.pose)

    def words(self) -> str:
        """Return what the action does."""
        if self.incidence is None:
            return "Go to the nearest singular pose"
        return f"Go to the nearest pose with δ{self.incidence} = 0"


def name_of(stratum: Stratum) -> str:
    """Return how a stratum is written, such as "(3, 4, 2, 1)"."""
    return f"({', '.join(map(str, stratum))})"
