"""The faces of a constant-orientation workspace, each on the exact surface of its limit.

Regular triangles on the surface of each limit are cut by all other limits, at points that are
found on the exact surfaces. So faces are as fine as the pattern, their edges lie on the exact
curves, and no facet of a boolean is seen. Triangles share their vertices before and after a cut:
each edge that the line crosses gets one vertex.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, dot
from explorer.numerics.computed_once import computed_once
from explorer.numerics.roots import find_roots
from explorer.workspace.faces.surfaces import Smooth, Surfaces, pattern
from explorer.workspace.limits.constraints import Constraint, Never
from explorer.workspace.limits.region import contract_box, region_of
from explorer.workspace.solids.facets import Box
from explorer.workspace.workspace import Workspace


def divide(faces: IntArray, high: BoolArray) -> tuple[IntArray, IntArray, BoolArray]:
    """Divide the faces (m, 3) with vertices on either side of a level, high for n vertices.

    Return the ends of the edges that the level crosses, the low one first, shape (k, 2), of which
    the i-th gets the vertex n + i; all faces, shape (l, 3); and whether each is high, shape (l,).
    """
    count = len(high)
    sides = high[faces]
    number: IntArray = sides.sum(axis=1)
    mixed, whole = np.flatnonzero(number % 3), np.flatnonzero(number % 3 == 0)
    # The corner that is alone on its side comes first.
    lone_is_high = number[mixed] == 1
    lone = np.argmax(sides[mixed] == lone_is_high[:, None], axis=1)
    corners = np.take_along_axis(faces[mixed], (lone[:, None] + np.arange(3)) % 3, axis=1)
    a, b, c = corners.T
    low, high = np.where(lone_is_high, [b, c], a), np.where(lone_is_high, a, [b, c])
    keys, inverse = np.unique(low * count + high, return_inverse=True)
    on_ab, on_ac = count + inverse.reshape(2, -1)
    parts = ((a, on_ab, on_ac), (on_ab, b, c), (on_ab, c, on_ac))
    faces = np.concatenate([faces[whole], *(np.stack(part, axis=1) for part in parts)])
    is_high = np.concatenate([number[whole] == 3, lone_is_high, ~lone_is_high, ~lone_is_high])
    return np.stack(np.divmod(keys, count), axis=1), faces, is_high


# Distances below this share of the size of a workspace are rounding; those of roots are
# below this share of it.
ROUNDING = 1e-9
ROOT_SHARE = 1e-3
# Vertices so near a surface, over the shortest edge about them, are moved onto it.
SNAP = 0.25
# Triangles are made anew for faces that fill a smaller share of the box, in at most so many rounds;
# they may reach beyond what was found by this share.
LOOSE, MOST_ROUNDS, MISSED = 0.6, 4, 0.01
# Triangles with a smaller share of its squared size are lines.
LEAST_AREA = 1e-12


@dataclass(frozen=True)
class Faces:
    """Triangles of a surface, in design units.

    Attributes:
        vertices: Positions, shape (n, 3); faces of two limits share none.
        triangles: Indices of vertices, counter-clockwise from outside, shape (m, 3).
        limit_of_triangle: Index in `limits` of the limit of each triangle, shape (m,).
        limits: Names of limits.
        edges: Ends of the segments along which two faces meet, shape (k, 2, 3).
    """

    vertices: FloatArray
    triangles: IntArray
    limit_of_triangle: IntArray
    limits: tuple[str, ...]
    edges: FloatArray


@dataclass(frozen=True)
class _Cut:
    """Triangles on the surfaces of limits while they are cut.

    Attributes:
        vertices: Positions, shape (n, 3).
        owner: Index of the limit on whose surface each vertex lies, shape (n,).
        cuts: For each vertex a number with a bit for every other limit on whose surface it lies.
        triangles: Indices of vertices, shape (m, 3).
    """

    vertices: FloatArray
    owner: IntArray
    cuts: IntArray
    triangles: IntArray


_NO_INDICES: IntArray = np.zeros(0, dtype=np.int64)
NOTHING = _Cut(np.zeros((0, 3)), _NO_INDICES, _NO_INDICES, _NO_INDICES.reshape(0, 3))
"""No triangles."""


@computed_once
def workspace_faces(workspace: Workspace) -> Faces:
    """Return the faces of a workspace; none if it is empty."""
    return faces_within(workspace.limits)


def faces_within(limits: Sequence[Constraint]) -> Faces:
    """Return the faces of the positions that satisfy all limits; none if there is no position."""
    smooth = [limit for limit in limits if not isinstance(limit, Never)]
    surfaces = Surfaces(smooth)
    names = tuple(limit.name for limit in smooth)
    box = region_of(limits).box
    ends = None if box is None else contract_box(limits, *box)
    if ends is None:
        return _finish(NOTHING, surfaces, names, 1.0)
    box = Box(*ends).surroundings(ROUNDING)
    cut = NOTHING
    for _ in range(MOST_ROUNDS):
        cut = _cut_by_all(smooth, surfaces, box)
        if not len(cut.vertices):
            break
        lows, highs = cut.vertices.min(axis=0), cut.vertices.max(axis=0)
        if float(np.linalg.norm(highs - lows)) > LOOSE * box.size:
            break
        # The triangles are too large for so small a workspace.
        more = MISSED * box.size
        box = Box(np.maximum(lows - more, box.lows), np.minimum(highs + more, box.highs))
    return _finish(cut, surfaces, names, box.size)


def _cut_by_all(limits: Sequence[Smooth], surfaces: Surfaces, box: Box) -> _Cut:
    """Return the triangles of all limits' patterns in a box, cut by all limits."""
    chosen = [index for index in range(len(limits)) if not surfaces.is_repeated(index)]
    patterns = [pattern(limits[index], box) for index in chosen]
    sizes = [len(points) for points, _ in patterns]
    points = np.concatenate([NOTHING.vertices, *(points for points, _ in patterns)])
    parts = zip(patterns, np.cumsum([0, *sizes]).tolist(), strict=False)
    faces = np.concatenate([NOTHING.triangles, *(own + first for (_, own), first in parts)])
    owners, count = np.repeat(np.array(chosen, dtype=np.int64), sizes), len(points)
    rounding = ROUNDING * box.size
    values = np.array([surfaces.distances_from(points, k) for k in range(len(limits))])
    values[owners, np.arange(count)] = np.inf
    # Bits for the sides of the box, and for limits that are violated. Of two faces that coincide,
    # that of the first limit stays.
    beyond = np.zeros(count, dtype=np.int64)
    violations = (
        value < np.where(owners > index, rounding, -rounding) for index, value in enumerate(values)
    )
    for bit, is_beyond in enumerate((*(points < box.lows).T, *(points > box.highs).T, *violations)):
        beyond |= is_beyond.astype(np.int64) << bit
    a, b, c = faces.T
    near = faces[beyond[a] & beyond[b] & beyond[c] == 0]
    cut = _Cut(points, owners, np.zeros(count, dtype=np.int64), near)
    cut = _snap(_compact(cut), surfaces, values[:, _used(cut)], rounding)
    for index in range(len(limits)):
        cut = _cut_by(cut, surfaces, index, rounding)
    return _compact(cut)


def _snap(cut: _Cut, surfaces: Surfaces, values: FloatArray, rounding: float) -> _Cut:
    """Move vertices near the surface of a limit onto it, so that no triangle becomes a sliver.

    Values (k, n) are the distance of each vertex from each surface, infinite from its own.
    """
    room = np.full(len(cut.vertices), np.inf)
    for ends in (cut.triangles[:, :2], cut.triangles[:, 1:], cut.triangles[:, ::2]):
        lengths = np.linalg.norm(np.diff(cut.vertices[ends], axis=1)[:, 0], axis=1)
        np.minimum.at(room, ends, SNAP * lengths[:, None])
    sizes = np.abs(values)
    sizes[sizes <= rounding] = np.inf
    nearest = sizes.argmin(axis=0)
    chosen = np.flatnonzero(sizes[nearest, np.arange(len(room))] < room)
    if not len(chosen):
        return cut
    points = cut.vertices[chosen]
    which = np.stack([cut.owner[chosen], nearest[chosen]], axis=1)
    projected, off = surfaces.project(points, which, ROOT_SHARE * rounding)
    fits = (np.linalg.norm(projected - points, axis=1) < room[chosen]) & (off <= rounding)
    vertices, cuts = cut.vertices.copy(), cut.cuts.copy()
    vertices[chosen[fits]] = projected[fits]
    cuts[chosen[fits]] = 1 << nearest[chosen[fits]]
    return replace(cut, vertices=vertices, cuts=cuts)


def _cut_by(cut: _Cut, surfaces: Surfaces, index: int, rounding: float) -> _Cut:
    """Return the triangles, cut by the limit with an index."""
    value = surfaces.distances_from(cut.vertices, index)
    value[cut.owner == index] = np.inf
    at = (np.abs(value) <= rounding) | (cut.cuts >> index & 1 == 1)
    value[at] = 0.0
    high = value >= 0.0
    triangles = cut.triangles
    if at.any():
        cut = replace(cut, cuts=cut.cuts | (at.astype(np.int64) << index))
        a, b, c = triangles.T
        flat = np.flatnonzero(at[a] & at[b] & at[c])
        if len(flat):
            triangles = np.delete(triangles, flat[~_stays(cut, surfaces, index, flat, rounding)], 0)
    a, b, c = triangles.T
    if (high[a] & high[b] & high[c]).all():
        return replace(cut, triangles=triangles)
    ends, faces, is_high = divide(triangles, high)
    points, common = _cross(cut, surfaces, index, value, ends, rounding)
    return _Cut(
        np.concatenate([cut.vertices, points]),
        np.concatenate([cut.owner, cut.owner[ends[:, 0]]]),
        np.concatenate([cut.cuts, common | (1 << index)]),
        faces[is_high],
    )


def _cross(
    cut: _Cut, surfaces: Surfaces, index: int, value: FloatArray, ends: IntArray, rounding: float
) -> tuple[FloatArray, IntArray]:
    """Return the points at which edges (k, 2) cross a surface, and the other cuts of the edges.

    An edge between two vertices of one curve is the curve.
    """
    a, b = ends.T
    common = cut.cuts[a] & cut.cuts[b]
    start, span = cut.vertices[a], cut.vertices[b] - cut.vertices[a]
    own = np.stack([cut.owner[a], _lowest_bit(common)], axis=1)
    error = ROOT_SHARE * rounding
    chord = start + (value[a] / (value[a] - value[b]))[:, None] * span
    cutting = np.full((len(a), 1), index, dtype=np.int64)
    points, off = surfaces.project(chord, np.concatenate([own, cutting], axis=1), error)
    moved = np.linalg.norm(points - chord, axis=1)
    lost = np.flatnonzero((off > rounding) | (moved > 0.3 * np.linalg.norm(span, axis=1)))
    if len(lost):
        # Where surfaces nearly touch, the crossing is kept between the ends.
        def point(share: FloatArray) -> FloatArray:
            near = start[lost] + share[:, None] * span[lost]
            return surfaces.project(near, own[lost, :1], error)[0]

        def value_at(share: FloatArray) -> FloatArray:
            return surfaces.distances_from(point(share), index)

        points[lost] = point(find_roots(value_at, value[a[lost]], value[b[lost]], error))
    return points, common


def _stays(
    cut: _Cut, surfaces: Surfaces, index: int, chosen: IntArray, rounding: float
) -> BoolArray:
    """Return whether triangles with all corners on the surface of a limit are within it.

    Of two faces that coincide, that of the first limit stays.
    """
    triangles = cut.triangles[chosen]
    owner = cut.owner[triangles[:, 0]]
    middles = cut.vertices[triangles].mean(axis=1)
    middle, _ = surfaces.project(middles, owner[:, None], ROOT_SHARE * rounding)
    value = surfaces.distances_from(middle, index)
    return np.where(np.abs(value) <= rounding, owner < index, value > 0.0)


def _lowest_bit(bits: IntArray) -> IntArray:
    """Return the index of the lowest bit of numbers; -1 for zero."""
    lowest = bits & -bits
    return np.where(bits == 0, -1, np.round(np.log2(np.maximum(lowest, 1)))).astype(np.int64)


def _used(cut: _Cut) -> BoolArray:
    """Return whether each vertex has a triangle."""
    used = np.zeros(len(cut.vertices), dtype=np.bool_)
    used[cut.triangles] = True
    return used


def _compact(cut: _Cut) -> _Cut:
    """Leave out the vertices that no triangle has."""
    used = _used(cut)
    number = np.cumsum(used) - 1
    return _Cut(cut.vertices[used], cut.owner[used], cut.cuts[used], number[cut.triangles])


def _finish(cut: _Cut, surfaces: Surfaces, names: tuple[str, ...], size: float) -> Faces:
    """Turn triangles outwards, and find the edges."""
    a, b, c = (cut.vertices[cut.triangles[:, k]] for k in range(3))
    # Normals as long as twice the areas.
    across = np.cross(b - a, c - a)
    is_line = dot(across, across) <= (LEAST_AREA * size**2) ** 2
    cut = _compact(replace(cut, triangles=cut.triangles[~is_line]))
    corners, across = cut.vertices[cut.triangles], across[~is_line]
    owner = cut.owner[cut.triangles[:, 0]]
    inward = surfaces.distances(corners.mean(axis=1), owner)[1]
    triangles = cut.triangles.copy()
    turned = dot(across, inward) > 0.0
    triangles[turned] = triangles[turned][:, ::-1]
    return Faces(cut.vertices, triangles, owner, names, _edges_of(cut))


def _edges_of(cut: _Cut) -> FloatArray:
    """Return the segments (k, 2, 3) on the curves of two surfaces, each from one of the two."""
    sides = np.stack([cut.triangles, np.roll(cut.triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    sides = np.sort(sides, axis=1)
    # A face that lies on another surface as a whole does not meet it along a curve.
    whole = np.zeros(len(cut.vertices), dtype=np.int64)
    for owner in np.unique(cut.owner):
        own = cut.owner == owner
        whole[own] = np.bitwise_and.reduce(cut.cuts[own])
    common = cut.cuts[sides[:, 0]] & cut.cuts[sides[:, 1]] & ~whole[sides[:, 0]]
    sides, other = sides[common != 0], _lowest_bit(common[common != 0])
    keys = sides[:, 0] * len(cut.vertices) + sides[:, 1]
    _, first, counts = np.unique(keys, return_index=True, return_counts=True)
    first = first[counts == 1]
    sides, other = sides[first], other[first]
    has_face = np.isin(other, cut.owner)
    chosen = (cut.owner[sides[:, 0]] < other) | ~has_face
    return cut.vertices[sides[chosen]]
