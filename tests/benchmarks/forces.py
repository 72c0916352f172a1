"""Actuator forces of many poses, beside NumPy's solution of the same linear systems."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.samples import DESIGN, around_home
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer import actuator_forces, jacobian, largest_force, strut_bending
from explorer.numerics.compiled import warm

POSES, ROUNDS = 100_000, 10


def run() -> Iterator[Row]:
    """Yield the rows."""
    positions, rotations, _ = around_home(POSES)
    loads = np.random.default_rng(1).normal(size=(POSES, 6))
    most = np.full(6, 100.0)
    warm()
    ours = best_of(ROUNDS, lambda: actuator_forces(DESIGN, positions, rotations, loads))

    def solve() -> object:
        transposed = np.swapaxes(jacobian(DESIGN, positions, rotations), -1, -2)
        return np.linalg.solve(transposed, -loads[..., None])

    theirs = best_of(3, solve)
    yield Row(
        f"forces of the six actuators in {POSES:,} poses, one core",
        seconds(ours),
        "60 ms",
        f"numpy.linalg.solve: {seconds(theirs)}; {times(theirs / ours)}",
    )
    bending = best_of(ROUNDS, lambda: strut_bending(DESIGN, positions, rotations, loads))
    yield Row(f"bending of both struts in {POSES:,} poses", seconds(bending))
    force = best_of(ROUNDS, lambda: largest_force(DESIGN, positions, rotations, most))
    yield Row(f"largest force in every direction in {POSES:,} poses", seconds(force))
    one = positions[0], rotations[0], loads[0]
    alone = best_of(100, lambda: actuator_forces(DESIGN, *one))
    yield Row("forces of the six actuators in one pose", seconds(alone))
