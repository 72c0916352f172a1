"""The faces of workspaces lie on the exact surfaces, and look smooth at the size of a page."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from limited_designs import ordinary_case, thin_case

from explorer import PRESETS
from explorer.mechanism.design import Design, Swing
from explorer.numerics.arrays import FloatArray, dot
from explorer.workspace.faces.faces import Faces, faces_within
from explorer.workspace.limits.constraints import (
    BallOrCylinder,
    Cone,
    Constraint,
    HalfSpace,
)
from explorer.workspace.solids.solid import Solid, cut_solid
from explorer.workspace.solids.solids import workspace_solid
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]
# Pixels across the diagonal of a workspace that fills a page of 1440 x 900.
PIXELS = 800.0


def coned() -> Design:
    return OPTIMAL.with_limits(swing=Swing(a1=70.0, b2=60.0, b4=50.0))


def at_home(design: Design) -> tuple[Design, FloatArray]:
    return design, design.home_pose.rotation


# The other preset has joints at both ends of a leg that bound it by one and the same cone.
PRESET_CASES = (at_home(PRESETS["paper-initial"]), at_home(OPTIMAL))
CASES = (*PRESET_CASES, at_home(coned()), *(ordinary_case(seed) for seed in range(3)), thin_case(0))


def faces_of(
    design: Design, rotation: FloatArray, *more: Constraint
) -> tuple[Faces, tuple[Constraint, ...], Solid]:
    limits = (*Workspace(design, rotation).limits, *more)
    solid = workspace_solid(design, rotation, 2e-3 * design.reach)
    return faces_within(limits), limits, solid


def size_of(faces: Faces) -> float:
    return float(np.linalg.norm(np.ptp(faces.vertices, axis=0)))


def normals_of(faces: Faces) -> FloatArray:
    """Return normals as long as twice the areas."""
    a, b, c = (faces.vertices[faces.triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def areas(faces: Faces | Solid) -> dict[str, float]:
    triangles = faces.triangles if isinstance(faces, Faces) else faces.faces
    owner = faces.limit_of_triangle if isinstance(faces, Faces) else faces.limit_of_face
    a, b, c = (faces.vertices[triangles[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return {name: float(area[owner == k].sum()) for k, name in enumerate(faces.limits)}


def outward(limit: Constraint, points: FloatArray) -> FloatArray:
    """Return the unit normals of a surface at points on it, by differences of its slack."""
    step = 1e-6 * float(np.abs(points).max())
    rate = np.stack(
        [limit.slack(points + step * e) - limit.slack(points - step * e) for e in np.eye(3)], axis=1
    )
    return -rate / np.linalg.norm(rate, axis=1, keepdims=True)


@pytest.mark.parametrize("case", CASES)
def test_vertices_and_edges_lie_on_their_surfaces_and_faces_have_the_areas_of_a_boolean(
    case: tuple[Design, FloatArray],
) -> None:
    faces, limits, solid = faces_of(*case)
    size = size_of(faces)
    ends = faces.edges.reshape(-1, 3)
    assert len(ends) > 0
    off = np.sort([limit.distance(ends) for limit in limits], axis=0)
    # Surfaces that nearly touch leave little to tell on which of their curves a point is.
    assert float(np.quantile(off[1], 0.99)) < 1e-8 * size
    assert float(off[1].max()) < 0.5 * size / PIXELS
    found, expected = areas(faces), areas(solid)
    total = sum(expected.values())
    assert sum(found.values()) == pytest.approx(total, rel=5e-3)
    assert max(abs(found[name] - expected[name]) for name in expected) < 0.01 * total
    for index, limit in enumerate(limits):
        own = np.unique(faces.triangles[faces.limit_of_triangle == index])
        assert (limit.distance(faces.vertices[own]) < 1e-9 * size).all()
        beyond = np.minimum(limit.slack(faces.vertices), 0.0)
        assert (np.where(beyond < 0.0, limit.distance(faces.vertices), 0.0) < 3e-4 * size).all()


@pytest.mark.parametrize("case", CASES)
def test_triangles_are_within_half_a_pixel_of_the_surface_and_shaded_as_it_is(
    case: tuple[Design, FloatArray],
) -> None:
    """A browser takes the sum of the normals about a vertex, weighted by areas."""
    faces, limits, _ = faces_of(*case)
    corners, normals = faces.vertices[faces.triangles], normals_of(faces)
    sums = np.zeros_like(faces.vertices)
    for k in range(3):
        np.add.at(sums, faces.triangles[:, k], normals)
    sums /= np.linalg.norm(sums, axis=1, keepdims=True)
    angles: list[float] = []
    for index, limit in enumerate(limits):
        own = faces.limit_of_triangle == index
        middles = corners[own].mean(axis=1)
        if not len(middles):
            continue
        sides = 0.5 * (corners[own] + np.roll(corners[own], 1, axis=1)).reshape(-1, 3)
        off = np.concatenate([limit.distance(middles), limit.distance(sides)])
        assert off.max() < 0.5 * size_of(faces) / PIXELS
        assert (dot(normals[own], outward(limit, middles)) > 0.0).all()
        vertices = np.unique(faces.triangles[own])
        cosine = dot(sums[vertices], outward(limit, faces.vertices[vertices]))
        angles.extend(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).tolist())
    # Beside the narrow ends of faces a vertex may have no triangle but slivers.
    assert float(np.quantile(angles, 0.99)) < 5.0
    assert float(np.median(angles)) < 1.0


def test_a_limit_that_coincides_with_others_has_edges_only_where_surfaces_cross() -> None:
    # At home the plane z = 0 is a side of the box and the place of all three incidences.
    faces, limits, _ = faces_of(*at_home(PRESETS["paper-optimal"]))
    ends = faces.edges.reshape(-1, 3)
    near = [np.abs(limit.distance(ends)) < 1e-7 * size_of(faces) for limit in limits]
    normals = [outward(limit, ends) for limit in limits]
    crosses = np.zeros(len(ends), dtype=np.bool_)
    for i, j in itertools.combinations(range(len(limits)), 2):
        slope = np.linalg.norm(np.cross(normals[i], normals[j]), axis=1)
        crosses |= near[i] & near[j] & (slope > 1e-6)
    assert crosses.all()


@pytest.mark.parametrize("axis", range(3))
def test_cut_is_a_face_with_the_area_of_the_slice(axis: int) -> None:
    level = (10.0, 5.0, 6.0)[axis]
    half_space = HalfSpace("cut", np.eye(3)[axis], level)
    faces, _, solid = faces_of(*PRESET_CASES[0], half_space)
    expected = areas(cut_solid(solid, half_space))["cut"]
    assert areas(faces)["cut"] == pytest.approx(expected, rel=1e-2)
    assert float(faces.vertices[:, axis].max()) == pytest.approx(level, abs=1e-9)


def test_limits_that_coincide_give_one_face() -> None:
    design, rotation = PRESET_CASES[0]
    once, limits, _ = faces_of(design, rotation)
    twice, _, _ = faces_of(design, rotation, *limits)
    area, expected = (np.linalg.norm(normals_of(each), axis=1).sum() for each in (twice, once))
    assert area == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("half_angle", [0.3, 1.2, 2.0])
@pytest.mark.parametrize("flat", [False, True])
def test_cone_of_a_joint_has_a_face(half_angle: float, flat: bool) -> None:
    ball = BallOrCylinder("ball", np.zeros(3), 2.0, is_ball=True, inside=True)
    axis = np.array([0.0, 0.6, 0.8])
    cone = Cone("cone", np.zeros(3), axis, half_angle, flat)
    faces = faces_within([ball, cone])
    found = areas(faces)
    # Half of a disc on either side of a wedge; the cone over a circle of the ball.
    expected = 4.0 * np.pi if flat else 4.0 * np.pi * np.sin(half_angle)
    assert found["cone"] == pytest.approx(expected, rel=5e-3)
    share = half_angle / np.pi if flat else 0.5 * (1.0 - np.cos(half_angle))
    assert found["ball"] == pytest.approx(16.0 * np.pi * share, rel=5e-3)
