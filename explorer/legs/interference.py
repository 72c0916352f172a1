"""The paper's test for leg interference over one sampling step, by swept tetrahedra.

Over a step at constant orientation a leg stays within the tetrahedron of its two base ends and
its two platform ends. The step is free if no two of the four tetrahedra overlap or touch. Legs 1
and 4 have fixed base ends, so their tetrahedra are triangles. The test ignores the legs' radii.

Two convex bodies are apart if and only if their projections on some axis are. For solid bodies
the candidates are the face normals and the cross products of an edge of each (Gottschalk, Lin and
Manocha, "OBBTree", 1996). If all these projections overlap deeply, so do the bodies. If some only
touch, as happens for bodies in one plane, segments and points, the shortest connections of edges
are candidates as well.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.clearance import PAIRS, closest_shares, joined_pairs, leg_axes
from explorer.mechanism.configuration import Configuration
from explorer.numerics import arrays
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.compiled import helper, kernel
from explorer.numerics.vectors import Vector, dot3, minus

# Share of the largest coordinate up to which a gap is rounding, so that two bodies touch.
TOUCHING = 2.0**-46
# Share of the size above which an overlap of projections is deep.
DEEP = 2.0**-8
# Share of the squared size below which the direction of a cross product is mostly rounding.
FAINT = 1e-12
EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))


@helper
def vertex(bodies: FloatArray, body: int, k: int) -> Vector:
    """Return vertex k of a body, from the vertices of both, shape (2, 3, 4)."""
    return (bodies[body, 0, k], bodies[body, 1, k], bodies[body, 2, k])


@helper
def compare_boxes(p: FloatArray, q: FloatArray, row: int) -> tuple[float, float, bool]:
    """Return the largest |coordinate|, the size, and whether the bounding boxes are apart."""
    largest, size, gap = 0.0, 0.0, 0.0
    for axis in range(3):
        a, b, c, d = p[row, 0, axis], p[row, 1, axis], p[row, 2, axis], p[row, 3, axis]
        low, high = min(a, b, c, d), max(a, b, c, d)
        a, b, c, d = q[row, 0, axis], q[row, 1, axis], q[row, 2, axis], q[row, 3, axis]
        low2, high2 = min(a, b, c, d), max(a, b, c, d)
        largest = max(largest, -low, high, -low2, high2)
        size = max(size, high - low, high2 - low2)
        gap = max(gap, low2 - high, low - high2)
    return largest, size, gap > TOUCHING * largest


@helper
def write_body(
    rows: FloatArray,
    row: int,
    origin: Vector,
    body: int,
    bodies: FloatArray,
    edges: FloatArray,
) -> None:
    """Write the vertices of a body relative to a point, and its six edges."""
    for axis in range(3):
        o = origin[axis]
        a, b = rows[row, 0, axis] - o, rows[row, 1, axis] - o
        c, d = rows[row, 2, axis] - o, rows[row, 3, axis] - o
        bodies[body, axis, 0], bodies[body, axis, 1] = a, b
        bodies[body, axis, 2], bodies[body, axis, 3] = c, d
        edges[body, axis, 0], edges[body, axis, 1] = b - a, c - a
        edges[body, axis, 2], edges[body, axis, 3] = d - a, c - b
        edges[body, axis, 4], edges[body, axis, 5] = d - b, d - c


@helper
def cross_edges(
    edges: FloatArray, first: int, i: int, second: int, j: int, axes: FloatArray, k: int
) -> None:
    """Write the cross product of two edges as an axis."""
    ux, uy, uz = edges[first, 0, i], edges[first, 1, i], edges[first, 2, i]
    vx, vy, vz = edges[second, 0, j], edges[second, 1, j], edges[second, 2, j]
    axes[0, k], axes[1, k], axes[2, k] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@helper
def project(
    bodies: FloatArray, axes: FloatArray, count: int, tolerance: float, size: float
) -> tuple[bool, bool, bool]:
    """Return whether on some axis the projections are apart, overlap slightly, overlap deeply.

    Bodies are vertices (2, 3, 4), axes the first `count` of (3, n); a gap up to the tolerance, over
    the axis' length, is a touch. The loop has no branch, so that compilers make vector instructions
    of it.
    """
    (ax, ay, az), (bx, by, bz) = vertex(bodies, 0, 0), vertex(bodies, 0, 1)
    (cx, cy, cz), (dx, dy, dz) = vertex(bodies, 0, 2), vertex(bodies, 0, 3)
    (ex, ey, ez), (fx, fy, fz) = vertex(bodies, 1, 0), vertex(bodies, 1, 1)
    (gx, gy, gz), (hx, hy, hz) = vertex(bodies, 1, 2), vertex(bodies, 1, 3)
    faint = FAINT * size * size
    apart = shallow = deep = False
    for k in range(count):
        x, y, z = axes[0, k], axes[1, k], axes[2, k]
        a, b = x * ax + y * ay + z * az, x * bx + y * by + z * bz
        c, d = x * cx + y * cy + z * cz, x * dx + y * dy + z * dz
        e, f = x * ex + y * ey + z * ez, x * fx + y * fy + z * fz
        g, h = x * gx + y * gy + z * gz, x * hx + y * hy + z * hz
        low, high = min(a, b, c, d), max(a, b, c, d)
        low2, high2 = min(e, f, g, h), max(e, f, g, h)
        gap, length = max(low2 - high, low - high2), abs(x) + abs(y) + abs(z)
        is_deep = gap < -DEEP * size * length
        apart |= gap > tolerance * length
        shallow |= (length > faint) & (not is_deep)
        deep |= (length > faint) & is_deep
    return apart, shallow, deep


@helper
def perpendicular_part(w: Vector, u: Vector) -> Vector:
    """Return the part of w perpendicular to u, where u is not zero."""
    uu = dot3(u, u)
    share = dot3(w, u) / uu if uu > 0.0 else 0.0
    return (w[0] - share * u[0], w[1] - share * u[1], w[2] - share * u[2])


@helper
def connections_separate(
    bodies: FloatArray, axes: FloatArray, tolerance: float, size: float
) -> bool:
    """Return whether the shortest connection of any two edges is a separating axis."""
    for i, j in EDGES:
        a = vertex(bodies, 0, i)
        u = minus(vertex(bodies, 0, j), a)
        for k, m in EDGES:
            b = vertex(bodies, 1, k)
            v = minus(vertex(bodies, 1, m), b)
            r = minus(a, b)
            s, t = closest_shares(u, v, r)
            w = (
                r[0] + s * u[0] - t * v[0],
                r[1] + s * u[1] - t * v[1],
                r[2] + s * u[2] - t * v[2],
            )
            if abs(w[0]) + abs(w[1]) + abs(w[2]) <= tolerance:
                return False
            # Of a short connection only the part perpendicular to the edges is more than rounding.
            if 0.0 < s < 1.0:
                w = perpendicular_part(w, u)
            if 0.0 < t < 1.0:
                w = perpendicular_part(w, v)
            axes[0, 0], axes[1, 0], axes[2, 0] = w
            if project(bodies, axes, 1, tolerance, size)[0]:
                return True
    return False


@helper
def overlaps(
    p: FloatArray, q: FloatArray, row: int, bodies: FloatArray, edges: FloatArray, axes: FloatArray
) -> bool:
    """Return whether a pair of bodies (n, 4, 3) overlaps; the last three are working space."""
    largest, size, apart = compare_boxes(p, q, row)
    if apart:
        return False
    tolerance = TOUCHING * largest
    origin = (p[row, 0, 0], p[row, 0, 1], p[row, 0, 2])
    write_body(p, row, origin, 0, bodies, edges)
    write_body(q, row, origin, 1, bodies, edges)
    for body in range(2):
        cross_edges(edges, body, 0, body, 1, axes, 4 * body)
        cross_edges(edges, body, 0, body, 2, axes, 4 * body + 1)
        cross_edges(edges, body, 1, body, 2, axes, 4 * body + 2)
        cross_edges(edges, body, 3, body, 4, axes, 4 * body + 3)
    apart, shallow, deep = project(bodies, axes, 8, tolerance, size)
    if apart:
        return False
    for i in range(6):
        for j in range(6):
            cross_edges(edges, 0, i, 1, j, axes, 6 * i + j)
    apart, shallow2, deep2 = project(bodies, axes, 36, tolerance, size)
    if apart:
        return False
    if not (shallow or shallow2) and (deep or deep2):
        return True
    return not connections_separate(bodies, axes, tolerance, size)


@kernel("void(f8[:,:,::1], f8[:,:,::1], b1[::1])")
def overlap_rows(p: FloatArray, q: FloatArray, overlap: BoolArray) -> None:
    """Write whether each pair overlaps, shape (n,), from its vertices p and q (n, 4, 3)."""
    bodies, edges, axes = np.empty((2, 3, 4)), np.empty((2, 3, 6)), np.empty((3, 36))
    for row in range(p.shape[0]):
        overlap[row] = overlaps(p, q, row, bodies, edges, axes)


def tetrahedra_overlap(p: ArrayLike, q: ArrayLike) -> BoolArray:
    """Return whether tetrahedra have a point in common, touching and containment included.

    Their vertices p and q, (..., 4, 3) each, are in one unit. Flat ones (triangles, segments,
    points) are allowed. Two touch if their gap is within the rounding of their coordinates: about
    1e-14 of the largest coordinate of the pair.

    Raises:
        InputError: P or q does not consist of finite numbers, or has another shape.
    """
    a, b = arrays.finite_array("p", p, (4, 3)), arrays.finite_array("q", q, (4, 3))
    batch = arrays.batch_shape((a, 2), (b, 2))
    a_rows, b_rows = arrays.rows_for_kernel(a, batch, 2), arrays.rows_for_kernel(b, batch, 2)
    overlap = np.empty(len(a_rows), dtype=np.bool_)
    overlap_rows(len(a_rows), a_rows, b_rows, overlap)
    return overlap.reshape(batch)


def swept_tetrahedra(start: Configuration, end: Configuration) -> FloatArray:
    """Return the tetrahedra that contain the four legs over a step, shape (..., 4, 4, 3).

    The vertices of a tetrahedron are the leg's base ends at the start and at the end of the
    step, then its platform ends. All batch axes are broadcast.
    """
    # From (base, platform) of both poses to (base, base, platform, platform).
    both = np.stack(np.broadcast_arrays(leg_axes(start), leg_axes(end)), axis=-2)
    return both.reshape(*both.shape[:-3], 4, 3)


def step_overlaps(start: Configuration, end: Configuration) -> BoolArray:
    """Return which pairs of swept tetrahedra overlap, shape (..., 6), in the order of `PAIRS`.

    The result is False for a pair that shares a joint, see `explorer.legs.clearance.joined_pairs`.
    """
    swept = swept_tetrahedra(start, end)
    first, second = np.array(PAIRS).T - 1
    overlap = tetrahedra_overlap(swept[..., first, :, :], swept[..., second, :, :])
    return overlap & ~joined_pairs(start.design)
