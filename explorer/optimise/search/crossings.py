"""Positions of a workspace at which a demanded clearance is violated, if there are any."""

from __future__ import annotations

from collections.abc import Callable

from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.workspace.least_clearance import least_clearances


def crossings(
    design: Design,
    rotation: FloatArray,
    clearance: float,
    margin: float,
    tolerance: float,
    before_each: Callable[[], None],
) -> FloatArray:
    """Return the positions of the least clearances that are less than demanded, shape (k, 3).

    Args:
        design: The manipulator.
        rotation: Rotation from platform to base, shape (3, 3).
        clearance: Clearance demanded of every pair of legs.
        margin: Least |δ| of the positions that count.
        tolerance: Tolerance of a least clearance, over the clearance demanded.
        before_each: Function that is called before each batch of positions; it may raise.
    """
    least = least_clearances(
        design,
        rotation,
        tolerance * clearance,
        below=clearance,
        margin=margin,
        before_each=before_each,
    )
    return least.position[least.clearance < clearance]
