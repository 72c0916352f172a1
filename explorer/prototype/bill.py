"""The bill of materials: every part with its measures, actuators with stroke and length."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.prototype.assembly import Prototype
from explorer.prototype.dimensions import Stroke


@dataclass(frozen=True)
class Item:
    """A line of the bill.

    Attributes:
        name: Of the part, such as "cylinder 2".
        size: Its extents along the axes of its own frame, in millimetres.
        volume: In cubic millimetres.
        mass: In kilograms.
    """

    name: str
    size: tuple[float, float, float]
    volume: float
    mass: float


@dataclass(frozen=True)
class Actuator:
    """An actuator of a leg: a cylinder and its rod.

    Attributes:
        leg: 1 to 4.
        stroke: Between what lengths it moves, from base joint to ball, in millimetres.
        asked: Between what lengths the limits ask for; one rod may have less.
        diameter: Of the cylinder, in millimetres.
        mass: Of cylinder and rod, in kilograms.
    """

    leg: int
    stroke: Stroke
    asked: Stroke
    diameter: float
    mass: float


@dataclass(frozen=True)
class Bill:
    """All parts of a prototype, and its actuators."""

    items: tuple[Item, ...]
    actuators: tuple[Actuator, ...]

    @property
    def mass(self) -> float:
        """That of all parts together, in kilograms."""
        return sum(item.mass for item in self.items)


def bill_of_materials(prototype: Prototype, density: float) -> Bill:
    """Return the bill of a prototype.

    Args:
        prototype: Its parts.
        density: Of what they are made from, in kg/m³.
    """
    unit, sizes = prototype.design.unit_mm, prototype.sizes
    items: list[Item] = []
    for part in prototype.parts:
        x, y, z = ((part.vertices.max(axis=0) - part.vertices.min(axis=0)) * unit).tolist()
        volume = part.unit_mass.mass * unit**3
        items.append(Item(part.name, (x, y, z), volume, part.mass(density, unit).mass))
    mass = {item.name: item.mass for item in items}
    actuators = (
        Actuator(
            leg,
            stroke,
            sizes.asked(leg),
            2.0 * sizes.radii[leg - 1],
            mass[f"cylinder {leg}"] + mass[f"rod {leg}"],
        )
        for leg, stroke in enumerate(sizes.strokes, 1)
    )
    return Bill(tuple(items), tuple(actuators))
