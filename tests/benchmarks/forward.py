"""The forward kinematics: a batch on one core, one call, and the error over reference cases."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from reference import read_reference

from benchmarks.numeric_root import LoopEquations, nearby
from benchmarks.samples import DESIGN, around_home, searches
from benchmarks.table import Row, per_second, seconds, times
from benchmarks.timing import best_of
from explorer import Design, forward
from explorer.mechanism.margins import mode_of
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import warm

COUNT, CALLS, ROUNDS = 100_000, 500, 100


def batch() -> Iterator[Row]:
    """Yield the row."""
    joints = around_home(COUNT).joints
    warm()
    forward(DESIGN, joints)
    rate = COUNT / best_of(ROUNDS, lambda: forward(DESIGN, joints))
    root = searches()
    root_rate = 1.0 / root.seconds_each
    yield Row(
        f"forward kinematics, batch of {COUNT:,}, all 8 modes, one core",
        per_second(rate),
        "5 million/s",
        f"scipy.optimize.root: {per_second(root_rate)} ({root}); {times(rate / root_rate)}",
    )


def once() -> Iterator[Row]:
    """Yield the row."""
    rows = [tuple(row) for row in around_home(CALLS).joints.tolist()]
    warm()

    def calls() -> None:
        for joints in rows:
            forward(DESIGN, joints)

    duration = best_of(ROUNDS, calls) / CALLS
    root = searches().seconds_each
    yield Row(
        "one forward call, all 8 modes",
        seconds(duration),
        "50 µs",
        f"scipy.optimize.root: {seconds(root)}, 1 mode; {times(root / duration)}",
    )


class Case(NamedTuple):
    """A design, a pose of it, its joints, and the reference's modes 0 to 7."""

    design: Design
    position: FloatArray
    rotation: FloatArray
    joints: FloatArray
    positions: FloatArray
    rotations: FloatArray

    @property
    def size(self) -> float:
        """The largest length of all."""
        return max(*map(abs, self.design.variables), float(np.abs(self.joints).max()))

    def errors(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return by how much each mode is missed, shape (8,): of the size, or in radians.

        Args:
            position: One of every mode, shape (8, 3), or one for all, shape (3,).
            rotation: Likewise, shape (8, 3, 3) or (3, 3).
        """
        moved = np.abs(self.positions - position).max(axis=1) / self.size
        turned = np.abs(self.rotations - rotation).max(axis=(1, 2))
        return np.maximum(moved, turned)


def error() -> Iterator[Row]:
    """Yield the rows of the worst and the median."""
    cases = _cases()
    ours = [case.errors(*forward(case.design, case.joints)[:2]).max() for case in cases]
    rng = np.random.default_rng(3)
    theirs: list[float] = []
    for case in cases:
        start = nearby(case.position, case.rotation, case.size, rng)
        found = LoopEquations(case.design).solve(case.joints, *start)
        if found.converged:
            # It finds whichever mode is near.
            theirs.append(float(case.errors(found.position, found.rotation).min()))
    of = f"of {len(theirs)} of {len(cases)} that converged"
    for name, statistic, target in (("worst", np.max, "1e-6"), ("median", np.median, "1e-13")):
        our, their = float(statistic(ours)), float(statistic(theirs))
        yield Row(
            f"forward kinematics, {name} error of {len(cases)} reference cases, relative",
            f"{our:.1e}",
            target,
            f"scipy.optimize.root: {their:.1e} ({of}); {times(their / our)}",
        )


def _cases() -> list[Case]:
    listing: list[dict[str, Any]] = read_reference("kinematics")["cases"]
    return [_case(entry) for entry in listing]


def _case(entry: dict[str, Any]) -> Case:
    modes = sorted(entry["assembly_modes"], key=lambda m: int(mode_of(np.array(m["margins"]))))
    return Case(
        Design(**entry["design"]),
        np.array(entry["position"]),
        np.array(entry["rotation"]),
        np.array(entry["joints"]),
        np.array([mode["position"] for mode in modes]),
        np.array([mode["rotation"] for mode in modes]),
    )
