"""The views of the camera, a menu of what the scene shows beside them, and the ground."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import viser

from explorer.app.features.feature import BarPart, Feature, Services, Tab, show
from explorer.app.features.mechanism import bodies
from explorer.app.inputs.controls import Controls
from explorer.app.scene.camera import VIEWS, ViewName
from explorer.app.scene.placing import Placed, ScenePart
from explorer.app.scene.shapes import add_label
from explorer.app.state.actions import Action, Set, draw_as
from explorer.app.state.state import State
from explorer.app.state.view import DrawnAs
from explorer.app.widgets.buttons import open_button, press_button
from explorer.app.widgets.chips import Chips, StateCommand
from explorer.app.widgets.markup import box
from explorer.mechanism.margins import TETRAHEDRA
from explorer.mechanism.rgb import Rgb
from explorer.numerics.arrays import FloatArray
from explorer.page.widgets.assigning import Updates
from explorer.page.widgets.palette import Key, shift, with_keys
from explorer.six_legged.files import TWIN

FORMS: Mapping[DrawnAs, tuple[str, tuple[Key, ...]]] = {
    "schematic": ("Legs and plates as simple bodies.", ()),
    "prototype": ("Parts that can be made; the tab Prototype lists them.", (Key("R"),)),
    "6-4 twin": (
        "Six legs: the same motion, with two legs from a1 and a2 in place of each carriage.",
        (shift("T"),),
    ),
}
"""Hint and keys of each form of the mechanism."""

OVERLAYS = "Overlays"
"""Title of the menu."""

LAYERS: dict[str, tuple[str, tuple[Key, ...]]] = {
    "Flags": ("flags", (shift("F"),)),
    "Bodies": ("bodies", (Key("B"),)),
    "Legs": ("legs", (shift("B"),)),
    "Labels": ("labels", (Key("L"),)),
    "Drag handle": ("handle", (shift("H"),)),
    "Grid": ("grid", (Key("G"),)),
    "Leaves": ("leaves", ()),
    "Closest pair": ("clearance", (shift("C"),)),
    "Tool and payload": ("machine", ()),
}
"""The layers of the scene: the field of the view that switches each, and the keys of its switch."""

LAYER_HINTS = {
    "flags": "Points, lines and planes, coloured by proximity; they reach out to near gaps.",
    "bodies": "The plates of base and platform.",
    "legs": "Actuators, joints, carriages and guide.",
    "labels": "The names a1 … b4 of the attachment points, and δ1 … δ3 of the tetrahedra.",
    "handle": "Arrows and arcs that move the platform when dragged.",
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


class OverlaysMenu(Controls):
    """The form of the mechanism, and a switch for each layer of the scene."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui, forms = services.gui, _form_chips(services)
        self.markup(lambda frame: box(forms.html(frame.state)))
        with gui.add_folder("Layers"):
            for label, (name, keys) in LAYERS.items():
                self.checkbox(label, LAYER_HINTS[name], f"view.{name}", keys=keys)
        with gui.add_folder("Tetrahedra"), services.commands.within("Tetrahedra"):
            for index, points in enumerate(TETRAHEDRA):
                self.checkbox(
                    f"δ{index + 1}:  {' '.join(points)}",
                    f"The edges of the tetrahedron that is flat where δ{index + 1} is zero. Near "
                    "such a pose it is filled, and the gap that is left to it is drawn.",
                    f"view.tetrahedra.{index}",
                )


def _form_chips(services: Services) -> Chips:
    """Return the options of what the mechanism is drawn as; a press on one again goes back."""
    chips = {
        form: StateCommand(
            f"{OVERLAYS} › Drawn as › {draw_as(form).text}",
            hint,
            lambda state, form=form: draw_as("schematic" if state.view.drawn_as == form else form),
            lambda state, form=form: state.view.drawn_as == form,
            keys=keys,
            words=draw_as(form).text.capitalize(),
        )
        for form, (hint, keys) in FORMS.items()
    }
    return Chips(services.buttons, services.session, "view.form", "Drawn as", chips)


def view_buttons(services: Services) -> BarPart:
    """Return a button for each of the views that CAD programs offer, one for all, and the menu."""
    cameras, markup = services.cameras, ""

    def point(label: str, client: viser.ClientHandle) -> None:
        if label == FIT:
            cameras.fit(client)
        else:
            cameras.point(client, LABELS[label])

    services.buttons.on(PRESS, point, values=CAMERA_HINTS)
    for label, hint in CAMERA_HINTS.items():
        keys = (Key(VIEW_KEYS[label]),)
        services.buttons.offer(f"View › {label}", hint, PRESS, label, keys=keys)
        words = with_keys(hint, keys)
        markup += press_button(PRESS, label, label, hint=words, class_name="ex-tool")
    hint = "Choose what the scene shows: the form of the mechanism, layers and tetrahedra."
    markup += open_button(OVERLAYS, OVERLAYS, hint=hint, class_name="ex-tool is-menu")
    views = f'<span class="ex-views" role="toolbar" aria-label="Views">{markup}</span>'
    return lambda _: views


def _toggle_tetrahedra(state: State) -> Action:
    on = not all(state.view.tetrahedra)
    return Set("view.tetrahedra", (on, on, on), "All tetrahedra", "on" if on else "off")


TO_SUN = np.array([-0.22, 0.3, 1.0])
"""Direction from the scene to the sun, so that shadows fall towards the isometric camera."""

# Colours of the light from above and from below, and the intensities of both lights.
SKY: Rgb = (255, 255, 255)
FROM_BELOW: Rgb = (112, 120, 150)
SKY_INTENSITY, SUN_INTENSITY = 2.0, 3.0
# The shadow lies below the lines of the grid, and both below the base plate.
GRID_BELOW, SHADOW_BELOW = 0.01, 0.03
# Colours of the grid and of the shadow, by whether the page is dark.
GRID: dict[bool, dict[str, Rgb]] = {
    False: {"cell_color": (226, 230, 236), "section_color": (203, 209, 218)},
    True: {"cell_color": (38, 41, 46), "section_color": (56, 61, 69)},
}
SHADOW: dict[bool, dict[str, Rgb]] = {
    False: {"color": (188, 192, 200)},
    True: {"color": (4, 4, 5)},
}
# Directions on the ground, in each of which an outline has a corner.
CORNERS = 32
ANGLES = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
OUTWARD = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)
# Radii of a flat disc of size one, (3, 2).
DISC = np.eye(3)[:, :2]
# Both plates, and as many legs as the twin has.
OUTLINES = 2 + len(TWIN)
# Rows that project a direction along the sun's rays on the ground.
PROJECTION = np.column_stack([np.eye(2), -TO_SUN[:2] / TO_SUN[2]])


class Ground(ScenePart):
    """The lights, the grid with the size of its squares, and the shadow.

    `labels.js` writes the size in a corner of the scene, or draws a bar of such a length where that
    is the same at every depth. The shadow is the outline of each body as the sun projects it on the
    ground, in closed form: viser's own lighting, an environment map and shadow maps, takes a
    software renderer four times as long, and three.js may keep drawing a mesh of another shape
    than it has while shadow maps come and go.
    """

    def __init__(self, services: Services) -> None:
        scene = services.scene
        scene.configure_environment_map(hdri=None)
        scene.configure_default_lights(enabled=False, cast_shadow=False)
        # Lights shine from where they are towards the origin.
        scene.add_light_hemisphere(
            "/lights/sky",
            sky_color=SKY,
            ground_color=FROM_BELOW,
            intensity=SKY_INTENSITY,
            position=(0.0, 0.0, 1.0),
        )
        scene.add_light_directional(
            "/lights/sun", intensity=SUN_INTENSITY, cast_shadow=False, position=tuple(TO_SUN)
        )
        self._scale = add_label(scene, "/ground/scale", "")
        self._grid = scene.add_grid(
            "/grid",
            width=60.0,
            height=60.0,
            fade_distance=46.0,
            fade_from="origin",
            shadow_opacity=0.0,
        )
        fans = np.stack(
            [np.zeros(CORNERS - 2, int), np.arange(1, CORNERS - 1), np.arange(2, CORNERS)], axis=1
        )
        faces = (CORNERS * np.arange(OUTLINES)[:, None, None] + fans).reshape(-1, 3)
        self._shadow = scene.add_mesh_simple(
            "/shadow",
            np.zeros((OUTLINES * CORNERS, 3)),
            faces,
            # Flat and of one tone, so that the cheapest material does.
            material="toon3",
        )
        services.theme.paint(self._grid, GRID)
        services.theme.paint(self._shadow, SHADOW)

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the ground of this frame."""
        view, lowest = placed.frame.state.view, ground_of(placed)
        yield from show(view.grid, self._grid, self._scale)
        # Of the sides of the squares, which the page draws.
        square = f"{placed.square_in_unit:.6g} {placed.frame.state.unit.name}"
        yield self._scale, "text", square
        yield self._grid, "cell_size", placed.square
        yield self._grid, "section_size", 5.0 * placed.square
        yield self._grid, "position", (0.0, 0.0, lowest - GRID_BELOW)
        outlines = shadow_outlines(placed, lowest)
        # Without the grid nothing says that there is a ground.
        yield self._shadow, "visible", view.grid and bool(outlines)
        vertices = np.zeros((OUTLINES, CORNERS, 3))
        if outlines:
            vertices[: len(outlines), :, :2] = outlines
        yield self._shadow, "vertices", vertices.reshape(-1, 3).astype(np.float32)
        yield self._shadow, "position", (0.0, 0.0, lowest - SHADOW_BELOW)


def ground_of(placed: Placed) -> float:
    """Return the height at which the base stands, in scene units."""
    if placed.floor is None:
        return bodies.PLATE_TOP - bodies.PLATE_THICKNESS
    return placed.scale * placed.floor


def shadow_outlines(placed: Placed, ground: float) -> list[FloatArray]:
    """Return the shadows of the drawn bodies and legs on a height, convex polygons (CORNERS, 2)."""
    view, p, size = placed.frame.state.view, placed.points, placed.thickness
    outlines: list[FloatArray] = []
    if view.bodies and placed.is_schematic:
        feet = np.array([p[name] * [1.0, 1.0, 0.0] for name in ("a1", "a2", "a3")])
        depths = (0.0, bodies.PLATE_THICKNESS)
        discs = np.concatenate([feet + [0.0, 0.0, bodies.PLATE_TOP - t] for t in depths])
        outlines.append(_outlines(discs, bodies.BASE_RADIUS * DISC, ground))
        rotation = placed.frame.snapshot.rotation
        local = np.array(list(placed.platform_points.values()))
        centres = local + [0.0, 0.0, bodies.PLATFORM_SHIFT * size * placed.facing]
        axes = bodies.PLATFORM_RADIUS * size * rotation[:, :2]
        outlines.append(_outlines(p["b4"] + centres @ rotation.T, axes, ground))
    if view.legs and (placed.is_schematic or view.is_twin):
        twin = [(p[base], p[tip]) for base, tip in TWIN]
        legs = np.array(twin) if view.is_twin else np.stack(placed.struts, axis=1)
        radii = np.zeros(len(twin)) if view.is_twin else placed.leg_radii
        radii = np.where(radii > 0.0, bodies.SHARES[0] * radii, bodies.AXIS_RADIUS)
        outlines += list(_outlines(legs, radii[:, None, None] * DISC, ground))
    return outlines


def _outlines(centres: FloatArray, axes: FloatArray, ground: float) -> FloatArray:
    """Return shadows (..., CORNERS, 2) of equal discs at (..., n, 3), two radii as (..., 3, 2)."""
    flat = (centres - [0.0, 0.0, ground]) @ PROJECTION.T
    # Farthest point of an ellipse in each direction, seen from its centre.
    ellipse = PROJECTION @ axes
    reach = OUTWARD @ ellipse
    lengths = np.linalg.norm(reach, axis=-1, keepdims=True)
    rim = (reach / np.maximum(lengths, 1e-9)) @ np.swapaxes(ellipse, -1, -2)
    farthest = np.argmax(flat @ OUTWARD.T, axis=-2)
    return np.take_along_axis(flat, farthest[..., None], axis=-2) + rim


VIEW = Feature(
    "view",
    manual="page.md",
    tabs=(Tab("dialog", OVERLAYS, OverlaysMenu),),
    bar=(("right", view_buttons),),
    scene=(Ground,),
    commands=(
        StateCommand(
            f"{OVERLAYS} › All tetrahedra",
            "Show or hide the three tetrahedra that are flat where the mechanism is singular, and "
            "the gaps that are left to such poses.",
            _toggle_tetrahedra,
            keys=(Key("T"),),
        ),
    ),
)
