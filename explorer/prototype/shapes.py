"""The bodies of the parts, by booleans of plain shapes, and whether parts overlap.

The only module of the prototype that uses manifold3d. Shapes are in millimetres, each in
the frame of the body that it moves with (`explorer.prototype.chains`).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from explorer.arrays import FloatArray
from explorer.errors import ExplorerError
from explorer.prototype.chains import LEGS, ON_GUIDE, Places
from explorer.prototype.dimensions import CLEARANCE, LegSizes
from explorer.prototype.part import Part
from explorer.prototype.sizes import Sizes
from explorer.prototype.sketch import platform_points

if TYPE_CHECKING:
    from manifold3d import Manifold

SEGMENTS = 48
"""Edges of a circle."""

# Of eyes over which lugs and arms are wide.
_SLIM = 0.55


def parts_of(sizes: Sizes) -> tuple[Part, ...]:
    """Return all parts, the base first.

    Raises:
        ExplorerError: a boolean fails.
    """
    made: list[tuple[str, str, Manifold]] = [("base", "base", _base(sizes))]
    for leg, own in zip(LEGS, sizes.legs, strict=True):
        if leg in ON_GUIDE:
            made.append((f"carriage {leg}", f"carriage {leg}", _carriage(sizes, own)))
        else:
            made.append((f"cross {leg}", f"cross {leg}", _cross(own)))
        made.append((f"cylinder {leg}", f"cylinder {leg}", _cylinder(sizes, leg)))
        made.append((f"rod {leg}", f"rod {leg}", _rod(sizes, leg)))
    made.append(("platform", "platform", _platform(sizes)))
    made += [(f"ball {leg}", "platform", _ball(sizes, leg)) for leg in LEGS]
    return tuple(_part(name, body, shape, sizes.design.unit_mm) for name, body, shape in made)


def overlaps(parts: Sequence[Part], places: Places) -> Iterator[tuple[str, str, float]]:
    """Yield the pairs of parts that share a volume, and the volume in cubed design units.

    Args:
        parts: Those to look at.
        places: Where the bodies are, at one pose.

    Raises:
        ExplorerError: a boolean fails.
    """
    known, boxes = _placed(parts, places)
    for j, second in enumerate(known):
        for i, first in enumerate(known[:j]):
            if _touching(boxes[i], boxes[j]):
                volume = float(_sound(first ^ second).volume())
                if volume > 0.0:
                    yield parts[i].name, parts[j].name, volume


def least_gap(parts: Sequence[Part], places: Places, within: float) -> tuple[float, str, str]:
    """Return the least distance of two parts, and their names.

    Args:
        parts: Those to look at.
        places: Where the bodies are, at one pose.
        within: Distances beyond it are not looked for, in design units.
    """
    known, boxes = _placed(parts, places)
    found = (within, "", "")
    for j, second in enumerate(known):
        for i, first in enumerate(known[:j]):
            low, high = boxes[i]
            if _touching((low - found[0], high + found[0]), boxes[j]):
                gap = float(first.min_gap(second, found[0]))
                if gap < found[0]:
                    found = (gap, parts[i].name, parts[j].name)
    return found


def _placed(
    parts: Sequence[Part], places: Places
) -> tuple[list[Manifold], list[tuple[FloatArray, FloatArray]]]:
    """Return the parts at one pose, and the corners of their boxes."""
    from manifold3d import Manifold, Mesh64

    known: list[Manifold] = []
    boxes: list[tuple[FloatArray, FloatArray]] = []
    for part in parts:
        turn, origin = places.rotation[part.body_index], places.origin[part.body_index]
        points = np.ascontiguousarray(part.vertices @ turn.T + origin)
        known.append(Manifold(Mesh64(points, part.faces.astype(np.uint64))))
        boxes.append((points.min(axis=0), points.max(axis=0)))
    return known, boxes


def _touching(one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]) -> bool:
    return bool((one[0] <= other[1]).all() and (other[0] <= one[1]).all())


def _base(sizes: Sizes) -> Manifold:
    """Return the plate, the lugs of both universal joints, the rails on their pillars."""
    side, unit = sizes.chains.side, sizes.design.unit_mm
    low, high = -sizes.depth - sizes.base_plate, -sizes.depth
    a3 = (sizes.design.a3[0] * unit, sizes.design.a3[1] * unit * side)
    guide = sizes.guide
    ends = [x for rail in sizes.rails for x in rail]
    feet = [
        (0.0, 0.0, sizes.legs[0].swing),
        (*a3, sizes.legs[3].swing),
        *((x, 0.0, 2.0 * guide.radius) for x in ends),
    ]
    pieces = [_hull([_disc(radius, low, high, x, y) for x, y, radius in feet])]
    for index, (x, y) in ((0, (0.0, 0.0)), (3, a3)):
        mount = np.diag([1.0, side, side]) @ sizes.chains.mounts[index]
        lugs = _lugs(sizes.legs[index], low)
        pieces.append(lugs.transform(np.column_stack([mount, [x, y, 0.0]])))
    for start, end in sizes.rails:
        pieces.append(_box((start, -guide.shaft, -guide.shaft), (end, guide.shaft, guide.shaft)))
        pieces.extend(
            _box((foot, -guide.shaft, low), (foot + guide.pillar, guide.shaft, guide.shaft))
            for foot in (start, end - guide.pillar)
        )
    # Made with the platform above it.
    return _union(pieces).rotate((180.0 * (side < 0), 0.0, 0.0))


def _lugs(own: LegSizes, low: float) -> Manifold:
    """Return the two eyes that hold the first axis, on stems down to the base plate."""
    eye = _disc(own.eye, own.inner, own.outer).rotate((0.0, 90.0, 0.0))
    # As narrow as the fork's arms, which pass beside it when the leg leans both ways.
    half = _SLIM * own.eye
    lug = eye + _box((own.inner, -half, low + 0.5 * own.plate), (own.outer, half, 0.0))
    hole = _hole(own.pin + CLEARANCE, -own.outer - 1.0, own.outer + 1.0).rotate((0.0, 90.0, 0.0))
    return _union([lug, lug.mirror((1.0, 0.0, 0.0))]) - hole


def _cross(own: LegSizes) -> Manifold:
    """Return the cross of a universal joint: two shafts, their ends thinner."""
    half = own.inner - CLEARANCE
    shaft = _disc(0.8 * own.radius, -half, half) + _disc(own.pin, -own.outer, own.outer)
    return shaft.rotate((0.0, 90.0, 0.0)) + shaft.rotate((90.0, 0.0, 0.0))


def _carriage(sizes: Sizes, own: LegSizes) -> Manifold:
    """Return a sleeve on the square shaft, with a flange at both ends."""
    guide, half = sizes.guide, own.radius
    flange = _flange(own)
    pieces = [
        _disc(guide.sleeve, -half, half),
        _disc(guide.flange, -half, flange - half),
        _disc(guide.flange, half - flange, half),
    ]
    hole = guide.shaft + CLEARANCE
    sleeve = _union(pieces).rotate((0.0, 90.0, 0.0))
    return sleeve - _box((-half - 1.0, -hole, -hole), (half + 1.0, hole, hole))


def _flange(own: LegSizes) -> float:
    return max(0.2 * own.radius, 0.25)


def _cylinder(sizes: Sizes, leg: int) -> Manifold:
    """Return a cylinder, open at its end, with what joins it to the base."""
    own, stroke = sizes.legs[leg - 1], sizes.strokes[leg - 1]
    top = stroke.shortest - own.end - CLEARANCE
    bottom = own.floor - own.plate
    tube = _disc(own.radius, bottom, top) - _hole(own.bore, own.floor, top + 1.0)
    return tube + (_ring(sizes, own) if leg in ON_GUIDE else _fork(own))


def _ring(sizes: Sizes, own: LegSizes) -> Manifold:
    """Return the eye of a leg about the guide."""
    guide = sizes.guide
    half = own.radius - _flange(own) - CLEARANCE
    around = _disc(guide.eye, -half, half).rotate((0.0, 90.0, 0.0))
    # The neck fills what is left between the eye and the round bottom.
    neck = _box((-half, -0.6 * guide.eye, 0.0), (half, 0.6 * guide.eye, guide.eye + own.plate))
    neck ^= _disc(own.radius, 0.0, guide.eye + own.plate)
    hole = _hole(guide.sleeve + CLEARANCE, -half - 1.0, half + 1.0).rotate((0.0, 90.0, 0.0))
    return (around + neck) - hole


def _fork(own: LegSizes) -> Manifold:
    """Return the two eyes that hold the second axis, and the bridge between them."""
    eye = _disc(own.eye, own.inner, own.outer).rotate((-90.0, 0.0, 0.0))
    half = _SLIM * own.eye
    arm = _box((-half, own.inner, 0.0), (half, own.outer, own.floor))
    hole = _hole(own.pin + CLEARANCE, -own.outer - 1.0, own.outer + 1.0).rotate((90.0, 0.0, 0.0))
    bridge = _box((-own.eye, -own.outer, own.bottom), (own.eye, own.outer, own.floor))
    arms = _union([eye, arm]) - hole
    return _union([arms, arms.mirror((0.0, 1.0, 0.0)), bridge])


def _rod(sizes: Sizes, leg: int) -> Manifold:
    """Return a rod with the cup of the ball joint, whose centre is the origin."""
    own, stroke = sizes.legs[leg - 1], sizes.strokes[leg - 1]
    length = stroke.shortest - own.floor - CLEARANCE
    cup = _disc(own.cup, -own.end, -own.rim) - _sphere((own.ball + CLEARANCE) / _inscribed())
    return cup + _disc(own.rod, -length, -own.end + 0.5 * own.wall)


def _platform(sizes: Sizes) -> Manifold:
    """Return the plate, on the far side of the platform plane, with a hole for each ball."""
    points = platform_points(sizes.design) * sizes.design.unit_mm
    low, high = sizes.standoff, sizes.standoff + sizes.platform_plate
    discs: list[Manifold] = []
    holes: list[Manifold] = []
    for own, (x, y, _) in zip(sizes.legs, points.tolist(), strict=True):
        discs.append(_disc(1.5 * own.radius, low, high, x, y))
        holes.append(_hole(own.neck + CLEARANCE, low - 1.0, high + 1.0, x, y))
    return _facing(_hull(discs) - _union(holes), sizes)


def _ball(sizes: Sizes, leg: int) -> Manifold:
    """Return a ball on its neck, which reaches through the platform plate."""
    own = sizes.legs[leg - 1]
    x, y, _ = (platform_points(sizes.design)[leg - 1] * sizes.design.unit_mm).tolist()
    neck = _disc(own.neck, 0.0, sizes.standoff + sizes.platform_plate)
    return _facing((_sphere(own.ball) + neck).translate((x, y, 0.0)), sizes)


def _facing(shape: Manifold, sizes: Sizes) -> Manifold:
    """Return a shape that was made for a1 below the platform, facing a1 where it is."""
    return shape.mirror((0.0, 0.0, 1.0)) if sizes.chains.platform_side > 0 else shape


def _disc(radius: float, low: float, high: float, x: float = 0.0, y: float = 0.0) -> Manifold:
    """Return a cylinder along z."""
    from manifold3d import Manifold

    made = Manifold.cylinder(high - low, radius, radius, SEGMENTS)
    return made.translate((x, y, low))


def _hole(radius: float, low: float, high: float, x: float = 0.0, y: float = 0.0) -> Manifold:
    """Return what to cut out for a round hole: its chords lie outside the circle."""
    return _disc(radius / math.cos(math.pi / SEGMENTS), low, high, x, y)


def _sphere(radius: float) -> Manifold:
    from manifold3d import Manifold

    return Manifold.sphere(radius, SEGMENTS)


@functools.cache
def _inscribed() -> float:
    """Return how near the faces of a sphere of radius 1 come to its centre."""
    mesh: Any = _sphere(1.0).to_mesh64()
    corners = np.array(mesh.vert_properties)[:, :3][np.array(mesh.tri_verts)]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normals = np.cross(b - a, c - a)
    distances = np.einsum("ij,ij->i", normals, a) / np.linalg.norm(normals, axis=1)
    return float(distances.min())


def _box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Manifold:
    from manifold3d import Manifold

    x, y, z = (b - a for a, b in zip(low, high, strict=True))
    return Manifold.cube((x, y, z)).translate(low)


def _union(shapes: Sequence[Manifold]) -> Manifold:
    from manifold3d import Manifold, OpType

    return Manifold.batch_boolean(list(shapes), OpType.Add)


def _hull(shapes: Sequence[Manifold]) -> Manifold:
    from manifold3d import Manifold

    return Manifold.batch_hull(list(shapes))


def _sound(shape: Manifold) -> Manifold:
    from manifold3d import Error

    if shape.status() != Error.NoError:
        raise ExplorerError(f"the body of a part cannot be made: {shape.status().name}")
    return shape


def _part(name: str, body: str, shape: Manifold, unit_mm: float) -> Part:
    mesh: Any = _sound(shape).to_mesh64()
    vertices = np.array(mesh.vert_properties, dtype=np.float64)[:, :3] / unit_mm
    return Part(name, body, vertices, np.array(mesh.tri_verts, dtype=np.int32))
