"""The bill of materials: every part with its extents and mass, every actuator with its stroke."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.prototype.assembly import Prototype
from explorer.prototype.dimensions import Stroke


@dataclass(frozen=True)
class Item:
    """One part in the bill of materials.

    Attributes:
        name: Name of the part, such as "cylinder 2".
        size: Extents along the axes of the part's own frame, in millimetres.
        volume: Volume in cubic millimetres.
        mass: Mass in kilograms.
    """

    name: str
    size: tuple[float, float, float]
    volume: float
    mass: float


@dataclass(frozen=True)
class Actuator:
    """An actuator of a leg: a cylinder and its rod.

    Attributes:
        leg: Number of the leg, 1 to 4.
        stroke: Shortest and longest length, from base joint to ball, in millimetres.
        required: Stroke that the limits of the design allow; a single rod may cover less of it.
        diameter: Diameter of the cylinder, in millimetres.
        mass: Mass of cylinder and rod, in kilograms.
    """

    leg: int
    stroke: Stroke
    required: Stroke
    diameter: float
    mass: float


@dataclass(frozen=True)
class Bill:
    """All parts of a prototype, and its actuators."""

    items: tuple[Item, ...]
    actuators: tuple[Actuator, ...]

    @property
    def mass(self) -> float:
        """The mass of all parts, in kilograms."""
        return sum(item.mass for item in self.items)


def bill_of_materials(prototype: Prototype, density: float) -> Bill:
    """Return the bill of materials of a prototype; the density is in kg/m³."""
    unit, sizes = prototype.design.unit_mm, prototype.sizes
    items: list[Item] = []
    for part in prototype.parts:
        x, y, z = ((part.vertices.max(axis=0) - part.vertices.min(axis=0)) * unit).tolist()
        volume = part.unit_mass.mass * unit**3
        items.append(Item(part.name, (x, y, z), volume, part.mass(density, unit).mass))
    mass = {item.name: item.mass for item in items}
    actuators: list[Actuator] = []
    for leg, stroke in enumerate(sizes.strokes, 1):
        actuator_mass = mass[f"cylinder {leg}"] + mass[f"rod {leg}"]
        diameter = 2.0 * sizes.radii[leg - 1]
        actuators.append(Actuator(leg, stroke, sizes.required_stroke(leg), diameter, actuator_mass))
    return Bill(tuple(items), tuple(actuators))
