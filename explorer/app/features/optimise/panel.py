"""The tab that optimises the design: what is wanted, one button, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import viser

from explorer.app.features.optimise.actions import (
    Accept,
    CancelRun,
    LiftBox,
    Revert,
    SetWish,
    StartRun,
    TakePaperBox,
)
from explorer.app.features.optimise.plots import OptimisePlots
from explorer.app.features.optimise.problem import (
    box_on_offer,
    refuted,
    wished_box,
    wished_reach,
    wished_volume,
)
from explorer.app.features.optimise.words import (
    comparison_table,
    progress_line,
    refused_words,
    verdict_words,
)
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.frame import Frame
from explorer.app.state.optimisation import PLACE, Wish
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Controls
from explorer.app.widgets.markup import alert
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.pose import Triple
from explorer.optimise.problem import YAW, ObjectiveName
from explorer.optimise.refutation.refutation import BOX_LIMIT

OBJECTIVES: dict[str, ObjectiveName] = {
    "match a volume": "match-volume",
    "smallest reach for a volume": "smallest-reach",
    "largest volume for a reach": "largest-volume",
    "largest worst margin over a box": "largest-margin",
}
FREE = {
    **{name: f"Let {name} change." for name in VARIABLES},
    YAW: "Let the yaw of home change, and with it the orientation of the workspace.",
    PLACE: "Let the required box move, as it is.",
}
FREE_LABELS = {YAW: "yaw of home", PLACE: "place of the box"}
ACCEPT, REVERT = "Accept", "Revert"
HULL_FILE, DESIGN_FILE, SEARCH_FILE = "Hull", "Design", "Search"
CANCEL_COLOUR, REMEDY_COLOUR = "red", "gray"
STEP = 0.001

Send = Callable[[int | None], None]
"""Sends a file to one browser."""


class OptimisePanel:
    """The wish, the button, the charts and the verdict.

    Args:
        gui: Where all of it is added.
        session: To which it posts.
        export_hull: Sends the hull of the present design's workspace.
        save_design: Sends the present design.
        save_search: Sends the record of the last search.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        session: Session,
        export_hull: Send,
        save_design: Send,
        save_search: Send,
    ) -> None:
        self._session = session
        self._controls = controls = Controls(gui, session)
        with gui.add_folder("What is wanted (design units)"):
            self._add_wish()
        with gui.add_folder("What may change", expand_by_default=False):
            for name, hint in FREE.items():
                self._add_free(name, hint)
        self._notice = gui.add_html("", visible=False)
        self._lift = controls.button(
            "Lift the box",
            "Take the box for b4 out of the limits of the design; one undo brings it back.",
            LiftBox,
            icon=viser.Icon.BOX_OFF,
        )
        self._paper_box = controls.button(
            "Take the paper's box",
            "Bound b4 by the box of the paper's optimum; one undo brings yours back.",
            TakePaperBox,
            icon=viser.Icon.BOX,
        )
        for each in (self._lift, self._paper_box):
            each.color, each.visible = REMEDY_COLOUR, False
        self._optimise = controls.button(
            "Optimise",
            "Look for the best design from the present one; its limits hold throughout.",
            StartRun,
            icon=viser.Icon.SPARKLES,
        )
        self._cancel = controls.button(
            "Cancel", "End the search, and keep the best so far.", CancelRun
        )
        self._cancel.color = CANCEL_COLOUR
        self._cancel.visible = False
        self._words = gui.add_html("", visible=False)
        self._decision = gui.add_button_group(
            "Result",
            (ACCEPT, REVERT),
            hint="Keep what was found, or return to your own design in its pose.",
            visible=False,
        )
        self._decision.on_click(self._decided)
        self._files = gui.add_button_group(
            "Download",
            (HULL_FILE, DESIGN_FILE, SEARCH_FILE),
            hint="The convex hull of the workspace, in the format chosen in the tab Workspace; "
            "the design as a file to open again; the record by which the search can be repeated.",
            visible=False,
        )
        self._sends = {
            HULL_FILE: export_hull,
            DESIGN_FILE: save_design,
            SEARCH_FILE: save_search,
        }
        self._files.on_click(self._asked_for)
        self._table = gui.add_html("", visible=False)
        self._plots = OptimisePlots(gui)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield from self._controls.updates(frame)
        found = frame.state.optimisation
        run = found.run
        yield from self._refused(frame.state)
        yield self._optimise, "visible", not found.is_on
        yield self._cancel, "visible", found.is_on
        yield self._cancel, "disabled", run is not None and run.phase == "cancelling"
        words = ""
        if found.refusal is not None:
            words = alert("This cannot be optimised", found.refusal)
        elif run is not None and run.verdict is not None:
            words = verdict_words(frame.state, run, run.verdict)
        elif run is not None:
            words = progress_line(run)
        yield self._words, "visible", words != ""
        yield self._words, "content", words
        has_result = run is not None and run.best is not None
        yield self._decision, "visible", run is not None and run.is_undecided
        yield self._files, "visible", has_result
        yield self._table, "visible", has_result
        if run is not None and has_result:
            yield self._table, "content", comparison_table(run)
        yield from self._plots.updates(run)

    def _refused(self, state: State) -> Iterator[Update]:
        """Yield what tells that the limits cannot give what is asked for, and what would help."""
        found = state.optimisation
        refusals = () if found.is_on else refuted(state)
        yield self._notice, "visible", bool(refusals)
        if refusals:
            yield self._notice, "content", refused_words(refusals)
        verdict = None if found.run is None or found.run.accepted else found.run.verdict
        held = {each.limit for each in refusals}
        is_same_box = found.run is not None and (
            found.run.problem.start.limits.box == state.design.limits.box
        )
        if verdict is not None and verdict.status == "infeasible" and is_same_box:
            held.add(verdict.holding)
        is_boxed = BOX_LIMIT in held and state.design.limits.box is not None and not found.is_on
        box = box_on_offer(state) if is_boxed else None
        yield self._lift, "visible", is_boxed
        yield self._paper_box, "visible", box is not None and box != state.design.limits.box

    def _add_wish(self) -> None:
        controls = self._controls
        controls.dropdown(
            "Objective",
            "What the best design is best at.",
            tuple(OBJECTIVES),
            lambda frame: next(
                words for words, name in OBJECTIVES.items() if name == _wish(frame).objective
            ),
            lambda state, chosen: _wishing(state, objective=OBJECTIVES[chosen], volume=None),
        )
        controls.number(
            "Volume",
            "The exact volume of the workspace, in units³, at the orientation of home: to match, "
            "or at least.",
            lambda frame: wished_volume(frame.state),
            lambda state, value: _wishing(state, volume=value),
            least=0.0,
            step=STEP,
            visible=lambda state: state.optimisation.wish.needs_volume,
        )
        controls.number(
            "Reach",
            "The largest length allowed.",
            lambda frame: wished_reach(frame.state),
            lambda state, value: _wishing(state, reach=value),
            least=0.0,
            step=STEP,
            visible=lambda state: state.optimisation.wish.needs_reach,
        )
        controls.number(
            "Legs apart by",
            "The clearance that every two legs keep, their radii taken off, wherever in the "
            "workspace all margins are at least a 20th of the reach; 0 for no demand.",
            lambda frame: _wish(frame).clearance,
            lambda state, value: _wishing(state, clearance=value),
            least=0.0,
            step=STEP,
        )
        controls.checkbox(
            "Required box",
            "Demand that a box lies within the workspace; it is drawn.",
            lambda frame: _wish(frame).needs_box,
            lambda state, on: _wishing(state, with_box=on),
            disabled=lambda state: state.optimisation.wish.objective == "largest-margin",
        )
        for end, word in enumerate(("from", "to")):
            self._add_corner(end, f"Box {word}")
        controls.number(
            "Starts",
            "From how many designs to start: the present one, and others all over the bounds.",
            lambda frame: _wish(frame).starts,
            lambda state, value: _wishing(state, starts=round(value)),
            least=1,
            step=1,
        )

    def _add_corner(self, end: int, label: str) -> None:
        def write(state: State, value: Triple) -> Action:
            lows, highs = wished_box(state)
            return _wishing(state, box=(value, highs) if end == 0 else (lows, value))

        self._controls.triple(
            label,
            "A corner of the box, in the base frame.",
            lambda frame: wished_box(frame.state)[end],
            write,
            step=STEP,
            visible=lambda state: state.optimisation.wish.needs_box,
        )

    def _add_free(self, name: str, hint: str) -> None:
        def write(state: State, on: bool) -> Action:
            free = state.optimisation.wish.free
            chosen = [each for each in FREE if (on if each == name else each in free)]
            return _wishing(state, free=tuple(chosen))

        self._controls.checkbox(
            FREE_LABELS.get(name, name),
            hint,
            lambda frame: name in _wish(frame).free,
            write,
            disabled=(lambda state: not state.optimisation.wish.needs_box)
            if name == PLACE
            else None,
        )

    def _decided(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        action = Accept() if self._decision.value == ACCEPT else Revert()
        self._session.do(action, who=event.client_id)

    def _asked_for(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        self._sends[self._files.value](event.client_id)


def _wish(frame: Frame) -> Wish:
    return frame.state.optimisation.wish


def _wishing(state: State, **changes: Any) -> Action:
    return SetWish(replace(state.optimisation.wish, **changes))
