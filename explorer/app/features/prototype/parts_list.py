"""The list of parts for a workshop: one line for parts that are alike, with the stock to cut.

Stock is the bar or the block that a part is cut from.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from explorer.numerics.number_text import format_decimals
from explorer.prototype.assembly import Actuator, Prototype, bill_of_materials
from explorer.prototype.shapes import Part

# Axis of the round bar in the frame of the part, for the kinds cut from one.
_ROUND = {"cylinder": 2, "rod": 2, "ball": 2, "carriage": 0}
# Kinds in the order of assembly.
_ORDER = ("base", "carriage", "cross", "cylinder", "rod", "ball", "platform")
# Significant digits in which volume and stock of parts that are alike agree.
_DIGITS = 6


@dataclass(frozen=True)
class Bar:
    """A round bar, in millimetres."""

    diameter: float
    length: float

    def __str__(self) -> str:
        return f"Ø {format_decimals(self.diameter, 1)} × {format_decimals(self.length, 1)}"


@dataclass(frozen=True)
class Block:
    """A block along the axes of the part's frame, its sides in millimetres."""

    x: float
    y: float
    z: float

    def __str__(self) -> str:
        return " × ".join(format_decimals(side, 1) for side in (self.x, self.y, self.z))


Stock = Bar | Block


@dataclass(frozen=True)
class Line:
    """Parts that are alike.

    Attributes:
        kind: Kind of part, such as "rod".
        legs: Legs that have one; () for base and platform.
        stock: Stock that each is cut from.
        volume: Volume of each, in mm³.
    """

    kind: str
    legs: tuple[int, ...]
    stock: Stock
    volume: float

    @property
    def count(self) -> int:
        """The number of these parts."""
        return max(len(self.legs), 1)

    @property
    def name(self) -> str:
        """The kind, and the legs."""
        return " ".join([self.kind, ", ".join(map(str, self.legs))]).strip()

    def mass(self, density: float) -> float:
        """Return the mass of all of them in grams, at a density in kg/m³."""
        return self.count * density * self.volume * 1e-6


@dataclass(frozen=True)
class PartsList:
    """Parts and actuators of a prototype."""

    lines: tuple[Line, ...]
    actuators: tuple[Actuator, ...]

    def mass(self, density: float) -> float:
        """Return the mass of all parts in grams, at a density in kg/m³."""
        return sum(line.mass(density) for line in self.lines)

    def moving_mass(self, density: float) -> float:
        """Return the mass of all but the base in grams, at a density in kg/m³."""
        return sum(line.mass(density) for line in self.lines if line.kind != "base")


def parts_list(prototype: Prototype) -> PartsList:
    """Return the list of a prototype's parts."""
    bill = bill_of_materials(prototype, 1.0)
    lines: dict[object, Line] = {}
    for part, item in zip(prototype.parts, bill.items, strict=True):
        stock = stock_of(part, prototype.design.unit_mm)
        key = (part.kind, _rounded((item.volume, *vars(stock).values())))
        same = lines.get(key)
        _, _, leg = part.name.partition(" ")
        legs = (*(() if same is None else same.legs), *((int(leg),) if leg else ()))
        lines[key] = Line(part.kind, legs, stock, item.volume)
    in_order = sorted(lines.values(), key=lambda line: _ORDER.index(line.kind))
    return PartsList(tuple(in_order), bill.actuators)


def stock_of(part: Part, unit_mm: float) -> Stock:
    """Return the stock of a part; `unit_mm` is the millimetres in a design unit."""
    points = part.vertices * unit_mm
    lows, highs = points.min(axis=0), points.max(axis=0)
    x, y, z = (highs - lows).tolist()
    axis = _ROUND.get(part.kind)
    if axis is None:
        return Block(x, y, z)
    off = np.delete(points - 0.5 * (lows + highs), axis, axis=1)
    return Bar(2.0 * float(np.hypot(off[:, 0], off[:, 1]).max()), (x, y, z)[axis])


def _rounded(values: Sequence[float]) -> tuple[float, ...]:
    return tuple(round(value, _DIGITS - 1 - math.floor(math.log10(value))) for value in values)
