"""The prototype: parts in place of the schematic legs and bodies, moved as rigid bodies.

Each part has a node from the start. The node gets a mesh when the design changes, and only its
place in each frame.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.bodies import colliding_legs
from explorer.app.features.prototype.work import PARTS_FEED, Parts, parts_to_draw
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.scene.shapes import BALL, CARRIAGE, NO_MESH, PLATFORM_BODY, RAIL, ROD, TUBE
from explorer.app.scene.surfaces import Drawn
from explorer.app.widgets.assigning import Update
from explorer.measures.box import corners_of
from explorer.mechanism.pose import quaternion_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.prototype.assembly import exploded_offsets
from explorer.prototype.chains import BODIES, LEGS, Places
from explorer.singularity.colours import OUTLINE, Rgb

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
    """The parts, assembled or exploded."""

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
        self._drawn: tuple[Parts | None, float] = None, 0.0
        self._meshes: dict[str, Drawn] = {}

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the parts of a frame."""
        view, parts = placed.frame.state.view, parts_to_draw(self._feed)
        for name, node in self._nodes.items():
            switch = view.bodies if name in ON_BODIES or name in BALLS else view.legs
            yield node, "visible", switch and parts is not None
        if parts is None:
            return
        yield from self._shapes(parts, placed.scale)
        yield from self._places(placed, parts)
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

    def _shapes(self, parts: Parts, scale: float) -> Iterator[Update]:
        if self._drawn[0] is not parts or self._drawn[1] != scale:
            self._drawn = parts, scale
            names = (part.name for part in parts.prototype.parts)
            self._meshes = {
                name: (vertices * np.float32(scale), faces)
                for name, (vertices, faces) in zip(names, parts.meshes, strict=True)
            }
        for name, (vertices, faces) in self._meshes.items():
            yield self._nodes[name], "vertices", vertices
            yield self._nodes[name], "faces", faces

    def _places(self, placed: Placed, parts: Parts) -> Iterator[Update]:
        places = places_of(placed, parts)
        names = [part.name for part in parts.prototype.parts]
        turns = quaternion_from_rotation(places.rotation).tolist()
        platform = names.index("platform")
        for name, position, turn in zip(names, placed.scale * places.origin, turns, strict=True):
            if name in BALLS:
                off = position - placed.scale * places.origin[platform]
                there = off @ places.rotation[platform]
            else:
                there = position
                yield self._nodes[name], "wxyz", tuple(turn)
            yield self._nodes[name], "position", tuple(there.tolist())


def places_of(placed: Placed, parts: Parts) -> Places:
    """Return where the parts are drawn, in their order and in design units."""
    frame = placed.frame
    places = parts.prototype.places(frame.state.pose.position, frame.snapshot.rotation)
    share = frame.state.view.prototype.exploded
    if share == 0.0:
        return places
    away = share * exploded_offsets(parts.prototype, places)
    return Places(places.origin + away, places.rotation)
