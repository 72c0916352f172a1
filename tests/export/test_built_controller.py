"""The kernel for controllers, of machines that were built: what C computes is what Python does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from compiled_kernel import COMPILER, CompiledKernel
from exported_designs import in_mm, limited_design, machine_of, scaled, size_of
from long_cases import long_after
from machines import OPTIMAL
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from explorer import Configuration, Design
from explorer.mechanism.margins import margins, mode_of
from explorer.numerics.arrays import FloatArray

pytestmark = [
    pytest.mark.skipif(COMPILER is None, reason="no C compiler `cc` on this machine"),
    pytest.mark.usefixtures("warm_kernels"),
]


def regular_poses(design: Design, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return poses of all modes whose margins are a tenth of the size or more."""
    rng = np.random.default_rng(seed)
    positions = size_of(design) * rng.uniform(-2.0, 2.0, (count, 3))
    rotations = Rotation.random(count, rng).as_matrix()
    far = np.abs(margins(positions, rotations)).min(axis=1) > 0.1 * size_of(design)
    return positions[far], rotations[far]


@pytest.mark.parametrize("seed", long_after(4, range(50)))
def test_kernel_of_a_machine_equals_python(seed: int, tmp_path: Path) -> None:
    design = limited_design(seed) if seed % 2 else OPTIMAL
    machine = machine_of(design, seed)
    kernel, machine = CompiledKernel(design, tmp_path, machine=machine), scaled(machine)
    design, poses = machine.design, regular_poses(machine.design, 40_000, seed)
    size, joints = size_of(design), machine.inverse(*poses)
    assert len(joints) > 5000
    found = kernel.built_inverse(*poses)
    assert_allclose(found, joints, rtol=0, atol=1e-12 * size)
    assert np.abs(found - kernel.inverse(*poses)).max() > 1e-4 * size
    positions, rotations, closes = kernel.built_forward(joints, mode_of(margins(*poses)))
    assert closes.all()
    assert_allclose(positions, poses[0], rtol=0, atol=1e-9 * size)
    assert_allclose(rotations, poses[1], rtol=0, atol=1e-9)


def test_limits_and_the_kernel_of_the_design_are_not_those_of_the_machine(tmp_path: Path) -> None:
    design = limited_design(2)
    (one := tmp_path / "one").mkdir()
    kernels = (
        CompiledKernel(design, one),
        CompiledKernel(design, tmp_path, machine=machine_of(design, 5)),
    )
    poses = regular_poses(in_mm(design), 5000, 1)
    joints = kernels[0].inverse(*poses)
    assert_array_equal(kernels[0].limits(*poses), kernels[1].limits(*poses))
    assert_array_equal(kernels[1].inverse(*poses), joints)
    assert_array_equal(kernels[0].forward(joints)[0], kernels[1].forward(joints)[0])


def test_machine_without_deviations_is_the_design(tmp_path: Path) -> None:
    kernel, design = CompiledKernel(OPTIMAL, tmp_path), in_mm(OPTIMAL)
    poses = regular_poses(design, 5000, 3)
    expected = Configuration(design, *poses).joints
    assert_allclose(kernel.built_inverse(*poses), expected, rtol=0, atol=1e-12 * size_of(design))
    modes = mode_of(margins(*poses))
    rows = np.arange(len(modes))
    found = kernel.forward(expected)
    for built, nominal in zip(kernel.built_forward(expected, modes), found, strict=True):
        assert_array_equal(built, nominal[rows, modes] if nominal.ndim > 1 else nominal // 8)


def test_legs_that_do_not_close_are_told(tmp_path: Path) -> None:
    machine = machine_of(OPTIMAL, 0)
    kernel, machine = CompiledKernel(OPTIMAL, tmp_path, machine=machine), scaled(machine)
    joints = machine.inverse(*regular_poses(machine.design, 2000, 3))
    joints *= np.random.default_rng(0).uniform(0.9, 1.1, joints.shape)
    strange = np.repeat(joints[:1], 24, axis=0)
    for index, value in enumerate((np.nan, np.inf, 0.0, -1.0)):
        strange[6 * index + np.arange(6), np.arange(6)] = value
    modes = np.full(len(joints), 3)
    closes = kernel.built_forward(joints, modes)[2]
    expected = machine.forward(joints, [-1, 1, 1]).closes
    assert 0.02 < expected.mean() < 0.98
    assert_array_equal(closes, expected)
    closes = kernel.built_forward(strange, modes[:24])[2]
    assert not closes[:12].any()
