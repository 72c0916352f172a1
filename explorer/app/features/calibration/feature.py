"""*Calibration*: a table of what was measured is dropped, and the machine is told and saved."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache, partial

from explorer.app.features.feature import Feature, Services, Tab, html_of
from explorer.app.inputs.controls import Controls
from explorer.app.session.feed import FeedOf
from explorer.app.session.session import Who
from explorer.app.state.actions import Action, Set
from explorer.app.state.frame import Frame
from explorer.app.state.parts import FeaturePart
from explorer.app.widgets.blocks import render
from explorer.app.widgets.markup import box, dim
from explorer.calibration.identify import Calibration, calibrate
from explorer.calibration.machine_file import encode_machine
from explorer.calibration.measurement import setup_of
from explorer.calibration.words import calibration_blocks
from explorer.errors import InputError
from explorer.export.measured_tables import kind_of, read_measured
from explorer.export.pose_tables import parse_table
from explorer.files.json_text import decode_text
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import typical_machine
from explorer.page.widgets.assigning import Update

DROP = "Drop a table of joints and of what was measured there on the page (CSV)."
NAMES = {"measured": "Measured table", "targets": "Target positions"}


@dataclass(frozen=True)
class Calibrated(FeaturePart, name="calibrated"):
    """What was measured of a machine, as text of tables, "" for none, and how well it is known.

    Attributes:
        sigma: Standard deviation of measured lengths, in millimetres.
        sigma_turn: Standard deviation of measured turns, in degrees.
    """

    measured: str = ""
    targets: str = ""
    sigma: float = 0.01
    sigma_turn: float = 0.005

    def on_open(self) -> Calibrated:
        """Return the part for another design, of which nothing was measured."""
        return replace(self, measured="", targets="")


def calibrate_table(request: tuple[Design, Calibrated]) -> Calibration:
    """Return the machine of a design in tables; tolerances that it does not state are typical."""
    design, part = typical_machine(request[0])[0], request[1]
    table = parse_table(NAMES["measured"], part.measured.encode(), design.unit_mm)
    points = None
    if part.targets:
        places = parse_table(NAMES["targets"], part.targets.encode(), design.unit_mm)
        points = places.numbers(*"xyz")
    kind = kind_of(table)
    if kind in ("bar", "gauge"):
        raise InputError("of bars and gauges explorer calibrate takes the setup, not the page")
    setup = setup_of(design, kind, points, part.sigma, part.sigma_turn)
    return calibrate(design, *read_measured(table, design, setup))


def _request_for(frame: Frame) -> tuple[Design, Calibrated] | None:
    part = Calibrated.of(frame.state)
    return (frame.state.design, part) if part.measured else None


CALIBRATION_FEED = FeedOf(calibrate_table, _request_for, process="calibrate", in_scene=False)


@lru_cache(2)
def machine_html(found: Calibration) -> str:
    """Return what a calibration tells as HTML."""
    return render(calibration_blocks(found))


class CalibrationPanel:
    """How well lengths and turns are known, what the table tells of the machine, and its file."""

    def __init__(self, services: Services) -> None:
        gui, self._services = services.gui, services
        self._feed, self._controls = services.get(CALIBRATION_FEED), Controls(services)
        with self._controls.folder("Calibration", is_open=False):
            for label, field, step, of in (
                ("σ of lengths (mm)", "sigma", 0.001, "lengths"),
                ("σ of turns (°)", "sigma_turn", 0.001, "turns of the platform"),
            ):
                hint = f"Standard deviation of measured {of}, where the table states none."
                self._controls.number(label, hint, f"calibrated.{field}", least=1e-6, step=step)
            hint = "Download the machine, for --machine of the explorer's commands."
            self._download = gui.add_button("Download machine", hint=hint, color=None)
            self._download.on_click(lambda event: self._send(event.client_id))
            services.commands.offer(self._download, lambda client: self._send(client.client_id))
            self._forget = self._controls.button(
                "Forget the table",
                "Forget what was measured; undo brings it back.",
                lambda: Set("calibrated.measured", "", NAMES["measured"], "forgotten"),
            )
            self._result = gui.add_html("")

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that tell the machine of a frame."""
        yield from self._controls.updates(frame)
        content, has_table = box(dim(DROP)), bool(Calibrated.of(frame.state).measured)
        yield self._forget, "visible", has_table
        if has_table:
            told = html_of(self._feed, machine_html, "No machine")
            assumed = "; ".join(typical_machine(frame.state.design)[1])
            note = dim(f"Assumed, since the design states none: {assumed}.")
            content = f"{told}{box(note) if assumed else ''}"
        yield self._result, "content", content
        found = self._feed.drawing
        yield self._download, "visible", found is not None and found.gains

    def _send(self, who: Who) -> None:
        found = self._feed.drawing
        if found is not None and found.gains:
            data = encode_machine(found.machine, found.unseen)
            self._services.downloads.send(who, "machine.json", data)


def open_table(field: str, _: Services, data: bytes, name: str) -> tuple[Action, str]:
    """Return the action that takes a table, "measured" or "targets"."""
    action = Set(f"calibrated.{field}", decode_text(data, "cp1252"), NAMES[field], name)
    words = f"{NAMES[field]} of the calibration, in the tab Loads"
    return action, f"{words}. Poses of a path are opened in the tab Paths, by Poses from a file."


CALIBRATION = Feature(
    "calibration",
    manual="calibration.md",
    tabs=(Tab("analyse", "Loads", CalibrationPanel),),
    openers={"l1": partial(open_table, "measured"), "x,y,z": partial(open_table, "targets")},
    later_feeds=(CALIBRATION_FEED,),
)
