"""The buttons of the optimiser by name: what they do, and when they can be pressed.

They stand in the markup of its tab, in the search, and wherever else the page shows them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import viser

from explorer.app.features.feature import Services
from explorer.app.features.optimise import actions, work
from explorer.app.features.optimise.state import Optimisation
from explorer.app.state.state import State
from explorer.app.widgets.chips import StateCommand
from explorer.page.widgets.palette import Key, shift

START, CANCEL = "optimise.start", "optimise.cancel"
ACCEPT, REVERT = "optimise.accept", "optimise.revert"
PAPER, LIFT = "optimise.paper", "optimise.lift"


def _is_running(state: State) -> bool:
    run = Optimisation.of(state).run
    return run is not None and run.phase == "running"


def _is_undecided(state: State) -> bool:
    return Optimisation.of(state).undecided is not None


BUTTONS: Mapping[str, StateCommand] = {
    START: StateCommand(
        "Optimise › Optimise",
        "Search for the best design from the present one; its limits hold throughout.",
        lambda _: actions.start_run(),
        is_ready=lambda state: not (Optimisation.of(state).is_on or work.find_refusals(state)),
        keys=(Key("O"),),
    ),
    CANCEL: StateCommand(
        "Optimise › Cancel",
        "End the search, and keep the best so far.",
        lambda _: actions.cancel_run(),
        is_ready=_is_running,
        keys=(shift("O"),),
    ),
    ACCEPT: StateCommand(
        "Optimise › Accept",
        "Keep the new design.",
        lambda _: actions.accept(),
        is_ready=_is_undecided,
    ),
    REVERT: StateCommand(
        "Optimise › Revert",
        "Return to your own design in its pose.",
        lambda _: actions.revert(),
        is_ready=_is_undecided,
    ),
    PAPER: StateCommand(
        "Optimise › The paper's problem",
        "Open the paper's initial design within the box of its optimum, and ask for its volume of "
        "8,000 cm³ with a clearance of 2 mm; one undo brings your design back.",
        lambda _: actions.take_paper_problem(),
        is_ready=lambda state: not Optimisation.of(state).is_on,
    ),
    LIFT: StateCommand(
        "Optimise › Lift the limit",
        "Take the limit that prevents the search out of the design; one undo brings it back.",
        lambda state: actions.lift_limit(next(iter(work.liftable_limits(state)), "")),
        is_ready=lambda state: bool(work.liftable_limits(state)),
    ),
}
"""The buttons by their names."""


def add_buttons(services: Services) -> None:
    """Register the buttons of the optimiser, and offer them in the search."""

    def press(name: str, value: str, client: viser.ClientHandle) -> None:
        is_named = name == LIFT and value
        change = actions.lift_limit(value) if is_named else BUTTONS[name].change
        services.session.do(change, who=client.client_id)

    for name, each in BUTTONS.items():
        services.buttons.on(name, partial(press, name))
        services.commands.add(each.of(services.session))


def button(
    name: str,
    state: State,
    *,
    words: str = "",
    value: str = "",
    hint: str = "",
    is_main: bool = False,
) -> str:
    """Return a button as HTML, disabled where it cannot be pressed.

    Words and hint are those of the command if ""; only that which lifts a limit has a value, the
    name of the limit.
    """
    command = replace(BUTTONS[name], words=words, does=hint or BUTTONS[name].does)
    return command.html(name, value, "ex-button is-main" if is_main else "ex-button", state)
