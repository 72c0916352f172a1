"""Forms of the parts: booleans of simple shapes that any `ShapeMaker` can make, as meshes.

Shapes are in millimetres, each in the frame of its body (`explorer.motion.chains`). Closed
meshes are made by manifold3d, which no other module of the prototype uses.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from explorer.errors import ExplorerError
from explorer.mechanism.pose import Triple
from explorer.motion.chains import BODIES, LEGS, ON_GUIDE
from explorer.motion.masses import Mass
from explorer.numerics.arrays import FloatArray
from explorer.prototype.sizes import CLEARANCE, LegSizes, Sizes
from explorer.workspace.solids.solid import Solid

Shape: TypeAlias = Any
"""A body: `+`, `-` and `^` are union, difference and intersection; it has the methods
`translate`, `rotate` (degrees about x, y and z in turn), `mirror` (normal to an axis) and
`transform` (a matrix of three rows and four columns)."""


class Circle(NamedTuple):
    """A circle in a plane normal to z."""

    radius: float
    x: float = 0.0
    y: float = 0.0


SEGMENTS = 48
"""Number of edges of a circle."""

# Inner radius, rounded down, of the polyhedron with these edges for a ball of radius 1.
_INSCRIBED = 0.99425


class ShapeMaker:
    """A maker of polyhedra in millimetres: inscribed in round shapes, circumscribed about holes.

    A maker of other bodies overrides every method.
    """

    @cached_property
    def _library(self) -> Any:
        import manifold3d

        return manifold3d

    def disc(self, circle: Circle, low: float, high: float) -> Shape:
        """Return a cylinder along z between two heights."""
        radius, length = circle.radius, high - low
        cylinder = self._library.Manifold.cylinder(length, radius, radius, SEGMENTS)
        return cylinder.translate((circle.x, circle.y, low))

    def hole(self, circle: Circle, low: float, high: float) -> Shape:
        """Return the tool that cuts a round hole; its chords lie outside the circle."""
        radius = circle.radius / math.cos(math.pi / SEGMENTS)
        return self.disc(circle._replace(radius=radius), low, high)

    def ball(self, radius: float) -> Shape:
        """Return a ball about the origin."""
        return self._library.Manifold.sphere(radius, SEGMENTS)

    def cavity(self, radius: float) -> Shape:
        """Return the tool that cuts a seat for a ball about the origin."""
        return self.ball(radius / _INSCRIBED)

    def box(self, low: Triple, high: Triple) -> Shape:
        """Return a box between two corners."""
        x, y, z = (b - a for a, b in zip(low, high, strict=True))
        return self._library.Manifold.cube((x, y, z)).translate(low)

    def union(self, shapes: Sequence[Shape]) -> Shape:
        """Return the union of shapes."""
        return functools.reduce(operator.add, shapes)

    def hull(self, circles: Sequence[Circle], low: float, high: float) -> Shape:
        """Return a plate between two heights, whose outline is the convex hull of circles."""
        return self._library.Manifold.batch_hull([self.disc(each, low, high) for each in circles])


# Half the width of lugs and arms, over the radius of their eyes.
_SLIM = 0.55


def forms_of(sizes: Sizes, k: ShapeMaker) -> Iterator[tuple[str, str, Shape]]:
    """Yield the name, the body and the shape of all parts, the base first."""
    yield "base", "base", _base(k, sizes)
    for leg, dims in zip(LEGS, sizes.legs, strict=True):
        if leg in ON_GUIDE:
            yield f"carriage {leg}", f"carriage {leg}", _carriage(k, sizes, dims)
        else:
            yield f"cross {leg}", f"cross {leg}", _cross(k, dims)
        yield f"cylinder {leg}", f"cylinder {leg}", _cylinder(k, sizes, leg)
        yield f"rod {leg}", f"rod {leg}", _rod(k, sizes, leg)
    yield "platform", "platform", _platform(k, sizes)
    for leg in LEGS:
        yield f"ball {leg}", "platform", _ball(k, sizes, leg)


def _base(k: ShapeMaker, sizes: Sizes) -> Shape:
    """Return the base: its plate, the lugs of both universal joints, the rails on pillars."""
    side, unit, guide = sizes.chains.side, sizes.design.unit_mm, sizes.guide
    low, high = -sizes.depth - sizes.base_plate, -sizes.depth
    a3 = (sizes.design.a3[0] * unit, sizes.design.a3[1] * unit * side)
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
    # All above is for a platform above the base.
    return k.union(pieces).rotate((180.0 * (side < 0), 0.0, 0.0))


def _lugs(k: ShapeMaker, dims: LegSizes, low: float) -> Shape:
    """Return the two eyes that hold the first axis, on stems down to the base plate."""
    eye = k.disc(Circle(dims.eye), dims.inner, dims.outer).rotate((0.0, 90.0, 0.0))
    # The lug is as narrow as the fork's arms, which pass it when the leg leans both ways.
    half = _SLIM * dims.eye
    lug = eye + k.box((dims.inner, -half, low + 0.5 * dims.plate), (dims.outer, half, 0.0))
    hole = k.hole(Circle(dims.pin + CLEARANCE), -dims.outer - 1.0, dims.outer + 1.0)
    return k.union([lug, lug.mirror((1.0, 0.0, 0.0))]) - hole.rotate((0.0, 90.0, 0.0))


def _cross(k: ShapeMaker, dims: LegSizes) -> Shape:
    """Return the cross of a universal joint: two shafts, their ends thinner."""
    half = dims.inner - CLEARANCE
    pin = k.disc(Circle(dims.pin), -dims.outer, dims.outer)
    shaft = k.disc(Circle(0.8 * dims.radius), -half, half) + pin
    return shaft.rotate((0.0, 90.0, 0.0)) + shaft.rotate((90.0, 0.0, 0.0))


def _carriage(k: ShapeMaker, sizes: Sizes, dims: LegSizes) -> Shape:
    """Return a sleeve on the square shaft, with a flange at both ends."""
    guide, half, flange = sizes.guide, dims.radius, _flange(dims)
    pieces = [
        k.disc(Circle(guide.sleeve), -half, half),
        k.disc(Circle(guide.flange), -half, flange - half),
        k.disc(Circle(guide.flange), half - flange, half),
    ]
    hole = guide.shaft + CLEARANCE
    sleeve = k.union(pieces).rotate((0.0, 90.0, 0.0))
    return sleeve - k.box((-half - 1.0, -hole, -hole), (half + 1.0, hole, hole))


def _flange(dims: LegSizes) -> float:
    return max(0.2 * dims.radius, 0.25)


def _cylinder(k: ShapeMaker, sizes: Sizes, leg: int) -> Shape:
    """Return a cylinder, open at its end, with the eye or the fork that joins it to the base."""
    dims, stroke = sizes.legs[leg - 1], sizes.strokes[leg - 1]
    top = stroke.shortest - dims.end - CLEARANCE
    bottom = dims.floor - dims.plate
    tube = k.disc(Circle(dims.radius), bottom, top)
    tube -= k.hole(Circle(dims.bore), dims.floor, top + 1.0)
    return tube + (_ring(k, sizes, dims) if leg in ON_GUIDE else _fork(k, dims))


def _ring(k: ShapeMaker, sizes: Sizes, dims: LegSizes) -> Shape:
    """Return the eye of a leg about the guide."""
    guide = sizes.guide
    half = dims.radius - _flange(dims) - CLEARANCE
    around = k.disc(Circle(guide.eye), -half, half).rotate((0.0, 90.0, 0.0))
    # The neck fills the space between the eye and the round bottom.
    neck = k.box((-half, -0.6 * guide.eye, 0.0), (half, 0.6 * guide.eye, guide.eye + dims.plate))
    neck ^= k.disc(Circle(dims.radius), 0.0, guide.eye + dims.plate)
    hole = k.hole(Circle(guide.sleeve + CLEARANCE), -half - 1.0, half + 1.0)
    return (around + neck) - hole.rotate((0.0, 90.0, 0.0))


def _fork(k: ShapeMaker, dims: LegSizes) -> Shape:
    """Return the two eyes that hold the second axis, and the bridge between them."""
    eye = k.disc(Circle(dims.eye), dims.inner, dims.outer).rotate((-90.0, 0.0, 0.0))
    half = _SLIM * dims.eye
    arm = k.box((-half, dims.inner, 0.0), (half, dims.outer, dims.floor))
    hole = k.hole(Circle(dims.pin + CLEARANCE), -dims.outer - 1.0, dims.outer + 1.0)
    bridge = k.box((-dims.eye, -dims.outer, dims.bottom), (dims.eye, dims.outer, dims.floor))
    arms = k.union([eye, arm]) - hole.rotate((90.0, 0.0, 0.0))
    return k.union([arms, arms.mirror((0.0, 1.0, 0.0)), bridge])


def _rod(k: ShapeMaker, sizes: Sizes, leg: int) -> Shape:
    """Return a rod with the cup of the ball joint, whose centre is the origin."""
    dims, stroke = sizes.legs[leg - 1], sizes.strokes[leg - 1]
    length = stroke.shortest - dims.floor - CLEARANCE
    cup = k.disc(Circle(dims.cup), -dims.end, -dims.rim) - k.cavity(dims.ball + CLEARANCE)
    return cup + k.disc(Circle(dims.rod), -length, -dims.end + 0.5 * dims.wall)


def _platform(k: ShapeMaker, sizes: Sizes) -> Shape:
    """Return the platform plate, beyond the platform plane, with a hole for each ball's neck."""
    points = sizes.design.platform_points * sizes.design.unit_mm
    low, high = sizes.standoff, sizes.standoff + sizes.platform_plate
    legs = [(dims, x, y) for dims, (x, y, _) in zip(sizes.legs, points.tolist(), strict=True)]
    plate = k.hull([Circle(1.5 * dims.radius, x, y) for dims, x, y in legs], low, high)
    necks = (Circle(dims.neck + CLEARANCE, x, y) for dims, x, y in legs)
    holes = k.union([k.hole(neck, low - 1.0, high + 1.0) for neck in necks])
    return _facing(plate - holes, sizes)


def _ball(k: ShapeMaker, sizes: Sizes, leg: int) -> Shape:
    """Return a ball on its neck, which reaches through the platform plate."""
    dims = sizes.legs[leg - 1]
    x, y, _ = (sizes.design.platform_points[leg - 1] * sizes.design.unit_mm).tolist()
    neck = k.disc(Circle(dims.neck), 0.0, sizes.standoff + sizes.platform_plate)
    return _facing((k.ball(dims.ball) + neck).translate((x, y, 0.0)), sizes)


def _facing(shape: Shape, sizes: Sizes) -> Shape:
    """Return a shape made for a1 below the platform, mirrored if a1 is above it."""
    return shape.mirror((0.0, 0.0, 1.0)) if sizes.chains.platform_side > 0 else shape


@dataclass(frozen=True)
class PrototypePart:
    """A part, such as "cylinder 2", of a body out of `explorer.motion.chains.BODIES`.

    Its vertices (n, 3) are in the frame of the body, in design units; its faces (m, 3) are
    counter-clockwise from outside.
    """

    name: str
    body: str
    vertices: FloatArray
    faces: NDArray[np.int32]

    @property
    def kind(self) -> str:
        """The name without its number, on which the colour depends."""
        return self.name.partition(" ")[0]

    @property
    def body_index(self) -> int:
        """The index of the body in `BODIES`."""
        return BODIES.index(self.body)

    @cached_property
    def solid(self) -> Solid:
        """The part as a closed mesh in its own frame."""
        limit_of_face = np.zeros(len(self.faces), dtype=np.int64)
        return Solid(self.vertices, self.faces, limit_of_face, (self.name,), 0.0)

    @cached_property
    def unit_mass(self) -> Mass:
        """The mass properties at a density of 1, in design units."""
        import trimesh

        untyped: Any = trimesh.triangles
        found = untyped.mass_properties(self.vertices[self.faces], density=1.0)
        return Mass(float(found["mass"]), found["center_mass"], found["inertia"])

    def mass(self, density: float, unit_mm: float) -> Mass:
        """Return the mass properties in kilograms and metres, at a density in kg/m³."""
        own, metres = self.unit_mass, 1e-3 * unit_mm
        factor = density * metres**3
        return Mass(own.mass * factor, own.centre * metres, own.inertia * (factor * metres**2))


def make_parts(sizes: Sizes) -> tuple[PrototypePart, ...]:
    """Make all parts, the base first."""
    unit = sizes.design.unit_mm
    return tuple(
        _part(name, body, shape, unit) for name, body, shape in forms_of(sizes, ShapeMaker())
    )


def _part(name: str, body: str, shape: Shape, unit_mm: float) -> PrototypePart:
    from manifold3d import Error

    if shape.status() != Error.NoError:
        raise ExplorerError(f"the {name} cannot be made: manifold3d reports {shape.status().name}")
    mesh: Any = shape.to_mesh64()
    vertices = np.array(mesh.vert_properties, dtype=np.float64)[:, :3] / unit_mm
    return PrototypePart(name, body, vertices, np.array(mesh.tri_verts, dtype=np.int32))
