"""The form and the visible parts of the mechanism, the ground, and the views of the camera."""

from __future__ import annotations

from collections.abc import Mapping

import viser

from explorer.app.features.feature import Feature, InBar, Services, StateCommand, Tab
from explorer.app.features.view.ground import Ground
from explorer.app.inputs.controls import Controls
from explorer.app.scene.camera import VIEWS, ViewName
from explorer.app.state.actions import Action, Set, draw_as
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.state.view import DrawnAs
from explorer.app.widgets.assigning import Updates
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.chips import Chip, Chips, Effect
from explorer.app.widgets.markup import box
from explorer.app.widgets.palette import Key, shift, with_keys
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

LAYERS = {
    "Flags": "flags",
    "Bodies": "bodies",
    "Legs": "legs",
    "Labels": "labels",
    "Drag handle": "handle",
    "Grid": "grid",
    "Leaves": "leaves",
    "Closest pair": "clearance",
    "Tool and payload": "machine",
}
"""The layers of the scene, and the field of the view that switches each."""

LAYER_HINTS = {
    "flags": "Points, lines and planes, coloured by proximity; they reach out to near gaps.",
    "bodies": "The plates of base and platform.",
    "legs": "Actuators, joints, carriages and guide.",
    "labels": "The names a1 … b4 of the attachment points, and δ1 … δ3 of the tetrahedra.",
    "handle": "Arrows and arcs that move the platform when dragged; small where they hide a gap.",
    "grid": "The ground grid; a corner of the scene tells the size of its squares.",
    "leaves": "The planes of the guide with b4 and of a1 with the line b2b3, and the three folds.",
    "clearance": "Mark the two legs that are closest to each other, and their clearance.",
    "machine": "The axes of the tool and a ball for the payload; the tab Machine sets both.",
}

PRESS = "view.camera"
FIT = "Fit"
LABELS: dict[str, ViewName] = {name.capitalize(): name for name in VIEWS}
CAMERA_HINTS = {
    **{label: f"Look at the mechanism from the {label.lower()}." for label in LABELS},
    "Isometric": "Look at the mechanism from a corner.",
    FIT: "Show the whole mechanism from where you look.",
}
VIEW_KEYS = {"Isometric": "0", "Front": "1", "Side": "3", "Top": "7", FIT: "F"}


class ViewPanel:
    """The form of the mechanism, and a switch for each layer of the scene."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._forms = _form_chips(services)
        self._form_row = gui.add_html("")
        self._controls = controls = Controls(gui, services.session)
        with gui.add_folder("Layers"):
            for label, name in LAYERS.items():
                controls.checkbox(label, LAYER_HINTS[name], f"view.{name}")
        with gui.add_folder("Tetrahedra"):
            for index, points in enumerate(TETRAHEDRA):
                controls.checkbox(
                    f"δ{index + 1}:  {' '.join(points)}",
                    f"The edges of the tetrahedron that is flat where δ{index + 1} is zero. Near "
                    "such a pose it is filled, and the gap that is left to it is drawn.",
                    f"view.tetrahedra.{index}",
                )

    def updates(self, frame: Frame) -> Updates:
        """Yield the updates that make the panel show the frame."""
        yield self._form_row, "content", box(self._forms.html(frame.state))
        yield from self._controls.updates(frame)


def _form_chips(services: Services) -> Chips:
    """Return the options of what the mechanism is drawn as; a press on one again goes back."""

    def chip(form: DrawnAs, hint: str, keys: tuple[Key, ...]) -> Chip:
        def is_on(state: State) -> bool:
            return state.view.drawn_as == form

        effect = Effect(lambda state: draw_as("schematic" if is_on(state) else form), is_on)
        return Chip(form.capitalize(), f"Show › Drawn as › {form}", hint, effect, keys=keys)

    chips = {form: chip(form, *words) for form, words in FORMS.items()}
    return Chips(services.buttons, services.session, "view.form", "Drawn as", chips)


class CameraButtons:
    """A button for each of the views that CAD programs offer, and one that fits all."""

    def __init__(self, services: Services) -> None:
        self._cameras = services.cameras
        services.buttons.on(PRESS, self._point, values=CAMERA_HINTS)
        self._markup = ""
        for label, hint in CAMERA_HINTS.items():
            keys = (Key(VIEW_KEYS[label]),)
            services.buttons.offer(f"View › {label}", hint, PRESS, label, keys=keys)
            words = with_keys(hint, keys)
            self._markup += press_button(PRESS, label, label, hint=words, class_name="ex-tool")

    def __call__(self, _: Frame) -> str:
        """Return the buttons as HTML."""
        return f'<span class="ex-views">{self._markup}</span>'

    def _point(self, label: str, client: viser.ClientHandle) -> None:
        if label == FIT:
            self._cameras.fit(client)
        else:
            self._cameras.point(client, LABELS[label])


def _toggle_tetrahedra(state: State) -> Action:
    on = not all(state.view.tetrahedra)
    return Set("view.tetrahedra", (on, on, on), "All tetrahedra", "on" if on else "off")


VIEW = Feature(
    "view",
    tabs=(Tab("build", "Show", ViewPanel, viser.Icon.EYE),),
    bar=(InBar("right", CameraButtons),),
    scene=(Ground,),
    commands=(
        StateCommand(
            "Show › All tetrahedra",
            "Show or hide the three tetrahedra that are flat where the mechanism is singular, and "
            "the gaps that are left to such poses.",
            _toggle_tetrahedra,
            keys=(Key("T"),),
        ),
    ),
    keys={
        "Show › Flags": (shift("F"),),
        "Show › Bodies": (Key("B"),),
        "Show › Legs": (shift("B"),),
        "Show › Labels": (Key("L"),),
        "Show › Grid": (Key("G"),),
        "Show › Drag handle": (shift("H"),),
        "Show › Closest pair": (shift("C"),),
    },
)
