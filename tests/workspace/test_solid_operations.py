"""Solids made of others: halves, hulls, and workspaces over several orientations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from limited_designs import ordinary_case
from meshes import assert_lies_on_its_limits, corners_of, euler_characteristic

from explorer import PRESETS, ExplorerError, InputError, poses_are_valid
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.workspace.limits.constraints import HalfSpace
from explorer.workspace.orientations.sets import cone_of_directions
from explorer.workspace.slices.volume import home_rotation
from explorer.workspace.solids.booleans import HULL, convex_hull, cut_solid
from explorer.workspace.solids.solids import inclusive_solid, total_solid, workspace_solid

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
YAWS: FloatArray = rotation_from_yaw_pitch_roll([(yaw, 4.0, -3.0) for yaw in (-85.0, -73.1, -60.0)])


@pytest.mark.parametrize("seed", range(4))
def test_cut_divides_a_solid_in_two(seed: int) -> None:
    design, rotation = ordinary_case(seed)
    solid = workspace_solid(design, rotation)
    rng = np.random.default_rng(seed)
    normal: FloatArray = 3.0 * rng.normal(size=3)
    heights = solid.vertices @ normal
    level = float(rng.uniform(float(heights.min()), float(heights.max())))
    below = cut_solid(solid, HalfSpace("cut", normal, level))
    above = cut_solid(solid, HalfSpace("cut", -normal, -level))
    assert below.volume + above.volume == pytest.approx(solid.volume, rel=1e-9)
    near = 1e-9 * np.abs(heights).max()
    for part, sign in ((below, 1.0), (above, -1.0)):
        assert part.is_watertight
        off = part.vertices @ normal - level
        assert (sign * off <= near).all()
        # Faces in the plane are the cut's, and the others those of the limits as before.
        assert part.limits == (*solid.limits, "cut")
        in_plane = (np.abs(off) <= near)[part.faces].all(axis=1)
        np.testing.assert_array_equal(part.limit_of_face == len(solid.limits), in_plane)
        rest, of_face = part.faces[~in_plane], part.limit_of_face[~in_plane]
        kept = replace(part, faces=rest, limit_of_face=of_face, limits=solid.limits)
        assert_lies_on_its_limits(kept, design, rotation)


def test_hull_of_one_solid_is_the_same_each_time() -> None:
    # Of a fine mesh the threads of manifold3d share the work.
    solid = workspace_solid(OPTIMAL, home_rotation(OPTIMAL), 2e-4 * OPTIMAL.reach)
    first, *others = (convex_hull(solid) for _ in range(3))
    assert len(first.faces) > 5000
    for other in others:
        np.testing.assert_array_equal(other.vertices, first.vertices)
        np.testing.assert_array_equal(other.faces, first.faces)


@pytest.mark.parametrize("seed", range(3))
def test_hull_is_convex_and_contains_the_solid(seed: int) -> None:
    design, rotation = ordinary_case(seed)
    solid = workspace_solid(design, rotation)
    hull = convex_hull(solid)
    assert hull.is_watertight
    assert euler_characteristic(hull) == 2
    assert hull.limits == (HULL,)
    assert not hull.limit_of_face.any()
    assert hull.volume >= solid.volume * (1.0 - 1e-12)
    a, b, c = corners_of(hull)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    wide = lengths > 1e-9 * lengths.max()
    normals = normals[wide] / lengths[wide, None]
    heights = solid.vertices @ normals.T - (a[wide] * normals).sum(axis=1)
    assert float(heights.max()) < 1e-6 * design.reach


@pytest.mark.parametrize("tool", [(0.0, 0.0, 0.0), (3.0, -2.0, -5.0)])
def test_inclusive_and_total_solids_are_union_and_intersection_of_those_of_the_tool(
    tool: tuple[float, float, float],
) -> None:
    tolerance = 0.1
    rotations = cone_of_directions(home_rotation(OPTIMAL), 12.0, 7)
    inclusive = inclusive_solid(OPTIMAL, rotations, tolerance, tool)
    total = total_solid(OPTIMAL, rotations, tolerance, tool)
    low, high = inclusive.vertices.min(axis=0) - 1.0, inclusive.vertices.max(axis=0) + 1.0
    points = np.random.default_rng(0).uniform(low, high, (600, 3))
    offsets = rotations @ np.array(tool)
    # Membership from the poses themselves: those of b4 that put the tool at a point.
    poses = points[:, None] - offsets

    def allowed(moves: FloatArray) -> BoolArray:
        return poses_are_valid(OPTIMAL, poses + moves, rotations)

    within = allowed(np.zeros(3))
    steps = 2.0 * tolerance * np.vstack([np.eye(3), -np.eye(3)])
    clear: BoolArray = np.ones(len(points), dtype=np.bool_)
    for step in steps:
        clear &= (allowed(step) == within).all(axis=1)
    any_of, all_of = (np.asarray(reduce(within, axis=1)) for reduce in (np.any, np.all))
    for solid, expected in ((inclusive, any_of), (total, all_of)):
        assert solid.is_watertight
        assert 20 < expected[clear].sum() < clear.sum() - 20
        windings = np.array([solid.winding(point) for point in points[clear]])
        np.testing.assert_allclose(windings, expected[clear], atol=1e-6)
    at_b4 = inclusive_solid(OPTIMAL, rotations, tolerance)
    assert (abs(inclusive.volume - at_b4.volume) > 0.01 * at_b4.volume) == any(tool)


def test_inclusive_and_total_solids_empty_name_limits() -> None:
    opposite = rotation_from_yaw_pitch_roll([(-73.1, 0.0, 0.0), (73.1, 0.0, 0.0)])
    nothing = total_solid(OPTIMAL, opposite)
    assert nothing.is_empty
    assert nothing.empty_because == ("margin δ2",)
    assert not inclusive_solid(OPTIMAL, opposite).is_empty
    level = np.eye(3)[None]
    assert inclusive_solid(OPTIMAL, level).empty_because == ("margin δ2",)


def test_solids_over_invalid_rotations_are_refused() -> None:
    for make in (inclusive_solid, total_solid):
        with pytest.raises(InputError, match="tool must be finite"):
            make(OPTIMAL, YAWS, None, (0.0, 0.0, np.inf))
    for rotations in (np.eye(3), np.zeros((0, 3, 3)), 2.0 * np.eye(3)[None], "x"):
        for make in (inclusive_solid, total_solid):
            with pytest.raises(ExplorerError):
                make(OPTIMAL, rotations)
