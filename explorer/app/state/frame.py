"""A state and what follows from it, computed when it is first asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from explorer.app.state.moves import folds_of
from explorer.app.state.state import Folds, State
from explorer.errors import InputError
from explorer.legs.moves import MoveClearance, move_clearance
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.measures.verdict import Verdict, verdict
from explorer.singularity import ellipsoids


@dataclass(frozen=True)
class Frame:
    """A state and what follows from it: all that scene and panels need to draw."""

    state: State

    @cached_property
    def snapshot(self) -> Snapshot:
        """The design in its pose."""
        return evaluate(self.state.design, self.state.pose)

    @cached_property
    def folds(self) -> Folds:
        """The folds of the pose: r in design units and β, ε, φ1, φ2, φ3 in degrees."""
        return folds_of(self.state)

    @cached_property
    def verdict(self) -> Verdict:
        """How near the pose is to a singularity; the colours of the flags follow it."""
        return verdict(self.snapshot, self.state.warn_below)

    @cached_property
    def performance(self) -> ellipsoids.Performance:
        """How fast and how strong the platform is in its pose, at the point that is shown."""
        return ellipsoids.performance(self.state.design, self.state.pose, self.state.tool)

    @cached_property
    def free_ball(self) -> ellipsoids.SingularityFreeBall:
        """The largest ball of positions about the pose without a singular one."""
        return ellipsoids.singularity_free_ball(self.state.pose)

    @cached_property
    def last_move(self) -> MoveClearance | None:
        """The straight move from the start of the last gesture to here; None if there is none."""
        gesture = self.state.gesture
        if gesture is None:
            return None
        try:
            return move_clearance(
                self.state.design, gesture.start, self.state.pose, tool=self.state.tool
            )
        except InputError:
            # The gesture ended where it began: only a move without length is refused.
            return None
