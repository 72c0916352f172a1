"""Array types, and the conversion of a caller's numbers to checked float64 arrays.

Leading axes are batch axes everywhere; docstrings give the shapes of the trailing axes.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from explorer.errors import InputError
from explorer.numerics.checks import FARTHEST, size_problem

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def finite_array(
    name: str,
    value: ArrayLike,
    shape: tuple[int, ...],
    most: float = math.inf,
    *,
    signed: bool = True,
) -> FloatArray:
    """Return numbers as a float64 array, after checking their shape and that all are finite.

    Args:
        name: Name of the value in the error message.
        value: Numbers that NumPy can read, shape (..., *shape).
        shape: Required trailing axes.
        most: Largest size of an entry.
        signed: Whether an entry may be negative.

    Raises:
        InputError: The value is not numeric, has another shape, or has an entry that is not
            finite, too large, or negative where none may be.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} must be numbers of shape {_shape_text(shape)}: {error}") from None
    if array.ndim < len(shape) or array.shape[array.ndim - len(shape) :] != shape:
        raise InputError(
            f"{name} must have the shape {_shape_text(shape)}, leading batch axes allowed; "
            f"got {array.shape}"
        )
    # A number that is none is not allowed either.
    allowed = np.isfinite(array) if math.isinf(most) else np.abs(array) <= most
    if not allowed.all():
        odd = float(array[~allowed].flat[0])
        if not math.isfinite(odd):
            raise InputError(f"{name} must be finite numbers; got {odd}")
        raise InputError(f"{name} {size_problem(odd, most=most)}")
    if not signed and (array < 0.0).any():
        raise InputError(f"{name} must not be negative; got {array.min():g}")
    return array


def positive_array(name: str, value: ArrayLike, count: int) -> FloatArray:
    """Return positive numbers (..., count), which may be infinite for no limit or a rigid part."""
    array = np.asarray(value, dtype=np.float64)
    if array.shape[-1:] != (count,) or not (array > 0.0).all():
        text = np.array2string(array, threshold=12).replace("\n", "")
        raise InputError(f"{name} must be {count} positive numbers, which may be inf; got {text}")
    return array


def position_array(name: str, value: ArrayLike) -> FloatArray:
    """Return positions (..., 3) as `finite_array` does, none beyond `FARTHEST`."""
    return finite_array(name, value, (3,), FARTHEST)


def _shape_text(shape: tuple[int, ...]) -> str:
    return f"(..., {', '.join(map(str, shape))})" if shape else "(...)"


def for_kernel(array: FloatArray) -> FloatArray:
    """Return the array contiguous and writeable, as the signatures of compiled kernels require."""
    contiguous = np.ascontiguousarray(array)
    return contiguous if contiguous.flags.writeable else contiguous.copy()


def rows_for_kernel(array: FloatArray, batch: tuple[int, ...], trailing: int) -> FloatArray:
    """Return an array with `trailing` axes of its own as one row for each entry of a batch."""
    own = array.shape[array.ndim - trailing :]
    shape = (*batch, *own)
    # A broadcast array is read-only and would be copied, also if it is as it was.
    spread = array if array.shape == shape else np.broadcast_to(array, shape)
    return for_kernel(spread.reshape(math.prod(batch), *own))


def batch_shape(*arrays: tuple[FloatArray, int]) -> tuple[int, ...]:
    """Return the common batch shape of arrays, each given with its number of trailing axes."""
    shapes = [array.shape[: array.ndim - trailing] for array, trailing in arrays]
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        raise InputError(f"batch axes {shapes} do not broadcast") from None


def triple(values: FloatArray) -> tuple[float, float, float]:
    """Return an array (3,) as three plain numbers."""
    x, y, z = values.tolist()
    return x, y, z


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the inner product over the last axis."""
    return np.asarray(np.einsum("...i,...i->...", a, b), dtype=np.float64)


def lengths_of(vectors: FloatArray) -> FloatArray:
    """Return the Euclidean norms of vectors (..., 3)."""
    return np.sqrt(dot(vectors, vectors))


def rotate(rotation: FloatArray, vector: FloatArray) -> FloatArray:
    """Return `rotation @ vector` over batches, shapes (..., 3, 3) and (..., 3)."""
    return np.asarray(np.einsum("...ij,...j->...i", rotation, vector), dtype=np.float64)
