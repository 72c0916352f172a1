"""Machines of the paper's optimum with typical errors, and what is measured of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from machines import OPTIMAL
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer import BuiltMachine, Configuration, Design, Measurement
from explorer.calibration.poses import sample_poses
from explorer.mechanism.built_machine import COUNT
from explorer.mechanism.design_file import typical_machine
from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import source_errors

TYPICAL = typical_machine(OPTIMAL)[0]
"""Errors of the encoders of 0.05 mm, tolerances of 0.1 mm and 0.1°; a unit is 10 mm."""

MICROMETRE = 1e-4
"""A micrometre in units of 10 mm."""

POSES = Measurement("poses", np.zeros((0, 6)), np.repeat([10.0 * MICROMETRE, np.radians(0.005)], 3))
"""Whole poses, measured to 10 µm and 0.005°."""

PLACES = np.array([[0.0, 0.0, 3.0], [4.0, 0.0, 3.0], [0.0, 5.0, 2.0]])
TARGETS = Measurement("targets", np.zeros((0, 9)), np.array(10.0 * MICROMETRE), PLACES)
BAR = replace(
    TARGETS,
    kind="bar",
    values=np.zeros((0, 1)),
    points=PLACES[:1],
    base=np.array([[5.0, -4.0, 0.0]]),
)
GAUGE = replace(BAR, kind="gauge", base=np.array([[0.0, 0.0, 1.0, 2.0]]))
WALLS = replace(
    GAUGE,
    base=np.array([[0.0, 0.1, 1.0, 2.0], [1.0, 0.0, 0.2, 3.0], [0.1, 1.0, 0.0, -2.0]]),
    plane=np.arange(3),
)
"""A gauge on three planes in turn."""


def design_itself(design: Design = TYPICAL) -> BuiltMachine:
    """Return the machine without deviations."""
    return BuiltMachine(design)


def true_machine(rng: np.random.Generator, design: Design = TYPICAL) -> BuiltMachine:
    """Return a random machine within the tolerances."""
    return BuiltMachine(design, source_errors(design) * rng.uniform(-1.0, 1.0, COUNT))


def with_errors(measured: Measurement, rng: np.random.Generator) -> Measurement:
    """Return what is measured with random errors."""
    errors = measured.sigma * rng.normal(size=measured.values.shape)
    values = measured.values + errors
    if measured.kind == "poses":
        turns = Rotation.from_rotvec(errors[:, 3:]) * Rotation.from_rotvec(measured.values[:, 3:])
        values[:, 3:] = turns.as_rotvec()
    return replace(measured, values=values)


@dataclass(frozen=True)
class Session:
    """A machine whose controller, which knows the design alone, went to some poses.

    Attributes:
        machine: The true machine.
        readings: Joints that were commanded, shape (n, 6).
        exact: What is measured without errors.
        measured: What was measured.
    """

    machine: BuiltMachine
    readings: FloatArray
    exact: Measurement
    measured: Measurement

    @staticmethod
    def of(
        kind: Measurement, poses: Configuration, seed: int, machine: BuiltMachine | None = None
    ) -> Session:
        """Return the session of a random machine, or of one, in poses for its design."""
        rng = np.random.default_rng(seed)
        true = machine or true_machine(rng, poses.design)
        readings = design_itself(poses.design).inverse(poses.position, poses.rotation)
        there = true.forward(readings)
        assert there.closes.all()
        exact = replace(
            kind, values=kind.model(there.position, there.rotation, np.zeros(kind.unknowns))
        )
        return Session(true, readings, exact, with_errors(exact, rng))


ELSEWHERE = sample_poses(TYPICAL, 200, seed=99)
"""Poses in which nothing is measured."""


def tool_errors(machine: BuiltMachine, known: BuiltMachine) -> FloatArray:
    """Return how far a machine is off elsewhere, shape (200,), in mm, if its controller knows one.

    The controller commands the joints by the inverse kinematics of the machine that it knows.
    """
    reached = machine.forward(known.inverse(ELSEWHERE.position, ELSEWHERE.rotation))
    assert reached.closes.all()
    off = reached.position - ELSEWHERE.position
    return np.linalg.norm(off, axis=1) * machine.design.unit_mm


def rms(values: ArrayLike) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
