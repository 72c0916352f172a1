"""Whether two tetrahedra overlap, by the separating axis theorem, flat ones included.

Two convex bodies are apart if and only if their projections on some axis are. Four kinds
of test, from the cheapest on; each answers only where it is sure and hands on the rest:

1. the axes of coordinates, then the eight face normals;
2. where one is solid, its six edges: a plane through an edge is a mix of the two faces
   that meet there, so all 36 axes edge × edge come down to the distances from the faces,
   as in F. Ganovelli, F. Ponchio and C. Rocchini, "Fast tetrahedron-tetrahedron overlap
   algorithm" (2002);
3. where both are flat, their sections with the line in which their planes meet;
4. else (touching, parallel planes, segments, points) every axis edge × edge one by one,
   and the shortest connections of edges, which are the axes within a common plane.

The first three look at many pairs side by side, see `explorer.legs.overlap_lanes`.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.overlap_lanes import (
    ANGLE,
    BODY,
    ENDS,
    FACE,
    GAP,
    HEIGHT,
    HIGH,
    LANES,
    LARGEST,
    LOW,
    NEAR,
    ODD,
    OPEN,
    OWN,
    SIZE,
    SLACK,
    STATES,
    TOLERANCE,
    test_boxes,
    test_edges,
    test_faces,
    write_sections,
)
from explorer.legs.segments import Vector, closest_shares, cross3, dot3, minus
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, batch_shape, finite_array
from explorer.numerics.compiled import MANY_ROWS, helper, kernel

# Flat bodies at least this wide and this much inclined, as shares, have a section that is
# sure where its vertices and ends are this clear.
WIDE, CLEAR = 1e-3, 1e-5
EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
UNSURE, APART, OVERLAPPING = 0, 1, 2


@helper
def vertex(body: FloatArray, k: int) -> Vector:
    """Return a row of a (4, 3) array."""
    return (body[k, 0], body[k, 1], body[k, 2])


@helper
def size1(n: Vector) -> float:
    """Return the sum of the magnitudes, a cheap stand-in for the length."""
    return abs(n[0]) + abs(n[1]) + abs(n[2])


@helper
def sort_out(
    numbers: FloatArray,
    vertices: FloatArray,
    faces: FloatArray,
    state: FloatArray,
    known: IntArray,
) -> None:
    """Write what is known of the pairs in the lanes, as many as there are results.

    The coordinates, the faces, and the edges of the first body where it is solid.
    """
    many = len(known)
    test_boxes(numbers, vertices, state, many)
    test_faces(vertices, faces, state, many)
    solid = False
    for k in range(many):
        solid = solid or (state[GAP + k] <= 0.0 and state[HEIGHT + k] > 0.0)
    if solid:
        test_edges(faces, state, 0, many)
    for k in range(many):
        known[k] = UNSURE
        if state[GAP + k] > 0.0:
            known[k] = APART
        elif state[HEIGHT + k] > 0.0 and state[OPEN + k] == 0.0:
            known[k] = OVERLAPPING


@helper
def settle(
    numbers: FloatArray,
    vertices: FloatArray,
    faces: FloatArray,
    state: FloatArray,
    rows: IntArray,
    overlap: BoolArray,
) -> None:
    """Write at the given rows whether the pairs in the lanes overlap that were left unsure."""
    many = len(rows)
    test_boxes(numbers, vertices, state, many)
    test_faces(vertices, faces, state, many)
    solid, flat = False, False
    for k in range(many):
        solid = solid or state[HEIGHT + LANES + k] > 0.0
        flat = flat or state[HEIGHT + LANES + k] <= 0.0
    if solid:
        test_edges(faces, state, 1, many)
    if flat:
        write_sections(vertices, faces, state, many)
    bodies = np.zeros((2, 4, 3))
    for k in range(many):
        known = UNSURE
        if state[GAP + k] > 0.0:
            known = APART
        elif state[HEIGHT + LANES + k] > 0.0:
            known = OVERLAPPING if state[OPEN + LANES + k] == 0.0 else UNSURE
        elif state[HEIGHT + k] <= 0.0:
            known = by_sections(faces, state, k)
        if known == UNSURE:
            for corner in range(4):
                for axis in range(3):
                    at = (3 * corner + axis) * LANES + k
                    bodies[0, corner, axis] = vertices[at]
                    bodies[1, corner, axis] = vertices[at + BODY * LANES]
            known = by_all_axes(bodies, state[TOLERANCE + k])
        overlap[rows[k]] = known == OVERLAPPING


@helper
def by_sections(faces: FloatArray, state: FloatArray, lane: int) -> int:
    """Decide on two flat bodies by their sections with the line where their planes meet."""
    f, g = LARGEST + lane, LARGEST + FACE * LANES + lane
    size_f, size_g = faces[f + 3 * LANES], faces[g + 3 * LANES]
    size, angle = state[SIZE + lane], state[ANGLE + lane]
    flat = faces[f + OWN] <= faces[f + SLACK] and faces[g + OWN] <= faces[g + SLACK]
    # Of what is next to a segment or a point the normal is rounding.
    wide = min(size_f, size_g) > WIDE * size * size
    if not (flat and wide) or angle <= WIDE * size_f * size_g:
        return UNSURE
    # A vertex close to the other's plane makes the section unsure.
    near, near2 = state[NEAR + lane], state[NEAR + ENDS + lane]
    if near <= CLEAR * size * size_g or near2 <= CLEAR * size * size_f:
        return UNSURE
    apart = max(
        state[LOW + lane] - state[HIGH + ENDS + lane],
        state[LOW + ENDS + lane] - state[HIGH + lane],
    )
    margin = CLEAR * size * angle
    if apart > margin:
        return APART
    return OVERLAPPING if apart < -margin else UNSURE


@helper
def is_separating(n: Vector, bodies: FloatArray, tolerance: float) -> bool:
    """Whether the projections of both on an axis are apart."""
    low, high, low2, high2 = math.inf, -math.inf, math.inf, -math.inf
    for k in range(4):
        x, y = dot3(n, vertex(bodies[0], k)), dot3(n, vertex(bodies[1], k))
        low, high, low2, high2 = min(low, x), max(high, x), min(low2, y), max(high2, y)
    return max(low - high2, low2 - high) > tolerance * size1(n)


@helper
def without(w: Vector, u: Vector) -> Vector:
    """Return the part of w perpendicular to u, where u is not zero."""
    uu = dot3(u, u)
    share = dot3(w, u) / uu if uu > 0.0 else 0.0
    return (w[0] - share * u[0], w[1] - share * u[1], w[2] - share * u[2])


@helper
def by_all_axes(bodies: FloatArray, tolerance: float) -> int:
    """Decide by all 36 axes edge × edge and the 36 shortest connections of edges."""
    for i, j in EDGES:
        a = vertex(bodies[0], i)
        u = minus(vertex(bodies[0], j), a)
        for k, m in EDGES:
            b = vertex(bodies[1], k)
            v = minus(vertex(bodies[1], m), b)
            r = minus(a, b)
            s, t = closest_shares(u, v, r)
            w = (
                r[0] + s * u[0] - t * v[0],
                r[1] + s * u[1] - t * v[1],
                r[2] + s * u[2] - t * v[2],
            )
            if size1(w) <= tolerance:
                return OVERLAPPING
            if is_separating(cross3(u, v), bodies, tolerance):
                return APART
            # A short connection is mostly rounding, but for what is perpendicular.
            if 0.0 < s < 1.0:
                w = without(w, u)
            if 0.0 < t < 1.0:
                w = without(w, v)
            if is_separating(w, bodies, tolerance):
                return APART
    return OVERLAPPING


@kernel("void(f8[:,:,::1], f8[:,:,::1], b1[::1], i8[::1])")
def overlap_rows(p: FloatArray, q: FloatArray, overlap: BoolArray, odd: IntArray) -> None:
    """Write for each pair whether it overlaps.

    Args:
        p: Shape (n, 4, 3).
        q: Shape (n, 4, 3).
        overlap: Written, shape (n,).
        odd: Written: how many pairs have a number that is not finite, shape (1,).
    """
    numbers, waiting = np.zeros(24 * LANES), np.zeros(24 * LANES)
    vertices, faces = np.zeros(2 * BODY * LANES), np.zeros(10 * FACE * LANES)
    state, known = np.zeros(STATES * LANES), np.zeros(LANES, dtype=np.int64)
    rows = np.zeros(LANES, dtype=np.int64)
    odd[0] = 0
    unsure = 0
    for start in range(0, p.shape[0], LANES):
        many = min(LANES, p.shape[0] - start)
        for k in range(many):
            for corner in range(4):
                for axis in range(3):
                    at = (3 * corner + axis) * LANES + k
                    numbers[at] = p[start + k, corner, axis]
                    numbers[at + 12 * LANES] = q[start + k, corner, axis]
        sort_out(numbers, vertices, faces, state, known[:many])
        for k in range(many):
            odd[0] += state[ODD + k] != 0.0
        for k in range(many):
            overlap[start + k] = known[k] == OVERLAPPING
            if known[k] != UNSURE:
                continue
            # They wait until there are enough of them to fill the lanes.
            for row in range(24):
                waiting[row * LANES + unsure] = numbers[row * LANES + k]
            rows[unsure] = start + k
            unsure += 1
            if unsure == LANES:
                settle(waiting, vertices, faces, state, rows, overlap)
                unsure = 0
    if unsure > 0:
        settle(waiting, vertices, faces, state, rows[:unsure], overlap)


def tetrahedra_overlap(p: ArrayLike, q: ArrayLike) -> BoolArray:
    """Return whether tetrahedra have a point in common, touching and containment included.

    Flat ones (triangles, quadrilaterals, segments, points) are as good as solid ones. Two
    touch if they are apart by less than the rounding of their coordinates: about 1e-14 of
    the largest coordinate of the pair.

    Args:
        p: The four vertices, shape (..., 4, 3), in any unit.
        q: Likewise; the batch axes of both are broadcast.

    Raises:
        InputError: not finite numbers of these shapes.
    """
    a, b = _bodies("p", p), _bodies("q", q)
    batch = batch_shape((a, 2), (b, 2))
    a_rows, b_rows = _rows(a, batch), _rows(b, batch)
    overlap, odd = np.empty(len(a_rows), dtype=np.bool_), np.zeros(1, dtype=np.int64)
    overlap_rows(len(a_rows), a_rows, b_rows, overlap, odd)
    if odd[0]:
        finite_array("p", a, (4, 3))
        finite_array("q", b, (4, 3))
    return overlap.reshape(batch)


def _bodies(name: str, value: ArrayLike) -> FloatArray:
    """Return vertices whose shape is right; those of an array may still not be finite."""
    if isinstance(value, np.ndarray):
        array = cast("FloatArray", value)
        large = array.shape[-2:] == (4, 3) and array.size >= 12 * MANY_ROWS
        # The kernel looks at each number anyhow.
        return array if large and array.dtype == np.float64 else finite_array(name, array, (4, 3))
    return finite_array(name, value, (4, 3))


def _rows(bodies: FloatArray, batch: tuple[int, ...]) -> FloatArray:
    """Return one row for each pair, in an array as kernels take it: writeable, in C order."""
    rows = np.broadcast_to(bodies, (*batch, 4, 3)).reshape(-1, 4, 3)
    if bodies.flags.writeable and rows.size == bodies.size:
        rows = bodies.reshape(-1, 4, 3)
    return rows if rows.flags.c_contiguous and rows.flags.writeable else rows.copy()
