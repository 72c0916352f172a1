"""The machine that was built: its inverse and forward kinematics undo each other."""

from __future__ import annotations

import numpy as np
import pytest
from machines import OPTIMAL
from numpy.testing import assert_allclose
from refusals import refusal
from scipy.spatial.transform import Rotation

from explorer import Configuration, Design, margins
from explorer.mechanism import built_machine
from explorer.mechanism.built_machine import COUNT, BuiltMachine
from explorer.mechanism.machine import A1, GUIDE, PLATFORM, STRUTS
from explorer.mechanism.margins import mode_of, planes_of_singularity, signs_of
from explorer.numerics.arrays import FloatArray

# Errors of encoders and lengths of 0.05 and 0.1 mm, of angles of 0.1°, in units of 10 mm.
TYPICAL = np.full(COUNT, 0.01)
TYPICAL[:6] = 0.005
TYPICAL[[15, 16, 29, 30]] = np.radians(0.1)
MARGIN_MM = 30.0
X = np.array(OPTIMAL.variables)


def random_machine(seed: int, size: float = 1.0) -> BuiltMachine:
    """Return a machine of the optimum or of a random design, with the typical errors or others."""
    rng = np.random.default_rng(seed)
    design = OPTIMAL
    if seed % 2:
        flips = rng.choice([-1.0, 1.0], 6, p=[0.2, 0.8])
        design = design.with_variables((X * flips * rng.uniform(0.7, 1.3, 6)).tolist())
    return BuiltMachine(design, size * TYPICAL * rng.uniform(-1.0, 1.0, COUNT))


def poses_of_all_modes(design: Design, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return random poses whose margins are at least 30 mm, some tenth of the count."""
    rng = np.random.default_rng(seed)
    positions = rng.uniform(-1.0, 1.0, (count, 3)) * design.reach
    rotations = Rotation.random(count, random_state=rng).as_matrix()
    regular = np.abs(margins(positions, rotations)).min(axis=1) * design.unit_mm >= MARGIN_MM
    return positions[regular], rotations[regular]


def largest_loss(machine: BuiltMachine, count: int, seed: int) -> tuple[int, int, float]:
    """Return the number of poses, of those lost, and the largest error of the others, in mm."""
    positions, rotations = poses_of_all_modes(machine.design, count, seed)
    joints, modes = machine.inverse(positions, rotations), mode_of(margins(positions, rotations))
    lost, error = 0, 0.0
    for mode in range(8):
        own = modes == mode
        found = machine.forward(joints[own], signs_of(mode))
        off = np.abs(found.position - positions[own]).max(initial=0.0)
        turned = machine.design.reach * np.abs(found.rotation - rotations[own]).max(initial=0.0)
        lost += int((~found.closes).sum())
        error = max(error, float(off), float(turned))
    return len(joints), lost, error * machine.design.unit_mm


def test_machine_without_deviations_has_the_joints_and_poses_of_its_design() -> None:
    machine = BuiltMachine(OPTIMAL)
    positions, rotations = poses_of_all_modes(OPTIMAL, 2000, 1)
    expected = Configuration(OPTIMAL, positions, rotations).joints
    assert_allclose(machine.inverse(positions, rotations), expected, rtol=0, atol=1e-13)
    assert (machine.defects == 0.0).all()


def test_joints_of_a_machine_are_those_of_exactly_flagged_design_seen_from_its_guide() -> None:
    """A machine whose flags have no defects is another design in a moved base and platform."""
    rng = np.random.default_rng(2)
    design = OPTIMAL.with_variables((X * rng.uniform(0.8, 1.2, 6)).tolist())
    off = np.zeros(COUNT)
    a3x, a3y, b1x, b1y, b2, b3 = np.array(design.variables) - X
    off[[9, 10]] = a3x, a3y
    off[6:][PLATFORM] = [b1x, b1y, 0.0, b2, 0.0, 0.0, b3, 0.0, 0.0, 0.0, 0.0, 0.0]
    machine = BuiltMachine(OPTIMAL, off)
    positions, rotations = poses_of_all_modes(design, 2000, 3)
    expected = Configuration(design, positions, rotations).joints
    assert_allclose(machine.inverse(positions, rotations), expected, rtol=0, atol=1e-12)
    # Any motion of all points of the base is one of the platform.
    moved = off.copy()
    for part in (A1, slice(3, 6), GUIDE):
        moved[6:][part] += [0.3, -0.2, 0.1]
    there = BuiltMachine(OPTIMAL, moved).inverse(positions + [0.3, -0.2, 0.1], rotations)
    assert_allclose(there, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("seed", range(50))
def test_forward_kinematics_in_all_modes_loses_no_pose(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(built_machine, "ROUNDS", 3)
    count, lost, error = largest_loss(random_machine(seed), 4000, seed)
    assert count > 300
    assert lost == 0
    assert error < (1e-8 if seed % 2 else 1e-9)


@pytest.mark.long
def test_forward_kinematics_of_a_million_poses_loses_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(built_machine, "ROUNDS", 3)
    rows = [largest_loss(random_machine(2 * seed), 200_000, seed) for seed in range(50)]
    counts, lost, errors = np.array(rows).T
    assert counts.sum() > 1e6
    assert lost.sum() == 0
    assert errors.max() < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_forward_kinematics_without_defects_at_b4_is_closed(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    off = random_machine(seed).deviations.copy()
    off[[6 + PLATFORM.start + 3 * k + axis for k in (1, 2, 3) for axis in (1, 2)]] = 0.0
    machine = BuiltMachine(random_machine(seed).design, off)
    assert_allclose(machine.defects[1], 0.0, atol=1e-15)
    assert np.abs(machine.defects[0]).max() > 1e-4
    monkeypatch.setattr(built_machine, "ROUNDS", 0)
    _, lost, error = largest_loss(machine, 4000, seed)
    assert lost == 0
    assert error < 1e-9


def test_forward_kinematics_of_large_deviations_closes_with_more_rounds() -> None:
    for seed in range(6):
        _, lost, error = largest_loss(random_machine(seed, 5.0), 4000, seed)
        assert lost == 0
        assert error < 1e-8


def test_forward_kinematics_is_of_home_unless_a_mode_is_asked() -> None:
    machine, home = random_machine(0), OPTIMAL.home_pose
    joints = machine.inverse(home.position, home.rotation)
    found = machine.forward(joints)
    assert found.closes
    assert_allclose(found.position, home.position, atol=1e-12)
    mirrored = machine.forward(joints, signs_of(7 - int(mode_of(margins(*found[:2])))))
    assert mirrored.closes
    assert np.sign(mirrored.position[2]) == -np.sign(found.position[2])
    assert_allclose(machine.inverse(*mirrored[:2]), joints, atol=1e-11)
    # Joints that no pose has are found to be such, beside others that are closed.
    batch = machine.forward(joints * np.array([[1.0] * 6, [1.0] * 5 + [5.0], [0.0] * 6]))
    assert batch.closes.tolist() == [True, False, False]
    assert np.isfinite(batch.rotation).all()


def test_defects_are_those_of_a1_beside_the_guide_and_of_b4_beside_its_line() -> None:
    off = np.zeros(COUNT)
    off[6:][A1], off[6:][GUIDE] = [0.1, 0.2, 0.3], [0.0, 0.05, 0.1]
    # b2 and b3 shifted alike, so that b4 lies on the other side of their line.
    off[6:][PLATFORM] = np.ravel([[0.0, 0.0, 0.0], [0.0, 0.1, 0.2], [0.0, 0.1, 0.2], [0.0] * 3])
    off[6:][STRUTS] = 0.01
    assert_allclose(BuiltMachine(OPTIMAL, off).defects, [[0.15, 0.2], [-0.1, -0.2]], atol=1e-14)


def test_unusable_deviations_and_joints_are_refused() -> None:
    assert "shape (..., 31)" in refusal(BuiltMachine, OPTIMAL, np.zeros(29))
    assert "not a batch" in refusal(BuiltMachine, OPTIMAL, np.zeros((2, COUNT)))
    machine = random_machine(0)
    assert "must not be negative" in refusal(machine.forward, [-1.0] * 6)


def determinants(machine: BuiltMachine, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return det J of a machine in poses, shape (n,), by differences of its joints."""
    rows = np.empty((6, len(position), 6))
    for k, step in enumerate(1e-5 * np.eye(6)):
        turned = Rotation.from_rotvec(step[3:]).as_matrix()
        there = machine.inverse(position + step[:3], turned @ rotation)
        rows[k] = there - machine.inverse(position - step[:3], turned.T @ rotation)
    return np.linalg.det(np.swapaxes(rows, 0, 1) / 2e-5)


def own_frames(machine: BuiltMachine) -> tuple[FloatArray, ...]:
    """Return origins and axes of a machine's flags in the frames of base and platform.

    They are a1's foot on the guide and b4's on the line b2b3; x is along the lines, and y towards
    a3 and b1.
    """
    axes, (b1, b4) = machine.b2b3_frame
    guide, (a1, a3) = machine.turns[1], machine.bases
    ends = (guide, machine.shifts[1], a1[0], a3), (axes.T, machine.points[1], b4[0], b1)
    found = list[FloatArray]()
    for own, start, foot, plane in ends:
        turn = Rotation.from_rotvec([np.arctan2(plane[2], plane[1]), 0.0, 0.0]).as_matrix()
        found += [start + foot * own[:, 0], own @ turn]
    return tuple(found)


def test_singular_poses_are_no_farther_from_those_of_the_machines_flags_than_the_allowance() -> (
    None
):
    """The determinant changes its sign between the two sides of each plane of singularity."""
    crossed = 0
    for seed in range(30):
        rng = np.random.default_rng(seed)
        machine = BuiltMachine(OPTIMAL, rng.uniform(-0.01, 0.01, COUNT))
        a1, base, b4, platform = own_frames(machine)
        position = rng.uniform((2.0, -10.0, 2.0), (25.0, 20.0, 17.0), (300, 3))
        turns = Rotation.from_rotvec(0.4 * rng.normal(size=(300, 3))).as_matrix()
        rotation = turns @ OPTIMAL.home_pose.rotation
        planes = planes_of_singularity(rotation)
        for k in range(3):
            length = np.linalg.norm(planes[:, k], axis=1, keepdims=True)
            own = margins(position, rotation)[:, k, None] / length
            foot = position - own * planes[:, k] / length
            far = np.abs(np.delete(margins(foot, rotation), k, axis=1)).min(axis=1) > 3.0
            step = machine.allowance * (planes[:, k] / length**2)[far]
            # The poses of the flags are poses of the platform's frame.
            r = base @ rotation[far] @ platform.T
            sides = [
                determinants(machine, a1 + (foot[far] + s * step) @ base.T - r @ b4, r)
                for s in (1.0, -1.0)
            ]
            assert (sides[0] * sides[1] < 0.0).all()
            crossed += len(step)
    assert crossed > 1000
