"""The prototype: whether it is drawn, how far apart, what it consists of, and files of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from html import escape
from typing import Any

import viser

from explorer.app.features.prototype.feed import PartsFeed
from explorer.app.features.prototype.parts import Parts
from explorer.app.features.prototype.parts_list import PartsList
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.actions import SetView
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Controls, Span
from explorer.app.widgets.markup import DIM, alert
from explorer.export.assembly import FORMATS
from explorer.mechanism.design import LENGTHS
from explorer.prototype.bill import Actuator

SCHEMATIC, PROTOTYPE = "schematic", "prototype"
STEP = "step"
RIGHT = '<td style="text-align:right;white-space:nowrap">'
# Zipped STL files are the one format whose name is no suffix.
SUFFIXES = {"stl-zip": "parts-stl.zip"}

Export = Callable[[str, int | None], None]
"""Sends the assembly to one browser: in a format, to a client."""


class PrototypePanel:
    """Chooses the prototype, draws it apart, and lists and exports its parts."""

    def __init__(self, gui: viser.GuiApi, session: Session, export: Export) -> None:
        self._controls = controls = Controls(gui, session)
        with gui.add_folder("Mechanism"):
            controls.dropdown(
                "Drawn as",
                "Schematic legs and plates, or parts that can be made: sized from the design, "
                "the radii of its legs and its unit.",
                (SCHEMATIC, PROTOTYPE),
                lambda frame: PROTOTYPE if frame.state.view.prototype.shown else SCHEMATIC,
                lambda state, chosen: _changed(state, shown=chosen == PROTOTYPE),
                disabled=lambda state: state.view.twin,
            )
            self._trouble = gui.add_html("", visible=False)
        self._folder = gui.add_folder("Prototype", visible=False)
        with self._folder:
            controls.slider(
                "Drawn apart",
                "The exploded view: 0 together, 1 each part by itself.",
                lambda frame: frame.state.view.prototype.exploded,
                lambda state, value: _changed(state, exploded=value),
                lambda _: Span(0.0, 1.0, 0.01),
            )
            controls.number(
                "Density (kg/m³)",
                "Of all parts. Aluminium 2700, steel 7850, printed PLA 1240.",
                lambda frame: frame.state.view.prototype.density,
                lambda state, value: _changed(state, density=value),
                least=1.0,
                step=1.0,
            )
            self._bill = gui.add_html("")
            self._format = gui.add_dropdown(
                "Format",
                (*FORMATS, STEP),
                hint="Of the assembly in the home pose: 3MF in millimetres, with names and "
                "colours; GLB with the tree of joints; a zip with an STL for each part; STEP "
                "with exact faces, which needs the extra cad.",
            )
            button = gui.add_button(
                "Export assembly",
                icon=viser.Icon.DOWNLOAD,
                hint="Download the parts, assembled in the home pose.",
            )

            @button.on_click
            def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
                export(self._format.value, event.client_id)

    def updates(self, frame: Frame, feed: PartsFeed) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield from self._controls.updates(frame)
        trouble = trouble_of(frame, feed)
        yield self._trouble, "visible", trouble is not None
        if trouble is not None:
            yield self._trouble, "content", trouble
        yield self._folder, "visible", feed.parts is not None
        if feed.parts is not None:
            density = frame.state.view.prototype.density
            yield self._bill, "content", parts_table(feed.parts.listed, density)


def trouble_of(frame: Frame, feed: PartsFeed) -> str | None:
    """Return as HTML why there are no parts, or why they do not take the pose, if so."""
    if not frame.state.view.prototype.shown:
        return None
    if frame.state.view.twin:
        return alert("No prototype of the 6-4 twin", "Switch the twin off to see the parts.")
    if feed.problem is not None:
        return alert("The parts could not be made", feed.problem)
    drawing = feed.drawing
    if drawing is not None and drawing.refusal is not None:
        return alert("No prototype of this design", _sentence(drawing.refusal))
    if drawing is None or drawing.parts is None:
        return f'<div style="padding:4px 12px;{DIM}">Making the parts …</div>'
    return _hindered(frame, drawing.parts)


def _hindered(frame: Frame, parts: Parts) -> str | None:
    found = parts.prototype.broken_joint_limits(frame.state.pose.position, frame.snapshot.rotation)
    return alert("The parts do not take this pose", _sentence("; ".join(found))) if found else None


def parts_table(listed: PartsList, density: float) -> str:
    """Return the bill of materials as HTML: parts, then actuators.

    Args:
        listed: The parts of the prototype.
        density: Of all parts, in kg/m³.
    """
    rows = "".join(
        f'<tr><td style="padding:1px 0">{escape(line.name)}</td>{RIGHT}{line.count}</td>'
        f"{RIGHT}{line.stock}</td>{RIGHT}{_grams(line.mass(density))}</td></tr>"
        for line in listed.lines
    )
    actuators = "".join(
        f'<tr title="The limits ask for {_mm(a.asked.shortest)} to {_mm(a.asked.longest)} mm">'
        f'<td style="padding:1px 0">{LENGTHS[a.leg - 1]}, leg {a.leg}</td>'
        f"{RIGHT}{_mm(a.stroke.shortest)}</td>{RIGHT}{_mm(a.stroke.longest)}</td>"
        f"{RIGHT}{_mm(a.stroke.longest - a.stroke.shortest)}</td></tr>"
        for a in listed.actuators
    )
    table = '<table style="width:100%;border-collapse:collapse;margin-bottom:8px">'
    short = (
        ""
        if all(_is_enough(a) for a in listed.actuators)
        else f'<div style="{DIM};margin:-4px 0 8px">The limits ask for more than one rod in its '
        "cylinder has.</div>"
    )
    return (
        '<div style="padding:2px 12px 6px;font-size:12.5px;line-height:1.45;'
        'font-variant-numeric:tabular-nums">'
        f'<div style="font-size:15px;font-weight:600">{_weight(listed.mass(density))}</div>'
        f'<div style="{DIM};margin-bottom:6px">all parts; without the base '
        f"{_weight(listed.moving_mass(density))}</div>"
        f'{table}<tr style="{DIM}"><td>part</td>{RIGHT}count</td>{RIGHT}stock, mm</td>'
        f"{RIGHT}mass, g</td></tr>{rows}</table>"
        f'{table}<tr style="{DIM}"><td>actuator</td>{RIGHT}shortest</td>{RIGHT}longest</td>'
        f"{RIGHT}stroke, mm</td></tr>{actuators}</table>{short}</div>"
    )


def _is_enough(actuator: Actuator) -> bool:
    """Whether a stroke has all that the limits ask for, but for the last bits."""
    asked, stroke = actuator.asked, actuator.stroke
    slack = 1e-9 * asked.longest
    return stroke.shortest <= asked.shortest + slack and stroke.longest >= asked.longest - slack


def assembly_name(file_format: str) -> str:
    """Return how the name of a file of the assembly ends."""
    return SUFFIXES.get(file_format, f"mechanism.{file_format}")


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _mm(value: float) -> str:
    return f"{value:.1f}"


def _grams(value: float) -> str:
    return f"{value:,.1f}" if value < 1000.0 else f"{value:,.0f}"


def _weight(grams: float) -> str:
    return f"{grams:.1f} g" if grams < 1000.0 else f"{grams / 1000.0:.4g} kg"


def _changed(state: State, **changes: Any) -> Action:
    return SetView(replace(state.view, prototype=replace(state.view.prototype, **changes)))
