"""Whether tetrahedra overlap: solid, flat, touching, contained, of every size and anywhere."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from reference import read_reference
from refusals import refusal
from scipy.optimize import linprog

from explorer import rotation_from_quaternion, tetrahedra_overlap
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import MANY_ROWS

REFERENCE: list[dict[str, Any]] = read_reference("interference")["tetrahedra"]
P, Q = (np.array([case[key] for case in REFERENCE]) for key in "pq")
OVERLAP = np.array([case["overlap"] for case in REFERENCE])
SCALES = (1e-6, 1.0, 1e6)

CORNER = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
RANKS = ("solid", "quadrilateral", "triangle", "segment", "point", "sliver")


def turns(rng: np.random.Generator, count: int) -> FloatArray:
    """Return transposed random rotations, which turn rows of vertices."""
    return np.swapaxes(rotation_from_quaternion(rng.normal(size=(count, 4))), -1, -2)


def bodies(rng: np.random.Generator, rank: str, count: int) -> FloatArray:
    """Return tetrahedra of a kind within a cube of side two."""
    body = rng.uniform(-1.0, 1.0, (count, 4, 3))
    if rank == "quadrilateral":
        shares = rng.uniform(-0.5, 1.0, (count, 2, 1))
        body[:, 3] = body[:, 0] + (shares * (body[:, 1:3] - body[:, :1])).sum(axis=1)
    elif rank == "triangle":
        body[:, 3] = body[:, 1]
    elif rank == "segment":
        body[:, 2:] = (
            body[:, :1] + rng.uniform(0, 1, (count, 2, 1)) * (body[:, 1] - body[:, 0])[:, None]
        )
    elif rank == "point":
        body[:, 1:] = body[:, :1]
    elif rank == "sliver":
        height = 10.0 ** rng.uniform(-14.0, -1.0, (count, 1))
        body[:, 3] = body[:, :3].mean(axis=1) + height * rng.normal(size=(count, 3))
    return body


def pairs_of(
    rng: np.random.Generator, ranks: tuple[str, ...], count: int
) -> tuple[FloatArray, FloatArray]:
    """Return bodies of every pair of kinds."""
    pairs = [(bodies(rng, a, count), bodies(rng, b, count)) for a in ranks for b in ranks]
    p, q = (np.concatenate(side) for side in zip(*pairs, strict=True))
    return p, q


def all_kinds(seed: int, count: int) -> tuple[FloatArray, FloatArray]:
    """Return pairs of all kinds of bodies; about half of the solid ones overlap."""
    rng = np.random.default_rng(seed)
    p, q = pairs_of(rng, RANKS, count)
    return p, q + rng.uniform(-0.6, 0.6, (len(q), 1, 3))


def in_a_plane(seed: int, count: int) -> tuple[FloatArray, FloatArray]:
    """Return coplanar pairs of flat bodies, turned at random."""
    rng = np.random.default_rng(seed)
    p, q = pairs_of(rng, RANKS[1:5], count)
    p[..., 2] = q[..., 2] = 0.0
    q += rng.uniform(-0.7, 0.7, (len(q), 1, 3)) * [1.0, 1.0, 0.0]
    turn = turns(rng, len(p))
    return p @ turn, q @ turn


def separation(p: FloatArray, q: FloatArray) -> float:
    """Return the widest gap of the projections of two bodies on any axis, zero if they overlap.

    A linear programme finds the axis n, |n_i| at most 1.
    """
    # max t such that n·p_i ≥ m + t and n·q_j ≤ m.
    rows = [[*(-x), 1.0, 1.0] for x in p] + [[*x, -1.0, 0.0] for x in q]
    bounds = [(-1.0, 1.0)] * 3 + [(None, None), (0.0, None)]
    found = linprog([0, 0, 0, 0, -1], A_ub=rows, b_ub=np.zeros(8), bounds=bounds, method="highs")
    assert found.status == 0
    return -float(found.fun or 0.0)


@pytest.mark.parametrize("scale", SCALES)
def test_overlap_reference_pairs_at_any_scale_match(scale: float) -> None:
    assert len(REFERENCE) == 400
    np.testing.assert_array_equal(tetrahedra_overlap(scale * P, scale * Q), OVERLAP)
    np.testing.assert_array_equal(tetrahedra_overlap(scale * Q, scale * P), OVERLAP)


def test_overlap_turned_moved_or_renumbered_bodies_is_unchanged() -> None:
    rng = np.random.default_rng(1)
    turn = turns(rng, 400)
    for distance in (1.0, 1e3, 1e6):
        shift = distance * rng.normal(size=(400, 1, 3))
        order = rng.permutation(4)
        p, q = (P @ turn + shift)[:, order], (Q @ turn + shift)[:, order[::-1]]
        np.testing.assert_array_equal(tetrahedra_overlap(p, q), OVERLAP)


def test_overlap_single_broadcast_read_only_or_strided_arrays_match_a_batch() -> None:
    for p, q, expected in list(zip(P, Q, OVERLAP, strict=True))[::5]:
        assert tetrahedra_overlap(p, q).shape == ()
        assert bool(tetrahedra_overlap(p, q)) is bool(expected)
    assert len(OVERLAP) >= MANY_ROWS
    table = tetrahedra_overlap(P[:, None], Q)
    assert table.shape == (400, 400)
    np.testing.assert_array_equal(table.diagonal(), OVERLAP)
    p = P.copy()
    p.flags.writeable = False
    np.testing.assert_array_equal(tetrahedra_overlap(p, Q), OVERLAP)
    np.testing.assert_array_equal(tetrahedra_overlap(P[::-1], Q[::-1]), OVERLAP[::-1])
    np.testing.assert_array_equal(tetrahedra_overlap(P.tolist(), Q.tolist()), OVERLAP)
    assert tetrahedra_overlap(np.zeros((0, 4, 3)), Q[0]).shape == (0,)


def test_overlap_all_kinds_of_bodies_match_a_linear_programme() -> None:
    for p, q in (all_kinds(3, 8), in_a_plane(3, 8)):
        found = tetrahedra_overlap(p, q)
        np.testing.assert_array_equal(tetrahedra_overlap(q, p), found)
        gaps = np.array([separation(a, b) for a, b in zip(p, q, strict=True)])
        clear = (gaps < 1e-12) | (gaps > 1e-8)
        assert clear.mean() > 0.98
        np.testing.assert_array_equal(found[clear], gaps[clear] < 1e-12)
        assert 0.05 < found.mean() < 0.9


def test_overlap_body_with_itself_or_a_contained_one_is_true() -> None:
    p, _ = all_kinds(7, 50)
    assert tetrahedra_overlap(p, p).all()
    shares = np.random.default_rng(8).dirichlet(np.ones(4), (len(p), 4))
    inside = shares @ p
    assert tetrahedra_overlap(p, inside).all()
    assert tetrahedra_overlap(inside, p).all()


def touching(rng: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
    """Return pairs of which a vertex, an edge or a face meet in the plane x = 0."""
    p, q = bodies(rng, "solid", count), bodies(rng, "solid", count)
    p[..., 0], q[..., 0] = -np.abs(p[..., 0]) - 0.1, np.abs(q[..., 0]) + 0.1
    kind = np.arange(count) % 3
    # A vertex of q inside a face of p.
    p[:, :3, 0] = np.where(kind == 0, 0.0, p[:, :3, 0].T).T
    shares = rng.dirichlet(np.ones(3), count)
    inside = np.einsum("nk,nki->ni", shares, p[:, :3])
    q[kind == 0, 0] = inside[kind == 0]
    # Two edges that cross.
    edges = kind == 1
    p[edges, :2, 0] = q[edges, :2, 0] = 0.0
    middle = 0.3 * p[edges, 0] + 0.7 * p[edges, 1]
    q[edges, 1] = middle - 0.5 * (q[edges, 0] - middle)
    # A vertex of q on an edge of p.
    p[kind == 2, :2, 0] = 0.0
    on_edge = 0.4 * p[:, 0] + 0.6 * p[:, 1]
    q[kind == 2, 0] = on_edge[kind == 2]
    return p, q


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
def test_overlap_touching_bodies_is_decided_by_the_smallest_shift(scale: float) -> None:
    rng = np.random.default_rng(11)
    p, q = touching(rng, 900)
    turn = turns(rng, 900)
    for shift in (0.0, 3.0):
        offset = np.array([shift, -shift, 0.0])
        for step, expected in ((0.0, True), (-1e-9, True), (1e-9, False), (1e-12, False)):
            moved = q + [step, 0.0, 0.0]
            found = tetrahedra_overlap(scale * (p @ turn + offset), scale * (moved @ turn + offset))
            # What lies beyond an edge need not be inside.
            sure = slice(None) if step >= 0.0 else np.arange(900) % 3 < 2
            np.testing.assert_array_equal(found[sure], expected)


@pytest.mark.parametrize("gap", [1e-12, 1e-9, 1e-3])
def test_overlap_segments_and_points_touch_until_shifted(gap: float) -> None:
    rng = np.random.default_rng(13)
    turn = turns(rng, 300)
    o, (x, y, z) = np.zeros(3), np.eye(3)
    segment, point, triangle = np.array([o, x, x, o]), np.array([o] * 4), np.array([o, x, y, y])
    cases = {
        "collinear": (segment, segment + x, x),
        "crossing": (segment, np.array([0.3 * x - y, 0.3 * x + y] * 2), z),
        "end on segment": (segment, np.array([0.3 * x, 0.3 * x + y] * 2), y),
        "parallel": (segment, segment + 0.2 * x, y),
        "points": (point, point, y),
        "point on segment": (segment, point + 0.6 * x, y),
        "point on triangle": (triangle, point + 0.2 * x + 0.3 * y, z),
    }
    for name, (p, q, away) in cases.items():
        assert tetrahedra_overlap(p @ turn, q @ turn).all(), name
        assert not tetrahedra_overlap(p @ turn, (q + gap * away) @ turn).any(), name


@pytest.mark.parametrize("odd", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("count", [1, 3 * MANY_ROWS])
def test_overlap_numbers_not_finite_are_refused(odd: float, count: int) -> None:
    q = np.tile(CORNER, (count, 1, 1))
    q[count // 2, 3, 1] = odd
    assert "q must be finite" in refusal(tetrahedra_overlap, CORNER, q)
    assert "p must be finite" in refusal(tetrahedra_overlap, q, np.tile(CORNER, (count, 1, 1)))


@pytest.mark.parametrize("bad", [np.zeros((3, 3)), np.zeros(12), "four corners", [[1, 2, 3]]])
def test_overlap_arrays_of_another_shape_are_refused(bad: Any) -> None:
    assert "p must" in refusal(tetrahedra_overlap, bad, CORNER)
    assert "do not broadcast" in refusal(tetrahedra_overlap, P[:2], Q[:3])
