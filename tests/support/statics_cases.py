"""The reference cases of loads, and random poses away from the singular planes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from reference import read_reference
from scipy.spatial.transform import Rotation

from explorer import Design, margins, rotation_from_quaternion
from explorer.mechanism.points import IN_LEGS
from explorer.motion.weights import (
    AXIS_X,
    FIRST_MOMENT,
    ROD,
    ROD_CENTRE,
    TOTAL,
    MovingBodies,
)
from explorer.numerics.arrays import FloatArray


@dataclass(frozen=True)
class LegMasses:
    """Masses in kg of the parts of four legs, with the distances of their centres.

    Those of the cylinders are from the base joints, those of the rods back from the platform.
    """

    carriages: tuple[float, ...] = (0.0,) * 4
    cylinders: tuple[float, ...] = (0.0,) * 4
    cylinder_centres: tuple[float, ...] = (0.0,) * 4
    rods: tuple[float, ...] = (0.0,) * 4
    rod_centres: tuple[float, ...] = (0.0,) * 4

    @property
    def bodies(self) -> MovingBodies:
        """The legs as bodies; the carriages of legs 1 and 4 do not move."""
        rows = np.zeros((4, 11))
        carriages = np.where(IN_LEGS[:, 0], 0.0, self.carriages)
        rows[:, TOTAL] = carriages + self.cylinders + np.array(self.rods)
        rows[:, ROD], rows[:, ROD_CENTRE] = self.rods, self.rod_centres
        rows[:, FIRST_MOMENT] = np.multiply(self.cylinders, self.cylinder_centres)
        rows[:, AXIS_X] = 1.0
        return MovingBodies(legs=rows)


@dataclass(frozen=True)
class Loaded:
    """A case of the reference; its numbers by the names of the file."""

    numbers: dict[str, Any]

    @property
    def pose(self) -> tuple[Design, FloatArray, FloatArray]:
        """The design, the position and the rotation."""
        position = np.array(self.numbers["position"])
        rotation = rotation_from_quaternion(self.numbers["quaternion"])
        return Design(**self.numbers["design"]), position, rotation

    @property
    def load(self) -> FloatArray:
        """The force and the moment at the tool."""
        return np.array([*self.numbers["force"], *self.numbers["moment"]])

    def __getattr__(self, name: str) -> Any:
        """Return numbers of the file."""
        try:
            return np.array(self.numbers[name])
        except KeyError:
            raise AttributeError(name) from None


CASES = [Loaded(each) for each in read_reference("loads")["cases"]]


def random_poses(
    design: Design, count: int, seed: int = 0, margin: float = 0.05
) -> tuple[FloatArray, FloatArray]:
    """Return random poses whose margins exceed a share of the reach."""
    rng = np.random.default_rng(seed)
    many = 20 * count
    positions = rng.uniform(-1.0, 1.0, (many, 3)) * design.reach
    rotations = Rotation.random(many, random_state=rng).as_matrix()
    regular = np.abs(margins(positions, rotations)).min(axis=1) > margin * design.reach
    return positions[regular][:count], rotations[regular][:count]
