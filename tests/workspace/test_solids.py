"""Solids are closed, lie on the surfaces of their limits, and tend to the exact volumes.

Random designs have sizes from 1e-4 to 1e4, are near degenerate ones, at quarter turns and near
the identity, and have shells thinner than a chord and cones around 90°.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import (
    DEFECTS,
    defect_case,
    limited,
    ordinary_case,
    reference_case,
    thin_case,
    troubled_case,
)
from long_cases import long_after
from meshes import assert_lies_on_its_limits, corners_of, edges_are_paired, euler_characteristic
from scipy.spatial.transform import Rotation

from explorer import PRESETS, Design, ExplorerError, InputError, Limits, Pose, poses_are_valid
from explorer.mechanism.design import Swing
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.workspace.limits.constraints import BallOrCylinder, HalfSpace
from explorer.workspace.orientations.share import cone_of_directions
from explorer.workspace.slices.volume import workspace_volume
from explorer.workspace.solids.solid import HULL, carved_solid, convex_hull, cut_solid
from explorer.workspace.solids.solids import inclusive_solid, total_solid, workspace_solid
from explorer.workspace.workspace import Workspace

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
FREE = Limits(l1=(0.0, 1e3), d2=(0.0, 1e3), d4=(0.0, 1e3), l4=(0.0, 1e3), margin=None)


def free(design: Design, **limits: Any) -> Design:
    """Return the design with these limits and none other that matters."""
    return limited(msgspec.structs.replace(design, limits=FREE), **limits)


# Of the defects a limit was omitted if rounding put it just beyond the end of the box.
@pytest.mark.parametrize(
    ("case", "error"),
    [
        *((defect_case(index), 1e-3) for index in range(len(DEFECTS["solids"]))),
        *((reference_case(index), 2e-4) for index in range(8)),
    ],
)
def test_solid_of_reference_workspaces_and_defects_has_their_volumes(
    case: tuple[Design, FloatArray, float], error: float
) -> None:
    design, rotation, volume = case
    solid = workspace_solid(design, rotation)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(volume, rel=error)
    assert_lies_on_its_limits(solid, design, rotation)


@pytest.mark.parametrize("seed", [16, 19])
def test_solid_of_quarter_turns_ends_at_its_margins(seed: int) -> None:
    """Normals that are an axis but for rounding put a plane beyond the end of the box."""
    rng = np.random.default_rng(seed)
    rotation = Rotation.from_euler("ZYX", 0.5 * np.pi * rng.integers(0, 4, 3)).as_matrix()
    home = Pose.of(rng.uniform(-4.0, 4.0, 3), rotation)
    margin, most = float(rng.uniform(0.1, 0.4)), float(rng.uniform(3.0, 9.0))
    design = free(msgspec.structs.replace(OPTIMAL, home=home), margin=margin, l1=(0.0, most))
    exact = workspace_volume(design, rotation).volume
    solid = workspace_solid(design, rotation)
    assert solid.volume == pytest.approx(exact, rel=2e-3)
    if exact > 0.0:
        assert solid.is_watertight
        assert_lies_on_its_limits(solid, design, rotation)


def lens(depth: float) -> tuple[Design, float]:
    """Return a design whose workspace is a lens of two balls with a depth, and its volume."""
    bare = free(OPTIMAL)
    balls = Workspace(bare, bare.home_pose.rotation).limits
    one, other = (x.centre for x in balls if isinstance(x, BallOrCylinder) and x.is_ball)
    apart = float(np.linalg.norm(one - other))
    r, s = 0.4 * apart, 0.6 * apart + depth
    # E. W. Weisstein, Sphere-sphere intersection.
    around = apart**2 + 2.0 * apart * (r + s) - 3.0 * (r - s) ** 2
    return limited(bare, l1=(0.0, r), l4=(0.0, s)), np.pi * depth**2 * around / (12.0 * apart)


@pytest.mark.parametrize("depth", [0.1, 1e-3])
def test_solid_of_a_lens_thinner_than_the_tolerance_has_its_volume(depth: float) -> None:
    design, volume = lens(depth)
    solid = workspace_solid(design)
    assert solid.agrees
    assert solid.is_watertight
    assert solid.volume == pytest.approx(volume, rel=0.01)
    assert_lies_on_its_limits(solid, design, design.home_pose.rotation)


@pytest.mark.parametrize("depth", [0.0, -1e-9])
def test_solid_of_two_separate_balls_is_empty(depth: float) -> None:
    design, _ = lens(depth)
    solid = workspace_solid(design)
    assert solid.is_empty
    assert solid.agrees
    assert solid.empty_because == ("l1 maximum", "l4 maximum")


# With a tolerance of a 500th of the reach these volumes differ by 1 % to 2 %.
@pytest.mark.parametrize("seed", [8, 31])
def test_solid_between_near_minima_and_maxima_has_the_exact_volume(seed: int) -> None:
    design, rotation = thin_case(seed)
    solid = workspace_solid(design, rotation)
    assert solid.agrees
    assert solid.is_watertight
    exact = workspace_volume(design, rotation).volume
    assert solid.volume == pytest.approx(exact, rel=0.01)
    assert_lies_on_its_limits(solid, design, rotation)


def test_solid_not_refined_disagrees_and_so_do_its_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("explorer.workspace.solids.solids.MOST_REFINED", 0)
    design, volume = lens(1e-3)
    solid = workspace_solid(design)
    assert solid.volume > 10.0 * volume
    assert solid.agrees is False
    middle = 0.5 * (solid.vertices.min(axis=0) + solid.vertices.max(axis=0))
    up = np.array([0.0, 0.0, 1.0])
    assert convex_hull(solid).agrees is False
    assert cut_solid(solid, HalfSpace("cut", up, float(middle[2]))).agrees is False
    assert carved_solid(solid, [], middle).agrees is False


@pytest.mark.parametrize("name", PRESETS)
def test_solid_of_presets_is_a_topological_ball(name: str) -> None:
    solid = workspace_solid(PRESETS[name])
    assert solid.is_watertight
    assert edges_are_paired(solid.faces)
    assert euler_characteristic(solid) == 2
    exact = workspace_volume(PRESETS[name]).volume
    assert solid.volume == pytest.approx(exact, rel=1e-4)
    assert not solid.is_empty
    assert solid.empty_because == ()


@pytest.mark.parametrize("seed", long_after(30, range(160)))
def test_solid_of_extreme_designs_is_closed_and_lies_on_its_limits(seed: int) -> None:
    design, given = troubled_case(seed)
    rotation = design.home_pose.rotation if given is None else given
    exact = workspace_volume(design, rotation)
    solid = workspace_solid(design, given)
    if solid.is_empty:
        assert not solid.is_watertight
        assert solid.volume == 0.0
        assert solid.empty_because == exact.empty_because
        assert exact.volume <= 1e-6 * solid.tolerance * design.reach**2
        return
    assert solid.is_watertight
    assert np.isfinite(solid.vertices).all()
    # Part of what the tolerance allows, were all faces off to one side.
    allowed = 0.15 * solid.areas.sum() * solid.tolerance + 4.0 * exact.error
    assert solid.volume == pytest.approx(exact.volume, abs=allowed)
    assert_lies_on_its_limits(solid, design, rotation)


@pytest.mark.parametrize("seed", range(3))
def test_solid_with_finer_tolerance_tends_to_the_exact_volume(seed: int) -> None:
    design, rotation = ordinary_case(seed)
    exact = workspace_volume(design, rotation).volume
    largest = exact ** (1.0 / 3.0)
    shares = np.array([0.04, 0.01, 0.0025])
    solids = [workspace_solid(design, rotation, share * largest) for share in shares]
    errors = np.abs(np.array([solid.volume for solid in solids]) / exact - 1.0)
    # A bound that shrinks with the tolerance, with a constant that all cases share.
    assert (errors <= 0.6 * shares).all()
    assert errors[-1] < 1e-3


@pytest.mark.parametrize(
    ("design", "characteristic", "limits"),
    [
        (free(OPTIMAL, l1=(0.0, 10.0), d2=(3.0, 1e3)), 0, {"l1 maximum", "d2 minimum"}),
        (free(OPTIMAL, l1=(5.0, 10.0)), 4, {"l1 minimum", "l1 maximum"}),
    ],
)
def test_solid_with_a_minimum_length_is_a_ring_or_hollow(
    design: Design, characteristic: int, limits: set[str]
) -> None:
    solid = workspace_solid(design)
    assert solid.is_watertight
    assert euler_characteristic(solid) == characteristic
    assert solid.volume == pytest.approx(workspace_volume(design).volume, rel=1e-4)
    assert {solid.limits[index] for index in solid.limit_of_face} == limits


@pytest.mark.parametrize("thickness", [1e-2, 1e-5])
def test_solid_of_a_shell_thinner_than_a_chord_has_no_holes(thickness: float) -> None:
    design = free(OPTIMAL, l1=(10.0 - thickness, 10.0))
    solid = workspace_solid(design, tolerance=0.1)
    assert solid.is_watertight
    assert euler_characteristic(solid) == 4
    assert solid.volume == pytest.approx(4.0 * np.pi * 100.0 * thickness, rel=2e-3)


def test_solid_of_a_box_far_inside_balls_is_that_box() -> None:
    design = free(OPTIMAL, box=((1.0, 2.0, 3.0), (2.0, 4.0, 6.0)))
    solid = workspace_solid(design)
    assert solid.volume == pytest.approx(6.0, rel=1e-12)
    assert len(solid.faces) == 12


def test_solid_of_coincident_limits_is_closed() -> None:
    lows, highs = OPTIMAL.limits.box or pytest.fail("no box")
    assert lows[2] == 0.0
    lower = limited(OPTIMAL, box=((*lows[:2], -50.0), highs))
    assert workspace_solid(OPTIMAL).volume == pytest.approx(workspace_solid(lower).volume, rel=1e-4)
    rotation = OPTIMAL.home_pose.rotation
    b1x, b1y = (-(rotation.T @ [*OPTIMAL.a3, 0.0]))[:2].tolist()
    equal = msgspec.structs.replace(OPTIMAL, b1=(b1x, b1y), home=OPTIMAL.home_pose)
    solid = workspace_solid(equal)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(workspace_volume(equal).volume, rel=1e-4)


@pytest.mark.parametrize(
    ("joint", "angle"),
    [("a1", 25.0), ("a3", 60.0), ("b1", 89.99), ("b2", 90.0), ("b3", 91.0), ("b4", 150.0)],
)
def test_solid_with_a_cone_has_the_volume_of_columns(joint: str, angle: float) -> None:
    tilted = Rotation.from_rotvec([0.3, -0.2, 0.4]).as_matrix() @ OPTIMAL.home_pose.rotation
    design = limited(OPTIMAL, swing=Swing(**{joint: angle}))
    exact = workspace_volume(design, tilted)
    solid = workspace_solid(design, tilted)
    assert solid.volume == pytest.approx(exact.volume, rel=1e-3)
    assert solid.volume > 100.0
    assert_lies_on_its_limits(solid, design, tilted)
    assert solid.volume <= workspace_solid(OPTIMAL, tilted).volume * (1.0 + 1e-4)


def test_solid_empty_names_the_limits_that_empty_it() -> None:
    solid = workspace_solid(limited(OPTIMAL, gap=50.0))
    assert solid.is_empty
    assert solid.empty_because == ("gap |d1 − d3|",)
    assert (solid.volume, solid.is_watertight) == (0.0, False)
    assert convex_hull(solid) is solid
    assert workspace_solid(OPTIMAL, np.eye(3)).empty_because == ("margin δ2",)


def test_solid_with_an_unusable_tolerance_is_refused() -> None:
    for tolerance in (0.0, -1.0, float("nan")):
        with pytest.raises(InputError, match="tolerance must be positive"):
            workspace_solid(OPTIMAL, tolerance=tolerance)
    with pytest.raises(InputError, match="at least about") as refusal:
        workspace_solid(OPTIMAL, tolerance=1e-7)
    allowed = float(str(refusal.value).rpartition(" ")[2])
    assert 1e-7 < allowed < 1e-2
    with pytest.raises(InputError, match="fewer orientations"):
        inclusive_solid(OPTIMAL, np.array([OPTIMAL.home_pose.rotation] * 2), 1e-6)


def test_solid_with_a_missing_face_is_not_watertight() -> None:
    solid = workspace_solid(OPTIMAL)
    assert not replace(solid, faces=solid.faces[1:]).is_watertight
    flipped = solid.faces.copy()
    flipped[0] = flipped[0, ::-1]
    assert not replace(solid, faces=flipped).is_watertight
    doubled = np.concatenate([solid.faces, solid.faces])
    assert not replace(solid, faces=doubled).is_watertight


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
    solid = workspace_solid(OPTIMAL, OPTIMAL.home_pose.rotation, 2e-4 * OPTIMAL.reach)
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
    rotations = cone_of_directions(OPTIMAL.home_pose.rotation, 12.0, 7)
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
