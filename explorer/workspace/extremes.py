"""The extent of a workspace, and the least margins within it.

Margins are linear in the position, so both are extremes of linear functions over a region that
spheres, cylinders along x, cones and planes bound. An extreme lies where the gradient is normal to
one surface, or to the curve in which two surfaces meet, or else where three surfaces meet. All
such points are computed, and those within the limits are compared; nothing is searched for.

Such a point has three equations, of degree two or one. If two of them are linear, a quadratic
remains. Otherwise the point lies on a ruling of a cylinder or a cone, and the condition that two
quadratics along a ruling have a common root is a trigonometric polynomial in its angle, their
resultant (D. Cox, J. Little and D. O'Shea, "Using Algebraic Geometry", chapter 3). Newton's method
then removes rounding errors.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import TypeAlias

import numpy as np

from explorer.mechanism.design import TOLERANCE
from explorer.mechanism.margins import planes_of_singularity
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, dot, rotate
from explorer.numerics.computed_once import computed_once
from explorer.workspace.limits.constraints import (
    BallOrCylinder,
    Cone,
    Constraint,
    HalfSpace,
    Never,
    shift,
    surface_of,
)
from explorer.workspace.limits.region import Region
from explorer.workspace.workspace import Workspace

# Degree of the resultant in the cosine and sine of the angle, and angles that determine it.
DEGREE = 4
ANGLES = 2.0 * math.pi * np.arange(2 * DEGREE + 1) / (2 * DEGREE + 1)
# Share of the largest coefficient up to which one is zero but for rounding.
ZERO = 1e-12
# Steps of Newton's method, and its damping.
STEPS, DAMPING = 5, 1e-13
# Kinds of surfaces; the last two have rulings.
SPHERE, PLANE, CYLINDER, CONE = range(4)

_Row: TypeAlias = tuple[int, FloatArray, float, FloatArray, float]
# Largest violation of a limit by a point before its rounding errors are removed, as a share of the
# size of the region.
NEAR = 1e-3
NO_NORMALS: FloatArray = np.zeros((0, 3))


@computed_once
def extent_of(workspace: Workspace) -> tuple[FloatArray, FloatArray] | None:
    """Return (lows, highs) of a workspace, each (3,), in design units; None if it has no volume."""
    points = extremes_of(workspace.limits, workspace.region, workspace.design.reach)
    return (points.min(axis=0), points.max(axis=0)) if len(points) else None


@computed_once
def least_margins(workspace: Workspace) -> FloatArray | None:
    """Return the least |δ1|, |δ2| and |δ3| in a workspace, in design units; None as `extent_of`."""
    gradients, design = planes_of_singularity(workspace.rotation), workspace.design
    points = extremes_of(workspace.limits, workspace.region, design.reach, gradients)
    if not len(points):
        return None
    least = np.abs(points @ gradients.T).min(axis=0)
    least[least <= design.tolerance] = 0.0
    return least


def extremes_of(
    limits: Sequence[Constraint], region: Region, reach: float, normals: FloatArray = NO_NORMALS
) -> FloatArray:
    """Return positions (n, 3) in a region with its limits, the extreme ones among them.

    They are extreme along the axes and along the normals, shape (m, 3), in the whole region and on
    either side of the planes through a1 with these normals. Tolerances are those of the reach.
    """
    box = region.box
    if box is None:
        return np.zeros((0, 3))
    lows, highs = box
    middle, unit = 0.5 * (lows + highs), 0.5 * float(np.linalg.norm(highs - lows))
    lengths = np.linalg.norm(normals, axis=1)
    directions = normals[lengths > 0.0] / lengths[lengths > 0.0, None]
    # A limit counts if its surface may pass through the ball about the region.
    crossing = [
        limit
        for limit in (*limits, *(HalfSpace("", normal, 0.0) for normal in directions))
        if isinstance(limit, Cone) or float(limit.distance(middle)) <= unit * (1.0 + 1e-12)
    ]
    surfaces = Quadrics.of([shift(limit, -middle) for limit in crossing], unit)
    radii = [limit.radius for limit in crossing if isinstance(limit, BallOrCylinder)]
    directions = np.vstack([np.eye(3), directions])

    def within(points: FloatArray, excess: float) -> BoolArray:
        positions = middle + unit * points
        kept: BoolArray = np.abs(points).max(axis=1) <= 1.0 + NEAR
        for limit in limits:
            rest = positions[kept]
            kept[kept] = (limit.slack(rest) >= 0.0) | (limit.distance(rest) <= excess)
        return kept

    points, equations = surfaces.common_points(directions)
    kept = within(points, NEAR * unit)
    refined = surfaces.refine(points[kept], equations[kept], directions)
    found = np.vstack([points[kept], refined, surfaces.poles(directions)])
    return middle + unit * found[within(found, TOLERANCE * max([reach, *radii]))]


@dataclass(frozen=True)
class Quadrics:
    """The surfaces of limits as those of `surface_of`, n of them.

    Attributes:
        kind: `SPHERE`, `PLANE`, `CYLINDER` or `CONE`, ascending, shape (n,).
        centre: Centres, points of the axes or apexes, shape (n, 3); 0 for a plane.
        steepness: 1 or −1, for a plane 0, for a cone the cosine of its half-angle, shape (n,).
        axis: Unit normals of planes, minus the unit axes of cones, otherwise 0, shape (n, 3).
        level: Radii or their negatives, offsets of planes, or 0 for cones, shape (n,).
    """

    kind: IntArray
    centre: FloatArray
    steepness: FloatArray
    axis: FloatArray
    level: FloatArray

    @staticmethod
    def of(limits: Sequence[Constraint], unit: float) -> Quadrics:
        """Return the surfaces of limits, lengths divided by a unit."""
        rows = sorted((row for limit in limits for row in _rows(limit, unit)), key=itemgetter(0))
        kind, centre, steepness, axis, level = zip(*rows, strict=True)
        numbers = np.array(centre), np.array(steepness), np.array(axis), np.array(level)
        return Quadrics(np.array(kind, dtype=np.int64), *numbers)

    @cached_property
    def scale(self) -> FloatArray:
        """The factors s of the axes, shape (n, 3)."""
        return np.where(self.kind[:, None] == CYLINDER, [0.0, 1.0, 1.0], 1.0)

    def forms(self) -> FloatArray:
        """Return the matrices Q of the equations (p, 1) · Q (p, 1) = 0, shape (n, 4, 4)."""
        forms, is_plane = np.zeros((len(self.kind), 4, 4)), self.kind == PLANE
        squares = self.steepness[:, None, None] ** 2 * (self.scale[:, None] * np.eye(3))
        squares -= self.axis[:, :, None] * self.axis[:, None]
        squares[is_plane] = 0.0
        by_centre = (squares @ self.centre[..., None])[..., 0]
        forms[:, :3, :3] = squares
        forms[:, :3, 3] = forms[:, 3, :3] = np.where(is_plane[:, None], 0.5 * self.axis, -by_centre)
        forms[:, 3, 3] = (
            dot(by_centre, self.centre) - np.where(is_plane, 1.0, self.level) * self.level
        )
        return forms

    def rulings(self) -> FloatArray:
        """Return points and directions of rulings by (1, cos, sin) of an angle, (n, 2, 3, 4)."""
        rows = np.zeros((len(self.kind), 2, 3, 4))
        rows[:, 0, 0, :3], rows[:, 0, 0, 3] = self.centre, 1.0
        round_ones = self.kind == CYLINDER
        rows[round_ones, 0, 1, 1] = rows[round_ones, 0, 2, 2] = self.level[round_ones]
        rows[round_ones, 1, 0, 0] = 1.0
        for index in np.flatnonzero(self.kind == CONE).tolist():
            cosine, axis = -float(self.steepness[index]), self.axis[index]
            _, _, frame = np.linalg.svd(axis[None])
            rows[index, 1, 0, :3] = cosine * axis
            rows[index, 1, 1:, :3] = math.sqrt(max(0.0, 1.0 - cosine**2)) * frame[1:]
        return rows

    def poles(self, directions: FloatArray) -> FloatArray:
        """Return apexes, centres, and the points of spheres with directions as normals, (m, 3)."""
        ways = np.vstack([np.zeros(3), directions, -directions])
        chosen = (self.kind == SPHERE) | (self.kind == CONE)
        poles = self.centre[chosen, None] + self.level[chosen, None, None] * ways
        return poles.reshape(-1, 3)

    def common_points(self, directions: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return points with three equations, and the equations, shape (m, 3) each.

        An equation is the index of a surface, or -1 - k if direction k is normal to the curve in
        which the two surfaces before it meet. Points may miss their equations where the roots are
        complex.
        """
        count, ways = len(self.kind), len(directions)
        pairs = np.array([*itertools.combinations(range(count), 2)], dtype=np.int64).reshape(-1, 2)
        triples = np.array([*itertools.combinations(range(count), 3)], dtype=np.int64)
        thirds = -1 - np.tile(np.arange(ways), len(pairs))
        stationary = np.column_stack([np.repeat(pairs, ways, axis=0), thirds])
        equations = np.vstack([triples.reshape(-1, 3), stationary])
        known = np.maximum(equations, 0)
        forms = self.forms()[known]
        # Two spheres meet in a plane, three in the planes of two pairs.
        are_spheres = (equations >= 0) & (self.kind[known] == SPHERE)
        for k in (1, 2):
            also = are_spheres[:, : k + 1].all(axis=1)
            forms[also, k] -= forms[also, 0]
        of_curves = forms[len(triples) :]
        of_curves[:, 2] = _stationary(of_curves[:, 0], of_curves[:, 1], directions[-1 - thirds])
        size = np.abs(forms).max(axis=(2, 3), keepdims=True)
        forms /= np.where(size > 0.0, size, 1.0)
        is_curved = np.abs(forms[..., :3, :3]).max(axis=(2, 3)) > 0.0
        has_no_rulings = np.where(equations < 0, SPHERE, self.kind[known]) < CYLINDER
        on_lines = is_curved.sum(axis=1) < 2
        on_rulings = ~on_lines & ~has_no_rulings.all(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            order = np.argsort(is_curved[on_lines], axis=1, kind="stable")
            straight = np.take_along_axis(forms[on_lines], order[..., None, None], axis=1)
            of_lines = _on_lines(straight)
            order = np.argsort(has_no_rulings[on_rulings], axis=1, kind="stable")
            ruled = np.take_along_axis(equations[on_rulings], order[:, :1], axis=1)[:, 0]
            others = np.take_along_axis(forms[on_rulings], order[:, 1:, None, None], axis=1)
            of_rulings = _on_rulings(self.rulings()[ruled], others)
        points = np.vstack([of_lines.reshape(-1, 3), of_rulings.reshape(-1, 3)])
        per_line = np.repeat(equations[on_lines], of_lines.shape[1], axis=0)
        per_ruling = np.repeat(equations[on_rulings], of_rulings.shape[1], axis=0)
        return points, np.vstack([per_line, per_ruling])

    def refine(self, points: FloatArray, equations: IntArray, directions: FloatArray) -> FloatArray:
        """Return points of `common_points` after steps of Newton's method, shape (m, 3)."""
        known, is_third = np.maximum(equations, 0), equations[:, 2] < 0
        scale, centre, axis = self.scale[known], self.centre[known], self.axis[known]
        steepness, level = self.steepness[known], self.level[known]
        n = directions[np.where(is_third, -1 - equations[:, 2], 0)]
        refined = points
        for _ in range(STEPS):
            off = refined[:, None] - centre
            length = np.linalg.norm(scale * off, axis=-1)
            length = np.where(length > 0.0, length, 1.0)
            towards = scale * off / length[..., None]
            values = steepness * length + dot(axis, off) - level
            slopes = steepness[..., None] * towards + axis
            # n · (g × h) = 0 where n is normal to the curve; g and h are the gradients.
            bends = np.eye(3) * scale[..., None] - towards[..., None] * towards[..., None, :]
            bends *= (steepness / length)[..., None, None]
            g, h = slopes[:, 0], slopes[:, 1]
            by_g, by_h = np.cross(h, n), np.cross(n, g)
            change = rotate(bends[:, 0], by_g) + rotate(bends[:, 1], by_h)
            values[is_third, 2] = dot(g, by_g)[is_third]
            slopes[is_third, 2] = change[is_third]
            size = np.linalg.norm(slopes, axis=-1)
            size = np.where(size > 0.0, size, 1.0)
            values, slopes = values / size, slopes / size[..., None]
            across = np.swapaxes(slopes, 1, 2)
            square = across @ slopes + DAMPING * np.eye(3)
            step = np.linalg.solve(square, across @ values[..., None])
            refined = refined - np.asarray(step[..., 0], dtype=np.float64)
        return refined


def _rows(limit: Constraint, unit: float) -> Iterator[_Row]:
    """Yield the surfaces of a limit as rows of `Quadrics`, lengths divided by a unit."""
    if isinstance(limit, Never):
        return
    origin, scale, axis, steepness, level = surface_of(limit)
    is_cone = isinstance(limit, Cone)
    if not (is_cone and (limit.flat or abs(steepness) <= ZERO)):
        kind = CONE if is_cone else PLANE if isinstance(limit, HalfSpace) else SPHERE
        kind = kind if scale.all() else CYLINDER
        yield kind, origin / unit, steepness, axis, level / unit
        return
    # A right angle leaves a plane. A flat cone lies between two planes along x.
    axis = axis * scale
    across = steepness * np.cross([1.0, 0.0, 0.0], axis) if limit.flat else np.zeros(3)
    along = float(axis @ axis) - steepness**2
    for sign in (-1.0, 1.0) if along > 0.0 else ():
        normal = math.sqrt(along) * axis + sign * across
        normal /= float(np.linalg.norm(normal))
        yield PLANE, np.zeros(3), 0.0, normal, float(normal @ origin) / unit


def _stationary(first: FloatArray, second: FloatArray, n: FloatArray) -> FloatArray:
    """Return n · (g × h) as a quadratic form, g and h the gradients of two, shape (m, 4, 4)."""
    g, h = first[:, :3], second[:, :3]
    # Row i of the product is n × (column i of h).
    across = np.cross(n[:, None], np.swapaxes(h, 1, 2))
    form = np.swapaxes(g, 1, 2) @ np.swapaxes(across, 1, 2)
    return form + np.swapaxes(form, 1, 2)


def _on_lines(forms: FloatArray) -> FloatArray:
    """Return the points at which two linear forms and a third are zero, shape (m, 2, 3)."""
    first, second = forms[:, 0], forms[:, 1]
    # A linear form is 2 f·p + c.
    f, g = 2.0 * first[:, :3, 3], 2.0 * second[:, :3, 3]
    along = np.cross(f, g)
    start = first[:, 3, 3, None] * np.cross(along, g) + second[:, 3, 3, None] * np.cross(f, along)
    start = start / dot(along, along)[:, None]
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    lines = np.zeros((len(forms), 2, 1, 4))
    lines[:, 0, 0, :3], lines[:, 0, 0, 3], lines[:, 1, 0, :3] = start, 1.0, along
    roots = _roots(*_along(lines, forms[:, 2:]))[:, 0, 0, :, None]
    return start[:, None] + roots * along[:, None]


def _on_rulings(rulings: FloatArray, forms: FloatArray) -> FloatArray:
    """Return the points of rulings (m, 2, 3, 4) at which two forms are zero, shape (m, 32, 3)."""
    # Powers 2, 1 and 0 of the position along a ruling, for both forms at each angle.
    basis = np.stack([np.ones(len(ANGLES)), np.cos(ANGLES), np.sin(ANGLES)], axis=1)
    powers = _along(basis @ rulings, forms)
    size = np.abs(powers).max(axis=(0, 3), keepdims=True)
    is_zero = (np.abs(powers).max(axis=3, keepdims=True) <= ZERO * size)[..., 0]
    # The simpler form comes first: a single power, then two.
    order = np.argsort(is_zero.sum(axis=0), axis=1)[:, ::-1]
    forms = np.take_along_axis(forms, order[:, :, None, None], axis=1)
    powers = np.take_along_axis(powers, order[None, :, :, None], axis=2)
    is_zero = np.take_along_axis(is_zero, order[None], axis=2)
    (a, d), (b, e), (c, f) = np.moveaxis(powers, 2, 1)
    resultant: FloatArray = (a * f - d * c) ** 2 - (a * e - d * b) * (b * f - e * c)
    # A factor that is zero at every angle is left out, and so is a second power.
    no_a, (no_c, no_f) = is_zero[0, :, :1], np.swapaxes(is_zero[2, :, :, None], 0, 1)
    is_single = is_zero[:, :, :1].sum(axis=0) == 2
    resultant = np.where(no_a, d * c**2 - b * e * c + b**2 * f, resultant)
    resultant = np.where(no_c & no_f, a * e - b * d, resultant)
    at_zero = np.where(no_c & ~no_f, f, 1.0)
    resultant = np.where(is_single, (a + b + c) * at_zero, resultant)
    angles = _angles(resultant)
    basis = np.stack([np.ones(angles.shape), np.cos(angles), np.sin(angles)], axis=-1)
    lines = basis[:, None] @ rulings
    roots = _roots(*_along(lines, forms))
    points = lines[:, 0, None, :, None, :3] + roots[..., None] * lines[:, 1, None, :, None, :3]
    return points.reshape(-1, math.prod(points.shape[1:-1]), 3)


def _along(lines: FloatArray, forms: FloatArray) -> FloatArray:
    """Return the coefficients of forms (m, k, 4, 4) along lines, highest power first, (3, m, k, n).

    Lines are points and directions in homogeneous coordinates, shape (m, 2, n, 4).
    """
    points, directions = lines[:, :1], lines[:, 1:]
    by_point, by_direction = points @ forms, directions @ forms
    return np.stack(
        [dot(by_direction, directions), 2.0 * dot(by_point, directions), dot(by_point, points)]
    )


def _roots(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return the roots of a x² + b x + c, shape (..., 2); real parts if they are complex."""
    square = np.maximum(b * b - 4.0 * a * c, 0.0)
    # This form avoids cancellation.
    q = -0.5 * (b + np.copysign(np.sqrt(square), b))
    return np.stack([q / a, c / q], axis=-1)


def _angles(values: FloatArray) -> FloatArray:
    """Return angles (m, 8) at which polynomials with values (m, 9) at `ANGLES` may be zero."""
    # With z the tangent of half the angle from `far`, exp(iφ) = (1 + iz) / (1 - iz). The largest
    # value becomes the leading coefficient of the polynomial in z.
    far = ANGLES[np.abs(values).argmax(axis=1)] + math.pi
    orders = np.arange(-DEGREE, DEGREE + 1)
    waves = values @ np.exp(-1j * np.outer(ANGLES, orders)) / len(ANGLES)
    waves *= np.exp(1j * far[:, None] * orders)
    # The powers 4 + k of 1 + iz and 4 - k of 1 - iz, whose roots are i and -i.
    roots = [[1j] * (DEGREE + k) + [-1j] * (DEGREE - k) for k in range(-DEGREE, DEGREE + 1)]
    of_waves = np.array([np.poly(each)[::-1] for each in roots]) * (-1.0) ** orders[:, None]
    rows = (waves @ of_waves).real
    companion = np.zeros((len(rows), 2 * DEGREE, 2 * DEGREE))
    companion[:, range(1, 2 * DEGREE), range(2 * DEGREE - 1)] = 1.0
    # A polynomial that is zero has no angles of its own.
    leading = np.where(rows[:, -1:] == 0.0, 1.0, rows[:, -1:])
    companion[:, :, -1] = -rows[:, :-1] / leading
    return far[:, None] + 2.0 * np.arctan(np.linalg.eigvals(companion).real)
