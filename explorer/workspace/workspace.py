"""The workspace of a design at one orientation, as a value: its limits, its region and its rules.

Volumes, solids, clearances and what else can be known of it are functions of this value, which are
computed once and kept in it. Other signs, or another margin, make another workspace.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import TOLERANCE, Design
from explorer.mechanism.pose import rotation_array
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.workspace.limits.constraints import Cone, Constraint, slacks, solids_of
from explorer.workspace.limits.region import Region, region_of
from explorer.workspace.limits.table import demands_of
from explorer.workspace.limits.valid_poses import Rules, poses_are_valid


class Workspace:
    """The positions of b4 that a design may have at one orientation.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        signs: Signs of the margins to demand instead of the home's, even if no margin is demanded.

    Raises:
        InputError: Not one rotation.
    """

    def __init__(
        self,
        design: Design,
        rotation: ArrayLike | None = None,
        *,
        signs: tuple[int, int, int] | None = None,
    ) -> None:
        self.design = design
        self.rotation = rotation_array(design.home_pose.rotation if rotation is None else rotation)
        if self.rotation.ndim != 2:
            raise InputError(f"give one rotation, shape (3, 3); got {self.rotation.shape}")
        self.signs = signs

    def __getstate__(self) -> dict[str, object]:
        """Return the arguments alone; another process computes what follows from them again."""
        return {"design": self.design, "rotation": self.rotation, "signs": self.signs}

    def __repr__(self) -> str:
        """Return the arguments; equal workspaces have equal texts."""
        return f"Workspace({self.design!r}, {self.rotation.tolist()}, signs={self.signs})"

    @cached_property
    def limits(self) -> tuple[Constraint, ...]:
        """The limits as solids of positions, in the order of the design file."""
        demands = demands_of(self.design, self.signs)
        return tuple(s for each in demands for s in solids_of(self.design, self.rotation, each))

    @cached_property
    def region(self) -> Region:
        """The region that satisfies all limits."""
        return region_of(self.limits)

    @cached_property
    def rules(self) -> Rules:
        """All demands on a pose, clearances of the legs among them."""
        return Rules.of(self.design, self.signs)

    def at(self, positions: ArrayLike) -> Configuration:
        """Return the design at positions (..., 3) of b4, in this orientation."""
        return Configuration(self.design, positions, self.rotation)

    def slacks(self, positions: ArrayLike) -> FloatArray:
        """Return the slacks of the n limits at positions (..., 3), shape (..., n), in units.

        Those of cones are in radians; a slack is negative where its limit is violated.
        """
        return slacks(self.limits, positions)

    def contains(self, positions: ArrayLike) -> BoolArray:
        """Return which positions (..., 3) satisfy all limits, shape (...), without a tolerance."""
        return np.asarray((self.slacks(positions) >= 0.0).all(axis=-1))

    def satisfies(self, positions: ArrayLike) -> BoolArray:
        """Return whether positions (..., 3) satisfy each limit to its tolerance, (..., n)."""
        own = self.design.tolerance
        tolerances = [TOLERANCE if isinstance(limit, Cone) else own for limit in self.limits]
        return self.slacks(positions) >= -np.array(tolerances)

    def is_valid(self, positions: ArrayLike) -> BoolArray:
        """Return which positions (..., 3) satisfy all limits and clearances, shape (...)."""
        return poses_are_valid(self.design, positions, self.rotation, rules=self.rules)
