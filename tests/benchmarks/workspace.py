"""The workspace: exact volume, solid, and the region that holds a load.

The volume is measured beside counting voxels, the solid beside the same booleans through
trimesh, the region beside marching cubes on a grid of the same error.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Iterator
from typing import Any
from unittest.mock import patch

import msgspec
import numpy as np
import trimesh

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer import Actuators, Payload, Struts
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import warm
from explorer.statics.load_cases import largest_shares, load_case
from explorer.workspace.carried_region import carried_region
from explorer.workspace.limits.constraints import BallOrCylinder, HalfSpace, slacks
from explorer.workspace.limits.region import mark_nodes, region_of
from explorer.workspace.slices.volume import workspace_volume
from explorer.workspace.solids.solids import workspace_solid
from explorer.workspace.workspace import Workspace

ROUNDS = 10
VOLUME_CALLS, VOXELS = 20, 480
TOLERANCE, SOLID_ERROR = 0.1, 1e-3
FINE, HELD_ERROR = 1e-5, 5e-3
SHORT = {"ROUNDS": 1, "VOLUME_CALLS": 1, "VOXELS": 60, "SOLID_ERROR": 1e-2, "HELD_ERROR": 5e-2}
LOADED = msgspec.structs.replace(
    DESIGN,
    payload=Payload(2.0, (1.0, 2.0, 3.0)),
    actuators=Actuators(push_n=(60.0, 50.0, 40.0, 50.0, 45.0, 70.0)),
    struts=Struts(moment_nm=6.0),
)


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    yield _exact_volume()
    yield _solid()
    yield _held_region()


def _exact_volume() -> Row:
    exact = workspace_volume(DESIGN).volume

    def calls() -> None:
        for _ in range(VOLUME_CALLS):
            workspace_volume(DESIGN)

    duration = best_of(20, calls) / VOLUME_CALLS
    counted, count_time = _voxels()
    return Row(
        "exact volume with its gradient, one core",
        seconds(duration),
        "2 ms, gradient 4 times",
        f"{VOXELS}³ voxels, compiled: {seconds(count_time)} at an error of "
        f"{abs(counted / exact - 1.0):.1g}; {times(count_time / duration)}",
    )


def _voxels() -> tuple[float, float]:
    """Return the volume by voxels whose centre is inside, and how long counting takes."""
    region = region_of(Workspace(DESIGN, DESIGN.home_pose.rotation).limits)
    lows, highs = region.ends
    step = float((highs - lows).max()) / VOXELS
    counts = np.ceil((highs - lows) / step).astype(np.int64)
    within = np.zeros(counts, dtype=np.bool_)

    def count() -> int:
        mark_nodes(within.size, *region.rows, lows + 0.5 * step, np.full(3, step), 0.0, within)
        return int(np.count_nonzero(within))

    duration = best_of(3, count)
    return count() * step**3, duration


def _solid() -> Row:
    exact = workspace_volume(DESIGN).volume
    solid = workspace_solid(DESIGN, tolerance=TOLERANCE)
    duration = best_of(ROUNDS, lambda: workspace_solid(DESIGN, tolerance=TOLERANCE))
    theirs, triangles, error = _through_trimesh(exact)
    return Row(
        "solid of the workspace at a volume error of 0.1 %",
        f"{seconds(duration)}, error {abs(solid.volume / exact - 1.0):.1g}, "
        f"{len(solid.faces)} faces",
        "40 ms",
        f"trimesh: {seconds(theirs)}, error {error:.1g}, {triangles} faces; "
        f"{times(theirs / duration)}",
    )


def _through_trimesh(exact: float) -> tuple[float, int, float]:
    """Return how long trimesh takes from plain primitives to an error of 0.1 % or less."""
    creation: Any = trimesh.creation
    boolean: Any = trimesh.boolean
    limits = Workspace(DESIGN, DESIGN.home_pose.rotation).limits

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
        if abs(volume / exact - 1.0) <= SOLID_ERROR:
            break
        sections = int(sections * 1.25)
    return best_of(5, lambda: make(sections)), faces, abs(volume / exact - 1.0)


def _held_region() -> Row:
    with patch("explorer.workspace.carried_region.VOLUME_ERROR", FINE):
        true = carried_region(Workspace(LOADED)).held_volume
    ours = best_of(5, lambda: carried_region(Workspace(LOADED)))
    found = carried_region(Workspace(LOADED))
    error, stated = abs(found.held_volume / true - 1.0), found.error / found.held_volume
    count, theirs, their_error = _marching_cubes(true)
    return Row(
        f"volume of the region that holds a load, off by {error:.3%}, {stated:.2%} stated",
        seconds(ours),
        "150 ms",
        f"marching cubes of scikit-image, {count} nodes an axis, off by {their_error:.2%}: "
        f"{seconds(theirs)}; {times(theirs / ours)}",
    )


def _marching_cubes(true: float) -> tuple[int, float, float]:
    """Return the nodes an axis of a grid of the allowed error, its time, and its error."""
    measure: Any = importlib.import_module("skimage.measure")
    rotation = LOADED.home_pose.rotation
    limits = Workspace(LOADED, rotation).limits
    case = load_case(LOADED, rotation, np.zeros(6))
    box = LOADED.limits.box or ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    count, taken, error = 10, 0.0, 1.0
    while error > HELD_ERROR:
        count += 10
        began = time.perf_counter()
        axes = [np.linspace(low - 0.5, high + 0.5, count) for low, high in zip(*box, strict=True)]
        nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        values = slacks(limits, nodes).min(axis=-1)
        values = np.minimum(values, 1.0 / largest_shares(case, rotation, nodes)[0] - 1.0)
        step = tuple(float(axis[1] - axis[0]) for axis in axes)
        mesh = measure.marching_cubes(values.reshape((count,) * 3), 0.0, spacing=step)
        vertices, faces = np.asarray(mesh[0], dtype=np.float64), np.asarray(mesh[1])
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        volume = abs(float(np.einsum("ij,ij->", a, np.cross(b, c)))) / 6.0
        taken = time.perf_counter() - began
        error = abs(volume / true - 1.0)
    return count, taken, error
