"""The page of one server: scene and panels, drawn from the session's frames."""

from __future__ import annotations

import sys
import time
import traceback
from typing import get_args

import numpy as np
import viser

from explorer.app.actions import SetPose
from explorer.app.assigning import Assigner
from explorer.app.jobs import Worker
from explorer.app.optimiser import Optimiser
from explorer.app.panels.design import DesignPanel
from explorer.app.panels.jog import JogPanel
from explorer.app.panels.legs import LegsPanel
from explorer.app.panels.move import MovePanel
from explorer.app.panels.optimise import OptimisePanel
from explorer.app.panels.paths import PathsPanel
from explorer.app.panels.prototype import PrototypePanel, assembly_name
from explorer.app.panels.singularity import SingularityPanel
from explorer.app.panels.view import ViewPanel
from explorer.app.panels.workspace import WorkspacePanel, tolerance_of
from explorer.app.panels.workspace_numbers import WorkspaceNumbers
from explorer.app.parts_feed import PartsFeed
from explorer.app.path_runner import PathRunner
from explorer.app.scene import Scene
from explorer.app.scene.camera import Cameras, ViewName, framing
from explorer.app.scene.placing import Placed, scene_scale
from explorer.app.session import Session, Who
from explorer.app.state import Frame, State
from explorer.app.strata_feed import StrataFeed
from explorer.app.tasks import Region, Rows, exported_name
from explorer.app.workspace_feed import (
    RadiusFeed,
    WorkspaceFeed,
    workspace_rows,
    workspace_start,
)
from explorer.design_file import encode_design
from explorer.export.trajectory import trajectory_csv
from explorer.home import home_pose
from explorer.pose import Pose, Triple

TITLE = "Flagged 4-4 explorer"
BRAND = (24, 74, 150)
# One complaint is shown this long, and not again within it.
COMPLAINT_SECONDS = 6.0
# While events come faster than frames, the figures are told this often.
FIGURES_SECONDS = 0.1
# Between two looks at a run that is waited for.
WAIT_SECONDS = 0.02
VIEW_LABELS: dict[str, ViewName] = {name.capitalize(): name for name in get_args(ViewName)}


class Page:
    """Draws frames on a viser server and posts what people do to the session.

    Args:
        server: On which everything is drawn.
        state: The first state.
        docked: Whether the panels lie beside the scene, rather than over it.
    """

    def __init__(self, server: viser.ViserServer, state: State, *, docked: bool = True) -> None:
        self._server = server
        self._complained: dict[str, float] = {}
        self._told = 0.0
        self._frame = Frame(state)
        self._assigner = Assigner(server)
        self.session = Session(state, self._draw, self._complain, self._report)
        self.worker = Worker(lambda message: self._complain(message, None))
        self.feed = WorkspaceFeed(self.worker, self.session.redraw)
        self.radius_feed = RadiusFeed(self.worker, self.session.redraw)
        self.strata_feed = StrataFeed(self.worker, self.session.redraw)
        self.parts_feed = PartsFeed(self.worker, self.session.redraw)
        self.path_runner = PathRunner(self.session, lambda message: self._complain(message, None))
        gui = server.gui
        gui.configure_theme(
            show_logo=False, show_share_button=False, control_width="large", brand_color=BRAND
        )
        gui.set_panel_label(TITLE)
        self.optimiser = Optimiser(
            self.session,
            lambda message: self._complain(message, None),
            lambda: self.feed.is_settled,
        )
        self._scene = Scene(server, self.feed)
        self._cameras = Cameras(self._placed)
        self._add_view_buttons(gui)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Move"):
            move = MovePanel(gui, self.session)
            jog = JogPanel(gui, self.session)
        with tabs.add_tab("Design"):
            design = DesignPanel(gui, self.session)
        with tabs.add_tab("Workspace"):
            self._workspace = WorkspacePanel(gui, self.session, self._export)
        with tabs.add_tab("Optimise"):
            self._optimise = OptimisePanel(gui, self.session, self._export_hull, self._save_design)
        with tabs.add_tab("View"):
            self._prototype = PrototypePanel(gui, self.session, self._export_assembly)
            view = ViewPanel(gui, self.session)
        side = gui.add_panel()
        with side.add_tab("Singularity"):
            self._singularity = SingularityPanel(gui, self.session)
        with side.add_tab("Workspace"):
            self._numbers = WorkspaceNumbers(gui)
        with side.add_tab("Legs"):
            self._legs = LegsPanel(gui, self.session)
        with side.add_tab("Paths"):
            paths = PathsPanel(gui, self.session, self._save_path)
        self._panels = (move, jog, design, view, paths)
        if docked:
            gui.main_panel.dock_right()
            gui.main_panel.set_width(350)
            side.dock_left()
            side.set_width(286)

        self._scene.drag_handle.handle.on_update(self._dragged)
        self._aim_initial_camera()
        server.on_client_connect(self._cameras.connected)
        server.on_client_disconnect(self._cameras.disconnected)
        self._draw(self._frame)

    def stop(self) -> None:
        """End the session and the worker."""
        self.session.stop()
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

    def _add_view_buttons(self, gui: viser.GuiApi) -> None:
        buttons = gui.add_button_group(
            "View", tuple(VIEW_LABELS), hint="Frame the mechanism from one of four sides."
        )

        @buttons.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            if event.client is not None:
                self._cameras.point(event.client, VIEW_LABELS[buttons.value])

    def _draw(self, frame: Frame) -> None:
        self._frame = frame
        # First, so that what is asked for is called out of date until it arrives.
        for feed in (self.feed, self.radius_feed, self.strata_feed, self.parts_feed):
            feed.follow(frame)
        # The mechanism follows the hand before the figures do, which nobody reads meanwhile.
        self._assigner.assign(self._scene.updates(self._placed()))
        self.optimiser.follow(frame)
        self.path_runner.follow(frame)
        now = time.monotonic()
        if self.session.has_more and now - self._told < FIGURES_SECONDS:
            return
        self._told = now
        updates = list(self._optimise.updates(frame))
        for panel in self._panels:
            updates.extend(panel.updates(frame))
        for panel in (self._workspace, self._numbers):
            updates.extend(panel.updates(frame, self.feed))
        updates.extend(self._legs.updates(frame, self.radius_feed))
        updates.extend(self._singularity.updates(frame, self.strata_feed))
        updates.extend(self._prototype.updates(frame, self.parts_feed))
        self._assigner.assign(updates)

    def _placed(self) -> Placed:
        drawing = self.feed.drawing
        extent = None if drawing is None else drawing.extent
        box = None if extent is None else np.array(extent)
        return Placed(self._frame, box, self.parts_feed.parts)

    def _dragged(self, event: viser.TransformControlsEvent) -> None:
        if event.client_id is None:
            return
        handle = self._scene.drag_handle.handle

        def change(state: State) -> SetPose:
            x, y, z = (np.asarray(handle.position) / scene_scale(state)).tolist()
            w, i, j, k = np.asarray(handle.wxyz, dtype=np.float64).tolist()
            return SetPose(Pose((x, y, z), (w, i, j, k)))

        self.session.post("drag", change, stamp=handle.update_timestamp, who=event.client_id)

    def _export(self, what: str, file_format: str, client_id: int | None) -> None:
        state = self.session.state
        frame, region = Frame(state), state.view.workspace.region
        start = workspace_start(frame)
        self._send_mesh(client_id, what, file_format, workspace_rows(frame), region, start)

    def _export_hull(self, client_id: int | None) -> None:
        """Send the hull of the workspace that is optimised: at the orientation of home."""
        rotation = home_pose(self.session.state.design).rotation
        rows = tuple(tuple(row) for row in rotation.tolist())
        self._send_mesh(client_id, "hull", self._workspace.file_format, rows, "limits", None)

    def _send_mesh(
        self,
        client_id: int | None,
        what: str,
        file_format: str,
        rotation: Rows,
        region: Region,
        start: Triple | None,
    ) -> None:
        client = self._client(client_id)
        if client is None:
            return
        state = self.session.state
        name = f"{state.design.name}-{exported_name(region, what).replace(' ', '-')}"
        self.worker.submit(
            ("export", client_id, what),
            "export_mesh",
            (state.design, rotation, tolerance_of(state), region, start, what, file_format),
            lambda data: client.send_file_download(
                f"{name}.{file_format}", data, save_immediately=True
            ),
            lambda problem: self._complain(problem, client_id),
        )

    def _export_assembly(self, file_format: str, client_id: int | None) -> None:
        client = self._client(client_id)
        if client is None:
            return
        design = self.session.state.design
        name = f"{design.name}-{assembly_name(file_format)}"
        self.worker.submit(
            ("export", client_id, "assembly"),
            "export_assembly",
            (design, file_format),
            lambda data: client.send_file_download(name, data, save_immediately=True),
            lambda problem: self._complain(problem, client_id),
        )

    def _save_design(self, client_id: int | None) -> None:
        client = self._client(client_id)
        if client is not None:
            design = self.session.state.design
            data = encode_design(design)
            client.send_file_download(f"{design.name}.json", data, save_immediately=True)

    def _save_path(self, client_id: int | None) -> None:
        client, journey = self._client(client_id), self.session.state.journey
        if client is not None and journey is not None:
            data = trajectory_csv(journey.trajectory).encode()
            name = f"{journey.design.name}-path.csv"
            client.send_file_download(name, data, save_immediately=True)

    def _client(self, client_id: int | None) -> viser.ClientHandle | None:
        return self._server.get_clients().get(-1 if client_id is None else client_id)

    def _aim_initial_camera(self) -> None:
        eye, target = framing(Placed(self._frame), "isometric", aspect=1.2)
        camera = self._server.initial_camera
        camera.position, camera.look_at = eye, target

    def _complain(self, message: str, who: Who) -> None:
        now = time.monotonic()
        if now - self._complained.get(message, -COMPLAINT_SECONDS) < COMPLAINT_SECONDS:
            return
        self._complained = {
            m: t for m, t in self._complained.items() if now - t < COMPLAINT_SECONDS
        }
        self._complained[message] = now
        clients = self._server.get_clients()
        for client_id, client in clients.items():
            if who is None or client_id == who:
                client.add_notification(
                    "That is not possible",
                    message,
                    auto_close_seconds=COMPLAINT_SECONDS,
                    color="orange",
                )

    def _report(self, error: Exception) -> None:
        traceback.print_exception(error, file=sys.stderr)
        self._complain(f"Something went wrong in the explorer itself: {error}", None)
