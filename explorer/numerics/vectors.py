"""Vectors of three numbers, as functions that kernels call."""

from __future__ import annotations

import math

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper

Vector = tuple[float, float, float]


@helper
def vector_of(values: FloatArray) -> Vector:
    """Return an array (3,) as a vector."""
    return (values[0], values[1], values[2])


@helper
def vector(points: FloatArray, index: int) -> Vector:
    """Return a row of an array (n, 3)."""
    return (points[index, 0], points[index, 1], points[index, 2])


@helper
def column(matrix: FloatArray, index: int) -> Vector:
    """Return a column of an array (3, n)."""
    return (matrix[0, index], matrix[1, index], matrix[2, index])


@helper
def times(matrix: FloatArray, a: FloatArray | Vector) -> Vector:
    """Return the product of a matrix (3, 3) and a vector (3,)."""
    return (
        matrix[0, 0] * a[0] + matrix[0, 1] * a[1] + matrix[0, 2] * a[2],
        matrix[1, 0] * a[0] + matrix[1, 1] * a[1] + matrix[1, 2] * a[2],
        matrix[2, 0] * a[0] + matrix[2, 1] * a[1] + matrix[2, 2] * a[2],
    )


@helper
def minus(a: Vector, b: Vector) -> Vector:
    """Return a − b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@helper
def along(a: Vector, share: float, b: Vector) -> Vector:
    """Return a + share · b."""
    return (a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2])


@helper
def dot3(a: Vector, b: Vector) -> float:
    """Return a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@helper
def cross3(a: Vector, b: Vector) -> Vector:
    """Return a × b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@helper
def norm3(a: Vector) -> float:
    """Return the length of a vector."""
    return math.sqrt(dot3(a, a))


@helper
def along_axis(axis: int, size: float) -> Vector:
    """Return a vector of a size along an axis."""
    return (size if axis == 0 else 0.0, size if axis == 1 else 0.0, size if axis == 2 else 0.0)
