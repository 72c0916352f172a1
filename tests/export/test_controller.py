"""The kernel for controllers: what C computes is what Python does, in millimetres."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
from compiled_kernel import COMPILER, SANITIZED, CompiledKernel, compile_c
from exported_designs import in_mm, limited_design, poses_about_home, random_poses, size_of
from long_cases import long_after
from numpy.testing import assert_allclose, assert_array_equal

from explorer import PRESETS, Design, forward, from_folds, inverse, jacobian, margins, to_folds
from explorer.export.controller import LIMIT_NAMES, kernel_files
from explorer.legs.clearance import PAIRS
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.margins import mode_of
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.workspace.limits.valid_poses import poses_are_valid, violations

pytestmark = [
    pytest.mark.skipif(COMPILER is None, reason="no C compiler `cc` on this machine"),
    pytest.mark.usefixtures("warm_kernels"),
]

OPTIMAL = PRESETS["paper-optimal"]
SHARE = 1e-12

# Names of limits in Python that are not those of the bits in lower case.
BITS = {
    **{f"box {axis}": axis.upper() for axis in "xyz"},
    **{f"margin δ{index}": f"DELTA{index}" for index in (1, 2, 3)},
    "gap |d1 − d3|": "GAP",
    "carriage order": "ORDER",
    **{f"legs {i}–{j}": f"LEGS_{i}{j}" for i, j in PAIRS},
}


@pytest.fixture(autouse=True)
def _defined(capfd: pytest.CaptureFixture[str]) -> Iterator[None]:  # pyright: ignore[reportUnusedFunction]
    """Let the sanitizer find no undefined behaviour."""
    yield
    assert capfd.readouterr().err == ""


# Twenty designs of 50,000 vectors each are a million.
@pytest.mark.parametrize("seed", long_after(3, range(20)))
def test_kernel_equals_python(seed: int, tmp_path: Path) -> None:
    design = limited_design(seed)
    kernel, design = CompiledKernel(design, tmp_path), in_mm(design)
    poses = random_poses(design, 50_000, seed)
    size = size_of(design)
    joints = inverse(design, *poses)
    assert_allclose(kernel.inverse(*poses), joints, rtol=0, atol=SHARE * size)
    assert_allclose(kernel.jacobian(*poses), jacobian(design, *poses), rtol=0, atol=SHARE * size)
    found, modes = kernel.margins(*poses)
    assert_allclose(found, margins(*poses), rtol=0, atol=SHARE * size)
    assert_array_equal(modes, mode_of(found))
    assert_allclose(kernel.folds(*poses), to_folds(*poses), rtol=SHARE, atol=SHARE)
    flat = from_folds(to_folds(*poses) * [1, 1, 1, 0, 0, 0] + [0, 0, 0, -np.pi, -np.pi, -np.pi])
    assert (kernel.folds(*flat) > -np.pi).all()

    # Joints that do not close, and those of poses with folds that are flat to rounding.
    joints[::7] *= np.random.default_rng(seed).uniform(0.5, 1.5, (len(joints[::7]), 6))
    position, rotation, feasible = forward(design, joints)
    positions, rotations, modes = kernel.forward(joints)
    assert 0.03 < 1.0 - feasible.mean() < 0.3
    assert_array_equal(modes, np.where(feasible, 8, 0))
    assert np.isnan(positions[~feasible]).all()
    assert_allclose(positions[feasible], position[feasible], rtol=0, atol=SHARE * size)
    assert_allclose(rotations[feasible], rotation[feasible], rtol=0, atol=SHARE)


def bits_of_python(design: Design, position: FloatArray, rotation: FloatArray) -> IntArray:
    return np.array(
        [
            sum(
                1 << LIMIT_NAMES.index(BITS.get(name, name.upper().replace(" ", "_")))
                for name in {violation.limit for violation in broken}
            )
            for broken in violations(Configuration(design, position, rotation))
        ]
    )


def test_kernel_tells_the_broken_limits(tmp_path: Path) -> None:
    met = 0
    for seed in range(4):
        (folder := tmp_path / str(seed)).mkdir()
        design = limited_design(seed)
        kernel, design = CompiledKernel(design, folder), in_mm(design)
        poses = poses_about_home(design, 2000, seed)
        broken = kernel.limits(*poses)
        assert_array_equal(broken, bits_of_python(design, *poses))
        assert_array_equal(broken == 0, poses_are_valid(design, *poses))
        met |= np.bitwise_or.reduce(broken)
    assert met == (1 << len(LIMIT_NAMES)) - 1


def test_kernel_of_degenerate_input_is_defined(tmp_path: Path) -> None:
    design = in_mm(OPTIMAL)
    kernel = CompiledKernel(OPTIMAL, tmp_path)
    strange = (np.nan, np.inf, -np.inf, 0.0, -1.0, 1e300, 5e-324)
    joints = np.repeat([[150.0, 100.0, 90.0, 110.0, 90.0, 150.0]], 6 * len(strange), axis=0)
    for index in range(6):
        joints[index::6, index] = strange
    _, _, modes = kernel.forward(joints)
    assert not modes[~np.isfinite(joints).all(axis=1)].any()
    assert not modes[(joints[:, [0, 2, 4, 5]] < 0.0).any(axis=1)].any()
    positions = np.array([[value] * 3 for value in strange])
    turns = np.repeat(np.eye(3)[None], len(strange), axis=0)
    assert (kernel.limits(positions, turns)[:3] != 0).all()
    # b1 is at a1, then b4 is at a3, so that l1 and l4 are zero and have no direction.
    ends = -np.array([*design.b1, 0.0]), np.array([*design.a3, 0.0])
    poses = np.array(ends), np.repeat(np.eye(3)[None], 2, axis=0)
    rows = kernel.jacobian(*poses)
    assert not rows[0, 0].any()
    assert not rows[1, 5].any()
    assert_allclose(rows, jacobian(design, *poses), rtol=0, atol=SHARE * size_of(design))


@pytest.mark.parametrize("name", ["arm", "*/ int /* ??/ \\", "Größe \u201cA\u201d $x ${y}"])
def test_example_of_the_header_compiles_and_runs(name: str, tmp_path: Path) -> None:
    design = msgspec.structs.replace(limited_design(1), name=name)
    for file, data in kernel_files(design).items():
        (tmp_path / file).write_bytes(data)
    header = (tmp_path / "flagged44.h").read_text("utf-8")
    assert header.isascii() == (name == "arm")
    lines = re.findall(r"^ \*     (.*)$", header, re.MULTILINE)
    example = "\n".join(lines[lines.index('#include "flagged44.h"') :])
    (tmp_path / "main.c").write_text(example, "utf-8")
    sources = [tmp_path / "main.c", tmp_path / "flagged44.c"]
    program = compile_c(tmp_path / "main", sources, *SANITIZED)
    done = subprocess.run([program], capture_output=True, text=True, check=True)
    pose = design.home_pose
    l1 = design.unit_mm * inverse(design, pose.position, pose.rotation)[0]
    mode = mode_of(margins(pose.position, pose.rotation))
    assert done.stdout.startswith(f"l1 = {l1:.6f} mm, mode {mode}, ")
