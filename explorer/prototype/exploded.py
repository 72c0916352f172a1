"""The exploded view: how far each part is drawn from its place.

Parts are lifted off the base in layers, each as far as it takes to come free of the one
below: what turns in the base, cylinders, rods, balls, and the platform off its balls. So the
parts of a layer keep their places beside each other, however the legs lean.
"""

from __future__ import annotations

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.prototype.assembly import Prototype
from explorer.prototype.chains import LEGS, Places

# Between layers: over the reach, and over the largest radius of a leg.
_GAP, _RADII = 0.05, 6.0


class Explosion:
    """Draws the parts of one prototype apart.

    Args:
        prototype: Whose parts.
    """

    def __init__(self, prototype: Prototype) -> None:
        design, sizes, parts = prototype.design, prototype.sizes, prototype.parts
        names = [part.name for part in parts]
        self._up = np.array([0.0, 0.0, float(sizes.chains.side)])
        self._platform_side = float(sizes.chains.platform_side)
        self._gap = max(_GAP * design.reach, _RADII * max(sizes.radii) / design.unit_mm)
        self._joints = [i for i, part in enumerate(parts) if part.kind in ("cross", "carriage")]
        self._cylinders = [names.index(f"cylinder {leg}") for leg in LEGS]
        self._rods = [names.index(f"rod {leg}") for leg in LEGS]
        self._balls = [names.index(f"ball {leg}") for leg in LEGS]
        self._platform = names.index("platform")
        self._tops = np.array([parts[i].vertices[:, 2].max() for i in self._cylinders])
        self._bottoms = np.array([parts[i].vertices[:, 2].min() for i in self._rods])

    def offsets(self, places: Places) -> FloatArray:
        """Return by what each part is moved in the full view, in the base frame.

        Args:
            places: Of all parts in one pose.

        Returns:
            Shape (n, 3), in design units.
        """
        found = np.zeros_like(places.origin)
        gap, up = self._gap, self._up
        along = places.rotation[self._rods][:, :, 2]
        lengths = np.linalg.norm(places.origin[self._rods] - places.origin[self._cylinders], axis=1)
        within = np.maximum(self._tops - (lengths + self._bottoms), 0.0) * np.abs(along @ up)
        found[self._joints] = gap * up
        found[self._cylinders] = 2.0 * gap * up
        found[self._rods] = (3.0 * gap + within.max()) * up
        # Necks of balls leave the platform along its normal, which may lean.
        normal = -self._platform_side * places.rotation[self._platform][:, 2]
        found[self._balls] = found[self._rods] + gap * normal
        found[self._platform] = found[self._balls][0] + gap * normal
        return found
