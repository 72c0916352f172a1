"""The prototype: all parts of a design, their placements, the exploded view, the bill of materials.

Parts are made once for a design; between poses they move as rigid bodies.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import Design
from explorer.motion.chains import BODIES, LEGS, Chains, Places
from explorer.motion.masses import Mass, total_mass
from explorer.numerics.arrays import FloatArray
from explorer.prototype.fitting import sizes_of
from explorer.prototype.shapes import PrototypePart, make_parts
from explorer.prototype.sizes import Sizes, StrokeRange

# The gap between layers of the exploded view: over the reach, and over the largest leg radius.
_GAP, _GAP_IN_RADII = 0.05, 6.0


@dataclass(frozen=True)
class Prototype:
    """The parts of a design, with unique names and the base first, and their sizes."""

    sizes: Sizes
    parts: tuple[PrototypePart, ...]

    @property
    def design(self) -> Design:
        """The design of which these are the parts."""
        return self.sizes.design

    @property
    def chains(self) -> Chains:
        """The chains of bodies and joints."""
        return self.sizes.chains

    def places(self, position: ArrayLike, rotation: ArrayLike) -> Places:
        """Return the placements of the parts in a pose, in the order of `parts`.

        Arguments are those of `Chains.joints`.
        """
        bodies = self.chains.places_at(position, rotation)
        index = [part.body_index for part in self.parts]
        return Places(bodies.origin[..., index, :], bodies.rotation[..., index, :, :])

    def masses(self, density: float) -> Mapping[str, Mass]:
        """Return the masses of all bodies but the base, in kg and metres; density in kg/m³."""
        return {
            body: total_mass(
                part.mass(density, self.design.unit_mm) for part in self.parts if part.body == body
            )
            for body in BODIES[1:]
        }


def make_prototype(design: Design) -> Prototype:
    """Return the parts of a design, sized from it, its legs' radii and its unit.

    Raises:
        InputError: The design is too tight for the parts; the message says what would fit.
        ExplorerError: A body cannot be made.
    """
    sizes = sizes_of(design)
    return Prototype(sizes, make_parts(sizes))


def exploded_offsets(prototype: Prototype, places: Places) -> FloatArray:
    """Return the shift of each part in the full exploded view, shape (n, 3), in design units.

    Parts are lifted off the base in layers, each as far as it takes to clear the one below:
    crosses and carriages, cylinders, rods, balls, and the platform. The parts of one layer
    keep their places beside each other, however the legs lean.
    """
    sizes, parts = prototype.sizes, prototype.parts
    index = {part.name: i for i, part in enumerate(parts)}
    cylinders, rods, balls = (
        [index[f"{kind} {leg}"] for leg in LEGS] for kind in ("cylinder", "rod", "ball")
    )
    design = prototype.design
    gap = max(_GAP * design.reach, _GAP_IN_RADII * max(sizes.radii) / design.unit_mm)
    up = np.array([0.0, 0.0, float(sizes.chains.side)])
    tops = np.array([parts[i].vertices[:, 2].max() for i in cylinders])
    bottoms = np.array([parts[i].vertices[:, 2].min() for i in rods])
    along = places.rotation[rods][:, :, 2]
    lengths = np.linalg.norm(places.origin[rods] - places.origin[cylinders], axis=1)
    overlap = np.maximum(tops - (lengths + bottoms), 0.0) * np.abs(along @ up)
    # The necks of balls leave the platform along its normal, which may lean.
    normal = -sizes.chains.platform_side * places.rotation[index["platform"]][:, 2]
    offsets = np.zeros_like(places.origin)
    offsets[[i for i, part in enumerate(parts) if part.kind in ("cross", "carriage")]] = gap * up
    offsets[cylinders] = 2.0 * gap * up
    offsets[rods] = (3.0 * gap + overlap.max()) * up
    offsets[balls] = offsets[rods] + gap * normal
    offsets[index["platform"]] = offsets[balls][0] + gap * normal
    return offsets


@dataclass(frozen=True)
class Item:
    """One part in the bill of materials, such as "cylinder 2".

    Its size is that along the axes of its own frame, in millimetres, its volume in mm³, its mass in
    kilograms.
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
    stroke: StrokeRange
    required: StrokeRange
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
    items: dict[str, Item] = {}
    for part in prototype.parts:
        x, y, z = (np.ptp(part.vertices, axis=0) * unit).tolist()
        volume, mass = part.unit_mass.mass * unit**3, part.mass(density, unit).mass
        items[part.name] = Item(part.name, (x, y, z), volume, mass)
    actuators = tuple(
        Actuator(
            leg,
            stroke,
            sizes.required_stroke(leg),
            2.0 * sizes.radii[leg - 1],
            items[f"cylinder {leg}"].mass + items[f"rod {leg}"].mass,
        )
        for leg, stroke in zip(LEGS, sizes.strokes, strict=True)
    )
    return Bill(tuple(items.values()), actuators)
