"""The buttons of the optimiser by name: what they do, and when they can be pressed.

They stand in the markup of its tab, in the palette, and wherever else the page shows them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import viser

from explorer.app.features.designs.feature import send_design
from explorer.app.features.feature import Services
from explorer.app.features.optimise import actions, work
from explorer.app.features.optimise.state import Optimisation
from explorer.app.features.workspace.feeds import send_workspace
from explorer.app.session.session import Who
from explorer.app.state.actions import Action
from explorer.app.state.state import State
from explorer.app.widgets.buttons import press_button
from explorer.optimise.outcome import encode_record
from explorer.page.widgets.palette import Key, shift, with_keys

START, CANCEL = "optimise.start", "optimise.cancel"
ACCEPT, REVERT = "optimise.accept", "optimise.revert"
PAPER, PAPER_BOX, LIFT = "optimise.paper", "optimise.box", "optimise.lift"
HULL, DESIGN, RECORD = "optimise.hull", "optimise.design", "optimise.record"


@dataclass(frozen=True)
class Button:
    """A button of the optimiser.

    Attributes:
        label: Words on the button, and its name in the palette.
        hint: Sentence on what a press does.
        is_ready: Function that tells whether it can be pressed.
        action: Function that returns the action of a press from the state and the value of the
            button; None where a press sends a file.
        keys: Keys that do the same.
    """

    label: str
    hint: str
    is_ready: Callable[[State], bool]
    action: Callable[[State, str], Action] | None = None
    keys: tuple[Key, ...] = ()


def _is_undecided(state: State) -> bool:
    return Optimisation.of(state).undecided is not None


def _has_result(state: State) -> bool:
    run = Optimisation.of(state).run
    return run is not None and run.best is not None


BUTTONS: Mapping[str, Button] = {
    START: Button(
        "Optimise",
        "Search for the best design from the present one; its limits hold throughout.",
        lambda state: not (Optimisation.of(state).is_on or work.find_refusals(state)),
        lambda _, __: actions.StartRun(),
        (Key("O"),),
    ),
    CANCEL: Button(
        "Cancel",
        "End the search, and keep the best so far.",
        lambda state: (run := Optimisation.of(state).run) is not None and run.phase == "running",
        lambda _, __: actions.CancelRun(),
        (shift("O"),),
    ),
    ACCEPT: Button("Accept", "Keep the new design.", _is_undecided, lambda _, __: actions.Accept()),
    REVERT: Button(
        "Revert",
        "Return to your own design in its pose.",
        _is_undecided,
        lambda _, __: actions.Revert(),
    ),
    PAPER: Button(
        "The paper's problem",
        "Open the paper's initial design within the box of its optimum, and ask for its volume of "
        "8,000 cm³ with a clearance of 2 mm; one undo brings your design back.",
        lambda state: not Optimisation.of(state).is_on,
        lambda _, __: actions.TakePaperProblem(),
    ),
    PAPER_BOX: Button(
        "Take the paper's box",
        "Bound b4 by the box of the paper's optimum; one undo brings yours back.",
        work.is_paper_box_on_offer,
        lambda _, __: actions.TakePaperBox(),
    ),
    LIFT: Button(
        "Lift the limit",
        "Take the limit that prevents the search out of the design; one undo brings it back.",
        lambda state: bool(work.liftable_limits(state)),
        lambda state, limit: actions.LiftLimit(
            limit or next(iter(work.liftable_limits(state)), "")
        ),
    ),
    HULL: Button(
        "Download the hull",
        "Download the convex hull of the workspace as 3MF; Export has other formats.",
        _has_result,
    ),
    DESIGN: Button(
        "Download the design", "Download the design as a file to open again.", _has_result
    ),
    RECORD: Button(
        "Download the record", "Download the record to repeat the search from.", _has_result
    ),
}
"""The buttons by their names."""


def add_buttons(services: Services) -> None:
    """Register the buttons of the optimiser, and offer them in the palette."""
    session = services.session

    def send_record(who: Who) -> None:
        state = session.state
        record = Optimisation.of(state).record
        if record is None:
            services.complain("a search that had to be ended leaves no record", who)
            return
        services.downloads.send(who, f"{state.design.name}.record.json", encode_record(record))

    sends: Mapping[str, Callable[[Who], None]] = {
        HULL: partial(send_workspace, services, "hull", "3mf", at_home=True),
        DESIGN: partial(send_design, services),
        RECORD: send_record,
    }

    def press(name: str, value: str, client: viser.ClientHandle) -> None:
        action = BUTTONS[name].action
        if action is None:
            sends[name](client.client_id)
        else:
            session.do(lambda state: action(state, value), who=client.client_id)

    for name, each in BUTTONS.items():
        services.buttons.on(name, partial(press, name))
        services.buttons.offer(
            f"Optimise › {each.label}",
            each.hint,
            name,
            is_ready=lambda each=each: each.is_ready(session.state),
            keys=each.keys,
        )


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

    Words and hint are those of the button if ""; its handler receives the value.
    """
    declared = BUTTONS[name]
    return press_button(
        name,
        value,
        words or declared.label,
        hint=with_keys(hint or declared.hint, declared.keys),
        class_name="ex-button is-main" if is_main else "ex-button",
        is_disabled=not declared.is_ready(state),
    )
