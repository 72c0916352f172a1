"""Parts of the scene, and the mechanism in its scale: about ten units large.

Each part is made once, then only assigned to, frame by frame.

The scale follows the design as it was opened and not its sliders, so that a growing
design is seen to grow. It is 1, 2 or 5 times a power of ten, as is the side of the ground's squares
in millimetres.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import distance

from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.measures.box import corners_of
from explorer.measures.snapshot import Snapshot
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray

if TYPE_CHECKING:
    from explorer.page.widgets.assigning import Update

# Approximate reach of a design in scene units.
SCENE_REACH = 10.0


def round_step(length: float) -> float:
    """Return the 1, 2 or 5 times a power of ten that is nearest in ratio to a length."""
    power = 10.0 ** math.floor(math.log10(length))
    return min(
        (factor * power for factor in (1.0, 2.0, 5.0, 10.0)),
        key=lambda step: abs(math.log(step / length)),
    )


def scene_scale(state: State) -> float:
    """Return scene units per design unit."""
    return 1.0 / round_step(state.base.reach / SCENE_REACH)


@dataclass(frozen=True)
class Placed:
    """A frame that is drawn, with its points in scene units.

    The floor is the height, in design units, of the lowest point of what is drawn in place of the
    schematic legs and bodies; None while these are drawn.
    """

    frame: Frame
    floor: float | None = None

    @property
    def is_schematic(self) -> bool:
        """Whether the schematic legs and bodies are drawn."""
        return self.floor is None

    @property
    def is_apart(self) -> bool:
        """Whether parts are drawn apart, away from the points of the mechanism."""
        return not self.is_schematic and self.frame.state.view.prototype.exploded > 0.0

    @cached_property
    def scale(self) -> float:
        """Scene units per design unit."""
        return scene_scale(self.frame.state)

    @cached_property
    def square_in_unit(self) -> float:
        """Side of the squares of the ground in the unit of the page, about one scene unit."""
        return round_step(self.frame.state.unit.convert(1.0 / self.scale))

    @property
    def square(self) -> float:
        """Side of the squares of the ground in scene units."""
        return self.scale * self.square_in_unit / self.frame.state.unit.convert(1.0)

    @cached_property
    def points(self) -> dict[str, FloatArray]:
        """Points a1 … b4 in scene units, each (3,)."""
        return {n: self.scale * p for n, p in self.frame.snapshot.points._asdict().items()}

    @cached_property
    def platform_points(self) -> dict[str, FloatArray]:
        """Points b1 … b4 in the platform frame, in scene units, each (3,)."""
        local = self.scale * self.frame.state.design.platform_points
        return dict(zip(("b1", "b2", "b3", "b4"), local, strict=True))

    @cached_property
    def point(self) -> FloatArray:
        """The point whose position is shown, b4 or the tool point, in scene units, (3,)."""
        return self.points["b4"] + self.offset

    @cached_property
    def offset(self) -> FloatArray:
        """The vector from b4 to that point in scene units, (3,)."""
        return self.scale * self.frame.state.offset(self.frame.snapshot.rotation)

    @cached_property
    def struts(self) -> tuple[FloatArray, FloatArray]:
        """Base ends and platform ends of the four legs in scene units, each (4, 3)."""
        p, on_guide = self.points, np.array([1.0, 0.0, 0.0])
        bases = np.array([p["a1"], on_guide * p["b2"], on_guide * p["b3"], p["a3"]])
        return bases, np.array([p["b1"], p["b2"], p["b3"], p["b4"]])

    @cached_property
    def leg_radii(self) -> FloatArray:
        """Radii of the four legs in scene units, (4,); 0 for one that has none."""
        return self.scale * np.array(self.frame.state.design.limits.leg_radii)

    def on_platform(self, point: Triple) -> FloatArray:
        """Return a point (3,) in scene units of one in the platform frame, in design units."""
        turned = self.frame.snapshot.rotation @ np.array(point)
        return self.points["b4"] + self.scale * turned

    @cached_property
    def reach(self) -> float:
        """The reach |a3| in scene units."""
        return self.scale * self.frame.state.design.reach

    @cached_property
    def thickness(self) -> float:
        """The scale of thicknesses: 1, and less if the platform's points are close."""
        gaps = distance.pdist(np.array(list(self.platform_points.values())))
        # b4 and b2 or b3 may coincide; the legs then simply share a joint.
        apart = gaps[gaps > 0.05]
        return float(np.clip(apart.min(initial=1.2) / 1.2, 0.3, 1.0))

    @cached_property
    def facing(self) -> float:
        """The side of the platform plane on which its body lies, ±1; away from a1 at home."""
        return 1.0 if self.frame.state.mode & 4 == 0 else -1.0


# Half the edge of a cube about a joint, in scene units.
HALF_JOINT = 0.8
NO_POINTS: FloatArray = np.empty((0, 3))


class ScenePart(ABC):
    """A part of the scene."""

    @abstractmethod
    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the part in this frame."""

    def corners(self, placed: Placed) -> FloatArray:  # noqa: ARG002 - most parts are within others
        """Return the points that a picture of the whole mechanism must show, shape (n, 3)."""
        return NO_POINTS


def around(points: FloatArray) -> FloatArray:
    """Return the corners of cubes about points (n, 3) of the mechanism, shape (8 n, 3)."""
    half = corners_of(np.array([[-HALF_JOINT] * 3, [HALF_JOINT] * 3]))
    return (points[:, None] + half).reshape(-1, 3)


def outline(snapshot: Snapshot) -> FloatArray:
    """Return lines along base, legs and platform, in design units, shape (n, 2, 3)."""
    points = snapshot.points
    d1, d3 = float(snapshot.joints[1]), float(snapshot.joints[3])
    first, second = np.array([d1, 0.0, 0.0]), np.array([d3, 0.0, 0.0])
    # The part of the guide between a1 and the carriages.
    low, high = np.array([[min(0.0, d1, d3), 0.0, 0.0], [max(0.0, d1, d3), 0.0, 0.0]])
    base = ((low, high), (points.a1, points.a3), (high, points.a3))
    corners = (points.b1, points.b2, points.b3, points.b4)
    legs = zip((points.a1, first, second, points.a3), corners, strict=True)
    return np.array([*base, *legs, *itertools.combinations(corners, 2)])
