"""The page of one server: scene and panels, drawn from the session's frames."""

from __future__ import annotations

import sys
import threading
import time
import traceback
from collections.abc import Iterable, Iterator
from typing import get_args

import numpy as np
import viser

from explorer.app.browser.press_events import listen
from explorer.app.drawing import Scene
from explorer.app.features.compare.drawing import compared_drawing
from explorer.app.features.compare.feed import CompareFeed
from explorer.app.features.compare.panel import ComparePanel
from explorer.app.features.designs.panel import DesignsPanel
from explorer.app.features.designs.shelf import Shelf
from explorer.app.features.history.panel import HistoryPanel
from explorer.app.features.legs.feed import RadiusFeed
from explorer.app.features.legs.panel import LegsPanel
from explorer.app.features.legs.tasks import draw_radius_curve
from explorer.app.features.mechanism.design_panel import DesignPanel
from explorer.app.features.mechanism.pose_panel import MovePanel
from explorer.app.features.mechanism.show_panel import ViewPanel
from explorer.app.features.optimise.panel import OptimisePanel
from explorer.app.features.optimise.runner import Optimiser
from explorer.app.features.paths.panel import PathsPanel
from explorer.app.features.paths.runner import PathRunner
from explorer.app.features.prototype.feed import PartsFeed
from explorer.app.features.prototype.panel import PrototypePanel
from explorer.app.features.sharing.downloads import Downloads
from explorer.app.features.sharing.panel import SharePanel
from explorer.app.features.singularity.feed import StrataFeed
from explorer.app.features.singularity.jog_panel import JogPanel
from explorer.app.features.singularity.panel import SingularityPanel
from explorer.app.features.studies.folders import StudyFolders
from explorer.app.features.studies.panel import StudiesPanel
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.numbers import WorkspaceNumbers
from explorer.app.features.workspace.panel import WorkspacePanel
from explorer.app.features.workspace.tasks import draw_workspace
from explorer.app.hands import Hands
from explorer.app.scene.camera import Cameras, ViewName
from explorer.app.scene.placing import Placed
from explorer.app.session.history import History
from explorer.app.session.jobs import Worker
from explorer.app.session.session import REDO, UNDO, Session, Who
from explorer.app.state.actions import SetPose
from explorer.app.state.frame import Frame
from explorer.app.state.presses import Presses
from explorer.app.state.state import State
from explorer.app.storage.keeping import Keep, Keeper
from explorer.app.storage.preferences import PreferenceFile
from explorer.app.widgets.assigning import QUIET_SECONDS, Assigner, Update
from explorer.mechanism.design import Design

TITLE = "Flagged 4-4 explorer"
# Modules that the worker imports before anything is asked of it.
TASKS = tuple(task.__module__ for task in (draw_workspace, draw_radius_curve, compared_drawing))
# What a notice is called that answers something asked for.
REFUSAL = "That is not possible"
# One notice is shown this long, and not again within it.
NOTICE_SECONDS = 6.0
# While events come faster than frames, all figures are told this often.
FIGURES_SECONDS = 0.1
# To send a frame to one browser takes about so long; up to so many at once are not felt.
REST_SECONDS, FEW_BROWSERS, LONGEST_REST_SECONDS = 0.002, 4, 0.04
# Properties that decide whether a control can be used.
IN_USE = ("disabled", "visible")
# Between two looks at a run that is waited for.
WAIT_SECONDS = 0.02
TRAVELS = {"Undo": UNDO, "Redo": REDO}
VIEW_LABELS: dict[str, ViewName] = {name.capitalize(): name for name in get_args(ViewName)}


class Page:
    """Draws frames on a viser server and posts what people do to the session.

    Args:
        server: On which everything is drawn.
        state: The first state.
        docked: Whether the panels lie beside the scene, rather than over it.
        keep: The user's designs and where the session is kept; None to keep nothing.
        history: That led to the state; None where it begins with it.
        preferences: Where theme and tour are remembered; None to be light and to begin no
            tour by itself.
        studies: Where design studies lie; None to offer none.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        state: State,
        *,
        docked: bool = True,
        keep: Keep | None = None,
        history: History | None = None,
        preferences: PreferenceFile | None = None,
        studies: StudyFolders | None = None,
    ) -> None:
        self._server = server
        self._notified: dict[str, float] = {}
        self._told = 0.0
        self._again: threading.Timer | None = None
        # What is read on other threads may be there before the last panel is.
        self._is_complete = False
        self._frame = Frame(state)
        self._assigner = Assigner(server)
        presses = Presses()
        self.session = Session(
            state, self._draw, self._complain, self._report, history, press_at=presses.at
        )
        faults = None if keep is None else keep.faults
        self.worker = Worker(self._tell, preload=TASKS, faults=faults)
        self.feed = WorkspaceFeed(self.worker, self.session.redraw)
        self.radius_feed = RadiusFeed(self.worker, self.session.redraw)
        self.strata_feed = StrataFeed(self.worker, self.session.redraw)
        self.parts_feed = PartsFeed(self.worker, self.session.redraw)
        self.compare_feed = CompareFeed(self.worker, self.session.redraw)
        self.path_runner = PathRunner(self.session, self._tell, faults)
        gui = server.gui
        gui.set_panel_label(TITLE)
        self.hands = Hands(server, self.session, preferences, self._complain)
        self.optimiser = Optimiser(
            self.session,
            self._tell,
            lambda: self.feed.is_settled,
            faults,
        )
        self._scene = Scene(server, self.feed, self.compare_feed)
        self._cameras = Cameras(server.initial_camera, self._placed)
        self.downloads = downloads = Downloads(
            server,
            self.session,
            self.worker,
            self._complain,
            lambda: self.hands.theme.is_dark,
        )
        self._add_edit_buttons(gui)
        self._add_view_buttons(gui)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Move"):
            move = MovePanel(gui, self.session)
            jog = JogPanel(gui, self.session)
        with tabs.add_tab("Design"):
            design = DesignPanel(gui, self.session)
        with tabs.add_tab("Workspace"):
            self._workspace = WorkspacePanel(gui, self.session, downloads.workspace)
        with tabs.add_tab("Optimise"):
            self._optimise = OptimisePanel(
                gui,
                self.session,
                lambda who: downloads.hull(self._workspace.file_format, who),
                downloads.design,
                downloads.search,
            )
        with tabs.add_tab("View"):
            self._prototype = PrototypePanel(gui, self.session, downloads.assembly)
            view = ViewPanel(gui, self.session)
        side = gui.add_panel()
        with side.add_tab("Singularity"):
            self._singularity = SingularityPanel(gui, self.session)
        with side.add_tab("Workspace"):
            self._numbers = WorkspaceNumbers(gui)
        with side.add_tab("Legs"):
            self._legs = LegsPanel(gui, self.session)
        with side.add_tab("Paths"):
            paths = PathsPanel(gui, self.session, downloads.path)
        self._panels = (move, jog, design, view, paths)
        drawer = self._add_drawer(gui, keep, studies)
        self.hands.complete(self._cameras, side, drawer, docked=docked)
        self._scene.drag_handle.handle.on_update(self._dragged)
        server.on_client_connect(self._cameras.connected)
        server.on_client_disconnect(self._cameras.disconnected)
        server.on_client_connect(lambda client: listen(client, presses))
        server.on_client_disconnect(lambda client: presses.forget(client.client_id))
        self._is_complete = True
        self.session.redraw()
        self.session.wait_until_idle()

    def stop(self) -> None:
        """End the session and the worker."""
        if self._again is not None:
            self._again.cancel()
        self.session.stop()
        if self.shelf is not None:
            self.shelf.stop()
        if self.keeper is not None:
            self.keeper.stop()
        if self.studies is not None:
            self.studies.stop()
        self.downloads.stop()
        self.path_runner.stop()
        self.worker.stop()
        self.optimiser.stop()

    def wait_until_drawn(self, timeout: float = 30.0) -> bool:
        """Wait until the newest state and its workspace are drawn; say whether they are.

        A run of the optimiser is waited for too.
        """
        deadline = time.monotonic() + timeout
        idle = self.session.wait_until_idle(timeout)
        while self.session.state.optimisation.is_on and time.monotonic() < deadline:
            time.sleep(WAIT_SECONDS)
        idle = idle and self.optimiser.worker.wait_until_idle(deadline - time.monotonic())
        # Drawing may ask the worker, whose answer is drawn again.
        for _ in range(2):
            idle = idle and self.session.wait_until_idle(deadline - time.monotonic())
            idle = idle and self.worker.wait_until_idle(deadline - time.monotonic())
        return idle and self.session.wait_until_idle(deadline - time.monotonic())

    def point_cameras(self, view: ViewName) -> None:
        """Point the camera of every open browser."""
        for client in self._server.get_clients().values():
            self._cameras.point(client, view)

    def _add_drawer(
        self, gui: viser.GuiApi, keep: Keep | None, studies: StudyFolders | None
    ) -> viser.PanelHandle:
        # A drawer over the foot of the scene: what is wide, and what is not needed all the time.
        drawer = gui.add_panel()
        self.shelf: Shelf | None = None
        self.keeper: Keeper | None = None
        self._designs: DesignsPanel | None = None
        if keep is not None:
            self.keeper = Keeper(keep.store, self._tell)
            self.shelf = Shelf(keep.library, self.session, self._complain)
            with drawer.add_tab("Designs"):
                self._designs = DesignsPanel(gui, self.session, self.shelf, self.downloads.design)
        with drawer.add_tab("Compare"):
            self._compare = ComparePanel(gui, self.session, self._saved_designs)
        self.studies: StudiesPanel | None = None
        if studies is not None:
            with drawer.add_tab("Studies") as tab:
                self.studies = StudiesPanel(
                    self._server,
                    tab,
                    self.session,
                    studies,
                    self._complain,
                    lambda client, tall: self.hands.set_drawer(client, drawer, tall=tall),
                    None if keep is None else keep.faults,
                )
        with drawer.add_tab("History"):
            self._history = HistoryPanel(gui, self.session)
        with drawer.add_tab("Share"):
            self._share = SharePanel(gui, self.downloads)
        return drawer

    def _add_view_buttons(self, gui: viser.GuiApi) -> None:
        buttons = gui.add_button_group(
            "View", tuple(VIEW_LABELS), hint="Frame the mechanism from one of four sides."
        )

        @buttons.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            if event.client is not None:
                self._cameras.point(event.client, VIEW_LABELS[buttons.value])

    def _add_edit_buttons(self, gui: viser.GuiApi) -> None:
        buttons = gui.add_button_group(
            "Edit",
            tuple(TRAVELS),
            hint="Undo the last step, or redo it; the drawer lists them all.",
        )
        buttons.on_click(
            lambda event: self.session.travel(TRAVELS[buttons.value], who=event.client_id)
        )

    def _draw(self, frame: Frame) -> None:
        if not self._is_complete:
            return
        self._draw_all(frame)
        self._rest()

    def _draw_all(self, frame: Frame) -> None:
        self._frame, began = frame, time.time()
        step = self.session.history.step
        self.downloads.log.record(frame.state, step.number, step.words)
        if self.keeper is not None:
            self.keeper.follow(frame.state, self.session.history)
        # First, so that what is asked for is called out of date until it arrives.
        for feed in (self.feed, self.radius_feed, self.strata_feed, self.parts_feed):
            feed.follow(frame)
        self.compare_feed.follow(frame)
        # The mechanism follows the hand before the figures do, which nobody reads meanwhile.
        self._assigner.assign(self._scene.updates(self._placed()), since=began)
        self.optimiser.follow(frame)
        self.path_runner.follow(frame)
        changed = self._assigner.assign(self._told_now(frame), since=began)
        # What a control allows, its command does; controls have been told of it by now.
        controls = any(name in IN_USE for _, name, _ in changed)
        self._assigner.assign(self.hands.updates(controls=controls))
        if self.shelf is not None:
            self.hands.offer_saved(self.shelf)
        self.hands.follow(frame)
        if self._assigner.settle():
            self._look_again()

    def _look_again(self) -> None:
        """Draw once more when hands rest, unless that is to come already."""
        if self._again is None:
            self._again = threading.Timer(QUIET_SECONDS, self._draw_again)
            self._again.daemon = True
            self._again.start()

    def _draw_again(self) -> None:
        self._again = None
        self.session.redraw()

    def _told_now(self, frame: Frame) -> list[Update]:
        """Return what makes the panels show a frame, or the first of them if another waits.

        What is left out is told with the next frame.
        """
        is_due = time.monotonic() - self._told >= FIGURES_SECONDS
        updates: list[Update] = []
        for panel in self._figures(frame):
            if self.session.has_more and not is_due:
                return updates
            updates.extend(panel)
        self._told = time.monotonic()
        return updates

    def _figures(self, frame: Frame) -> Iterator[Iterable[Update]]:
        """Yield the updates of panel after panel; each is computed when it is gone through."""
        for panel in (self._optimise, *self._panels):
            yield panel.updates(frame)
        for panel in (self._workspace, self._numbers):
            yield panel.updates(frame, self.feed)
        yield self._legs.updates(frame, self.radius_feed)
        yield self._singularity.updates(frame, self.strata_feed)
        yield self._prototype.updates(frame, self.parts_feed)
        yield self._history.updates(self.session.history)
        if self._designs is not None:
            yield self._designs.updates(frame)
        if self.studies is not None:
            yield self.studies.updates(frame, dark=self.hands.theme.is_dark)
        yield self._compare.updates(frame, self.compare_feed)
        yield self._share.updates()

    def _rest(self) -> None:
        """Leave the processor to the many browsers that a frame has to be sent to."""
        many = len(self._server.get_clients()) - FEW_BROWSERS
        if many > 0:
            time.sleep(min(REST_SECONDS * many, LONGEST_REST_SECONDS))

    def _saved_designs(self) -> tuple[Design, ...]:
        entries = () if self.shelf is None else self.shelf.entries
        return tuple(entry.design for entry in entries if entry.design is not None)

    def _placed(self) -> Placed:
        drawing = self.feed.drawing
        boxes = self.compare_feed.extents(self._frame.state)
        if drawing is not None and drawing.extent is not None:
            boxes.append(np.array(drawing.extent))
        box = None
        if boxes:
            box = np.array([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]])
        return Placed(self._frame, box, self.parts_feed.parts, self.hands.theme.is_dark)

    def _dragged(self, event: viser.TransformControlsEvent) -> None:
        if event.client_id is None:
            return
        gizmo = self._scene.drag_handle
        self.session.post(
            "drag",
            lambda state: SetPose(gizmo.pose(state)),
            stamp=gizmo.handle.update_timestamp,
            who=event.client_id,
        )

    def _complain(self, message: str, who: Who) -> None:
        self._notify(REFUSAL, message, who)

    def _tell(self, message: str) -> None:
        """Tell all of what nobody asked for."""
        self._notify("Please note", message, None)

    def _report(self, error: Exception) -> None:
        traceback.print_exception(error, file=sys.stderr)
        self._notify("Something went wrong", f"In the explorer itself: {error}", None)

    def _notify(self, title: str, message: str, who: Who) -> None:
        now = time.monotonic()
        if now - self._notified.get(message, -NOTICE_SECONDS) < NOTICE_SECONDS:
            return
        self._notified = {m: t for m, t in self._notified.items() if now - t < NOTICE_SECONDS}
        self._notified[message] = now
        for client_id, client in self._server.get_clients().items():
            if who is None or client_id == who:
                client.add_notification(
                    title, message, auto_close_seconds=NOTICE_SECONDS, color="orange"
                )
