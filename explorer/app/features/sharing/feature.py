"""The dialog of all files that the page offers, and those of the view, the scene and the report."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Iterator
from functools import partial
from html import escape

import numpy as np
import viser

from explorer.app.features.feature import Feature, FileExport, Services, Tab
from explorer.app.features.optimise.state import Optimisation
from explorer.app.features.paths.actions import request_for
from explorer.app.features.prototype.building import BuildVerdict
from explorer.app.features.requirement.state import Required
from explorer.app.features.sharing import scene_files
from explorer.app.features.sharing.links import decode_link, encode_link, open_link
from explorer.app.features.sharing.reporting import ReportFormat, make_report
from explorer.app.scene.camera import has_perspective
from explorer.app.scene.placing import scene_scale
from explorer.app.session.session import Who
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import extra_button, open_button, press_button
from explorer.app.widgets.downloads import File
from explorer.app.widgets.markup import box, sentence
from explorer.errors import InputError
from explorer.export.controller import kernel_files
from explorer.export.drawings.figure import COLUMN, PAGE, figure_svg
from explorer.export.drawings.mechanism import Projection
from explorer.export.linuxcnc import linuxcnc_files
from explorer.export.moving_page import moving_page
from explorer.files.extras import is_missing
from explorer.files.writing import zip_bytes
from explorer.mechanism.design import Design
from explorer.page.browser.viser_gaps import run_script_in
from explorer.page.look import call_script, read_script
from explorer.page.widgets.assigning import Update

PRESS = "export"
# Names of presses that copy the link to the state, and that open one.
COPY, OPEN_LINK = "link.copy", "link.open"
# Decimals of the direction of a camera in a link.
DIGITS = 4
LINK_HINT = "It opens this design, requirement, pose and view in any explorer or moving page."
PICTURES = {
    "PNG 1920 × 1080": ((1920, 1080), False),
    "PNG 3840 × 2160": ((3840, 2160), False),
    "PNG twice as shown": (None, False),
    "PNG transparent": (None, True),
}
"""Formats of pictures: width and height, None for twice those in the browser; if transparent."""
FIGURES = {
    f"SVG {width:g} mm{', black' if black else ''}": (width, black)
    for black in (False, True)
    for width in (COLUMN, PAGE)
}
"""Forms of figures: the width in millimetres, and whether they are black."""
REPORTS: dict[str, ReportFormat] = {"HTML": "html", "PDF": "pdf"}
# Extras that formats need.
EXTRA_OF_FORMAT = {"STEP": "cad", "PDF": "screenshot"}
# Background of the scene on viser's page, by whether it is dark.
BACKGROUNDS = {False: (255, 255, 255), True: (20, 20, 20)}


def send_picture(services: Services, name: str, who: Who) -> None:
    """Send the view of a browser as PNG in one of `PICTURES`, drawn by that browser."""
    size, transparent = PICTURES[name]

    def make(client: viser.ClientHandle) -> File:
        sides = size or scene_files.double_size(client)
        background = None if transparent else BACKGROUNDS[services.theme.is_dark_for(who)]
        data = scene_files.view_picture(client, sides, background)
        return f"{services.session.state.design.name}-{sides[0]}x{sides[1]}.png", data

    services.downloads.make(who, "Drawing the picture", make)


def send_figure(services: Services, width: float, who: Who, *, black: bool) -> None:
    """Send the mechanism from the camera of a browser as SVG, as wide as stated, in millimetres."""

    def make(client: viser.ClientHandle) -> File:
        state = services.session.latest_state()
        eye, target = (
            np.asarray(point) / scene_scale(state)
            for point in (client.camera.position, client.camera.look_at)
        )
        view = Projection.of_camera(eye, target, perspective=has_perspective(target - eye))
        snapshot, tetrahedra = Frame(state).snapshot, state.view.tetrahedra
        data = figure_svg(snapshot, view, width, black=black, tetrahedra=tetrahedra)
        return f"{state.design.name}-figure.svg", data

    services.downloads.make(who, "Drawing the figure", make)


def send_scene(services: Services, who: Who) -> None:
    """Send the scene as an HTML file with the present camera of the browser."""

    def make(client: viser.ClientHandle) -> File:
        state, date = services.session.latest_state(), dt.datetime.now().astimezone().date()
        eye = client.camera
        camera = scene_files.camera_messages(eye.position, eye.look_at, float(eye.fov))
        theme, dark = services.theme, services.theme.is_dark_for(who)
        data = scene_files.scene_html(
            services.server, state, camera, theme.messages(dark=dark), date=date, dark=dark
        )
        return f"{state.design.name}-scene.html", data

    services.downloads.make(who, "Packing the scene", make)


def send_report(services: Services, file_format: ReportFormat, who: Who) -> None:
    """Send the report of the design in its present pose."""
    state = services.session.latest_state()
    asked, needed = request_for(state), Required.of(state).requirement
    path, record = asked and asked[1], Optimisation.of(state).record
    told = state.design, state.pose, record, file_format, path, needed
    services.downloads.compute(
        who,
        f"{state.design.name}-report.{file_format}",
        make_report,
        (*told, state.view.lengths == "mm"),
        ("Writing the report", "This takes some seconds."),
    )


def sender_of(
    ending: str, write: Callable[[Design], bytes]
) -> Callable[[Services, str, Who], None]:
    """Return the function that sends what `write` makes of the design, as NAME and an ending."""

    def send(services: Services, _: str, who: Who) -> None:
        design = services.session.latest_state().design
        name = f"{design.name}{ending}"
        services.downloads.make(who, "Writing the file", lambda _: (name, write(design)))

    return send


class ExportDialog:
    """Whether the machine can be built, and a row for each thing."""

    def __init__(self, services: Services) -> None:
        gui, buttons = services.gui, services.buttons
        self._ready: tuple[bool, ...] = ()
        sends: dict[str, Callable[[Who], None]] = {}
        self._exports = tuple(each for one in services.features for each in one.exports)
        for each in self._exports:
            for name in each.formats:
                value = f"{each.title} as {name}"
                if is_missing(EXTRA_OF_FORMAT.get(name)):
                    continue
                sends[value] = partial(each.send, services, name)
                ready = partial(each.is_ready, services)
                buttons.offer(f"Export › {each.title} › {name}", each.hint, PRESS, value, ready)
        buttons.on(PRESS, lambda value, client: sends[value](client.client_id), values=sends)
        self._verdict, self._built = services.get(BuildVerdict), gui.add_html("")
        self._services, self._list = services, gui.add_html("")

    def updates(self, _: Frame) -> Iterator[Update]:
        """Yield the updates that show whether the machine can be built, and what there is now."""
        yield self._built, "content", box(self._verdict.html())
        ready = tuple(each.is_ready(self._services) for each in self._exports)
        if ready != self._ready:
            self._ready = ready
            rows = map(_row, self._exports, ready)
            yield self._list, "content", box("".join(rows))


def _row(export: FileExport, is_ready: bool) -> str:
    """Return a thing and the buttons of its formats, as HTML."""
    buttons = "".join(
        extra_button(EXTRA_OF_FORMAT[name])
        if is_missing(EXTRA_OF_FORMAT.get(name))
        else press_button(
            PRESS,
            f"{export.title} as {name}",
            escape(name),
            label=f"Export {export.title} as {name}",
            class_name="ex-button",
            is_disabled=not is_ready,
        )
        for name in export.formats
    )
    return (
        f'<div class="ex-export"><div><b>{escape(export.title)}</b>'
        f'<div class="ex-dim">{escape(export.hint)}</div></div>'
        f'<div class="ex-flow">{buttons}</div></div>'
    )


class ShareButtons:
    """The buttons of the bar that copy a link to the state, and that open the dialog.

    A script of the page sends the fragment of its address, which is opened.
    """

    def __init__(self, services: Services) -> None:
        self._services, buttons, server = services, services.buttons, services.server
        buttons.on(COPY, lambda _, client: self._copy(client))
        buttons.on(OPEN_LINK, self._open)
        buttons.offer("Export › Copy link", LINK_HINT, COPY)
        server.on_client_connect(
            lambda client: run_script_in(client, call_script("openLink", OPEN_LINK))
        )

    def __call__(self, _: Frame) -> str:
        """Return the buttons as HTML."""
        hint = "Download the workspace, the mechanism, pictures, reports and more."
        look = "ex-tool ex-outlined"
        copies = press_button(COPY, "", "Copy link", hint=LINK_HINT, class_name=look)
        return copies + open_button("Export", "Export", hint=hint, class_name=look)

    def _copy(self, client: viser.ClientHandle) -> None:
        try:
            state, cameras = self._services.session.latest_state(), self._services.cameras
            x, y, z = (round(part, DIGITS) for part in cameras.direction(client))
            fragment = encode_link(state, (x, y, z))
        except InputError as error:
            self._services.complain(sentence(str(error)), client.client_id)
            return
        run_script_in(client, read_script("copies") + call_script("copyLink", fragment))
        client.add_notification("The link is copied", LINK_HINT, auto_close_seconds=6.0)

    def _open(self, fragment: str, client: viser.ClientHandle) -> None:
        try:
            link = decode_link(fragment)
        except InputError as error:
            self._services.complain(sentence(str(error)), client.client_id)
            return
        self._services.session.do(open_link(link), who=client.client_id)
        if link.towards is not None:
            self._services.cameras.turn(client, link.towards)


SHARING = Feature(
    "sharing",
    manual="cad.md",
    tabs=(Tab("dialog", "Export", ExportDialog),),
    bar=(("right", ShareButtons),),
    exports=(
        FileExport(
            "Report",
            "The design in its pose on a few pages: drawings, slices, tables, limits.",
            tuple(REPORTS),
            lambda services, name, who: send_report(services, REPORTS[name], who),
        ),
        FileExport(
            "Picture",
            "The scene with its labels, from your camera.",
            tuple(PICTURES),
            send_picture,
        ),
        FileExport(
            "Figure",
            "The mechanism from your camera for a paper, as wide as a column or a page.",
            tuple(FIGURES),
            lambda services, name, who: send_figure(
                services, FIGURES[name][0], who, black=FIGURES[name][1]
            ),
        ),
        FileExport(
            "Scene",
            "One file to turn and zoom in any browser, without network.",
            ("HTML",),
            lambda services, _, who: send_scene(services, who),
        ),
        FileExport(
            "Moving page",
            "A small file with sliders in which the mechanism moves, for lessons and papers.",
            ("HTML",),
            sender_of("-moving.html", moving_page),
        ),
        FileExport(
            "Kernel for controllers",
            "Kinematics and limits of the design as C99 source, in millimetres.",
            ("C (zip)",),
            sender_of("-kernel.zip", lambda design: zip_bytes(kernel_files(design))),
        ),
        FileExport(
            "Configuration for LinuxCNC",
            "Kinematics, limits and home of the design, to run in simulation at first.",
            ("INI (zip)",),
            sender_of("-linuxcnc.zip", lambda design: zip_bytes(linuxcnc_files(design))),
        ),
    ),
)
