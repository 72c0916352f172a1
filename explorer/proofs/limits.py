"""The limits of a design over a box of positions of b4 and over all tilts from an orientation.

A tilt turns the platform about an axis parallel to the base plane. At one orientation closed forms
tell the worst position of the box: a longest length is convex in the position, so that its maximum
is at a corner; a shortest one is the distance of the box from a point; all other quantities are
linear.

Over a cell of azimuths and tilts a vector R v of the platform is within e |v| of a convex
combination of its values at the four corners, with e of the order of the square of the cell. A
slack that is concave in such vectors is therefore at least the least one of the corners, less e
times its rate. That of a shortest length is not concave: for it the half-space behind a plane that
touches the box stands for the box, since the distance from that is linear and no greater.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray, dot, lengths_of
from explorer.numerics.cells import CellValues, corners_of_cells, largest_values
from explorer.proofs.proof import Proof, proofs_of
from explorer.workspace.limits import quantities
from explorer.workspace.limits.constraints import apex_of, line_of
from explorer.workspace.limits.quantities import Bound
from explorer.workspace.limits.table import bounds_angles, demands_of

AXES_OF_LEGS = np.array([[1.0, 1.0, 1.0], [0.0, 1.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]])
"""The axes of the base along which each leg extends, shape (4, 3)."""


class End(NamedTuple):
    """One end of the range of a quantity.

    Attributes:
        name: Name of the limit at this end.
        quantity: Index of the quantity.
        bound: The end.
        side: 1 for a maximum, −1 for a minimum.
    """

    name: str
    quantity: int
    bound: Bound
    side: float

    @property
    def leg(self) -> int | None:
        """Index of the leg whose length it is; None for a quantity linear in the position."""
        return self.quantity - quantities.L1 if self.quantity >= quantities.L1 else None

    @property
    def is_shortest(self) -> bool:
        """Whether it is the least length of a leg."""
        return self.leg is not None and self.side < 0.0


class BoxLimits:
    """The limits of a design over a box of positions of b4, lows and highs, at tilts of a rotation.

    Raises:
        InputError: The design bounds the swing of a joint.
    """

    def __init__(self, design: Design, box: tuple[Triple, Triple], rotation: FloatArray) -> None:
        if bounds_angles(design):
            raise InputError("limits over a box are not decided for a design that bounds swings")
        self.design = design
        self.lows: FloatArray = np.array(box[0])
        self.highs: FloatArray = np.array(box[1])
        self.ends: list[End] = []
        for demand in demands_of(design):
            for bound, name, side in demand.finite_ends():
                if demand.quantity == quantities.GAP:
                    # No tilt that keeps the gap changes the order of the carriages.
                    self.ends.append(_end_of_gap(design, rotation, name, bound))
                elif side > 0.0 or bound.value > 0.0 or demand.quantity < quantities.L1:
                    self.ends.append(End(name, demand.quantity, bound, side))

    def rate(self, end: End) -> float:
        """Return the most by which a slack changes with a change of unit vectors by 1."""
        if end.leg is not None:
            return float(lengths_of(self.design.platform_points[end.leg]))
        if end.quantity in (quantities.DELTA1, quantities.DELTA2):
            return float(lengths_of(np.maximum(np.abs(self.lows), np.abs(self.highs))))
        return abs(float(line_of(self.design, np.eye(3), end.quantity)[1]))

    def worst(self, end: End, r: FloatArray) -> FloatArray:
        """Return the positions in the box with the least slacks at orientations, (..., 3)."""
        if end.leg is None:
            return self._farthest(end.side * line_of(self.design, r, end.quantity)[0])
        centre = apex_of(self.design, r, end.leg)[0]
        if end.is_shortest:
            return np.clip(centre, self.lows, self.highs)
        return self._farthest(0.5 * (self.lows + self.highs) - centre)

    def slacks(self, end: End, r: FloatArray, positions: FloatArray) -> FloatArray:
        """Return the slacks at orientations (..., 3, 3) and positions (..., 3), shape (...)."""
        if end.leg is None:
            normal, offset, _ = line_of(self.design, r, end.quantity)
            value = dot(normal, positions) + offset
        else:
            leg = (positions - apex_of(self.design, r, end.leg)[0]) * AXES_OF_LEGS[end.leg]
            value = lengths_of(leg)
        return end.side * (end.bound.value - value)

    def bound_cells(self, end: End, r: FloatArray, least: FloatArray) -> FloatArray:
        """Return lower bounds of the slacks at all means of c orientations, shape (n,).

        The least slacks (n,) are those at the orientations, (n, c, 3, 3).
        """
        if end.leg is None or not end.is_shortest:
            return least
        centres, axes = apex_of(self.design, r, end.leg)[0], AXES_OF_LEGS[end.leg]
        middle = centres.mean(axis=1)
        outwards = (middle - np.clip(middle, self.lows, self.highs)) * axes
        normal = outwards / np.maximum(lengths_of(outwards), 1e-300)[:, None]
        farthest = dot(normal, self._farthest(normal))
        nearest = dot(centres, normal[:, None]).min(axis=1) - farthest
        return np.maximum(nearest, 0.0) - end.bound.value

    def _farthest(self, direction: FloatArray) -> FloatArray:
        """Return the corners that lie farthest along directions (..., 3)."""
        return np.where(np.greater(direction, 0.0), self.highs, self.lows)


def _end_of_gap(design: Design, rotation: FloatArray, name: str, bound: Bound) -> End:
    """Return the end of d3 − d1 that keeps a gap on its side of zero at a rotation."""
    if (design.b3 - design.b2) * rotation[0, 0] >= 0.0:
        return End(name, quantities.ORDER, bound, -1.0)
    return End(name, quantities.ORDER, Bound(-bound.value), 1.0)


def tilted_rotations(rotation: FloatArray, tilts: FloatArray) -> FloatArray:
    """Return an orientation tilted by azimuths and tilts (..., 2) in degrees, (..., 3, 3)."""
    angles = np.radians(tilts)
    (x, c), (y, s) = (np.moveaxis(each(angles), -1, 0) for each in (np.cos, np.sin))
    across = (1.0 - c) * x * y
    rows = (
        (c + (1.0 - c) * y * y, -across, s * x),
        (-across, c + (1.0 - c) * x * x, s * y),
        (-s * x, -s * y, c),
    )
    turns = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    return turns @ rotation


def prove_limits(
    design: Design, box: tuple[Triple, Triple], rotation: FloatArray, tilt: float = 0.0
) -> list[Proof]:
    """Prove that the limits hold over a box and over all tilts up to one, or find where they fail.

    Collisions of legs are not among them. Limits hold to their tolerance; amounts are shares of the
    reach, and places azimuths and tilts.

    Args:
        design: The manipulator.
        box: Lows and highs of the positions of b4, in design units.
        rotation: Orientation that is tilted, platform to base, shape (3, 3).
        tilt: Largest tilt in every azimuth, in degrees, below 90.

    Raises:
        InputError: The design bounds the swing of a joint, or the tilt is out of range.
    """
    if not 0.0 <= tilt < 90.0:
        raise InputError(f"the tilt must be at least 0° and below 90°; got {tilt:.6g}°")
    over = BoxLimits(design, box, rotation)

    def measure(lows: FloatArray, highs: FloatArray) -> CellValues:
        places = corners_of_cells(lows, highs)
        r = tilted_rotations(rotation, places)
        azimuths, tilts = np.radians(highs - lows).T
        # Second derivatives of R v by the tilt are at most |v|, by the azimuth |v| times this.
        largest = np.radians(highs[:, 1])
        turning = np.sin(largest) + 2.0 * (1.0 - np.cos(largest))
        error = 0.125 * (tilts**2 + azimuths**2 * turning)
        shape = (len(lows), len(over.ends))
        found = CellValues(np.empty(shape), np.empty((*shape, 2)), np.empty(shape))
        for index, end in enumerate(over.ends):
            slacks = over.slacks(end, r, over.worst(end, r))
            worst, least = slacks.argmin(axis=1), slacks.min(axis=1)
            bound = over.bound_cells(end, r, least) - over.rate(end) * error
            found.values[:, index] = -(least + design.tolerance) / design.reach
            found.places[:, index] = places[np.arange(len(places)), worst]
            found.bounds[:, index] = -(bound + design.tolerance) / design.reach
        return found

    def pose_of(index: int, place: FloatArray) -> tuple[FloatArray, FloatArray]:
        r = tilted_rotations(rotation, place)
        return over.worst(over.ends[index], r), r

    found = largest_values(measure, np.array([-180.0, 0.0]), np.array([180.0, tilt]))
    return proofs_of([end.name for end in over.ends], found, pose_of)
