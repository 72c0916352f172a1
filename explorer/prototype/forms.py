"""The forms of the parts, as booleans of simple shapes that any `Kernel` can make.

Shapes are in millimetres, each in the frame of its body (`explorer.prototype.chains`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.prototype.chains import LEGS, ON_GUIDE
from explorer.prototype.dimensions import CLEARANCE, LegSizes
from explorer.prototype.kernel import Circle, Kernel, Shape
from explorer.prototype.sizes import Sizes
from explorer.prototype.sketch import platform_points

# Half the width of lugs and arms, over the radius of their eyes.
_SLIM = 0.55


def forms_of(sizes: Sizes, k: Kernel) -> Iterator[tuple[str, str, Shape]]:
    """Yield the name, the body and the shape of all parts, the base first."""
    yield "base", "base", _base(k, sizes)
    for leg, own in zip(LEGS, sizes.legs, strict=True):
        if leg in ON_GUIDE:
            yield f"carriage {leg}", f"carriage {leg}", _carriage(k, sizes, own)
        else:
            yield f"cross {leg}", f"cross {leg}", _cross(k, own)
        yield f"cylinder {leg}", f"cylinder {leg}", _cylinder(k, sizes, leg)
        yield f"rod {leg}", f"rod {leg}", _rod(k, sizes, leg)
    yield "platform", "platform", _platform(k, sizes)
    for leg in LEGS:
        yield f"ball {leg}", "platform", _ball(k, sizes, leg)


def _base(k: Kernel, sizes: Sizes) -> Shape:
    """Return the base: its plate, the lugs of both universal joints, the rails on pillars."""
    side, unit = sizes.chains.side, sizes.design.unit_mm
    low, high = -sizes.depth - sizes.base_plate, -sizes.depth
    a3 = (sizes.design.a3[0] * unit, sizes.design.a3[1] * unit * side)
    guide = sizes.guide
    ends = [x for rail in sizes.rails for x in rail]
    feet = [
        Circle(sizes.legs[0].swing),
        Circle(sizes.legs[3].swing, *a3),
        *(Circle(2.0 * guide.radius, x) for x in ends),
    ]
    pieces = [k.hull(feet, low, high)]
    for index, (x, y) in ((0, (0.0, 0.0)), (3, a3)):
        mount = np.diag([1.0, side, side]) @ sizes.chains.mounts[index]
        lugs = _lugs(k, sizes.legs[index], low)
        pieces.append(lugs.transform(np.column_stack([mount, [x, y, 0.0]])))
    for start, end in sizes.rails:
        pieces.append(k.box((start, -guide.shaft, -guide.shaft), (end, guide.shaft, guide.shaft)))
        pieces.extend(
            k.box((foot, -guide.shaft, low), (foot + guide.pillar, guide.shaft, guide.shaft))
            for foot in (start, end - guide.pillar)
        )
    # The base was made for a platform above it.
    return k.union(pieces).rotate((180.0 * (side < 0), 0.0, 0.0))


def _lugs(k: Kernel, own: LegSizes, low: float) -> Shape:
    """Return the two eyes that hold the first axis, on stems down to the base plate."""
    eye = k.disc(Circle(own.eye), own.inner, own.outer).rotate((0.0, 90.0, 0.0))
    # As narrow as the fork's arms, which pass beside it when the leg leans both ways.
    half = _SLIM * own.eye
    lug = eye + k.box((own.inner, -half, low + 0.5 * own.plate), (own.outer, half, 0.0))
    hole = k.hole(Circle(own.pin + CLEARANCE), -own.outer - 1.0, own.outer + 1.0).rotate(
        (0.0, 90.0, 0.0)
    )
    return k.union([lug, lug.mirror((1.0, 0.0, 0.0))]) - hole


def _cross(k: Kernel, own: LegSizes) -> Shape:
    """Return the cross of a universal joint: two shafts, their ends thinner."""
    half = own.inner - CLEARANCE
    shaft = k.disc(Circle(0.8 * own.radius), -half, half) + k.disc(
        Circle(own.pin), -own.outer, own.outer
    )
    return shaft.rotate((0.0, 90.0, 0.0)) + shaft.rotate((90.0, 0.0, 0.0))


def _carriage(k: Kernel, sizes: Sizes, own: LegSizes) -> Shape:
    """Return a sleeve on the square shaft, with a flange at both ends."""
    guide, half = sizes.guide, own.radius
    flange = _flange(own)
    pieces = [
        k.disc(Circle(guide.sleeve), -half, half),
        k.disc(Circle(guide.flange), -half, flange - half),
        k.disc(Circle(guide.flange), half - flange, half),
    ]
    hole = guide.shaft + CLEARANCE
    sleeve = k.union(pieces).rotate((0.0, 90.0, 0.0))
    return sleeve - k.box((-half - 1.0, -hole, -hole), (half + 1.0, hole, hole))


def _flange(own: LegSizes) -> float:
    return max(0.2 * own.radius, 0.25)


def _cylinder(k: Kernel, sizes: Sizes, leg: int) -> Shape:
    """Return a cylinder, open at its end, with the eye or the fork that joins it to the base."""
    own, stroke = sizes.legs[leg - 1], sizes.strokes[leg - 1]
    top = stroke.shortest - own.end - CLEARANCE
    bottom = own.floor - own.plate
    tube = k.disc(Circle(own.radius), bottom, top) - k.hole(Circle(own.bore), own.floor, top + 1.0)
    return tube + (_ring(k, sizes, own) if leg in ON_GUIDE else _fork(k, own))


def _ring(k: Kernel, sizes: Sizes, own: LegSizes) -> Shape:
    """Return the eye of a leg about the guide."""
    guide = sizes.guide
    half = own.radius - _flange(own) - CLEARANCE
    around = k.disc(Circle(guide.eye), -half, half).rotate((0.0, 90.0, 0.0))
    # The neck fills the space between the eye and the round bottom.
    neck = k.box((-half, -0.6 * guide.eye, 0.0), (half, 0.6 * guide.eye, guide.eye + own.plate))
    neck ^= k.disc(Circle(own.radius), 0.0, guide.eye + own.plate)
    hole = k.hole(Circle(guide.sleeve + CLEARANCE), -half - 1.0, half + 1.0).rotate(
        (0.0, 90.0, 0.0)
    )
    return (around + neck) - hole


def _fork(k: Kernel, own: LegSizes) -> Shape:
    """Return the two eyes that hold the second axis, and the bridge between them."""
    eye = k.disc(Circle(own.eye), own.inner, own.outer).rotate((-90.0, 0.0, 0.0))
    half = _SLIM * own.eye
    arm = k.box((-half, own.inner, 0.0), (half, own.outer, own.floor))
    hole = k.hole(Circle(own.pin + CLEARANCE), -own.outer - 1.0, own.outer + 1.0).rotate(
        (90.0, 0.0, 0.0)
    )
    bridge = k.box((-own.eye, -own.outer, own.bottom), (own.eye, own.outer, own.floor))
    arms = k.union([eye, arm]) - hole
    return k.union([arms, arms.mirror((0.0, 1.0, 0.0)), bridge])


def _rod(k: Kernel, sizes: Sizes, leg: int) -> Shape:
    """Return a rod with the cup of the ball joint, whose centre is the origin."""
    own, stroke = sizes.legs[leg - 1], sizes.strokes[leg - 1]
    length = stroke.shortest - own.floor - CLEARANCE
    cup = k.disc(Circle(own.cup), -own.end, -own.rim) - k.cavity(own.ball + CLEARANCE)
    return cup + k.disc(Circle(own.rod), -length, -own.end + 0.5 * own.wall)


def _platform(k: Kernel, sizes: Sizes) -> Shape:
    """Return the platform plate, beyond the platform plane, with a hole for each ball's neck."""
    points = platform_points(sizes.design) * sizes.design.unit_mm
    low, high = sizes.standoff, sizes.standoff + sizes.platform_plate
    pads: list[Circle] = []
    holes: list[Shape] = []
    for own, (x, y, _) in zip(sizes.legs, points.tolist(), strict=True):
        pads.append(Circle(1.5 * own.radius, x, y))
        holes.append(k.hole(Circle(own.neck + CLEARANCE, x, y), low - 1.0, high + 1.0))
    return _facing(k.hull(pads, low, high) - k.union(holes), sizes)


def _ball(k: Kernel, sizes: Sizes, leg: int) -> Shape:
    """Return a ball on its neck, which reaches through the platform plate."""
    own = sizes.legs[leg - 1]
    x, y, _ = (platform_points(sizes.design)[leg - 1] * sizes.design.unit_mm).tolist()
    neck = k.disc(Circle(own.neck), 0.0, sizes.standoff + sizes.platform_plate)
    return _facing((k.ball(own.ball) + neck).translate((x, y, 0.0)), sizes)


def _facing(shape: Shape, sizes: Sizes) -> Shape:
    """Return a shape made for a1 below the platform, mirrored if a1 is above it."""
    return shape.mirror((0.0, 0.0, 1.0)) if sizes.chains.platform_side > 0 else shape
