"""The exploded view: how far and where to each part is drawn from its place.

Parts leave as they would be taken apart: what turns in the base is lifted off it, cylinders
and rods go out along their legs, each rod until it is out of its cylinder, balls follow their
rods, and the platform is lifted off the balls.
"""

from __future__ import annotations

import numpy as np

from explorer.arrays import FloatArray
from explorer.prototype.assembly import Prototype
from explorer.prototype.chains import LEGS, Places

# Between parts that are drawn apart: over the reach, and over the largest radius of a leg.
_GAP, _RADII = 0.05, 5.0


class Explosion:
    """Draws the parts of one prototype apart.

    Args:
        prototype: Whose parts.
    """

    def __init__(self, prototype: Prototype) -> None:
        names = [part.name for part in prototype.parts]
        sizes = prototype.sizes
        self._side = float(sizes.chains.side)
        self._platform_side = float(sizes.chains.platform_side)
        design = prototype.design
        self._gap = max(_GAP * design.reach, _RADII * max(sizes.radii) / design.unit_mm)
        kinds = [part.kind for part in prototype.parts]
        self._firsts = [i for i, kind in enumerate(kinds) if kind in ("cross", "carriage")]
        self._cylinders = [names.index(f"cylinder {leg}") for leg in LEGS]
        self._rods = [names.index(f"rod {leg}") for leg in LEGS]
        self._balls = [names.index(f"ball {leg}") for leg in LEGS]
        self._platform = names.index("platform")
        heights = [part.vertices[:, 2] for part in prototype.parts]
        self._tops = np.array([heights[i].max() for i in self._cylinders])
        self._bottoms = np.array([heights[i].min() for i in self._rods])

    def offsets(self, places: Places) -> FloatArray:
        """Return by what each part is moved in the full view, in the base frame.

        Args:
            places: Of all parts in one pose.

        Returns:
            Shape (n, 3), in design units.
        """
        found = np.zeros_like(places.origin)
        gap = self._gap
        lift = np.array([0.0, 0.0, gap * self._side])
        along = places.rotation[self._rods][:, :, 2]
        lengths = np.linalg.norm(places.origin[self._rods] - places.origin[self._cylinders], axis=1)
        overlap = np.maximum(self._tops - (lengths + self._bottoms), 0.0)
        found[self._firsts] = lift
        found[self._cylinders] = lift + gap * along
        # The same for all legs, so that the platform stays in sight of its rods.
        found[self._rods] = found[self._cylinders] + (overlap.max() + gap) * along
        found[self._balls] = found[self._rods] + gap * along
        normal = -self._platform_side * places.rotation[self._platform][:, 2]
        found[self._platform] = found[self._balls].mean(axis=0) + gap * normal
        return found
