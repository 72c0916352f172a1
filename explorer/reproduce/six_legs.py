"""Mechanisms with six straight legs to compare with: the 6-4 twin and an octahedral platform."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from explorer.legs.clearance import pair_rows
from explorer.legs.interference import tetrahedra_overlap
from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, for_kernel

TWIN = (("a1", "b1"), ("a1", "b2"), ("a1", "b3"), ("a2", "b2"), ("a2", "b3"), ("a3", "b4"))
"""The six legs of the 6-4 twin, base point and platform point (the paper's Figure 1a)."""


@dataclass(frozen=True)
class SixLegs:
    """A platform on six legs, each between a point of the base and one of the platform.

    Attributes:
        name: Name for people.
        base: Points of the base, shape (6, 3), in design units.
        platform: Points of the platform in its frame, shape (6, 3).
        longest: Largest length of every leg; there is no least one.
        flags: Whether the mechanism has the flags of the 4-4, so that margins are its modes.
        home: Position and rotation of its home pose.
    """

    name: str
    base: FloatArray
    platform: FloatArray
    longest: float
    flags: bool
    home: tuple[FloatArray, FloatArray]

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """(lows, highs) of a box about the workspace at the orientation of home, each (3,)."""
        centres = self.base - self.platform @ self.home[1].T
        return (centres - self.longest).max(axis=0), (centres + self.longest).min(axis=0)

    @cached_property
    def pairs(self) -> IntArray:
        """The pairs of legs that share no joint, shape (m, 2)."""
        ends = self.base, self.platform
        pairs = itertools.combinations(range(6), 2)
        return np.array([(i, j) for i, j in pairs if all((p[i] != p[j]).any() for p in ends)])

    def lengths(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the lengths of the legs, shape (n, 6)."""
        axes = self.axes(position, rotation)
        return np.linalg.norm(axes[:, :, 1] - axes[:, :, 0], axis=-1)

    def axes(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return both ends of each leg, shape (n, 6, 2, 3)."""
        tips = position[:, None, :] + np.einsum("...ij,kj->...ki", rotation, self.platform)
        return np.stack([np.broadcast_to(self.base, tips.shape), tips], axis=-2)

    def clearances(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the distances of the axes of the pairs, shape (n, m)."""
        axes = self.axes(position, rotation)
        distance, points = np.empty((len(axes), 6)), np.empty((len(axes), 6, 2, 3))
        found: list[FloatArray] = []
        for i, j in self.pairs.tolist():
            # The first pair of these legs.
            pair_rows(len(axes), for_kernel(axes[:, [i, j, i, j]]), distance, points)
            found.append(distance[:, 0].copy())
        return np.stack(found, axis=-1)

    def step_overlaps(self, start: FloatArray, end: FloatArray, rotation: FloatArray) -> BoolArray:
        """Return whether legs collide on steps by the paper's test, shape (n,)."""
        one, two = self.axes(start, rotation), self.axes(end, rotation)
        swept = np.stack([one[:, :, 0], two[:, :, 0], one[:, :, 1], two[:, :, 1]], axis=-2)
        overlaps = [tetrahedra_overlap(swept[:, i], swept[:, j]) for i, j in self.pairs.tolist()]
        return np.asarray(np.any(overlaps, axis=0))

    def holds(self, position: FloatArray, rotation: FloatArray) -> BoolArray:
        """Return whether poses keep the lengths and the mode of home, shape (n,).

        Without flags the sign of det J stands for the mode, which may hold several.
        """
        within = (self.lengths(position, rotation) <= self.longest).all(axis=1)
        home, turned = self.home
        if self.flags:
            signs = np.sign(margins(home, turned))
            return within & (np.sign(margins(position, rotation)) == signs).all(axis=-1)
        sign = np.sign(self.determinant(home[None], turned[None]))[0]
        return within & (np.sign(self.determinant(position, rotation)) == sign)

    def determinant(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return det J of poses, rows (n; b × n) of unit directions, shape (n,)."""
        axes = self.axes(position, rotation)
        directions = axes[:, :, 1] - axes[:, :, 0]
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        arms = axes[:, :, 1] - position[:, None]
        return np.linalg.det(np.concatenate([directions, np.cross(arms, directions)], axis=-1))


def six_four_twin(design: Design, a2x: float) -> SixLegs:
    """Return the 6-4 twin of a design: each leg along the guide becomes two, from a1 and from a2.

    The 4-4 leaves a2x free. Every leg is at most as long as the longest one of the design.
    """
    flat = {"a2": (a2x, 0.0), "a3": design.a3, "b1": design.b1}
    flat |= {"b2": (design.b2, 0.0), "b3": (design.b3, 0.0)}
    points = {name: (*flat.get(name, (0.0, 0.0)), 0.0) for pair in TWIN for name in pair}
    home = design.home_pose
    return SixLegs(
        f"6-4, a2x = {a2x:.4g}",
        np.array([points[base] for base, _ in TWIN]),
        np.array([points[tip] for _, tip in TWIN]),
        design.reach,
        flags=True,
        home=(np.array(home.position), home.rotation),
    )


def octahedral(design: Design, size: float = 1.0) -> SixLegs:
    """Return the octahedral Stewart-Gough platform of the same reach, its base scaled by a size.

    Base and platform are equilateral triangles with the areas of a1 a2 a3 and b1 b2 b3, turned
    against each other by 60°; neighbouring legs share their joints.
    """
    areas = design.a2x * design.a3[1], (design.b3 - design.b2) * design.b1[1]
    # The circumradius of an equilateral triangle follows from its area.
    base, platform = (math.sqrt(2.0 * abs(area) / (3.0 * math.sqrt(3.0))) for area in areas)
    corners, tips = np.radians([[0.0, 120.0, 240.0], [60.0, 180.0, 300.0]])
    a = size * base * np.column_stack([np.cos(corners), np.sin(corners), np.zeros(3)])
    b = platform * np.column_stack([np.cos(tips), np.sin(tips), np.zeros(3)])
    name = "octahedral" if size == 1.0 else f"octahedral × {size:g}"
    home = np.array([0.0, 0.0, 0.5 * design.reach]), np.eye(3)
    base_points, tips = a[[0, 1, 1, 2, 2, 0]], b[[0, 0, 1, 1, 2, 2]]
    return SixLegs(name, base_points, tips, design.reach, flags=False, home=home)
