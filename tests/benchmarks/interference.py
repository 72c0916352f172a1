"""Overlap of tetrahedra beside python-fcl, clearances of the legs, and moves."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.samples import DESIGN, SIZE, around_home
from benchmarks.table import Row, per_second, seconds, times
from benchmarks.timing import best_of
from explorer import accessible_workspace, leg_clearances, tetrahedra_overlap
from explorer.legs.moves import pairs_are_clear
from explorer.mechanism.configuration import Configuration
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.compiled import warm
from explorer.workspace.accessible.radii import with_radius

PAIRS_COUNT = 200_000
# Pairs of the same sample for python-fcl, which needs an object for each body.
OBJECTS = 2_000
POSES = 100_000
MOVES = 20_000
NODES, RADIUS = 40, 0.2
ROUNDS = 20
SHORT = {"PAIRS_COUNT": 2_000, "OBJECTS": 50, "POSES": 500, "MOVES": 50, "NODES": 12, "ROUNDS": 4}


def mixed_pairs(count: int) -> tuple[FloatArray, FloatArray]:
    """Return pairs in random order: two in five overlap, one in two has a flat body."""
    rng = np.random.default_rng(1)
    p, q = rng.uniform(-1.0, 1.0, (2, count, 4, 3))
    flat, both = rng.uniform(size=count) < 0.5, rng.uniform(size=count) < 0.5
    q[flat, 3] = q[flat, 2]
    p[flat & both, 3] = p[flat & both, 2]
    return p, q + 0.3 * rng.uniform(-1.0, 1.0, (count, 1, 3))


def run() -> Iterator[Row]:
    """Yield the rows."""
    p, q = mixed_pairs(PAIRS_COUNT)
    samples = around_home(POSES)
    positions, rotations = samples.positions, samples.rotations
    warm()
    overlap = tetrahedra_overlap(p, q)
    rate = PAIRS_COUNT / best_of(ROUNDS, lambda: tetrahedra_overlap(p, q))
    yield Row(
        f"pairs of tetrahedra, {overlap.mean():.0%} overlapping, one core",
        per_second(rate),
        "4 million/s",
        _fcl(p[:OBJECTS], q[:OBJECTS], overlap[:OBJECTS], rate),
    )
    yield Row(
        f"clearances of all six pairs of legs in {POSES:,} poses, with the points",
        seconds(
            best_of(ROUNDS, lambda: leg_clearances(Configuration(DESIGN, positions, rotations)))
        ),
        "100 ms",
    )
    start, end = positions[:MOVES], positions[:MOVES] + 0.02 * SIZE
    turn = rotations[:MOVES]
    duration = best_of(ROUNDS // 4, lambda: pairs_are_clear(DESIGN, start, turn, end, turn))
    yield Row("one straight move proved free of collisions", seconds(duration / MOVES))
    thick = with_radius(DESIGN, RADIUS)
    yield Row(
        f"accessible workspace, {NODES} nodes an axis, its solid, legs of radius {RADIUS:g}",
        seconds(best_of(ROUNDS // 4, lambda: accessible_workspace(thick, nodes=NODES))),
        "1 s",
    )


def _fcl(p: FloatArray, q: FloatArray, overlap: BoolArray, rate: float) -> str:
    """Return, in words, the rate of python-fcl on the same pairs, and how it compares."""
    fcl: Any = importlib.import_module("fcl")
    triangles = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
    faces = np.concatenate([np.full((4, 1), 3), triangles], axis=1).ravel()

    def bodies(points: FloatArray) -> list[Any]:
        return [fcl.CollisionObject(fcl.Convex(body, 4, faces)) for body in points]

    first, second = bodies(p), bodies(q)
    request = fcl.CollisionRequest()

    def ask() -> list[bool]:
        return [
            bool(fcl.collide(a, b, request, fcl.CollisionResult()))
            for a, b in zip(first, second, strict=True)
        ]

    differ = int((np.array(ask()) != overlap).sum())
    fcl_rate = len(p) / best_of(ROUNDS, ask)
    return (
        f"python-fcl, objects made beforehand: {per_second(fcl_rate)}, {differ} of {len(p):,} "
        f"answers differ; {times(rate / fcl_rate)}"
    )
