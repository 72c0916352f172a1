"""The panel of the visible parts of the scene."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from explorer.app.features.feature import Services
from explorer.app.inputs.controls import Controls
from explorer.app.state.actions import draw_as
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.state.view import DrawnAs
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.chips import Chip, Chips, Effect
from explorer.app.widgets.commands import Key, shift
from explorer.app.widgets.markup import box
from explorer.mechanism.margins import TETRAHEDRA

FORMS: Mapping[DrawnAs, tuple[str, tuple[Key, ...]]] = {
    "schematic": ("Legs and plates as simple bodies.", ()),
    "prototype": ("Parts that can be made; the tab Prototype lists them.", (Key("R"),)),
    "6-4 twin": (
        "Six legs: the same motion, with two legs from a1 and a2 in place of each carriage.",
        (shift("T"),),
    ),
}
"""Hint and keys of each form of the mechanism."""

LAYERS = (
    (
        "flags",
        "Flags",
        "Points, lines and planes, coloured by proximity; they reach out to near gaps.",
    ),
    ("bodies", "Bodies", "The plates of base and platform."),
    ("legs", "Legs", "Actuators, joints, carriages and guide."),
    (
        "labels",
        "Labels",
        "The names a1 … b4 of the attachment points, and δ1 … δ3 of the tetrahedra.",
    ),
    (
        "handle",
        "Drag handle",
        "Arrows and arcs that move the platform when dragged; small where they hide a gap.",
    ),
    ("grid", "Grid", "The ground grid; a corner of the scene tells the size of its squares."),
    (
        "leaves",
        "Leaves",
        "The planes of the guide with b4 and of a1 with the line b2b3, and the three folds.",
    ),
    (
        "clearance",
        "Closest pair",
        "Mark the two legs that are closest to each other, and their clearance.",
    ),
    (
        "machine",
        "Tool and payload",
        "The axes of the tool and a ball for the payload; the tab Machine sets both.",
    ),
)


class ViewPanel:
    """The form of the mechanism, and a switch for each layer of the scene."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._forms = _form_chips(services)
        self._form_row = gui.add_html("")
        self._controls = controls = Controls(gui, services.session)
        with gui.add_folder("Layers"):
            for name, label, hint in LAYERS:
                controls.checkbox(label, hint, f"view.{name}")
        with gui.add_folder("Tetrahedra"):
            for index, points in enumerate(TETRAHEDRA):
                controls.checkbox(
                    f"δ{index + 1}:  {' '.join(points)}",
                    f"The edges of the tetrahedron that is flat where δ{index + 1} is zero. Near "
                    "such a pose it is filled, and the gap that is left to it is drawn.",
                    f"view.tetrahedra.{index}",
                )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield self._form_row, "content", box(self._forms.html(frame.state))
        yield from self._controls.updates(frame)


def _form_chips(services: Services) -> Chips:
    """Return the options of what the mechanism is drawn as; a press on one again goes back."""

    def chip(form: DrawnAs) -> Chip:
        hint, keys = FORMS[form]

        def is_on(state: State) -> bool:
            return state.view.drawn_as == form

        effect = Effect(lambda state: draw_as("schematic" if is_on(state) else form), is_on)
        return Chip(form.capitalize(), f"Show › Drawn as › {form}", hint, effect, keys=keys)

    chips = {form: chip(form) for form in FORMS}
    return Chips(services.buttons, services.session, "view.form", "Drawn as", chips)
