"""The region that holds a load, beside marching cubes on a grid of the same error."""

from __future__ import annotations

import importlib
import time
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer import Actuators, Payload, Struts
from explorer.mechanism.home import home_pose
from explorer.numerics.compiled import warm
from explorer.statics.held import largest_shares, load_case
from explorer.workspace.held import held_workspace
from explorer.workspace.limits.constraints import constraints, slacks

ROUNDS, FINE = 5, 50
ERROR = 5e-3
LOADED = msgspec.structs.replace(
    DESIGN,
    payload=Payload(2.0, (1.0, 2.0, 3.0)),
    actuators=Actuators(push_n=(60.0, 50.0, 40.0, 50.0, 45.0, 70.0)),
    struts=Struts(moment_nm=6.0),
)


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    true = held_workspace(LOADED, nodes=FINE).held_volume
    ours = best_of(ROUNDS, lambda: held_workspace(LOADED))
    error = abs(held_workspace(LOADED).held_volume / true - 1.0)
    count, theirs, their_error = _marching_cubes(true)
    yield Row(
        f"region that holds a load, its volume off by {error:.2%}",
        seconds(ours),
        "150 ms",
        f"marching cubes of scikit-image, {count} nodes an axis, off by {their_error:.2%}: "
        f"{seconds(theirs)}; {times(theirs / ours)}",
    )


def _marching_cubes(true: float) -> tuple[int, float, float]:
    """Return the nodes an axis of a grid of the allowed error, its time, and its error."""
    measure: Any = importlib.import_module("skimage.measure")
    rotation = home_pose(LOADED).rotation
    limits = constraints(LOADED, rotation)
    case = load_case(LOADED, rotation, np.zeros(6))
    box = LOADED.limits.box or ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    count, taken, error = 10, 0.0, 1.0
    while error > ERROR:
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
