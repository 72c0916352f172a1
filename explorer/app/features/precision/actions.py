"""The actions that give a design errors, stiffness and tolerances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from explorer.app.state.action import Action
from explorer.app.state.actions import check_free
from explorer.app.state.state import State
from explorer.app.state.values import with_value
from explorer.mechanism.typical import typical_machine
from explorer.statics.budget.costs import with_tolerances


@dataclass(frozen=True)
class AssumeTypical(Action):
    """Give the design typical errors, stiffness, struts and tolerances where it states none."""

    template: ClassVar[str] = "Typical errors, stiffness and tolerances"

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: the design is being optimised.
        """
        check_free(state)
        return with_value(state, "design", typical_machine(state.design)[0])


@dataclass(frozen=True)
class SetTolerances(Action):
    """Give the design the tolerances and the errors of its actuators that a budget found.

    Attributes:
        tolerances: Tolerances in mm and degrees, in the order of `SOURCES`; infinite for any,
            which the design keeps as it states them.
    """

    template: ClassVar[str] = "Tolerances of the budget"

    tolerances: tuple[float, ...]

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: the design is being optimised.
        """
        check_free(state)
        design = with_tolerances(state.design, np.array(self.tolerances))
        return with_value(state, "design", design)
