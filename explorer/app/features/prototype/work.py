"""The parts of the prototype, made in the worker: meshes, list for a workshop, and files.

They are made again when the design changes, not when the pose does.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from explorer.app.scene.surfaces import Drawn, with_creases
from explorer.app.session.feed import Feed, FeedOf
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import without_name
from explorer.errors import ExplorerError
from explorer.mechanism.design import Design
from explorer.numerics.computed_once import computed_once
from explorer.prototype.assembly import Prototype, bill_of_materials, make_prototype
from explorer.prototype.shapes import PrototypePart

# Axis of the round bar in the frame of the part, for the kinds cut from one.
ROUND = {"cylinder": 2, "rod": 2, "ball": 2, "carriage": 0}
# Kinds in the order of assembly.
ORDER = ("base", "carriage", "cross", "cylinder", "rod", "ball", "platform")
# Significant digits in which volume and stock of parts that are alike agree.
DIGITS = 6


@dataclass(frozen=True)
class Line:
    """Parts that are alike: their kind, the legs that have one, and stock and volume of each.

    Stock is the diameter and the length of a round bar, or the sides of a block along the axes of
    the part's frame, in mm; the volume is in mm³.
    """

    kind: str
    legs: tuple[int, ...]
    stock: tuple[float, ...]
    volume: float

    @property
    def count(self) -> int:
        """The number of these parts."""
        return max(len(self.legs), 1)

    @property
    def name(self) -> str:
        """The kind, and the legs."""
        return f"{self.kind} {', '.join(map(str, self.legs))}".strip()

    def mass(self, density: float) -> float:
        """Return the mass of all of them in grams, at a density in kg/m³."""
        return self.count * density * self.volume * 1e-6


def lines_of(prototype: Prototype) -> tuple[Line, ...]:
    """Return the list of a prototype's parts, one line for those that are alike."""
    bill = bill_of_materials(prototype, 1.0)
    lines: dict[object, Line] = {}
    for part, item in zip(prototype.parts, bill.items, strict=True):
        stock = stock_of(part, prototype.design.unit_mm)
        key = part.kind, *(f"{value:.{DIGITS - 1}e}" for value in (item.volume, *stock))
        legs = lines[key].legs if key in lines else ()
        numbers = map(int, part.name.split()[1:])
        lines[key] = Line(part.kind, (*legs, *numbers), stock, item.volume)
    return tuple(sorted(lines.values(), key=lambda line: ORDER.index(line.kind)))


def stock_of(part: PrototypePart, unit_mm: float) -> tuple[float, ...]:
    """Return the stock of a part as in `Line`; `unit_mm` is the millimetres in a design unit."""
    points = part.vertices * unit_mm
    lows, highs = points.min(axis=0), points.max(axis=0)
    sides = (highs - lows).tolist()
    axis = ROUND.get(part.kind)
    if axis is None:
        return tuple(sides)
    off = np.delete(points - 0.5 * (lows + highs), axis, axis=1)
    return 2.0 * float(np.hypot(off[:, 0], off[:, 1]).max()), sides[axis]


@dataclass(frozen=True)
class Parts:
    """The parts of a design, their meshes in their frames in design units, and their list."""

    prototype: Prototype
    meshes: tuple[Drawn, ...]
    lines: tuple[Line, ...]

    @cached_property
    def floor(self) -> float:
        """Height of the lowest point of the base, in design units."""
        return float(self.meshes[0][0][:, 2].min())

    @computed_once
    def meshes_in(self, scale: float) -> tuple[Drawn, ...]:
        """Return the meshes in scene units, of which there are `scale` in a design unit."""
        return tuple((vertices * np.float32(scale), faces) for vertices, faces in self.meshes)


def parts_drawing(design: Design) -> Parts | ExplorerError:
    """Return the parts of a design, ready to be drawn; or why it has none."""
    try:
        prototype = make_prototype(design)
    except ExplorerError as error:
        return error
    meshes = tuple(with_creases(part.vertices, part.faces) for part in prototype.parts)
    return Parts(prototype, meshes, lines_of(prototype))


def _request_for(frame: Frame) -> Design | None:
    """Return the design without its name, on which the parts do not depend."""
    if frame.state.view.drawn_as != "prototype":
        return None
    return without_name(frame.state.design)


PartsFeed: TypeAlias = Feed[Design, Parts | ExplorerError]
PARTS_FEED = FeedOf(parts_drawing, _request_for)


def parts_to_draw(feed: PartsFeed) -> Parts | None:
    """Return the parts to draw; None while there are none or none are requested."""
    return feed.drawing if isinstance(feed.drawing, Parts) else None


def export_assembly(design: Design, file_format: str) -> bytes:
    """Return a file of the prototype, assembled in the home pose, in a format of the page.

    Raises:
        ExplorerError: A design too tight for the parts, or a missing library.
    """
    from explorer.export.assembly import assembly_bytes

    return assembly_bytes(make_prototype(design), file_format)


def export_simulation(design: Design, density: float) -> bytes:
    """Return the model for physics engines as MJCF; `density` of its bodies in kg/m³.

    Raises:
        ExplorerError: A design without a model, such as one with legs of length zero.
    """
    from explorer.export.simulation import simulation_mjcf

    return simulation_mjcf(design, density).encode()
