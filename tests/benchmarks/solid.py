"""The solid of the workspace, beside the same booleans through trimesh."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import warm
from explorer.workspace.limits.constraints import BallOrCylinder, HalfSpace, constraints
from explorer.workspace.slices.volume import home_rotation, workspace_volume
from explorer.workspace.solids.solids import workspace_solid

ERROR = 1e-3
ROUNDS = 10
TOLERANCE = 0.1


def run() -> Iterator[Row]:
    """Yield the row."""
    warm()
    exact = workspace_volume(DESIGN).volume
    solid = workspace_solid(DESIGN, tolerance=TOLERANCE)
    duration = best_of(ROUNDS, lambda: workspace_solid(DESIGN, tolerance=TOLERANCE))
    theirs, triangles, error = _through_trimesh(exact)
    yield Row(
        "solid of the workspace at a volume error of 0.1 %",
        f"{seconds(duration)}, error {abs(solid.volume / exact - 1.0):.1g}, "
        f"{len(solid.faces)} faces",
        "40 ms",
        f"trimesh: {seconds(theirs)}, error {error:.1g}, {triangles} faces; "
        f"{times(theirs / duration)}",
    )


def _through_trimesh(exact: float) -> tuple[float, int, float]:
    """Return how long trimesh takes from plain primitives to an error of 0.1 % or less."""
    import trimesh

    creation: Any = trimesh.creation
    boolean: Any = trimesh.boolean
    limits = constraints(DESIGN, home_rotation(DESIGN))

    def box_of(planes: list[HalfSpace]) -> tuple[FloatArray, FloatArray]:
        lows, highs = np.full(3, -100.0), np.full(3, 100.0)
        for plane in planes:
            axis = int(np.argmax(np.abs(plane.normal)))
            end = plane.offset / float(plane.normal[axis])
            if plane.normal[axis] > 0.0:
                highs[axis] = min(highs[axis], end)
            else:
                lows[axis] = max(lows[axis], end)
        return lows, highs

    def make(sections: int) -> Any:
        lows, highs = box_of([limit for limit in limits if isinstance(limit, HalfSpace)])
        parts = [creation.box(bounds=[lows, highs])]
        for limit in limits:
            if not isinstance(limit, BallOrCylinder):
                continue
            if limit.is_ball:
                part = creation.uv_sphere(limit.radius, count=[sections // 2, sections])
            else:
                part = creation.cylinder(limit.radius, 100.0, sections=sections)
                part.apply_transform([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
            part.apply_translation(limit.centre)
            parts.append(part)
        return boolean.intersection(parts, engine="manifold")

    sections = 16
    while True:
        mesh = make(sections)
        volume, faces = float(mesh.volume), len(mesh.faces)
        if abs(volume / exact - 1.0) <= ERROR:
            break
        sections = int(sections * 1.25)
    return best_of(5, lambda: make(sections)), faces, abs(volume / exact - 1.0)
