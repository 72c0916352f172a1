"""All of the precision of many poses, beside the same by NumPy's linear algebra."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import msgspec
import numpy as np

from benchmarks.samples import DESIGN, around_home
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer import Actuators, Struts, jacobian, pose_precision, principal_compliances
from explorer.numerics.compiled import warm

POSES, ROUNDS = 10_000, 10
ERRORS = (0.1, 0.2, 0.1, 0.2, 0.1, 0.1)
STIFFNESS = (500.0, 600.0, 500.0, 600.0, 500.0, 400.0)
ACTUATORS = Actuators(error_mm=ERRORS, stiffness_n_mm=STIFFNESS)
STRUTS = Struts(outer_mm=6.0, inner_mm=4.0)
MACHINE = msgspec.structs.replace(DESIGN, actuators=ACTUATORS, struts=STRUTS)


def run() -> Iterator[Row]:
    """Yield the rows."""
    positions, rotations, _ = around_home(POSES)
    warm()

    def all_of_it() -> object:
        precision = pose_precision(MACHINE, positions, rotations)
        return precision, principal_compliances(precision.compliance)

    ours = best_of(ROUNDS, all_of_it)
    errors = np.array(ERRORS) / DESIGN.unit_mm
    corners = errors * np.array(list(itertools.product((-1.0, 1.0), repeat=6)))
    softness = 1.0 / (np.array(STIFFNESS) * DESIGN.unit_mm)

    def plain() -> object:
        joints = jacobian(DESIGN, positions, rotations)
        twists = np.linalg.solve(joints, np.broadcast_to(np.eye(6), joints.shape))
        compliance = (twists * softness) @ np.swapaxes(twists, -1, -2)
        moved = twists @ corners.T
        worst = [
            np.linalg.norm(moved[:, half], axis=1).max(axis=-1)
            for half in (slice(0, 3), slice(3, 6))
        ]
        return compliance, worst, np.linalg.eigh(compliance[:, :3, :3])

    theirs = best_of(3, plain)
    yield Row(
        f"compliance, principal directions, worst and RMS errors, 23 dimensions in {POSES:,} "
        "poses, one core",
        seconds(ours),
        "60 ms",
        f"NumPy, without the dimensions: {seconds(theirs)}; {times(theirs / ours)}",
    )
    alone = best_of(100, lambda: pose_precision(MACHINE, positions[0], rotations[0]))
    yield Row("all of the precision of one pose", seconds(alone))
