"""Validity of poses: whether they satisfy all demands of a design, in compiled loops.

The demands are the limits, the home's sign triple and the clearances of all pairs of legs.
`explorer.workspace.limits.broken` and `explorer.legs.clearance`, with which this module agrees,
name the demands that a pose violates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.clearance import joined_pairs, radii_of_pairs
from explorer.legs.segments import closest_shares, square_at
from explorer.mechanism.design import LENGTHS, TOLERANCE, Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import (
    BoolArray,
    FloatArray,
    batch_shape,
    finite_array,
    rows_for_kernel,
)
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import minus, vector
from explorer.workspace.limits.joint_cones import joint_cones

# Columns of the row of rules; see `Rules.of`.
A3, B1, B2, B3 = 0, 2, 4, 5
LENGTH_LOWS, LENGTH_HIGHS = 6, 10
GUIDE_LOW, GUIDE_HIGH, GAP = 14, 15, 16
BOX_LOWS, BOX_HIGHS = 17, 20
MARGIN, SIGNS, ORDER = 23, 24, 27
RADII = 28
RULE_COLUMNS = 34
# Columns of the rows of cones.
LEG, AXIS_X, AXIS_Y, AXIS_Z, COSINE, SINE, TURNS, CONE_COLUMNS = range(8)


@dataclass(frozen=True)
class Rules:
    """The demands of a design on a pose, as kernels take them.

    Attributes:
        row: Design variables, limits widened by their tolerance, signs of the home, order of the
            carriages and sums of radii, shape (RULE_COLUMNS,). A limit that is not demanded is
            infinite, an order that is not demanded 0.
        cones: Rows of the joints' cones: leg, axis, cosine and sine of the half-angle, and whether
            the axis turns with the platform, shape (n, CONE_COLUMNS). No pose satisfies a row
            whose leg is 0.
    """

    row: FloatArray
    cones: FloatArray

    @staticmethod
    def of(
        design: Design, signs: tuple[int, int, int] | None = None, order: int | None = None
    ) -> Rules:
        """Return the rules of a design.

        Args:
            design: The manipulator.
            signs: Sign triple to demand instead of the home's, even if no margin is demanded.
            order: Sign of d3 − d1 to demand, 0 for either; the design's if None.
        """
        limits, tolerance = design.limits, design.tolerance
        row = np.empty(RULE_COLUMNS)
        row[:LENGTH_LOWS] = design.variables
        for index, name in enumerate(LENGTHS):
            low, high = design.length_range(name)
            row[LENGTH_LOWS + index], row[LENGTH_HIGHS + index] = low - tolerance, high + tolerance
        low, high = limits.guide or (-math.inf, math.inf)
        row[GUIDE_LOW], row[GUIDE_HIGH] = low - tolerance, high + tolerance
        row[GAP] = limits.gap - tolerance
        lows, highs = limits.box or ((-math.inf,) * 3, (math.inf,) * 3)
        row[BOX_LOWS:BOX_HIGHS] = np.array(lows) - tolerance
        row[BOX_HIGHS:MARGIN] = np.array(highs) + tolerance
        row[MARGIN] = -math.inf if limits.margin is None else limits.margin - tolerance
        if signs is not None:
            row[MARGIN] = (limits.margin or 0.0) - tolerance
        row[SIGNS:ORDER] = signs or design.home_signs
        row[ORDER] = design.demanded_order if order is None else order
        # No clearance is demanded of a pair that shares a joint.
        row[RADII:] = np.where(joined_pairs(design), -1.0, radii_of_pairs(design))
        cones = np.zeros((len(joint_cones(design)), CONE_COLUMNS))
        for cone, cone_row in zip(joint_cones(design), cones, strict=True):
            if cone.axis is not None:
                angle = cone.half_angle + TOLERANCE
                # Half a turn is no bound, so its sine must be exact.
                cosine, sine = (
                    (math.cos(angle), math.sin(angle)) if angle < math.pi else (-1.0, 0.0)
                )
                cone_row[:] = (cone.leg, *cone.axis, cosine, sine, cone.in_platform)
        return Rules(row, cones)

    def without_clearances(self) -> Rules:
        """Return rules that demand no clearance."""
        row = self.row.copy()
        row[RADII:] = -1.0
        return Rules(row, self.cones)

    def tighten(self, margin: float, clearance: float) -> Rules:
        """Return rules that demand at least a margin and a clearance.

        Args:
            margin: Least margin in design units; ignored if the rules demand no margin.
            clearance: Clearance beyond the radii, in design units.
        """
        row = self.row.copy()
        if row[MARGIN] > -math.inf:
            row[MARGIN] = max(row[MARGIN], margin)
        row[RADII:] = np.where(row[RADII:] < 0.0, row[RADII:], row[RADII:] + clearance)
        return Rules(row, self.cones)


def poses_are_valid(
    design: Design, position: ArrayLike, rotation: ArrayLike, *, rules: Rules | None = None
) -> BoolArray:
    """Return whether poses satisfy all limits and clearances, shape (...).

    A clearance of zero is a collision, as for `explorer.tetrahedra_overlap`.

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (..., 3), in design units.
        rotation: Platform to base, shape (..., 3, 3).
        rules: Rules of the design, if they have been computed before.

    Raises:
        InputError: a pose that is not finite or not a rotation.
    """
    p, r = finite_array("position", position, (3,)), checked_rotation(rotation)
    batch = batch_shape((p, 1), (r, 2))
    p_rows, r_rows = rows_for_kernel(p, batch, 1), rows_for_kernel(r, batch, 2)
    valid = np.empty(len(p_rows), dtype=np.bool_)
    design_rules = rules or Rules.of(design)
    valid_rows(
        len(p_rows),
        design_rules.row,
        design_rules.cones,
        p_rows,
        r_rows,
        valid,
    )
    return valid.reshape(batch)


@helper
def is_root_within(square: float, low: float, high: float) -> bool:
    """Return whether the root of a square lies within bounds; `low` may be negative."""
    return square <= high * high and (low <= 0.0 or square >= low * low)


@helper
def carriages_apart(row: FloatArray, d1: float, d3: float) -> float:
    """Return the distance of the carriages; negative if they are not in the demanded order."""
    return row[ORDER] * (d3 - d1) if row[ORDER] != 0.0 else abs(d3 - d1)


@helper
def write_ends(
    row: FloatArray, p: FloatArray, r: FloatArray, base: FloatArray, ends: FloatArray
) -> None:
    """Write the base ends and the platform ends of the four legs, shape (4, 3) each."""
    for i in range(3):
        ends[0, i] = p[i] + row[B1] * r[i, 0] + row[B1 + 1] * r[i, 1]
        ends[1, i] = p[i] + row[B2] * r[i, 0]
        ends[2, i] = p[i] + row[B3] * r[i, 0]
        ends[3, i] = p[i]
        base[0, i] = base[1, i] = base[2, i] = base[3, i] = 0.0
    base[1, 0], base[2, 0] = ends[1, 0], ends[2, 0]
    base[3, 0], base[3, 1] = row[A3], row[A3 + 1]


@helper
def satisfies_limits(
    row: FloatArray, p: FloatArray, r: FloatArray, base: FloatArray, ends: FloatArray
) -> bool:
    """Return whether a pose satisfies the limits, other than cones and clearances."""
    for i in range(3):
        if not row[BOX_LOWS + i] <= p[i] <= row[BOX_HIGHS + i]:
            return False
    least = row[MARGIN]
    if least > -math.inf:
        delta1 = -(r[0, 2] * p[0] + r[1, 2] * p[1] + r[2, 2] * p[2])
        delta2 = r[1, 0] * p[2] - r[2, 0] * p[1]
        if (
            row[SIGNS] * delta1 < least
            or row[SIGNS + 1] * delta2 < least
            or row[SIGNS + 2] * p[2] < least
        ):
            return False
    d1, d3 = ends[1, 0], ends[2, 0]
    if min(d1, d3) < row[GUIDE_LOW] or max(d1, d3) > row[GUIDE_HIGH]:
        return False
    if carriages_apart(row, d1, d3) < row[GAP]:
        return False
    for leg in range(4):
        square = 0.0
        for i in range(3):
            square += (ends[leg, i] - base[leg, i]) ** 2
        if not is_root_within(square, row[LENGTH_LOWS + leg], row[LENGTH_HIGHS + leg]):
            return False
    return True


@helper
def satisfies_cones(cones: FloatArray, r: FloatArray, base: FloatArray, ends: FloatArray) -> bool:
    """Return whether a pose satisfies the cones of its joints."""
    for index in range(cones.shape[0]):
        leg = int(cones[index, LEG]) - 1
        if leg < 0:
            return False
        x, y, z = cones[index, AXIS_X], cones[index, AXIS_Y], cones[index, AXIS_Z]
        if cones[index, TURNS] > 0.0:
            x, y, z = (
                r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
                r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
                r[2, 0] * x + r[2, 1] * y + r[2, 2] * z,
            )
        a = ends[leg, 0] - base[leg, 0]
        b = ends[leg, 1] - base[leg, 1]
        c = ends[leg, 2] - base[leg, 2]
        along = a * x + b * y + c * z
        across = math.sqrt((b * z - c * y) ** 2 + (c * x - a * z) ** 2 + (a * y - b * x) ** 2)
        # The difference is the length times the sine of the cone's angle less the leg's.
        if cones[index, SINE] * along < cones[index, COSINE] * across:
            return False
    return True


@helper
def is_clear(i: int, j: int, radius: float, base: FloatArray, ends: FloatArray) -> bool:
    """Return whether the axes of two legs are farther apart than a sum of radii."""
    if radius < 0.0:
        return True
    # The projections on an axis of the base already separate most pairs.
    for axis in range(3):
        a, b = base[i, axis], ends[i, axis]
        c, d = base[j, axis], ends[j, axis]
        if max(min(a, b) - max(c, d), min(c, d) - max(a, b)) > radius:
            return True
    first, second = vector(base, i), vector(base, j)
    u, v = minus(vector(ends, i), first), minus(vector(ends, j), second)
    w = minus(first, second)
    s, t = closest_shares(u, v, w)
    return square_at(s, t, u, v, w) > radius * radius


@helper
def is_valid(
    row: FloatArray,
    cones: FloatArray,
    p: FloatArray,
    r: FloatArray,
    base: FloatArray,
    ends: FloatArray,
) -> bool:
    """Return whether a pose satisfies all rules; write the ends of the legs."""
    write_ends(row, p, r, base, ends)
    if not satisfies_limits(row, p, r, base, ends):
        return False
    if not satisfies_cones(cones, r, base, ends):
        return False
    pair = RADII
    for i in range(3):
        for j in range(i + 1, 4):
            if not is_clear(i, j, row[pair], base, ends):
                return False
            pair += 1
    return True


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], b1[::1])")
def valid_rows(
    row: FloatArray,
    cones: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    valid: BoolArray,
) -> None:
    """Write whether n poses satisfy all rules, given as the row and the cones of `Rules`."""
    base, ends = np.zeros((4, 3)), np.zeros((4, 3))
    for index in range(position.shape[0]):
        valid[index] = is_valid(row, cones, position[index], rotation[index], base, ends)
