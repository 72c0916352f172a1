"""How the prototype is shown: whether at all, how far apart, and of what it is made."""

from __future__ import annotations

import math
from dataclasses import dataclass

from explorer.errors import InputError

ALUMINIUM = 2700.0
"""Its density, in kg/m³."""


@dataclass(frozen=True)
class PrototypeView:
    """How the prototype is shown.

    Attributes:
        shown: Whether its parts replace the schematic legs and bodies.
        exploded: How far they are drawn apart, 0 to 1.
        density: Of all parts, in kg/m³.

    Raises:
        InputError: a share beyond 0 to 1, or a density that is not positive.
    """

    shown: bool = False
    exploded: float = 0.0
    density: float = ALUMINIUM

    def __post_init__(self) -> None:
        if not 0.0 <= self.exploded <= 1.0:
            raise InputError(f"parts are drawn apart by 0 to 1; got {self.exploded:g}")
        if not (math.isfinite(self.density) and self.density > 0.0):
            raise InputError(
                f"the density must be positive; got {self.density:g} (aluminium: 2700 kg/m³)"
            )
