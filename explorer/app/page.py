"""The page of one server: its features, drawn from the session's frames."""

from __future__ import annotations

import threading
import time
import traceback
from collections import deque
from typing import Literal

import numpy as np
import viser

from explorer.app.features.calibration.feature import CALIBRATION
from explorer.app.features.compare.feature import COMPARE
from explorer.app.features.designs.feature import DESIGNS
from explorer.app.features.feature import Feature, Panel, Services
from explorer.app.features.help.feature import HELP
from explorer.app.features.history.feature import HISTORY
from explorer.app.features.legs.feature import LEGS
from explorer.app.features.loads.feature import LOADS
from explorer.app.features.machine.feature import MACHINE
from explorer.app.features.mechanism.feature import MECHANISM
from explorer.app.features.optimise.feature import OPTIMISE
from explorer.app.features.orientation.feature import ORIENTATION
from explorer.app.features.paths.feature import PATHS
from explorer.app.features.prototype.feature import PROTOTYPE
from explorer.app.features.requirement.feature import REQUIREMENT
from explorer.app.features.sharing.feature import SHARING
from explorer.app.features.singularity.feature import SINGULARITY
from explorer.app.features.studies.feature import STUDIES
from explorer.app.features.studies.folders import StudyFolders, study_folders
from explorer.app.features.view.feature import VIEW
from explorer.app.features.workspace.feature import WORKSPACE
from explorer.app.layout import TITLE, Bar, Layout, Panels
from explorer.app.scene.camera import Cameras, ViewName
from explorer.app.scene.placing import Placed
from explorer.app.session.feed import modules_of
from explorer.app.session.session import Session, Who
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.storage.user_data import Autosaver, UserData
from explorer.app.widgets.buttons import Buttons
from explorer.app.widgets.downloads import Downloads
from explorer.app.widgets.markup import sentence
from explorer.app.widgets.theme import Theme
from explorer.export.drawings.markup import drawing_style
from explorer.jobs.jobs import PAGE, Jobs, log_error
from explorer.measures.field_words import message_of
from explorer.numerics.arrays import FloatArray
from explorer.page.browser.browser_facts import listen
from explorer.page.browser.viser_gaps import run_script
from explorer.page.look import read_script, read_stylesheet
from explorer.page.session import clock
from explorer.page.state.presses import Presses
from explorer.page.widgets.assigning import QUIET_SECONDS, Assigner, Update
from explorer.page.widgets.palette import Command, Palette

# The features, in the order of their tabs and of their parts of the bar.
FEATURES: tuple[Feature, ...] = (
    DESIGNS, MECHANISM, REQUIREMENT, MACHINE, HISTORY, VIEW, SINGULARITY, WORKSPACE, ORIENTATION,
    LOADS, CALIBRATION, PROTOTYPE, LEGS, OPTIMISE, STUDIES, COMPARE, PATHS, SHARING, HELP,
)  # fmt: skip
# Modules that the process of the page imports at its start.
TASKS = modules_of(feed for each in FEATURES for feed in (*each.feeds, *each.later_feeds))
# Scripts of the whole page.
SCRIPTS = (
    # Before all that reads keys.
    "keys",
    "throttles",
    "markup",
    "frames",
    "fields",
    "names",
    "opens",
    "stops",
    "search",
    "projection",
    "labels",
    "layers",
    "map",
    "notices",
)
# Title of a notice that a request is refused.
REFUSAL = "That is not possible"
# Title of a notice of what no request caused.
NOTE = "Please note"
# Seconds for which a notice is shown, and not repeated.
NOTICE_SECONDS = 6.0
# Colours of a warning, and of a notice that is none.
Colour = Literal["orange", "blue"]
WARNING: Colour = "orange"
NOTICE: Colour = "blue"
# Largest number of notices that wait for a browser; the newest are kept.
MOST_PENDING = 10
# Seconds that the panels of a frame may take during a drag and while another frame waits, and
# seconds without a change after which a drag counts as paused and all is drawn.
PANELS_SECONDS, DRAG_PAUSE = 0.003, 0.1
# Seconds without a frame after which cameras follow what was drawn.
FOLLOW_SECONDS = 0.35


class Page:
    """Draws frames on a viser server and posts what people do to the session.

    Args:
        server: Server that the page is drawn on.
        state: The first state.
        panels, user_data, tour, studies: As for `explorer.app.server.start`.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        state: State,
        *,
        panels: bool = True,
        user_data: UserData | None = None,
        tour: bool = False,
        studies: StudyFolders | None = None,
    ) -> None:
        self._server = server
        self._notified: dict[tuple[str, Who], float] = {}
        # Notices without a browser, kept for the next one; the lock guards them.
        self._pending: list[tuple[str, str, Colour]] = []
        self._pending_lock = threading.Lock()
        self._follows_at_release = False
        # When the state that is drawn was new.
        self._changed = 0.0
        # Other threads may ask for a frame before the last panel is there.
        self._is_complete = False
        self._frame = Frame(state)
        self._assigner = Assigner(server)
        self._presses = presses = Presses()
        history = None if user_data is None else user_data.history
        self.session = Session(
            state,
            self._draw,
            self._complain,
            self._report,
            history,
            press_at=presses.at,
            tell=self._tell,
            words_of=message_of,
        )
        self._drag_pause = clock.Pause(DRAG_PAUSE, self.session.redraw)
        self._quiet_pause = clock.Pause(QUIET_SECONDS, self.session.redraw)
        # Looks after the cameras once nothing has been drawn for a while, or at a release.
        self._camera_pause = clock.Pause(FOLLOW_SECONDS, self._follow)
        self.pauses = self._drag_pause, self._quiet_pause, self._camera_pause
        self.jobs = Jobs(self._warn)
        gui = server.gui
        gui.set_panel_label(TITLE)
        self.buttons = Buttons(server)
        theme = Theme(server, self.buttons, self.session.redraw)
        run_script(server, read_stylesheet(f".ex-machine {{{drawing_style()}}}"))
        for script in SCRIPTS:
            run_script(server, read_script(script))
        self.panels = Panels(gui)
        self.autosaver = (
            None if user_data is None else Autosaver(user_data.store, self._show_saving)
        )
        self.services = Services(
            server,
            self.session,
            self.jobs,
            self.buttons,
            Downloads(server, self.jobs, self._complain),
            self._complain,
            self._tell,
            theme,
            Cameras(server.initial_camera, self.corners),
            user_data,
            tour,
            self.autosaver,
            FEATURES,
            {} if studies is None else {study_folders: studies},
        )
        server.scene.set_up_direction("+z")
        self._features = self.services.features
        self._scene = [self.services.get(part) for each in self._features for part in each.scene]
        # The process computes in the order of their requests. The scene alone needs those feeds
        # only of which it draws.
        kinds = [kind for each in self._features for kind in each.feeds]
        kinds += [kind for each in self._features for kind in each.later_feeds]
        self._feeds = [
            self.services.get(kind) for kind in kinds if panels or self.services.has(kind)
        ]
        self.runners = [self.services.get(kind) for each in self._features for kind in each.runners]
        self.services.cameras.frame_first()
        self._panels = deque(self._add_panels() if panels else ())
        layout = Layout(self.services, self.panels if panels else None)
        theme.begin(server)
        self.palette = self._add_palette(layout)
        for message in () if user_data is None else user_data.messages:
            self._warn(sentence(message))
        server.on_client_connect(self._show_pending)
        server.on_client_connect(self.services.cameras.connected)
        server.on_client_disconnect(self.services.cameras.disconnected)
        is_saved = user_data is not None
        server.on_client_connect(
            lambda client: listen(client, presses, self._follow_after_release, is_saved=is_saved)
        )
        server.on_client_disconnect(lambda client: self._forget(client.client_id))
        self._is_complete = True
        self.session.redraw()
        self.session.wait_until_idle()

    def start_workers(self) -> None:
        """Start the processes that will be needed, that of the page first, in the background."""

        def prepare() -> None:
            for runner in self.runners:
                runner.prepare()

        self.jobs.prepare(PAGE, TASKS, prepare)

    def stop(self) -> None:
        """End the session, the features and the processes; keep what long work has found so far."""
        for runner in self.runners:
            runner.finish()
        for pause in self.pauses:
            pause.cancel()
        self.buttons.stop()
        self.session.stop()
        self.services.stop()
        self.services.downloads.stop()
        if self.autosaver is not None:
            self.autosaver.stop()
        self.jobs.stop()

    def point_cameras(self, view: ViewName) -> None:
        """Point the camera of every open browser."""
        for client in self._server.get_clients().values():
            self.services.cameras.point(client, view)

    def _add_panels(self) -> list[Panel]:
        panels: list[Panel] = [Bar(self.services, self._features)]
        for feature, tab in ((each, tab) for each in self._features for tab in each.tabs):
            with self.panels.tab(tab, feature.manual), self.services.commands.within(tab.title):
                panels.append(self.services.get(tab.panel))
        return panels

    def _add_palette(self, layout: Layout) -> Palette:
        hint = "Put the panels where they were at first."
        self.services.commands.add(Command("View › Reset layout", hint, layout.reset))
        for each in (command for feature in self._features for command in feature.commands):
            self.services.commands.add(each.of(self.session))
        return Palette(self._server, self.services.commands.all)

    def _draw(self, frame: Frame) -> None:
        if not self._is_complete:
            return
        is_drawn, began = frame.state is self._frame.state, time.time()
        is_dragged, now = self._is_held(), time.monotonic()
        if is_drawn and is_dragged and now < self._changed + DRAG_PAUSE:
            # What was computed for a state that is drawn already waits for the next change.
            self._drag_pause.begin()
            return
        if is_drawn:
            # What follows from the state is known already.
            frame = self._frame
        else:
            self._frame, self._changed = frame, now
        if self.autosaver is not None:
            self.autosaver.follow(self.session.history)
        # Feeds come first, so that a drawing counts as outdated until the new one arrives.
        for feed in self._feeds:
            feed.follow(frame)
        # The scene is updated before the panels, whose numbers nobody reads during a drag.
        placed = self._placed()
        drawn = [update for part in self._scene for update in part.updates(placed)]
        self._assigner.assign(drawn, since=began)
        for runner in self.runners:
            runner.follow(frame)
        panels = self._panel_updates(frame, is_dragged=is_dragged and not is_drawn)
        self._assigner.assign(panels, since=began)
        if self._assigner.resend_crossed():
            self._quiet_pause.begin()
        self._camera_pause.begin()

    def _follow(self) -> None:
        """Have the cameras follow what was drawn, once a user holds nothing and nothing changes."""
        # A release that comes meanwhile calls this again.
        self._follows_at_release = True
        if self._is_held():
            return
        self._follows_at_release = False
        self.services.cameras.follow(self._server.get_clients().values())

    def _is_held(self) -> bool:
        """Whether a user holds a control, as during a drag."""
        clients, now = self._server.get_clients(), clock.moment_of(time.time())
        return any(self._presses.at(number, now) is not None for number in clients)

    def _forget(self, who: int) -> None:
        self._presses.forget(who)
        self._follow_after_release()

    def _follow_after_release(self) -> None:
        if self._follows_at_release:
            self._camera_pause.begin()

    def _panel_updates(self, frame: Frame, *, is_dragged: bool) -> list[Update]:
        """Return the updates of all panels for a frame; of a few in turn while there is no time.

        That is so during a drag, whose next change must not wait, until it pauses.
        """
        began = time.monotonic()
        updates: list[Update] = []
        for _ in range(len(self._panels)):
            is_hurried = is_dragged or self.session.has_changes
            if is_hurried and time.monotonic() - began > PANELS_SECONDS:
                self._drag_pause.begin()
                break
            updates.extend(self._panels[0].updates(frame))
            self._panels.rotate(-1)
        return updates

    def _placed(self) -> Placed:
        floors = (each.floor(self.services) for each in self._features if each.floor is not None)
        floor = next((floor for floor in floors if floor is not None), None)
        return Placed(self._frame, floor)

    def corners(self) -> FloatArray:
        """Return the points of all that a picture must show, shape (n, 3)."""
        placed = self._placed()
        return np.concatenate([part.corners(placed) for part in self._scene])

    def _complain(self, message: str, who: Who) -> None:
        self._notify(REFUSAL, message, who)

    def _tell(self, message: str, who: Who = None) -> None:
        """Notify a browser, or all for None, of what no request caused and nobody need mend."""
        self._notify(NOTE, message, who, NOTICE)

    def _warn(self, message: str, who: Who = None) -> None:
        """Notify a browser, or all for None, of what no request caused and is amiss."""
        self._notify(NOTE, message, who)

    def _show_saving(self, message: str) -> None:
        # The bar shows whether saving fails, also to browsers that come later.
        if self._server.get_clients():
            self._warn(message)
        self.session.redraw()

    def _report(self, error: Exception) -> None:
        message = log_error(
            f"In the explorer itself: {error}", "".join(traceback.format_exception(error))
        )
        self._notify("Something went wrong", message, None)

    def _notify(self, title: str, message: str, who: Who, colour: Colour = WARNING) -> None:
        now, notice = clock.now(), (message, who)
        if now - self._notified.get(notice, -NOTICE_SECONDS) < NOTICE_SECONDS:
            return
        self._notified = {n: t for n, t in self._notified.items() if now - t < NOTICE_SECONDS}
        self._notified[notice] = now
        with self._pending_lock:
            clients = self._server.get_clients()
            if who is None and not clients:
                self._pending.append((title, message, colour))
                del self._pending[:-MOST_PENDING]
        for client_id, client in clients.items():
            if who is None or client_id == who:
                client.add_notification(
                    title, message, auto_close_seconds=NOTICE_SECONDS, color=colour
                )

    def _show_pending(self, client: viser.ClientHandle) -> None:
        """Show a new browser the notices that came while there was none, until it closes them."""
        with self._pending_lock:
            pending, self._pending = self._pending, []
        for title, message, colour in pending:
            client.add_notification(title, message, color=colour)
