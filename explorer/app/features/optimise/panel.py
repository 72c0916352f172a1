"""The tab that optimises the design: objective and demands, progress, and the result."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import viser

from explorer.app.features.designs.files import DesignFile
from explorer.app.features.feature import Services
from explorer.app.features.optimise.actions import (
    Accept,
    CancelRun,
    LiftBox,
    Revert,
    SetObjective,
    SetRequest,
    StartRun,
    TakePaperBox,
)
from explorer.app.features.optimise.plots import OptimisePlots
from explorer.app.features.optimise.problem import (
    box_on_offer,
    refuted,
    requested_box,
    requested_reach,
    requested_volume,
)
from explorer.app.features.optimise.words import (
    comparison_table,
    progress_line,
    refused_words,
    verdict_words,
)
from explorer.app.features.workspace.files import WorkspaceFiles
from explorer.app.session.session import Who
from explorer.app.state.action import Action
from explorer.app.state.frame import Frame
from explorer.app.state.optimisation import PLACE
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import At, Bound, Controls
from explorer.app.widgets.markup import alert
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.pose import Triple
from explorer.optimise.problem import YAW, ObjectiveName
from explorer.optimise.record import encode_record
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
    PLACE: "Let the required box move without changing its size.",
}
FREE_LABELS = {YAW: "yaw of home", PLACE: "place of the box"}
ACCEPT, REVERT = "Accept", "Revert"
HULL_FILE, DESIGN_FILE, SEARCH_FILE = "Hull", "Design", "Search"
CANCEL_COLOUR, REMEDY_COLOUR = "red", "gray"
STEP = 0.001


class OptimisePanel:
    """The controls of the problem, the charts and the result of a run."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._session, self._downloads = services.session, services.downloads
        self._complain = services.complain
        self._controls = controls = Controls(gui, services.session)
        with gui.add_folder("Objective and demands (design units)"):
            self._add_problem()
        with gui.add_folder("Free variables", expand_by_default=False):
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
        for button in (self._lift, self._paper_box):
            button.color, button.visible = REMEDY_COLOUR, False
        self._optimise = controls.button(
            "Optimise",
            "Search for the best design from the present one; its limits hold throughout.",
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
            hint="Keep the new design, or return to your own design in its pose.",
            visible=False,
        )
        self._decision.on_click(self._decide)
        self._files = gui.add_button_group(
            "Download",
            (HULL_FILE, DESIGN_FILE, SEARCH_FILE),
            hint="The convex hull of the workspace as 3MF; the design as a file to open again; the "
            "record to repeat the search from.",
            visible=False,
        )
        self._sends = {
            HULL_FILE: partial(services.get(WorkspaceFiles).send_hull_at_home, "3mf"),
            DESIGN_FILE: services.get(DesignFile).send,
            SEARCH_FILE: self._send_record,
        }
        self._files.on_click(self._send_file)
        self._table = gui.add_html("", visible=False)
        self._plots = OptimisePlots(gui)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that show a frame."""
        yield from self._controls.updates(frame)
        optimisation = frame.state.optimisation
        run = optimisation.run
        yield from self._update_refusals(frame.state)
        yield self._optimise, "visible", not optimisation.is_on
        yield self._cancel, "visible", optimisation.is_on
        yield self._cancel, "disabled", run is not None and run.phase == "cancelling"
        words = ""
        if optimisation.refusal is not None:
            words = alert("This cannot be optimised", optimisation.refusal)
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

    def _update_refusals(self, state: State) -> Iterator[Update]:
        """Yield the updates that show the demands that the limits rule out, and the remedies."""
        optimisation = state.optimisation
        run = optimisation.run
        refusals = () if optimisation.is_on else refuted(state)
        yield self._notice, "visible", bool(refusals)
        if refusals:
            yield self._notice, "content", refused_words(refusals)
        limit_box = state.design.limits.box
        limits = {refusal.limit for refusal in refusals}
        if (
            run is not None
            and not run.accepted
            and run.verdict is not None
            and run.verdict.status == "infeasible"
            and run.problem.start.limits.box == limit_box
        ):
            limits.add(run.verdict.holding)
        is_boxed = BOX_LIMIT in limits and limit_box is not None and not optimisation.is_on
        box = box_on_offer(state) if is_boxed else None
        yield self._lift, "visible", is_boxed
        yield self._paper_box, "visible", box is not None and box != limit_box

    def _add_problem(self) -> None:
        controls = self._controls
        controls.dropdown(
            "Objective",
            "The measure that the search improves.",
            OBJECTIVES,
            At("optimisation.request.objective", action=SetObjective),
        )
        controls.number(
            "Volume",
            "The exact volume of the workspace, in units³, at the orientation of home: to match, "
            "or at least.",
            At("optimisation.request.volume", default=requested_volume, action=SetRequest),
            least=0.0,
            step=STEP,
            visible=lambda state: state.optimisation.request.needs_volume,
        )
        controls.number(
            "Reach",
            "The largest length of l1 to l4 allowed.",
            At("optimisation.request.reach", default=requested_reach, action=SetRequest),
            least=0.0,
            step=STEP,
            visible=lambda state: state.optimisation.request.needs_reach,
        )
        controls.number(
            "Clearance",
            "The least clearance of any two legs, their radii taken off, wherever in the "
            "workspace all margins are at least a 20th of the reach; 0 for no demand.",
            At("optimisation.request.clearance", action=SetRequest),
            least=0.0,
            step=STEP,
        )
        controls.checkbox(
            "Required box",
            "Demand that a box lies within the workspace; it is drawn.",
            Bound(
                lambda frame: frame.state.optimisation.request.needs_box,
                lambda _, on: SetRequest("optimisation.request.with_box", on, "Required box"),
            ),
            disabled=lambda state: state.optimisation.request.objective == "largest-margin",
        )
        for end, word in enumerate(("from", "to")):
            self._add_corner(end, f"Box {word}")
        controls.number(
            "Starts",
            "Number of designs to start from: the present one, and others spread over the bounds.",
            At("optimisation.request.starts", convert=round, action=SetRequest),
            least=1,
            step=1,
        )

    def _add_corner(self, end: int, label: str) -> None:
        def write(state: State, value: Triple) -> Action:
            lows, highs = requested_box(state)
            box = (value, highs) if end == 0 else (lows, value)
            return SetRequest("optimisation.request.box", box, "Required box")

        self._controls.triple(
            label,
            "A corner of the box, in the base frame.",
            Bound(lambda frame: requested_box(frame.state)[end], write),
            step=STEP,
            visible=lambda state: state.optimisation.request.needs_box,
        )

    def _add_free(self, name: str, hint: str) -> None:
        def write(state: State, on: bool) -> Action:
            free = state.optimisation.request.free
            chosen = tuple(key for key in FREE if (on if key == name else key in free))
            label = f"Free variable {FREE_LABELS.get(name, name)}"
            return SetRequest("optimisation.request.free", chosen, label, "on" if on else "off")

        self._controls.checkbox(
            FREE_LABELS.get(name, name),
            hint,
            Bound(lambda frame: name in frame.state.optimisation.request.free, write),
            disabled=(lambda state: not state.optimisation.request.needs_box)
            if name == PLACE
            else None,
        )

    def _decide(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        action = Accept() if self._decision.value == ACCEPT else Revert()
        self._session.do(action, who=event.client_id)

    def _send_record(self, who: Who) -> None:
        state = self._session.state
        record = state.optimisation.record
        if record is None:
            self._complain("a search that had to be ended leaves no record", who)
            return
        self._downloads.send(who, f"{state.design.name}.record.json", encode_record(record))

    def _send_file(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        self._sends[self._files.value](event.client_id)
