"""The workspace that can be reached: all of it, its solid and the curve over the radius."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer import PRESETS, accessible_workspace, radius_curve
from explorer.legs.clearance import PAIRS, leg_axes
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import warm
from explorer.workspace.accessible.nodes import make_cell_grid, survey
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.limits.constraints import constraints, slacks
from explorer.workspace.slices.volume import home_rotation

DESIGN = PRESETS["paper-optimal"]
NODES = 40
RADIUS = 0.2
# Nodes for which python-fcl is asked.
ASKED = 1_000
ROUNDS = 5


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    thick = with_radius(DESIGN, RADIUS)
    r = home_rotation(DESIGN)
    for design, words in ((DESIGN, "no radii"), (thick, f"radius {RADIUS:g}, three pairs block")):
        took = best_of(ROUNDS, lambda design=design: accessible_workspace(design, nodes=NODES))
        yield Row(
            f"accessible workspace, {NODES} nodes an axis, solid and cost of each pair, {words}",
            seconds(took),
            "1 s",
        )
    lows, highs = np.array(DESIGN.limits.box)
    grid = make_cell_grid(lows, highs, NODES)
    surveyed = best_of(ROUNDS, lambda: survey(thick, r, grid))
    yield Row(
        "of that, the nodes and all steps between neighbours, certified",
        seconds(surveyed),
        beside=_fcl(grid.positions.reshape(-1, 3), r, surveyed),
    )
    took = best_of(ROUNDS, lambda: radius_curve(DESIGN, cells=NODES))
    yield Row("accessible volume against the radius, the whole curve", seconds(took))


def _fcl(nodes: FloatArray, rotation: FloatArray, ours: float) -> str:
    """Ask python-fcl for the collisions of capsules at some nodes, no steps."""
    fcl: Any = importlib.import_module("fcl")
    kept = (slacks(constraints(DESIGN, rotation), nodes) >= 0.0).all(axis=-1)
    axes = leg_axes(DESIGN, nodes[kept][:ASKED], rotation)

    def ask() -> int:
        found = 0
        for legs in axes:
            bodies: list[Any] = []
            for base, end in legs:
                along = end - base
                length = float(np.linalg.norm(along))
                turn = Rotation.align_vectors([along / length], [[0.0, 0.0, 1.0]])[0].as_matrix()
                place = fcl.Transform(turn, 0.5 * (base + end))
                bodies.append(fcl.CollisionObject(fcl.Capsule(RADIUS, length), place))
            request = fcl.CollisionRequest()
            found += any(
                fcl.collide(bodies[i - 1], bodies[j - 1], request, fcl.CollisionResult())
                for i, j in PAIRS
            )
        return found

    theirs = best_of(2, ask) / len(axes) * len(nodes)
    return f"python-fcl, nodes alone: {seconds(theirs)}, {times(theirs / ours)}"
