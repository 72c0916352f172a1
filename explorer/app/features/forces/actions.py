"""The action that sets the force at the tool."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from explorer.app.scene.placing import round_step
from explorer.app.state.action import Action
from explorer.app.state.state import State
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number

# Share of the reach below which and above which the arrow of a typed force has another scale.
SHORTEST, LONGEST = 0.1, 1.0
# Force in newtons below which the scale stays.
LEAST_FORCE = 1e-40
# Length of the arrow at the new scale, as a share of the reach.
FITTING = 0.45


@dataclass(frozen=True)
class SetForce(Action):
    """Set the force at the tool, along the axes of the base, in newtons.

    Attributes:
        force: The force.
        keeps_scale: Whether its arrow keeps its scale, as while it is dragged.
        title: Words of the step in the history; the force if empty.
    """

    force: Triple
    keeps_scale: bool = False
    title: str = ""

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: a force that is not finite.
        """
        forces = replace(state.view.forces, force=self.force)
        if not self.keeps_scale:
            forces = replace(forces, scale=fitting_scale(math.hypot(*self.force), forces.scale))
        return replace(state, view=replace(state.view, forces=forces))

    def words(self) -> str:
        """Return what the action does."""
        if self.title:
            return self.title
        numbers = ", ".join(format_number(value, 3) for value in self.force)
        return f"Force {numbers} N"


def rounded(force: FloatArray, size: float) -> Triple:
    """Return a force with the decimals that a thousandth of a size has.

    Args:
        force: The force, shape (3,), in newtons.
        size: The size, in newtons.
    """
    x, y, z = np.round(force, decimals_of(size)).tolist()
    return x, y, z


def decimals_of(size: float) -> int:
    """Return the decimals of a thousandth of a size."""
    return 3 - math.floor(math.log10(size))


def fitting_scale(force: float, scale: float) -> float:
    """Return the force whose arrow is as long as the reach, with which a force can be seen.

    Args:
        force: Size of the force, in newtons.
        scale: The present one, which stays while the arrow is neither short nor long.
    """
    if force < LEAST_FORCE or SHORTEST <= force / scale <= LONGEST:
        return scale
    return round_step(force / FITTING)
