"""The configuration for LinuxCNC: limits of the design, and kinematics that are Python's."""

from __future__ import annotations

import configparser
import ctypes
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from compiled_kernel import COMPILER, SANITIZED, CompiledKernel, compile_c
from exported_designs import (
    in_mm,
    limited_design,
    machine_of,
    poses_about_home,
    scaled,
    size_of,
)
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from explorer import PRESETS, BuiltMachine, Design, Pose, forward, inverse, jacobian
from explorer.errors import NoAnswerError
from explorer.export.controller import LIMIT_NAMES
from explorer.export.linuxcnc import axis_speeds, linuxcnc_files
from explorer.mechanism.design import JOINTS, LENGTHS
from explorer.mechanism.margins import margins, mode_of
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.statics.accuracy import SOURCES, drawing_values
from explorer.workspace.limits.valid_poses import poses_are_valid

pytestmark = pytest.mark.usefixtures("warm_kernels")
compiled = pytest.mark.skipif(COMPILER is None, reason="no C compiler `cc` on this machine")

OPTIMAL = PRESETS["paper-optimal"]
DESIGNS = {
    **PRESETS,
    "limited": limited_design(0),
    "open": OPTIMAL.with_limits(box=None),
    "guide": msgspec.structs.replace(OPTIMAL.with_limits(guide=(2.0, 19.0)), unit_mm=0.7),
}
SUPPORT = Path(__file__).parents[1] / "support" / "linuxcnc"
OF_LINUXCNC = ("X", "Y", "Z", "D1", "D3", *(name.upper() for name in LENGTHS))


def state_of(declared: str) -> str:
    """Return what halcompile makes of pins and parameters, each of which is a global variable."""
    pins = re.findall(r"^pin in float (\w+)", declared, re.MULTILINE)
    parameters = re.findall(r"^param rw float (\w+) = (\S+) ", declared, re.MULTILINE)
    assert len(pins) + len(parameters) == declared.count("float")
    assert "\noption no_convenience_defines yes;\n" in declared
    return "\n".join(
        [
            *(f"double hal_{name};" for name in pins),
            *(f"double hal_{name} = {value};" for name, value in parameters),
            "static struct __comp_state {",
            *(f"    double *{name};" for name in pins),
            *(f"    double {name};" for name, _ in parameters),
            "} state, *__comp_first_inst = &state;",
            "void update_state(void)\n{",
            *(f"    state.{name} = &hal_{name};" for name in pins),
            *(f"    state.{name} = hal_{name};" for name, _ in parameters),
            "}\n",
        ]
    )


class Component:
    """The component of a design, compiled around stubs of LinuxCNC, over n rows."""

    def __init__(self, design: Design, folder: Path, machine: BuiltMachine | None = None) -> None:
        files = linuxcnc_files(design, machine)
        (folder / "flagged44.h").write_bytes(files["flagged44.h"])
        (folder / "flagged44.c").write_bytes(files["flagged44.c"])
        declared, code = files["flagged44kins.comp"].decode().split("\n;;\n")
        (folder / "flagged44kins.c").write_text(state_of(declared) + code, "utf-8")
        sources, options = [SUPPORT / "kinematics_rows.c"], ("-shared", "-fPIC", f"-I{SUPPORT}")
        library = compile_c(folder / "kinematics.so", sources, *SANITIZED, *options)
        self.library = ctypes.CDLL(str(library))

    def set(self, **values: float) -> None:
        """Set pins of the tool and parameters."""
        for name, value in values.items():
            ctypes.c_double.in_dll(self.library, f"hal_{name}").value = value

    @property
    def message(self) -> str:
        return (ctypes.c_char * 600).in_dll(self.library, "message").value.decode()

    def inverse(self, worlds: FloatArray) -> tuple[FloatArray, IntArray]:
        return self._run("inverse_rows", worlds, np.full((len(worlds), 6), np.nan))

    def forward(self, joints: FloatArray, before: FloatArray) -> tuple[FloatArray, IntArray]:
        return self._run("forward_rows", joints, before.copy())

    def _run(
        self, function: str, given: FloatArray, out: FloatArray
    ) -> tuple[FloatArray, IntArray]:
        results: np.ndarray[Any, Any] = np.empty(len(given), dtype=np.intc)
        given = np.ascontiguousarray(given)
        pointers = (each.ctypes.data_as(ctypes.c_void_p) for each in (given, out, results))
        self.library[function](ctypes.c_long(len(given)), *pointers)
        return out, results.astype(np.int64)


def world_of(position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return X to C: turns about the fixed axes x, y, z, one after the other."""
    angles = Rotation.from_matrix(rotation).as_euler("xyz", degrees=True)
    return np.concatenate([position, angles], axis=-1)


def home_mode(design: Design) -> int:
    return int(mode_of(margins(design.home_pose.position, design.home_pose.rotation)))


@pytest.mark.parametrize("name", DESIGNS)
def test_files_have_the_limits_of_the_design(name: str) -> None:
    design = DESIGNS[name]
    files = {file: data.decode() for file, data in linuxcnc_files(design).items()}
    assert not [file for file, text in files.items() if "${" in text]
    ini = configparser.ConfigParser(interpolation=None)
    ini.read_string(files["flagged44.ini"])
    unit, limits, home = design.unit_mm, design.limits, design.home_pose
    world = world_of(unit * np.array(home.position), home.rotation)
    assert_allclose(list(map(float, ini["TRAJ"]["HOME"].split())), world, rtol=0, atol=1e-6)
    assert files[ini["HAL"]["HALFILE"]].count("motor-pos-fb") == int(ini["KINS"]["JOINTS"]) == 6
    for index, at in enumerate(unit * inverse(design, home.position, home.rotation)):
        joint = ini[f"JOINT_{index}"]
        assert float(joint["HOME"]) == float(joint["HOME_OFFSET"]) == pytest.approx(at, abs=1e-6)
    # Ranges are those of the design if it states them, and no valid pose leaves any.
    guide = limits.guide or (None, None)
    box = (3 * [None], 3 * [None]) if limits.box is None else limits.box
    stated = np.array(
        [
            *zip(*box, strict=True),
            *(design.length_range(each) if each in LENGTHS else guide for each in JOINTS),
        ],
        dtype=float,
    )
    sections = [*(f"AXIS_{axis}" for axis in "XYZ"), *(f"JOINT_{index}" for index in range(6))]
    keys = ("MIN_LIMIT", "MAX_LIMIT")
    ranges = np.array([[float(ini[each][key]) for key in keys] for each in sections])
    is_stated = np.isfinite(stated)
    assert_allclose(ranges[is_stated], unit * stated[is_stated], rtol=0, atol=1e-6)
    position, rotation = poses_about_home(design, 5000, 0)
    values = unit * np.hstack([position, inverse(design, position, rotation)])
    values = values[poses_are_valid(design, position, rotation)]
    assert len(values) > 50
    assert (ranges[:, 0] - 1e-6 <= values).all()
    assert (values <= ranges[:, 1] + 1e-6).all()


def test_no_joint_is_faster_than_its_speed() -> None:
    design = in_mm(limited_design(3))
    linear, angular = axis_speeds(design)
    position, rotation = poses_about_home(design, 2000, 3)
    spins = np.radians(angular) * np.random.default_rng(3).choice([-1.0, 1.0], (2000, 3))
    _, b, c = np.radians(world_of(position, rotation)[:, 3:]).T
    about_a = np.column_stack([np.cos(b) * np.cos(c), np.cos(b) * np.sin(c), -np.sin(b)])
    about_b = np.column_stack([-np.sin(c), np.cos(c), 0.0 * c])
    turn = spins[:, :1] * about_a + spins[:, 1:2] * about_b + spins[:, 2:] * [0.0, 0.0, 1.0]
    twist = np.column_stack([linear * np.sign(spins), turn])
    rates = jacobian(design, position, rotation) @ twist[:, :, None]
    assert 1.5 * linear < np.abs(rates).max() <= 3.0 * linear


@compiled
@pytest.mark.parametrize(
    ("unit_mm", "end"), [(1e-3, 0), (10.0, 0), (25.4, 0), (0.7, 1), (25.4, 1), (1e4, 1)]
)
def test_home_on_the_ends_of_all_ranges_is_within_those_of_the_files(
    unit_mm: float, end: int, tmp_path: Path
) -> None:
    """The first command of the README goes home, where LinuxCNC allows no rounding."""
    home = OPTIMAL.home_pose
    joints = inverse(OPTIMAL, home.position, home.rotation).tolist()
    lengths = {
        name: (joints[index], 2.0 * joints[index]) if end == 0 else (0.0, joints[index])
        for index, name in enumerate(JOINTS)
        if name in LENGTHS
    }
    guide = (joints[1], 2.0 * joints[3]) if end == 0 else (0.0, joints[3])
    box = (home.position, (20.0, 22.0, 18.0)) if end == 0 else ((0.0, -12.0, 0.0), home.position)
    limited = OPTIMAL.with_limits(**lengths, guide=guide, box=box)
    design = msgspec.structs.replace(limited, unit_mm=unit_mm)
    files = {file: data.decode() for file, data in linuxcnc_files(design).items()}
    ini = configparser.ConfigParser(interpolation=None)
    ini.read_string(files["flagged44.ini"])
    (line,) = (line for line in files["README.txt"].splitlines() if "G90 G1" in line)
    words = line.split()
    assert [word[0] for word in words[2:]] == [*"XYZABCF"]
    assert "e" not in line.lower()
    world = np.array([float(word[1:]) for word in words[2:8]])
    assert world.tolist() == [*map(float, ini["TRAJ"]["HOME"].split())]
    assert_allclose(world, world_of(unit_mm * np.array(home.position), home.rotation), rtol=1e-12)
    there, results = Component(design, tmp_path).inverse(world[None])
    assert results == 0
    places = {f"AXIS_{axis}": value for axis, value in zip("XYZABC", world, strict=True)}
    places |= {f"JOINT_{index}": value for index, value in enumerate(there[0])}
    for section, value in places.items():
        low, high = (float(ini[section][key]) for key in ("MIN_LIMIT", "MAX_LIMIT"))
        assert low <= value <= high, section
        assert float(ini[section]["MAX_VELOCITY"]) > 0.0
        if section.startswith("JOINT"):
            assert low <= float(ini[section]["HOME"]) <= high
            assert float(ini[section]["HOME"]) == pytest.approx(value, rel=1e-12)


def test_range_of_zero_alone_holds_zero() -> None:
    home = Pose((0.0, 5.0, 4.0), OPTIMAL.home_pose.quaternion)
    flat = OPTIMAL.with_limits(box=((0.0, -12.0, 0.0), (0.0, 22.0, 18.0)))
    files = linuxcnc_files(msgspec.structs.replace(flat, home=home))
    ini = configparser.ConfigParser(interpolation=None)
    ini.read_string(files["flagged44.ini"].decode())
    low, high = (float(ini["AXIS_X"][key]) for key in ("MIN_LIMIT", "MAX_LIMIT"))
    assert -1e-8 < low < 0.0 < high < 1e-8


@compiled
@pytest.mark.parametrize("name", DESIGNS)
def test_component_equals_python(name: str, tmp_path: Path) -> None:
    component, kernel = Component(DESIGNS[name], tmp_path), CompiledKernel(DESIGNS[name], tmp_path)
    design, mode = in_mm(DESIGNS[name]), home_mode(DESIGNS[name])
    size, poses = size_of(design), poses_about_home(design, 5000, 1)
    worlds, expected = world_of(*poses), inverse(design, *poses)
    found, results = component.inverse(worlds)
    others = sum(1 << LIMIT_NAMES.index(limit) for limit in OF_LINUXCNC)
    of_mode = mode_of(margins(*poses)) == mode
    allowed = (kernel.limits(*poses) & ~others == 0) & of_mode
    assert_array_equal(results, np.where(allowed, 0, -1))
    assert 0.02 < allowed.mean() < 1.0
    assert_allclose(found[allowed], expected[allowed], rtol=0, atol=1e-12 * size)
    assert np.isnan(found[~allowed]).all()

    expected[::5] *= np.random.default_rng(1).uniform(0.5, 1.5, (len(expected[::5]), 6))
    before = worlds + np.random.default_rng(2).uniform(-800.0, 800.0, worlds.shape)
    position, rotation, feasible = forward(design, expected)
    assert 0.0 < feasible.mean() < 1.0
    found, results = component.forward(expected, before)
    assert_array_equal(results, np.where(feasible, 0, -1))
    assert_array_equal(found[~feasible], before[~feasible])
    found, before = found[feasible], before[feasible]
    assert_allclose(found[:, :3], position[feasible, mode], rtol=0, atol=1e-12 * size)
    turned = Rotation.from_euler("xyz", found[:, 3:], degrees=True).as_matrix()
    assert_allclose(turned, rotation[feasible, mode], rtol=0, atol=1e-12)
    assert np.abs(found[:, [3, 5]] - before[:, [3, 5]]).max() <= 180.0
    assert np.abs(found[:, 4]).max() <= 90.0


@compiled
def test_moves_begin_where_joints_were_jogged_and_lead_back(tmp_path: Path) -> None:
    component, design = Component(OPTIMAL, tmp_path), in_mm(OPTIMAL)
    home = design.home_pose
    world = world_of(np.array([home.position]), home.rotation[None])
    joints = inverse(design, home.position, home.rotation)[None]
    # d1 passes d3, which breaks the order of the carriages.
    jogged = joints + [0.0, 12.0, 0.0, 0.0, 0.0, 0.0]
    there, results = component.forward(jogged, world)
    assert results == 0
    assert_allclose(component.inverse(there)[0], jogged, rtol=0, atol=1e-10)
    assert component.forward(joints, there)[1] == 0
    assert component.inverse(there)[1] == -1
    assert component.message == "flagged44kins: the pose breaks limits: order\n"
    # At a pitch of 90 degrees the roll is zero.
    steep = np.array([[*home.position, 20.0, -90.0, 150.0]])
    rotation = Rotation.from_euler("xyz", steep[:, 3:], degrees=True).as_matrix()
    assert mode_of(margins(steep[:, :3], rotation)) == home_mode(design)
    found, results = component.forward(inverse(design, steep[:, :3], rotation), world)
    assert results == 0
    turned = Rotation.from_euler("xyz", found[:, 3:], degrees=True).as_matrix()
    assert_allclose(turned, rotation, rtol=0, atol=1e-6)


@compiled
@pytest.mark.parametrize("name", ["paper-optimal", "limited"])
def test_component_of_a_machine_has_its_joints_and_poses(name: str, tmp_path: Path) -> None:
    machine = machine_of(DESIGNS[name], 3)
    component = Component(DESIGNS[name], tmp_path, machine)
    machine = scaled(machine)
    design, mode = machine.design, home_mode(DESIGNS[name])
    size, poses = size_of(design), poses_about_home(design, 5000, 1)
    worlds, expected = world_of(*poses), machine.inverse(*poses)
    found, results = component.inverse(worlds)
    allowed = results == 0
    assert allowed.sum() > 50
    assert_allclose(found[allowed], expected[allowed], rtol=0, atol=1e-12 * size)
    regular = np.abs(margins(*poses)).min(axis=1) > 0.1 * size
    regular &= mode_of(margins(*poses)) == mode
    found, results = component.forward(expected[regular], worlds[regular])
    assert (results == 0).all()
    assert_allclose(found, worlds[regular], rtol=0, atol=1e-7 * size)
    # Parameters that are set while it runs are those of another machine.
    other = scaled(machine_of(DESIGNS[name], 4))
    values = drawing_values(design, other.deviations).tolist()
    component.set(**dict(zip((n.replace(" ", "_") for n in SOURCES), values, strict=True)))
    found, _ = component.inverse(worlds)
    expected = other.inverse(*poses)
    assert_allclose(found[allowed], expected[allowed], rtol=0, atol=1e-12 * size)


@compiled
def test_tool_turns_with_the_platform(tmp_path: Path) -> None:
    component, design = Component(OPTIMAL, tmp_path), in_mm(OPTIMAL)
    position, rotation = poses_about_home(design, 2000, 2)
    allowed = component.inverse(world_of(position, rotation))[1] == 0
    position, rotation = position[allowed], rotation[allowed]
    offset = np.array([3.0, -5.0, 40.0])
    component.set(tool_x=3.0, tool_y=-5.0, tool_z=40.0)
    # LinuxCNC adds the offset to what is programmed: the tip, from which it leads to b4.
    tips = position - rotation @ offset
    found, results = component.inverse(world_of(tips + offset, rotation))
    assert (results == 0).all()
    joints = inverse(design, position, rotation)
    assert_allclose(found, joints, rtol=0, atol=1e-11 * size_of(design))
    back, results = component.forward(joints, world_of(tips, rotation))
    assert_allclose(back[:, :3], tips + offset, rtol=0, atol=1e-7)


def test_home_that_breaks_limits_is_refused() -> None:
    with pytest.raises(NoAnswerError, match=r"home pose, which breaks limits: l1 = 117\.4 mm"):
        linuxcnc_files(OPTIMAL.with_limits(l1=(0.0, 5.0)))


def test_singular_home_is_refused() -> None:
    home = OPTIMAL.home_pose
    flat = Pose((*home.position[:2], 0.0), home.quaternion)
    with pytest.raises(NoAnswerError, match="which is singular"):
        linuxcnc_files(msgspec.structs.replace(OPTIMAL, home=flat))


@pytest.mark.skipif(shutil.which("halcompile") is None, reason="no LinuxCNC on this machine")
@pytest.mark.parametrize("name", DESIGNS)
def test_halcompile_builds_the_component(name: str, tmp_path: Path) -> None:
    for file, data in linuxcnc_files(DESIGNS[name]).items():
        (tmp_path / file).write_bytes(data)
    subprocess.run(["halcompile", "--compile", "flagged44kins.comp"], cwd=tmp_path, check=True)
    assert (tmp_path / "flagged44kins.so").exists()
