"""Tests for the overlap of many pairs of tetrahedra side by side, one pair in each lane.

Each test is a loop over the lanes without a branch, over rows of `LANES` numbers at fixed
distances in one flat array: so compilers turn it into vector instructions. A test answers
only where it is sure; what it leaves open is for `explorer.legs.tetrahedra` to decide.

Rows, of each pair: `vertices` holds the coordinates v0 v1 v2 v3 v0 v1 v2 of both bodies, so
that each face is a window of three vertices followed by the opposite one; `faces` holds
`FACE` rows for each face of both bodies; `state` what is known of the pair.
"""

from __future__ import annotations

import math

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper

LANES = 64
# A gap within this share of the largest coordinate is rounding: the two touch.
TOUCHING = 2.0**-46
# Coordinates whose sixth powers fit are taken as they are, others are scaled.
LEAST, MOST = 1e-45, 1e45
# A body is solid if its heights exceed this share of the size,
THIN = 1e-9
# and its volume, times six, this share of the size's cube; else its normals may be rounding.
NOISE = 1e-11

# Rows of a body in `vertices`: seven vertices.
BODY = 21
# Rows of a face: inward normal, its size, slack, own depth, four depths of the other body.
FACE = 10
AREA, SLACK, OWN, DEPTHS = 3 * LANES, 4 * LANES, 5 * LANES, 6 * LANES
STRIDE = FACE * LANES
D0, D1, D2, D3 = DEPTHS, DEPTHS + LANES, DEPTHS + 2 * LANES, DEPTHS + 3 * LANES
# Rows of `state`. A positive gap separates.
TOLERANCE, SIZE, GAP = 0, LANES, 2 * LANES
# By body: its least height over the face's size; whether its edges leave the pair open.
HEIGHT, OPEN = 3 * LANES, 5 * LANES
# By body: ends of its section with the other's plane, and the least depth of a vertex.
ENDS = 3 * LANES
LOW, HIGH, NEAR = 7 * LANES, 8 * LANES, 9 * LANES
# The direction of the line where two planes meet, its size over that of the normals.
LINE, ANGLE = 13 * LANES, 16 * LANES
# What coordinates are multiplied by; whether one is not finite.
SCALE, ODD = 17 * LANES, 18 * LANES
STATES = 19
# By body: the face with the largest normal.
LARGEST = 8 * FACE * LANES


@helper
def test_boxes(numbers: FloatArray, vertices: FloatArray, state: FloatArray, many: int) -> None:
    """Write whether an axis of coordinates separates, and the vertices relative to one of them.

    Args:
        numbers: The coordinates of both bodies as they were given, shape (24 LANES,).
        vertices: Written, shape (2 BODY LANES,).
        state: Written, shape (STATES LANES,).
        many: Lanes in use.
    """
    state[:] = 0.0
    for axis in range(3):
        test_box(numbers[axis * LANES :], state, many)
    finish_boxes(state, many)
    for axis in range(3):
        place(numbers[axis * LANES :], vertices[axis * LANES :], state, many)


@helper
def test_box(numbers: FloatArray, state: FloatArray, many: int) -> None:
    """Take one axis of coordinates into account."""
    for k in range(many):
        a, b = numbers[k], numbers[3 * LANES + k]
        c, d = numbers[6 * LANES + k], numbers[9 * LANES + k]
        low, high = min(a, b, c, d), max(a, b, c, d)
        odd = ((a - a) + (b - b)) + ((c - c) + (d - d))
        a, b = numbers[12 * LANES + k], numbers[15 * LANES + k]
        c, d = numbers[18 * LANES + k], numbers[21 * LANES + k]
        low2, high2 = min(a, b, c, d), max(a, b, c, d)
        odd += ((a - a) + (b - b)) + ((c - c) + (d - d))
        state[ODD + k] += odd
        state[TOLERANCE + k] = max(state[TOLERANCE + k], -low, high, -low2, high2)
        state[SIZE + k] = max(state[SIZE + k], high - low, high2 - low2)
        # Less than zero is no gap anyhow.
        state[GAP + k] = max(state[GAP + k], low2 - high, low - high2)


@helper
def finish_boxes(state: FloatArray, many: int) -> None:
    """Write the scale, and what follows from the largest coordinate."""
    for k in range(many):
        largest = state[TOLERANCE + k]
        scale = min(1.0 / (largest if largest > 0.0 else 1.0), 1e300)
        scale = scale if (largest > MOST) | (largest < LEAST) else 1.0
        state[SCALE + k] = scale
        state[GAP + k] -= TOUCHING * largest
        state[SIZE + k] *= scale
        state[TOLERANCE + k] = TOUCHING * largest * scale


@helper
def place(numbers: FloatArray, vertices: FloatArray, state: FloatArray, many: int) -> None:
    """Write one coordinate of all vertices, relative to the first and scaled."""
    for k in range(many):
        scale = state[SCALE + k]
        origin = numbers[k] * scale
        b, c = numbers[3 * LANES + k] * scale - origin, numbers[6 * LANES + k] * scale - origin
        vertices[k] = vertices[12 * LANES + k] = 0.0
        vertices[3 * LANES + k] = vertices[15 * LANES + k] = b
        vertices[6 * LANES + k] = vertices[18 * LANES + k] = c
        vertices[9 * LANES + k] = numbers[9 * LANES + k] * scale - origin
        a, b = numbers[12 * LANES + k] * scale - origin, numbers[15 * LANES + k] * scale - origin
        c, d = numbers[18 * LANES + k] * scale - origin, numbers[21 * LANES + k] * scale - origin
        vertices[21 * LANES + k] = vertices[33 * LANES + k] = a
        vertices[24 * LANES + k] = vertices[36 * LANES + k] = b
        vertices[27 * LANES + k] = vertices[39 * LANES + k] = c
        vertices[30 * LANES + k] = d


@helper
def test_faces(vertices: FloatArray, faces: FloatArray, state: FloatArray, many: int) -> None:
    """Write all faces and whether the normal of one separates.

    Args:
        vertices: Shape (2 BODY LANES,).
        faces: Written, shape (10 FACE LANES,); the last two are the largest of each body.
        state: Updated, shape (STATES LANES,).
        many: Lanes in use.
    """
    for face in range(8):
        body = face // 4
        start = (body * BODY + (face - 4 * body) * 3) * LANES
        other = (1 - body) * BODY * LANES
        test_face(
            vertices[start : start + 12 * LANES],
            vertices[other : other + 12 * LANES],
            faces[face * FACE * LANES : (face + 1) * FACE * LANES],
            state,
            many,
        )
    for body in range(2):
        start, at = 4 * body * FACE * LANES, HEIGHT + body * LANES
        write_height(
            faces[start : start + 4 * FACE * LANES],
            state[SIZE : SIZE + LANES],
            state[at : at + LANES],
            many,
        )


@helper
def write_height(faces: FloatArray, size: FloatArray, height: FloatArray, many: int) -> None:
    """Write by how much a body's depths exceed those of a thin one."""
    for k in range(many):
        thin, noise = THIN * size[k], NOISE * size[k] * size[k] * size[k]
        a = faces[OWN + k] - thin * faces[AREA + k]
        b = faces[STRIDE + OWN + k] - thin * faces[STRIDE + AREA + k]
        c = faces[2 * STRIDE + OWN + k] - thin * faces[2 * STRIDE + AREA + k]
        d = faces[3 * STRIDE + OWN + k] - thin * faces[3 * STRIDE + AREA + k]
        height[k] = min(a, b, c, d) - noise


@helper
def test_face(
    own: FloatArray,
    other: FloatArray,
    face: FloatArray,
    state: FloatArray,
    many: int,
) -> None:
    """Write one face, given its three vertices and the opposite one, and whether it separates."""
    for k in range(many):
        ax, ay, az = own[k], own[LANES + k], own[2 * LANES + k]
        bx, by, bz = own[3 * LANES + k] - ax, own[4 * LANES + k] - ay, own[5 * LANES + k] - az
        cx, cy, cz = own[6 * LANES + k] - ax, own[7 * LANES + k] - ay, own[8 * LANES + k] - az
        nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        depth = (
            nx * (own[9 * LANES + k] - ax)
            + ny * (own[10 * LANES + k] - ay)
            + nz * (own[11 * LANES + k] - az)
        )
        sign = 1.0 if depth >= 0.0 else -1.0
        nx, ny, nz, depth = nx * sign, ny * sign, nz * sign, depth * sign
        level = nx * ax + ny * ay + nz * az
        x, y, z = other[k], other[LANES + k], other[2 * LANES + k]
        d0 = nx * x + ny * y + nz * z - level
        x, y, z = other[3 * LANES + k], other[4 * LANES + k], other[5 * LANES + k]
        d1 = nx * x + ny * y + nz * z - level
        x, y, z = other[6 * LANES + k], other[7 * LANES + k], other[8 * LANES + k]
        d2 = nx * x + ny * y + nz * z - level
        x, y, z = other[9 * LANES + k], other[10 * LANES + k], other[11 * LANES + k]
        d3 = nx * x + ny * y + nz * z - level
        size = abs(nx) + abs(ny) + abs(nz)
        # The normal of a thin face is rounding in part, so its vertices have depths too.
        odd = max(abs(nx * bx + ny * by + nz * bz), abs(nx * cx + ny * cy + nz * cz))
        slack = state[TOLERANCE + k] * size + odd
        gap = max(-max(d0, d1, d2, d3), min(d0, d1, d2, d3) - depth) - slack
        state[GAP + k] = max(state[GAP + k], gap)
        face[k], face[LANES + k], face[2 * LANES + k] = nx, ny, nz
        face[3 * LANES + k] = size
        face[SLACK + k] = slack
        face[OWN + k] = depth
        face[DEPTHS + k], face[DEPTHS + LANES + k] = d0, d1
        face[DEPTHS + 2 * LANES + k], face[DEPTHS + 3 * LANES + k] = d2, d3


@helper
def test_edges(faces: FloatArray, state: FloatArray, body: int, many: int) -> None:
    """Write whether a plane through an edge of a body separates, and whether that is open.

    Two faces meet in an edge. Mixes of both, with the depths d_f + ρ d_g for ρ > 0, are all
    the planes through it that have the body on one side. One separates if all depths of
    the other body are negative, which bounds ρ from below and above.
    """
    for f in range(3):
        for g in range(f + 1, 4):
            first, second = (4 * body + f) * FACE * LANES, (4 * body + g) * FACE * LANES
            test_edge(
                faces[first : first + FACE * LANES],
                faces[second : second + FACE * LANES],
                state,
                state[OPEN + body * LANES : OPEN + (body + 1) * LANES],
                many,
            )


@helper
def narrowed(x: float, y: float, low: float, high: float) -> tuple[float, float]:
    """Return the range of ρ once x + ρ y has to be negative too."""
    ratio = -x / (y if y != 0.0 else 1.0)
    low = max(low, ratio if (y < 0.0) & (x > 0.0) else 0.0)
    high = min(high, ratio if (y > 0.0) & (x < 0.0) else math.inf)
    return low, -1.0 if (y >= 0.0) & (x >= 0.0) else high


@helper
def test_edge(
    f: FloatArray, g: FloatArray, state: FloatArray, unsure: FloatArray, many: int
) -> None:
    """Write whether a plane through the edge of two faces separates, and whether that is open."""
    for k in range(many):
        # Depths less the slack, so that no plane that might separate is missed.
        s, t = f[SLACK + k], g[SLACK + k]
        x0, x1, x2, x3 = f[D0 + k], f[D1 + k], f[D2 + k], f[D3 + k]
        y0, y1, y2, y3 = g[D0 + k], g[D1 + k], g[D2 + k], g[D3 + k]
        low, high = narrowed(x0 - s, y0 - t, 0.0, math.inf)
        low, high = narrowed(x1 - s, y1 - t, low, high)
        low, high = narrowed(x2 - s, y2 - t, low, high)
        low, high = narrowed(x3 - s, y3 - t, low, high)
        rho = 0.5 * (low + high) if high < math.inf else 2.0 * low + 1.0
        top = max(x0 + rho * y0, x1 + rho * y1, x2 + rho * y2, x3 + rho * y3)
        # The body's own depths are from zero up.
        gap = -top - (s + rho * t) if low < high else -math.inf
        state[GAP + k] = max(state[GAP + k], gap)
        unsure[k] = 1.0 if (low < high) & (gap <= 0.0) else unsure[k]


@helper
def write_sections(vertices: FloatArray, faces: FloatArray, state: FloatArray, many: int) -> None:
    """Write where the planes of two flat bodies meet, and the sections of both with the line."""
    for body in range(2):
        start = 4 * body * FACE * LANES
        largest = LARGEST + body * FACE * LANES
        write_largest(
            faces[start : start + 4 * FACE * LANES],
            faces[largest : largest + FACE * LANES],
            many,
        )
    second = LARGEST + FACE * LANES
    write_line(faces[LARGEST:second], faces[second : second + FACE * LANES], state, many)
    for body in range(2):
        start = body * BODY * LANES
        plane, ends = LARGEST + (1 - body) * FACE * LANES, LOW + 3 * body * LANES
        write_section(
            vertices[start : start + 12 * LANES],
            faces[plane : plane + FACE * LANES],
            state[LINE : LINE + 3 * LANES],
            state[ends : ends + 3 * LANES],
            many,
        )


@helper
def write_largest(faces: FloatArray, largest: FloatArray, many: int) -> None:
    """Copy, of a body's four faces, the one with the largest normal."""
    for row in range(FACE):
        copy_largest(faces, faces[row * LANES :], largest[row * LANES :], many)


@helper
def copy_largest(faces: FloatArray, rows: FloatArray, largest: FloatArray, many: int) -> None:
    """Copy one row of the face with the largest normal."""
    for k in range(many):
        a, b = faces[AREA + k], faces[STRIDE + AREA + k]
        c, d = faces[2 * STRIDE + AREA + k], faces[3 * STRIDE + AREA + k]
        value = rows[k] if a >= b else rows[STRIDE + k]
        other = rows[2 * STRIDE + k] if c >= d else rows[3 * STRIDE + k]
        largest[k] = value if max(a, b) >= max(c, d) else other


@helper
def write_line(f: FloatArray, g: FloatArray, state: FloatArray, many: int) -> None:
    """Write the direction of the line in which two planes meet."""
    for k in range(many):
        fx, fy, fz = f[k], f[LANES + k], f[2 * LANES + k]
        gx, gy, gz = g[k], g[LANES + k], g[2 * LANES + k]
        x, y, z = fy * gz - fz * gy, fz * gx - fx * gz, fx * gy - fy * gx
        state[LINE + k], state[LINE + LANES + k], state[LINE + 2 * LANES + k] = x, y, z
        state[ANGLE + k] = abs(x) + abs(y) + abs(z)


@helper
def crossing(
    a: float, b: float, s: float, t: float, low: float, high: float
) -> tuple[float, float]:
    """Return the ends of a section with an edge added, from depths a, b and places s, t."""
    crosses = (a < 0.0) != (b < 0.0)
    at = s + (t - s) * (a / (a - b if crosses else 1.0))
    return min(low, at if crosses else math.inf), max(high, at if crosses else -math.inf)


@helper
def write_section(
    body: FloatArray, plane: FloatArray, line: FloatArray, ends: FloatArray, many: int
) -> None:
    """Write where the edges of a flat body meet the other's plane, along the line."""
    for k in range(many):
        x, y, z = line[k], line[LANES + k], line[2 * LANES + k]
        s0 = x * body[k] + y * body[LANES + k] + z * body[2 * LANES + k]
        s1 = x * body[3 * LANES + k] + y * body[4 * LANES + k] + z * body[5 * LANES + k]
        s2 = x * body[6 * LANES + k] + y * body[7 * LANES + k] + z * body[8 * LANES + k]
        s3 = x * body[9 * LANES + k] + y * body[10 * LANES + k] + z * body[11 * LANES + k]
        d0, d1, d2, d3 = plane[D0 + k], plane[D1 + k], plane[D2 + k], plane[D3 + k]
        low, high = crossing(d0, d1, s0, s1, math.inf, -math.inf)
        low, high = crossing(d0, d2, s0, s2, low, high)
        low, high = crossing(d0, d3, s0, s3, low, high)
        low, high = crossing(d1, d2, s1, s2, low, high)
        low, high = crossing(d1, d3, s1, s3, low, high)
        low, high = crossing(d2, d3, s2, s3, low, high)
        ends[k], ends[LANES + k] = low, high
        ends[2 * LANES + k] = min(abs(d0), abs(d1), abs(d2), abs(d3))
