"""The prototype: parts that can be made, in place of the schematic ones."""

from __future__ import annotations

from html import escape

import numpy as np
import viser

from explorer.app.features.feature import Feature, FileExport, Services, Tab
from explorer.app.features.mechanism.bodies import colliding_legs
from explorer.app.features.prototype import work
from explorer.app.features.prototype.building import (
    BUILD_FEED,
    VERDICTS,
    BuildVerdict,
    strokes_table,
)
from explorer.app.features.prototype.work import PARTS_FEED, Parts, PartsFeed, parts_to_draw
from explorer.app.inputs.bindings import ControlBinding
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import Span
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.scene.shapes import NO_MESH
from explorer.app.session.session import Who
from explorer.app.state.actions import draw_as
from explorer.app.state.frame import Frame
from explorer.app.widgets.markup import alert, box, caption, note, row, sentence, table
from explorer.errors import ExplorerError
from explorer.measures.box import corners_of
from explorer.mechanism.pose import quaternion_from_rotation
from explorer.mechanism.rgb import BALL, CARRIAGE, OUTLINE, PLATFORM_BODY, RAIL, ROD, TUBE, Rgb
from explorer.motion.chains import BODIES, LEGS, Places
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_decimals, format_number
from explorer.page.widgets.assigning import Updates
from explorer.prototype.assembly import exploded_offsets
from explorer.prototype.fitting import broken_joint_limits

# Format of each file by its name on the page, and end of the name of the file.
ASSEMBLIES = {
    "3MF": ("3mf", "mechanism.3mf"),
    "GLB": ("glb", "mechanism.glb"),
    "STL (zip)": ("stl-zip", "parts-stl.zip"),
    "STEP": ("step", "mechanism.step"),
}


class PrototypePanel(Controls):
    """Whether the machine can be built; controls that draw, explode and list its parts."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui, self._feed = services.gui, services.get(PARTS_FEED)
        self._verdict, self._build = services.get(BuildVerdict), services.get(BUILD_FEED)
        self.markup(self._built)
        self.checkbox(
            "Show the parts",
            "Draw the mechanism as parts that can be made: sized from the design, the radii of "
            "its legs and its unit.",
            ControlBinding(
                lambda frame: frame.state.view.drawn_as == "prototype",
                lambda _, on: draw_as("prototype" if on else "schematic"),
            ),
        )
        gui.add_html(note("Sized from the design; Export has them for printers and CAD."))
        self.markup(lambda frame: trouble_of(frame, self._feed))
        folder = gui.add_folder("Parts", visible=False)
        # A failure in the worker takes the parts away at any time.
        self.follow(folder, "visible", lambda _: parts_to_draw(self._feed) is not None)
        with folder:
            self.slider(
                "Exploded",
                "The exploded view: 0 together, 1 each part by itself.",
                "view.prototype.exploded",
                Span(0.0, 1.0, 0.01),
            )
            self.number(
                "Density (kg/m³)",
                "Density of all parts. Aluminium 2700, steel 7850, printed PLA 1240.",
                "view.prototype.density",
                least=1.0,
                step=1.0,
            )
            self.markup(self._bill)

    def _built(self, _: Frame) -> str:
        built = self._build.drawing
        strokes = "" if built is None else f'<div class="ex-after">{strokes_table(built)}</div>'
        return box(self._verdict.html(), strokes)

    def _bill(self, frame: Frame) -> str:
        parts = parts_to_draw(self._feed)
        return "" if parts is None else parts_table(parts, frame.state.view.prototype.density)


def trouble_of(frame: Frame, feed: PartsFeed) -> str:
    """Return as HTML why there are no parts or why they cannot take the pose; "" if they can."""
    if frame.state.view.drawn_as != "prototype":
        return ""
    if feed.problem is not None:
        return alert("The parts could not be made", feed.problem)
    drawing = feed.drawing
    if isinstance(drawing, ExplorerError):
        return alert("No prototype of this design", sentence(str(drawing)))
    if drawing is None:
        return note("Making the parts …")
    broken = broken_joint_limits(
        drawing.prototype.sizes, frame.state.pose.position, frame.snapshot.rotation
    )
    return alert("The parts do not take this pose", sentence("; ".join(broken))) if broken else ""


def parts_table(parts: Parts, density: float) -> str:
    """Return the bill of materials as HTML; the density is in kg/m³."""
    rows = (
        row(
            escape(line.name),
            f"{line.count}",
            f'<span class="ex-whole">{"Ø " * (len(line.stock) == 2)}'
            f"{' × '.join(format_decimals(side, 1) for side in line.stock)}</span>",
            _grams(line.mass(density)),
        )
        for line in parts.lines
    )
    moving = sum(line.mass(density) for line in parts.lines if line.kind != "base")
    mass = sum(line.mass(density) for line in parts.lines)
    return box(
        f'<div class="ex-status">{_mass(mass)}</div>',
        caption(f"all parts; without the base {_mass(moving)}"),
        table(rows, ("part", "count", "stock, mm", "mass, g")),
    )


def _grams(value: float) -> str:
    return format_decimals(value, 1 if value < 1000.0 else 0)


def _mass(grams: float) -> str:
    return f"{_grams(grams)} g" if grams < 1000.0 else f"{format_number(grams / 1000.0)} kg"


def _send_assembly(services: Services, name: str, who: Who) -> None:
    design = services.session.latest_state().design
    file_format, end = ASSEMBLIES[name]
    file = f"{design.name}-{end}"
    services.downloads.compute(who, file, work.export_assembly, (design, file_format))


def _send_simulation(services: Services, _: str, who: Who) -> None:
    state = services.session.latest_state()
    file = f"{state.design.name}-simulation.xml"
    arguments = state.design, state.view.prototype.density
    services.downloads.compute(who, file, work.export_simulation, arguments)


def _floor(services: Services) -> float | None:
    parts = parts_to_draw(services.get(PARTS_FEED))
    return None if parts is None else parts.floor


COLOURS: dict[str, Rgb] = {
    "base": PLATFORM_BODY,
    "cross": TUBE,
    "carriage": CARRIAGE,
    "cylinder": RAIL,
    "rod": ROD,
    "platform": PLATFORM_BODY,
    "ball": BALL,
}
"""Greys, as for the schematic parts: orange and blue belong to the singularities."""

BALLS = tuple(f"ball {leg}" for leg in LEGS)
NAMES = (*BODIES, *BALLS)
ON_BODIES = ("base", "platform")
"""Parts that the switch of the bodies shows, with the balls; that of the legs shows the rest."""


class PrototypeScene(ScenePart):
    """The parts, assembled or exploded, moved as rigid bodies.

    Each part has a node from the start, which gets a mesh when the design changes and a place in
    each frame.
    """

    def __init__(self, services: Services) -> None:
        scene, self._feed = services.scene, services.get(PARTS_FEED)
        self._nodes: dict[str, viser.MeshHandle] = {}
        for name in NAMES:
            # The platform is the parent of the balls, so that they move with it.
            path = f"platform/{name}" if name in BALLS else name
            kind = name.partition(" ")[0]
            self._nodes[name] = scene.add_mesh_simple(
                f"/prototype/{path}", *NO_MESH, color=COLOURS[kind], visible=False
            )

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the parts of a frame."""
        view, parts = placed.frame.state.view, parts_to_draw(self._feed)
        for name, node in self._nodes.items():
            switch = view.bodies if name in ON_BODIES or name in BALLS else view.legs
            yield node, "visible", switch and parts is not None
        if parts is None:
            return
        names = [part.name for part in parts.prototype.parts]
        places, platform = places_of(placed, parts), names.index("platform")
        origins = placed.scale * places.origin
        turns = quaternion_from_rotation(places.rotation).tolist()
        meshes = parts.meshes_in(placed.scale)
        for name, mesh, origin, turn in zip(names, meshes, origins, turns, strict=True):
            node = self._nodes[name]
            yield node, "vertices", mesh[0]
            yield node, "faces", mesh[1]
            place = origin
            if name in BALLS:
                place = (origin - origins[platform]) @ places.rotation[platform]
            else:
                yield node, "wxyz", tuple(turn)
            yield node, "position", tuple(place.tolist())
        alarms = colliding_legs(placed.frame.snapshot)
        for leg, alarm in zip(LEGS, alarms, strict=True):
            for kind in ("cylinder", "rod"):
                colour = OUTLINE if alarm else COLOURS[kind]
                yield self._nodes[f"{kind} {leg}"], "color", colour

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of boxes about the parts."""
        parts = parts_to_draw(self._feed)
        if parts is None:
            return NO_POINTS
        places, seen = places_of(placed, parts), list[FloatArray]()
        for (vertices, _), origin, rotation in zip(
            parts.meshes, places.origin, places.rotation, strict=True
        ):
            corners = corners_of(np.stack([vertices.min(axis=0), vertices.max(axis=0)]))
            seen.append(placed.scale * (corners @ rotation.T + origin))
        return np.concatenate(seen)


def places_of(placed: Placed, parts: Parts) -> Places:
    """Return where the parts are drawn, in their order and in design units."""
    frame = placed.frame
    places = parts.prototype.places(frame.state.pose.position, frame.snapshot.rotation)
    share = frame.state.view.prototype.exploded
    if share == 0.0:
        return places
    away = share * exploded_offsets(parts.prototype, places)
    return Places(places.origin + away, places.rotation)


PROTOTYPE = Feature(
    "prototype",
    manual="prototype-and-export.md",
    tabs=(Tab("analyse", "Prototype", PrototypePanel, viser.Icon.ENGINE),),
    bar=(("middle", lambda services: services.get(BuildVerdict).in_bar),),
    verdicts=VERDICTS,
    exports=(
        FileExport(
            "Mechanism",
            "Parts that can be made, assembled in the home pose, in millimetres.",
            tuple(ASSEMBLIES),
            _send_assembly,
        ),
        FileExport(
            "Simulation",
            "A model for MuJoCo and other engines, with servos that bear the weights at home.",
            ("MJCF",),
            _send_simulation,
        ),
    ),
    scene=(PrototypeScene,),
    feeds=(PARTS_FEED,),
    later_feeds=(BUILD_FEED,),
    floor=_floor,
)
