"""The kernel for controllers, beside the iteration that controllers of hexapods use today.

That is Newton's iteration on six leg lengths, here of the 6-4 twin, from the last pose to the next
one: it finds one mode at a time, and near a singular pose another one or none.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from compiled_kernel import COMPILER, CompiledKernel
from scipy.spatial.transform import Rotation

from benchmarks.samples import DESIGN, around_home
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer import from_folds, inverse, margins, to_folds
from explorer.mechanism.design_file import typical_machine
from explorer.mechanism.margins import mode_of
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.prototype.imperfect import ImperfectMachine

COUNT, CACHED, ROUNDS = 20_000, 500, 20
# Where the iteration starts, as a share of the reach and in radians: a cycle of a controller away.
CYCLE = 0.01
# A fold this far from flat, in degrees.
NEARLY_FLAT = 1.0
# Random starts from which the iteration looks for all modes of some joints.
STARTS, VECTORS = 50, 200
UNIT = DESIGN.unit_mm
SHORT = {"COUNT": 300, "CACHED": 50, "ROUNDS": 1, "STARTS": 10, "VECTORS": 5}


class Found(NamedTuple):
    """What the iteration found for n joints: the mode, −1 for none, and seconds for one call."""

    mode: IntArray
    seconds: float


class Newton:
    """Newton's iteration on the lengths of the twin's six legs, in millimetres."""

    def __init__(self, kernel: CompiledKernel) -> None:
        self._kernel = kernel
        self._points = UNIT * np.array([DESIGN.a2x, *DESIGN.variables])

    def find(
        self, joints: FloatArray, start: tuple[FloatArray, FloatArray], rounds: int = 1
    ) -> Found:
        """Iterate from a start to joints (n, 6)."""
        position, rotation = (np.empty_like(part) for part in start)
        iterations = np.zeros(len(joints), dtype=np.intc)

        def run() -> None:
            position[:], rotation[:] = start
            self._kernel.run("newton_rows", joints, self._points, position, rotation, iterations)

        seconds_each = best_of(rounds, run) / len(joints)
        modes = mode_of(margins(position, rotation))
        return Found(np.where(iterations > 0, modes, -1), seconds_each)


def poses_about(position: FloatArray, rotation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return poses within a cycle of a controller of some poses."""
    rng = np.random.default_rng(2)
    turns = Rotation.from_rotvec(CYCLE * rng.uniform(-1.0, 1.0, position.shape)).as_matrix()
    step = CYCLE * UNIT * DESIGN.reach * rng.uniform(-1.0, 1.0, position.shape)
    return position + step, turns @ rotation


def run() -> Iterator[Row]:
    """Yield the rows."""
    if COMPILER is None:
        yield Row("kernel for controllers", "no C compiler `cc` on this machine")
        return
    machine = ImperfectMachine.draw(typical_machine(DESIGN)[0], 0)
    with TemporaryDirectory() as folder:
        extra = [Path(__file__).parent / "six_lengths.c"]
        kernel = CompiledKernel(DESIGN, Path(folder), ["-O2"], extra, machine)
        yield from rows_of(kernel, Newton(kernel))
        yield row_of_machine(kernel)


def row_of_machine(kernel: CompiledKernel) -> Row:
    """Return the row of a machine that was built, beside its design."""
    positions, rotations, _ = around_home(CACHED)
    poses, out = (UNIT * positions, rotations.copy()), np.empty((CACHED, 6))
    built, nominal = (
        best_of(50 * ROUNDS, lambda name=name: kernel.run(name, *poses, out)) / CACHED
        for name in ("built_inverse_rows", "inverse_rows")
    )
    return Row(
        "kernel in C, inverse kinematics of a machine with 31 deviations",
        seconds(built),
        f"{seconds(1.1 * nominal)}, 1.1 of the design's",
        f"of the design: {seconds(nominal)}; {built / nominal:.2f} of it",
    )


def rows_of(kernel: CompiledKernel, newton: Newton) -> Iterator[Row]:
    """Yield the rows of a compiled kernel."""
    positions, rotations, joints = around_home(COUNT)
    positions, joints = UNIT * positions, UNIT * joints
    # As many as stay in the cache, as the one of a controller does.
    few = joints[:CACHED].copy()
    out = np.empty((CACHED, 8, 3)), np.empty((CACHED, 8, 9)), np.empty(CACHED, dtype=np.intc)
    eight = best_of(10 * ROUNDS, lambda: kernel.run("forward_rows", few, *out)) / CACHED
    one = newton.find(joints, poses_about(positions, rotations), ROUNDS)
    modes = mode_of(margins(positions, rotations))
    yield Row(
        "kernel in C, forward kinematics, all 8 modes",
        seconds(eight),
        "200 ns",
        f"Newton on six lengths to 1e-9, 1 mode of 8: {seconds(one.seconds)} "
        f"({(one.mode == modes).mean():.1%} found it); {times(one.seconds / eight)}",
    )

    folds, rows = to_folds(positions, rotations), np.arange(COUNT)
    flat = 3 + rows % 3
    folds[rows, flat] = np.copysign(np.radians(NEARLY_FLAT), folds[rows, flat])
    positions, rotations = from_folds(folds)
    flat_joints = UNIT * inverse(DESIGN, positions / UNIT, rotations)
    modes = mode_of(margins(positions, rotations))
    solved = kernel.forward(flat_joints)[0][rows, modes]
    off = np.linalg.norm(solved - positions, axis=1) / (UNIT * DESIGN.reach)
    found = newton.find(flat_joints, poses_about(positions, rotations)).mode
    none, right = (found == -1).mean(), (found == modes).mean()
    yield Row(
        f"the same with a fold of {NEARLY_FLAT:g}°: its mode found",
        f"{(off < 1e-9).mean():.1%}",
        "100.0%",
        f"Newton: {right:.1%}, another mode {1.0 - right - none:.1%}, none {none:.1%}",
    )

    repeated = np.repeat(joints[:VECTORS], STARTS, axis=0)
    rng = np.random.default_rng(3)
    places = UNIT * DESIGN.reach * rng.uniform(-1.0, 1.0, (len(repeated), 3))
    turns = Rotation.random(len(repeated), rng).as_matrix()
    found = newton.find(repeated, (places, turns))
    counts = [len({*each} - {-1}) for each in found.mode.reshape(VECTORS, STARTS).tolist()]
    yield Row(
        "all 8 modes of joints",
        seconds(eight),
        "200 ns",
        f"Newton from {STARTS} random starts: {np.mean(counts):.1f} of 8 modes in "
        f"{seconds(STARTS * found.seconds)}",
    )
