"""The prototype: all parts of a design, and where they are in a pose.

Parts are made once for a design; in a pose they only move as rigid bodies.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.prototype.chains import BODIES, Chains, Places
from explorer.prototype.fitting import sizes_of
from explorer.prototype.mass import Mass, together
from explorer.prototype.motion import hindrances
from explorer.prototype.part import Part
from explorer.prototype.sizes import Sizes


@dataclass(frozen=True)
class Prototype:
    """The parts of a design.

    Attributes:
        sizes: Those of the parts, in millimetres.
        parts: The base first; their names are unique.
    """

    sizes: Sizes
    parts: tuple[Part, ...]

    @property
    def design(self) -> Design:
        """What it is made from."""
        return self.sizes.design

    @property
    def chains(self) -> Chains:
        """How its bodies are joined."""
        return self.sizes.chains

    def places(self, position: ArrayLike, rotation: ArrayLike) -> Places:
        """Return where the parts are in a pose, in their order.

        Args:
            position: b4 in the base frame, shape (..., 3), in design units.
            rotation: Platform to base, shape (..., 3, 3).

        Raises:
            InputError: a pose that is not finite or not a rotation.
        """
        bodies = self.chains.places_at(position, rotation)
        index = [part.body_index for part in self.parts]
        return Places(bodies.origin[..., index, :], bodies.rotation[..., index, :, :])

    def hindrances(self, position: ArrayLike, rotation: ArrayLike) -> tuple[str, ...]:
        """Return why actuators and joints do not take one pose, () if they do.

        Whether parts of different legs meet is not looked at.

        Raises:
            InputError: a pose that is not finite or not a rotation.
        """
        return hindrances(self.sizes, position, rotation)

    def masses(self, density: float) -> Mapping[str, Mass]:
        """Return the masses of all bodies but the base, in kilograms and metres.

        Args:
            density: Of the parts, in kg/m³.
        """
        return {
            body: together(
                part.mass(density, self.design.unit_mm) for part in self.parts if part.body == body
            )
            for body in BODIES[1:]
        }

    def at(self, position: ArrayLike, rotation: ArrayLike) -> tuple[FloatArray, ...]:
        """Return the vertices of all parts in one pose, in the base frame and design units."""
        places = self.places(position, rotation)
        return tuple(
            np.asarray(part.vertices @ turn.T + origin)
            for part, origin, turn in zip(self.parts, places.origin, places.rotation, strict=True)
        )


def make_prototype(design: Design) -> Prototype:
    """Return the parts of a design, sized from it, its legs' radii and its unit.

    Raises:
        InputError: the design is too tight for the parts; the message says what would fit.
        ExplorerError: a body cannot be made.
    """
    from explorer.prototype.shapes import parts_of

    sizes = sizes_of(design)
    return Prototype(sizes, parts_of(sizes))
