"""Array types, and the one place where outside numbers become float64 arrays.

Leading axes are batch axes everywhere; the shapes in docstrings name the trailing ones.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from explorer.errors import InputError

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]


def finite_array(name: str, value: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Return `value` as float64 with the trailing `shape`, every entry finite.

    Args:
        name: What the value is called in the error message.
        value: Anything NumPy can read, shape (..., *shape).
        shape: The trailing axes that are required.

    Raises:
        InputError: not numeric, of another shape, or with NaN or infinite entries.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be numbers of shape {_shown(shape)}: {error}") from None
    if array.ndim < len(shape) or array.shape[array.ndim - len(shape) :] != shape:
        raise InputError(
            f"{name} must have the shape {_shown(shape)}, leading batch axes allowed; "
            f"got {array.shape}"
        )
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite numbers; got {_first_odd(array)}")
    return array


def _shown(shape: tuple[int, ...]) -> str:
    return f"(..., {', '.join(map(str, shape))})" if shape else "(...)"


def _first_odd(array: FloatArray) -> str:
    return str(float(array[~np.isfinite(array)].flat[0]))


def for_kernel(array: FloatArray) -> FloatArray:
    """Return the array as compiled kernels take it: contiguous, and not read-only."""
    contiguous = np.ascontiguousarray(array)
    return contiguous if contiguous.flags.writeable else contiguous.copy()


def batch_shape(*arrays: tuple[FloatArray, int]) -> tuple[int, ...]:
    """Return the common leading shape of arrays given with their number of trailing axes.

    Raises:
        InputError: the batch axes do not broadcast.
    """
    shapes = [array.shape[: array.ndim - trailing] for array, trailing in arrays]
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        raise InputError(f"batch axes {shapes} do not broadcast") from None


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the inner product over the last axis."""
    return np.asarray(np.einsum("...i,...i->...", a, b), dtype=np.float64)


def rotate(rotation: FloatArray, vector: FloatArray) -> FloatArray:
    """Return `rotation @ vector` over batches, shapes (..., 3, 3) and (..., 3)."""
    return np.asarray(np.einsum("...ij,...j->...i", rotation, vector), dtype=np.float64)
