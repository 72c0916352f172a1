"""Local minima of L + s S² over up to three angles.

L and S are linear in the cosine and the sine of each angle, so that one array of coefficients gives
the value and all derivatives. Newton's method refines the minima of a grid.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.numerics.arrays import FloatArray

# Number of grid angles in a turn, largest number of Newton steps, and the last step in radians.
GRID, STEPS, LAST_STEP = 12, 60, 1e-12
ANGLES = 3
"""Largest number of angles."""

# Relative rounding error of a value.
ROUNDING = 1e-15
# Orders of derivatives by each angle, of the gradient and of the Hessian.
_ORDERS = np.eye(ANGLES, dtype=np.int64)
FIRST = tuple(_ORDERS.T)
SECOND = tuple(np.moveaxis(_ORDERS[:, None] + _ORDERS, -1, 0))


def grid_minima(coefficients: FloatArray, sign: float, count: int) -> FloatArray:
    """Return the angles (n, 3) of local minima of a squared distance on a grid over all turns.

    For two angles these are the minima along either angle alone: far from a1 the value has
    valleys too narrow for the grid to locate the lowest point of their floor. For three
    angles there would be too many.
    """
    turn = np.linspace(0.0, 2.0 * math.pi, GRID, endpoint=False)
    powers = powers_of(turn)[:, 0]
    grids = [powers] * count + [powers[:1]] * (ANGLES - count)
    linear, square = coefficients
    for grid in reversed(grids):
        linear, square = (np.moveaxis(each @ grid.T, -1, 0) for each in (linear, square))
    value = linear + sign * square**2
    if count == 0:
        return np.zeros((1, ANGLES))
    along = [
        (value <= np.roll(value, 1, axis=axis)) & (value <= np.roll(value, -1, axis=axis))
        for axis in range(count)
    ]
    low = np.any(along, axis=0) if count == 2 else np.all(along, axis=0)
    return turn[np.argwhere(low)]


def minimise(coefficients: FloatArray, sign: FloatArray, angles: FloatArray) -> FloatArray:
    """Lower squared distances by Newton's method; change the angles (n, 3) and return the values.

    For the arguments see `derivatives`.
    """
    value, slope, curvature = derivatives(coefficients, sign, angles)
    rounding = ROUNDING * np.abs(coefficients[:, 0]).sum(axis=(1, 2, 3))
    damping = np.zeros(len(angles))
    active = np.arange(len(angles))
    for _ in range(STEPS):
        curvatures, axes = np.linalg.eigh(curvature[active])
        # The step descends even if the value is not convex, and is short if it is flat.
        curvatures = np.maximum(np.abs(curvatures), 1e-9) + damping[active, None]
        along = (np.swapaxes(axes, -1, -2) @ slope[active, :, None])[..., 0] / curvatures
        step = -(axes @ along[..., None])[..., 0]
        longest = np.abs(step).max(axis=-1)
        step *= np.minimum(1.0, 0.5 / np.maximum(longest, 1e-300))[:, None]
        trial = angles[active] + step
        moved = derivatives(coefficients[active], sign[active], trial)
        better = moved[0] <= value[active] + rounding[active]
        done = active[better]
        angles[done] = trial[better]
        value[done], slope[done], curvature[done] = (each[better] for each in moved)
        old = damping[active]
        damping[active] = np.where(better, 0.1 * old, np.maximum(10.0 * old, 1e-2))
        active = active[longest > LAST_STEP]
        if not len(active):
            break
    return value


def derivatives(
    coefficients: FloatArray, sign: FloatArray, angles: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return values (n,), gradients (n, 3) and Hessians (n, 3, 3) of squared distances.

    Args:
        coefficients: Coefficients of L and S, shape (n, 2, 3, 3, 3).
        sign: The sign s of the square, shape (n,).
        angles: Angles, shape (n, 3).
    """
    count = len(angles)
    powers = np.swapaxes(powers_of(angles), -1, -2)
    # Each product replaces the last axis by orders of derivatives, and puts it first.
    result = coefficients.reshape(count, 2, 9, 3)
    for angle in (2, 1, 0):
        product = result.reshape(count, -1, 3) @ powers[:, angle]
        result = np.moveaxis(product.reshape(count, 2, 9, 3), 3, 2)
    result = result.reshape(count, 2, 3, 3, 3)
    linear, square = result[:, 0], result[:, 1]
    base = square[:, 0, 0, 0]
    first = square[:, *FIRST]
    value = linear[:, 0, 0, 0] + sign * base**2
    slope = linear[:, *FIRST] + 2.0 * (sign * base)[:, None] * first
    curvature = linear[:, *SECOND] + 2.0 * sign[:, None, None] * (
        base[:, None, None] * square[:, *SECOND] + first[:, :, None] * first[:, None, :]
    )
    return value, slope, curvature


def powers_of(angles: FloatArray) -> FloatArray:
    """Return cosine, sine and 1 of angles (...), and two derivatives of each, (..., 3, 3)."""
    cosine, sine = np.cos(angles), np.sin(angles)
    powers = np.zeros((*angles.shape, 3, 3))
    powers[..., 0, 0], powers[..., 0, 1], powers[..., 0, 2] = cosine, sine, 1.0
    powers[..., 1, 0], powers[..., 1, 1] = -sine, cosine
    powers[..., 2, 0], powers[..., 2, 1] = -cosine, -sine
    return powers
