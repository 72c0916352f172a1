"""*Calibration*: a table of what was measured is dropped, and the machine is told and saved."""

from __future__ import annotations

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


class CalibrationPanel(Controls):
    """How well lengths and turns are known, what the table tells of the machine, and its file."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        self._feed, self._downloads = services.get(CALIBRATION_FEED), services.downloads
        with self.folder("Calibration", is_open=False):
            for label, field, step, of in (
                ("σ of lengths (mm)", "sigma", 0.001, "lengths"),
                ("σ of turns (°)", "sigma_turn", 0.001, "turns of the platform"),
            ):
                hint = f"Standard deviation of measured {of}, where the table states none."
                self.number(label, hint, f"calibrated.{field}", least=1e-6, step=step)
            hint = "Download the machine, for --machine of the explorer's commands."
            download = self.press("Download machine", hint, self._send)
            forget = self.button(
                "Forget the table",
                "Forget what was measured; undo brings it back.",
                lambda: Set("calibrated.measured", "", NAMES["measured"], "forgotten"),
            )
            self.markup(self._result)
        self.follow(forget, "visible", lambda frame: bool(Calibrated.of(frame.state).measured))
        self.follow(download, "visible", lambda _: self._gain is not None)

    def _result(self, frame: Frame) -> str:
        if not Calibrated.of(frame.state).measured:
            return box(dim(DROP))
        told = html_of(self._feed, machine_html, "No machine")
        assumed = "; ".join(typical_machine(frame.state.design)[1])
        note = dim(f"Assumed, since the design states none: {assumed}.")
        return f"{told}{box(note) if assumed else ''}"

    @property
    def _gain(self) -> Calibration | None:
        """The calibration, if it tells more of the machine than was known."""
        found = self._feed.drawing
        return found if found is not None and found.gains else None

    def _send(self, who: Who) -> None:
        found = self._gain
        if found is not None:
            data = encode_machine(found.machine, found.unseen)
            self._downloads.send(who, "machine.json", data)


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
