"""Designs with every kind of limit, and poses of them, for what is exported in millimetres."""

from __future__ import annotations

import msgspec
import numpy as np
from limited_designs import ordinary_case, scaled_design
from scipy.spatial.transform import Rotation

from explorer import BuiltMachine, Design, from_folds
from explorer.mechanism.design import Swing
from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import IS_TILT


def limited_design(seed: int) -> Design:
    """Return a design in its own unit with every kind of limit, and its home within them."""
    design, _ = ordinary_case(seed)
    angles = np.random.default_rng(seed).uniform(30.0, 150.0, 6).tolist()
    swing = Swing(**dict(zip(Swing.__struct_fields__, angles, strict=True)))
    design = design.with_limits(swing=swing, leg_radii=(0.1, 0.2, 0.3, 0.05), gap=0.5)
    return msgspec.structs.replace(design, unit_mm=7.3)


def in_mm(design: Design) -> Design:
    """Return a design with its lengths in millimetres."""
    return msgspec.structs.replace(scaled_design(design, design.unit_mm), unit_mm=1.0)


def size_of(design: Design) -> float:
    return max(map(abs, design.variables))


def random_poses(design: Design, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return poses of all modes, half of them with folds within 1e-2 to 1e-14 of flat."""
    rng = np.random.default_rng(seed)
    folds = rng.uniform(-np.pi, np.pi, (count, 6))
    folds[:, 0] = 2.0 * size_of(design) * rng.uniform(0.01, 1.0, count)
    folds[:, 1:3] = np.abs(folds[:, 1:3])
    half = count // 2
    flat = np.pi * rng.integers(0, 2, (half, 5)) + 10.0 ** rng.uniform(-14, -2, (half, 5))
    folds[:half, 1:] = np.where(rng.random((half, 5)) < 0.4, flat, folds[:half, 1:])
    return from_folds(folds)


def poses_about_home(design: Design, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    home, steps = design.home_pose, rng.uniform(0.0, 0.5, (count, 1))
    positions = np.array(home.position) + steps * size_of(design) * rng.normal(size=(count, 3))
    turns = Rotation.from_rotvec(steps * rng.normal(size=(count, 3))).as_matrix()
    return positions, turns @ home.rotation


def machine_of(design: Design, seed: int, share: float = 1e-3) -> BuiltMachine:
    """Return a random machine, whose points are off by a share of its size, and angles by 0.1°."""
    sizes = np.where(IS_TILT, np.radians(0.1), share * size_of(design))
    return BuiltMachine(design, sizes * np.random.default_rng(seed).uniform(-1.0, 1.0, 31))


def scaled(machine: BuiltMachine) -> BuiltMachine:
    """Return a machine with its lengths in millimetres."""
    unit = np.where(IS_TILT, 1.0, machine.design.unit_mm)
    return BuiltMachine(in_mm(machine.design), unit * machine.deviations)
