"""The longest of all sums Σ ± v_i of vectors, which is the farthest vertex of their zonotope."""

from __future__ import annotations

import math

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector, along, cross3, dot3, vector

# Sine of the angle up to which vectors count as parallel or in one plane. In the farthest sum S
# each vector w has w · S ≥ |w|², so that the wrong sign of one within this angle of the plane
# across S changes |S| by less than this share squared, which is rounding.
FLAT = 1e-8


@helper
def toward(total: Vector, side: float, w: Vector) -> Vector:
    """Return the total plus w where `side` is positive, and minus w elsewhere."""
    return along(total, 1.0 if side > 0.0 else -1.0, w)


@helper
def merge_parallel(columns: FloatArray, scale: float, w: FloatArray, u: FloatArray) -> int:
    """Write vectors w of which no two are parallel, and units u along them; return their number.

    The columns (3, m) are divided by the scale; parallel ones are added, pointing to one side.
    """
    count = 0
    for k in range(columns.shape[1]):
        v = (columns[0, k] / scale, columns[1, k] / scale, columns[2, k] / scale)
        length = math.sqrt(dot3(v, v))
        if length == 0.0:
            continue
        unit = (v[0] / length, v[1] / length, v[2] / length)
        i = 0
        while i < count:
            across = cross3(unit, vector(u, i))
            if dot3(across, across) <= FLAT * FLAT:
                break
            i += 1
        if i == count:
            count += 1
            u[i, 0], u[i, 1], u[i, 2] = unit
            w[i, 0], w[i, 1], w[i, 2] = v
        else:
            w[i, 0], w[i, 1], w[i, 2] = toward(vector(w, i), dot3(unit, vector(u, i)), v)
    return count


@helper
def longest_sum(w: FloatArray, u: FloatArray, count: int) -> Vector:
    """Return the longest sum Σ ± w_i of vectors of which no two are parallel.

    It is a vertex of the zonotope, which is the farthest one in a cone of directions. An edge n of
    that cone is perpendicular to two vectors i and j. Vectors out of the plane of i and j have
    the sign of their product with n; those in it have that with the normal of i in the plane, and i
    has both. The vectors of a plane span a polygon with i along one of its edges; every corner of
    it ends an edge of another vector too, so that pairs with i < j suffice.
    """
    longest, most = vector(w, 0), 0.0
    for i in range(count):
        for j in range(i + 1, count):
            normal = cross3(vector(u, i), vector(u, j))
            flat = FLAT * math.sqrt(dot3(normal, normal))
            inner = cross3(normal, vector(u, i))
            out, within = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            for k in range(count):
                if k != i:
                    side = dot3(normal, vector(u, k))
                    if abs(side) > flat:
                        out = toward(out, side, vector(w, k))
                    else:
                        within = toward(within, dot3(inner, vector(u, k)), vector(w, k))
            for corner in range(4):
                total = toward(out, 0.5 - (corner & 1), within)
                total = toward(total, 1.0 - (corner & 2), vector(w, i))
                square = dot3(total, total)
                if square > most:
                    longest, most = total, square
    return longest


@kernel("void(f8[:,:,::1], f8[:,::1])")
def farthest_rows(vectors: FloatArray, signs: FloatArray) -> None:
    """Write the signs (n, m) of the longest sum Σ ± w_i of each of n sets of columns (n, 3, m).

    Signs are 1 or −1; 0 for a zero vector, and for a set of which one vector is not finite.
    """
    m = vectors.shape[2]
    w, u = np.zeros((m, 3)), np.zeros((m, 3))
    for n in range(vectors.shape[0]):
        scale, finite = 0.0, True
        for k in range(m):
            signs[n, k] = 0.0
            for axis in range(3):
                size = abs(vectors[n, axis, k])
                scale, finite = max(scale, size), finite and math.isfinite(size)
        if scale == 0.0 or not finite:
            continue
        total = longest_sum(w, u, merge_parallel(vectors[n], scale, w, u))
        # Every vector of the longest sum points to its side.
        for k in range(m):
            v = (vectors[n, 0, k] / scale, vectors[n, 1, k] / scale, vectors[n, 2, k] / scale)
            side = dot3(total, v)
            if side != 0.0:
                signs[n, k] = 1.0 if side > 0.0 else -1.0


def signs_of_longest_sums(vectors: FloatArray) -> FloatArray:
    """Return the signs of the longest sums, shape (..., m), of columns of arrays (..., 3, m).

    They are 1 or −1; 0 for a zero vector, and for all of a set of which one is not finite.
    """
    signs = np.empty((*vectors.shape[:-2], vectors.shape[-1]))
    count = math.prod(signs.shape[:-1])
    farthest_rows(
        count, vectors.reshape(count, *vectors.shape[-2:]), signs.reshape(count, signs.shape[-1])
    )
    return signs
