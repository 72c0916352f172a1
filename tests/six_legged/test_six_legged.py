"""Tables on six legs: files, volumes, poses, forces and forward kinematics, by laws and MuJoCo."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import mujoco  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
import pytest
from differences import assert_is_jacobian
from refusals import refusal
from scipy.spatial.transform import Rotation

from explorer import PRESETS, InputError, Workspace, workspace_volume
from explorer.measures.catalogue import CATALOGUE, values_of
from explorer.measures.measure import Case
from explorer.mechanism.design import Design, Swing
from explorer.numerics.arrays import FloatArray
from explorer.six_legged.case import TABLE_MEASURES, TableCase
from explorer.six_legged.files import (
    TABLES,
    decode_table,
    load_table,
    made_equal,
    six_four_twin,
)
from explorer.six_legged.table import SixLegged, TableHome, TablePoses, table_of
from explorer.workspace.limits.constraints import HalfSpace, slacks
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.volume import region_volume

engine: Any = mujoco
OPTIMAL = PRESETS["paper-optimal"]
Struct = TypeVar("Struct", bound=msgspec.Struct)
CIRCLES, OCTAHEDRAL = TABLES["two circles"], TABLES["octahedral"]


def changed(of: Struct, **fields: Any) -> Struct:
    return msgspec.structs.replace(of, **fields)


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.2, -0.1, 0.3)])
def test_volume_is_that_of_random_positions(
    table: SixLegged, turn: tuple[float, float, float]
) -> None:
    rotation = Rotation.from_rotvec(turn).as_matrix() @ table.home_pose.rotation
    case = TableCase(table, rotation)
    assert case.region.box is not None
    lows, highs = case.region.box
    points = np.random.default_rng(1).uniform(lows, highs, (300_000, 3))
    share = float(case.holds(points, rotation).mean())
    box = float(np.prod(highs - lows))
    # The standard error of a share of independent positions.
    error = (share * (1.0 - share) / len(points)) ** 0.5
    assert abs(share * box - case.volume.volume) <= 4.0 * error * box
    assert case.volume.error <= 1e-9 * case.volume.volume
    inside = points[(slacks(case.limits, points) >= 0.0).all(axis=1)]
    beyond = np.ptp(inside, axis=0) - case.extent
    assert (beyond <= 1e-6).all()


def test_cones_bound_volume_and_poses_alike() -> None:
    table = changed(CIRCLES, cones_deg=(20.0, 20.0, 25.0, 25.0, 30.0, 30.0))
    rotation = Rotation.from_rotvec([0.1, 0.0, 0.1]).as_matrix()
    case = TableCase(table, rotation)
    assert case.region.box is not None
    lows, highs = case.region.box
    points = np.random.default_rng(1).uniform(lows, highs, (100_000, 3))
    held = case.holds(points, rotation)
    assert (held == (slacks(case.limits, points) >= 0.0).all(axis=1)).all()
    share = float(held.mean())
    error = (share * (1.0 - share) / len(points)) ** 0.5 * float(np.prod(highs - lows))
    expected = share * float(np.prod(highs - lows))
    assert case.volume.volume == pytest.approx(expected, abs=4.0 * error)
    assert 0.0 < case.volume.volume < TableCase(CIRCLES, rotation).volume.volume
    assert case.volume.gradient == {}


def test_gradient_of_the_volume_is_that_of_differences() -> None:
    rotation = Rotation.from_rotvec([0.2, -0.1, 0.3]).as_matrix()
    table = changed(CIRCLES, shortest_mm=(210.0, 215, 220, 225, 230, 235))
    gradient, step = TableCase(table, rotation).volume.gradient, 1e-3

    def volume(field: str, index: tuple[int, ...], by: float) -> float:
        values = np.array(getattr(table, field))
        values[index] += by
        return TableCase(changed(table, **{field: values}), rotation).volume.volume

    fields = {"base": "base_mm", "platform": "platform_mm"}
    size = max(map(abs, gradient.values()))
    assert len(gradient) == 6 * (3 + 3 + 2)
    for name, rate in gradient.items():
        kind, leg, last = name.split()
        field = fields.get(kind, "shortest_mm" if last == "minimum" else "longest_mm")
        index = (int(leg) - 1, *(["xyz".index(last)] if kind in fields else []))
        expected = (volume(field, index, step) - volume(field, index, -step)) / (2.0 * step)
        assert rate == pytest.approx(expected, rel=1e-5, abs=1e-5 * size), name


def test_twin_has_the_volume_of_the_design_in_one_mode_at_equal_limits() -> None:
    far = 10.0 * OPTIMAL.reach
    free = OPTIMAL.with_limits(box=None, guide=None, d2=(0.0, far), d4=(0.0, far))
    signs = [limit for limit in Workspace(free).limits if isinstance(limit, HalfSpace)]
    assert len(signs) == 3
    unit = OPTIMAL.unit_mm
    longest = unit * np.array([OPTIMAL.reach, far, far, far, far, OPTIMAL.reach])
    for a2x in (5.0, 12.0, 26.0):
        twin = changed(six_four_twin(OPTIMAL, a2x), longest_mm=longest)
        limits = (*twin.limits(OPTIMAL.home_pose.rotation), *signs)
        volume = region_volume(region_of(limits))[0] / unit**3
        assert volume == pytest.approx(workspace_volume(free).volume, rel=1e-9)


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_jacobian_is_that_of_differences(table: SixLegged) -> None:
    home = table.home_pose
    position, rotation = np.array(home.position), home.rotation
    assert_is_jacobian(
        lambda p, r: TablePoses(table, p, r).lengths,
        table.home_poses.jacobian,
        position,
        rotation,
        table.reach,
        1e-6,
    )


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_lengths_and_forces_are_those_of_mujoco(table: SixLegged) -> None:
    points = zip(table.base_mm, table.platform_mm, strict=True)
    at, sites = table.home, [(f"a{k}", a, f"b{k}", b) for k, (a, b) in enumerate(points)]

    def text(values: tuple[float, ...]) -> str:
        return " ".join(map(repr, values))

    def site(name: str, place: tuple[float, ...]) -> str:
        return f'<site name="{name}" pos="{text(place)}"/>'

    tendons = [
        f'<spatial name="t{a}"><site site="{a}"/><site site="{b}"/></spatial>'
        for a, _, b, _ in sites
    ]
    motors = "".join(f'<motor tendon="t{a}"/>' for a, *_ in sites)
    model = engine.MjModel.from_xml_string(
        f"""<mujoco><option gravity="0 0 0"/><worldbody>
        {"".join(site(a, p) for a, p, _, _ in sites)}
        <body name="platform" pos="{text(at.position_mm)}" quat="{text(at.quaternion)}">
        <freejoint/><geom size="1"/>{"".join(site(b, p) for _, _, b, p in sites)}</body>
        </worldbody><tendon>{"".join(tendons)}</tendon><actuator>{motors}</actuator></mujoco>"""
    )
    data = engine.MjData(model)
    engine.mj_forward(model, data)
    np.testing.assert_allclose(data.ten_length, table.home_lengths, rtol=1e-12)
    load = np.array([3.0, -2.0, 5.0, 400.0, 100.0, -300.0])
    # A motor's force pushes its length up, as the actuator's does.
    data.ctrl[:] = -table.home_poses.twists.T @ load
    data.xfrc_applied[1] = load
    engine.mj_forward(model, data)
    np.testing.assert_allclose(data.qfrc_smooth, 0.0, atol=1e-6 * np.abs(data.qfrc_actuator).max())
    unit = np.random.default_rng(0).normal(size=(100_000, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    forces = np.abs(unit @ table.home_poses.twists[:3]).max()
    assert forces == pytest.approx(float(table.home_poses.force_per_newton), rel=1e-3)
    assert forces <= table.home_poses.force_per_newton
    corners = np.array([*itertools.product((-1.0, 1.0), repeat=6)])
    errors = np.linalg.norm(corners @ table.home_poses.twists[:3].T, axis=1).max()
    assert errors == pytest.approx(float(table.home_poses.error_per_joint_error), rel=1e-12)


def test_forces_per_newton_of_a_design_are_those_of_its_reactions() -> None:
    case = Case(OPTIMAL)
    unit = np.random.default_rng(0).normal(size=(100_000, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    loads = np.concatenate([unit, np.zeros_like(unit)], axis=1)
    forces = np.abs(loads @ case.home_indices.twists).max()
    assert forces == pytest.approx(float(case.home_indices.force_per_newton), rel=1e-3)


def distinct(positions: FloatArray, rotations: FloatArray) -> list[FloatArray]:
    """Return poses (12,) that differ from each other, by positions in mm and rotations."""
    found: list[FloatArray] = []
    for pose in np.concatenate([positions, rotations.reshape(-1, 9)], axis=1):
        if all(np.abs(other - pose).max() > 1e-3 for other in found):
            found.append(pose)
    return found


def test_dietmaier_has_forty_poses_with_the_lengths_of_home() -> None:
    table, random = TABLES["Dietmaier"], np.random.default_rng(0)
    starts = random.uniform(-300.0, 300.0, (8_000, 3))
    turns = np.asarray(Rotation.random(len(starts), rng=random).as_matrix())
    found = table.forward(table.home_lengths, starts, turns)
    poses = distinct(found.position[found.closes], found.rotation[found.closes])
    assert len(poses) == 40
    for pose in poses:
        lengths = TablePoses(table, pose[:3], pose[3:].reshape(3, 3)).lengths
        np.testing.assert_allclose(lengths, table.home_lengths, rtol=1e-9)


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_forward_kinematics_from_home_find_a_pose_nearby(table: SixLegged) -> None:
    home, random = table.home_pose, np.random.default_rng(0)
    position = np.array(home.position) + random.uniform(-0.01, 0.01, (20, 3)) * table.reach
    turns = Rotation.from_rotvec(random.uniform(-0.02, 0.02, (20, 3))).as_matrix()
    poses = TablePoses(table, position, turns @ home.rotation)
    for lengths, p, r in zip(poses.lengths, position, poses.rotation, strict=True):
        found = table.forward(lengths)
        assert found.closes
        np.testing.assert_allclose(found.position, p, atol=1e-6)
        np.testing.assert_allclose(found.rotation, r, atol=1e-8)
    assert not table.forward((1.0, *table.home_lengths[1:])).closes


def test_griffis_and_duffy_moves_with_all_legs_locked() -> None:
    table = TABLES["Griffis and Duffy"]
    elsewhere = float(np.prod(table.home_poses.singular_values))
    position: FloatArray = np.array([0.0, 0.0, 200.0])
    rotation: FloatArray = np.asarray(Rotation.from_rotvec([0.0, 0.0, 0.4]).as_matrix())
    pose = TablePoses(table, position, rotation)
    lengths = pose.lengths
    last: FloatArray | None = None
    for _ in range(40):
        kernel: FloatArray = np.linalg.svd(pose.homogeneous)[2][-1]
        kernel = kernel if last is None or kernel @ last > 0.0 else -kernel
        turn = np.asarray(Rotation.from_rotvec(0.02 * kernel[3:]).as_matrix())
        near: FloatArray = position + 0.02 * table.base_size * kernel[:3]
        found = table.forward(lengths, near, turn @ rotation)
        position, rotation, last = found.position, found.rotation, kernel
        pose = TablePoses(table, position, rotation)
        assert found.closes
        assert np.prod(pose.singular_values) < 1e-9 * elsewhere
    assert np.linalg.norm(position - [0.0, 0.0, 200.0]) > 50.0


def test_measures_of_a_table_grow_with_it() -> None:
    small, large = (
        OCTAHEDRAL,
        table_of(
            **{
                name: 2.0 * np.array(getattr(OCTAHEDRAL, name))
                for name in ("base_mm", "platform_mm", "shortest_mm", "longest_mm")
            },
            home=TableHome((0.0, 0.0, 2.0 * OCTAHEDRAL.home.position_mm[2])),
        ),
    )
    values = [TableCase(table).measurements for table in (small, large)]
    assert tuple(values[0].values) == TABLE_MEASURES
    for name in TABLE_MEASURES:
        one, two = (each[name] for each in values)
        assert one is not None
        assert two == pytest.approx(one * 2.0 ** CATALOGUE[name].power, rel=1e-6), name


def test_greatest_tilt_and_share_at_home_are_those_of_its_poses() -> None:
    case = TableCase(OCTAHEDRAL)
    turns = Rotation.random(40_000, rng=np.random.default_rng(5)).as_matrix()
    share = case.holds(OCTAHEDRAL.home.position_mm, turns).mean()
    assert case.home_share == pytest.approx(share, abs=4.0 * (share / len(turns)) ** 0.5)
    # The platform tilts by so much about every horizontal axis, and by no more about one of them.
    for tilt, is_possible in ((case.home_tilt - 1e-6, True), (case.home_tilt + 1e-3, False)):
        angles = np.radians(np.arange(0.0, 360.0, 5.0))
        axes = np.stack([-np.sin(angles), np.cos(angles), np.zeros(72)], axis=1)
        tilted = Rotation.from_rotvec(np.radians(tilt) * axes).as_matrix()
        assert case.holds(OCTAHEDRAL.home.position_mm, tilted).all() == is_possible


def test_made_equal_has_the_stroke_and_the_cones_of_the_design() -> None:
    design = PRESETS["buildable"].with_limits(swing=Swing(a1=40.0, b1=35.0))
    stroke = design.unit_mm * max(np.ptp(design.length_range(n)) for n in ("l1", "d2", "d4", "l4"))
    for table in TABLES.values():
        equal = made_equal(table, design)
        strokes = np.subtract(equal.longest_mm, equal.shortest_mm)
        np.testing.assert_allclose(strokes, stroke)
        assert equal.cones_deg == (35.0,) * 6
        middle = 0.5 * np.add(equal.longest_mm, equal.shortest_mm)
        is_free = np.array(equal.shortest_mm) > 0.0
        np.testing.assert_allclose(middle[is_free], table.home_lengths[is_free])
    assert made_equal(CIRCLES, OPTIMAL).cones_deg is None
    # Its source tells what was made equal, also where it told nothing before.
    told = made_equal(changed(CIRCLES, source=""), design).source
    assert told.startswith("made equal to buildable: strokes of ")
    assert made_equal(CIRCLES, design).source == f"{CIRCLES.source}; {told}"


@pytest.mark.parametrize(
    "design",
    [
        OPTIMAL.with_limits(swing=Swing(a1=180.0)),
        changed(OPTIMAL, unit_mm=1e4),
        OPTIMAL.with_limits(**dict.fromkeys(("l1", "d2", "d4", "l4"), (5.0, 5.0))),
    ],
    ids=["swing of half a turn", "unit of ten metres", "no stroke"],
)
def test_tables_are_made_equal_to_every_design(design: Design) -> None:
    for table in (*TABLES.values(), changed(CIRCLES, source="long " * 180)):
        equal = made_equal(table, design)
        assert equal.source.endswith(("no cones", "cones of 179°"))
        assert made_equal(equal, design).longest_mm == equal.longest_mm
    # A leg without length at home has no axis of a cone.
    tips = np.array(CIRCLES.platform_mm) + CIRCLES.home.position_mm
    base = np.vstack([tips[:1], CIRCLES.base_mm[1:]])
    touching = changed(CIRCLES, base_mm=base, shortest_mm=(0.0,) * 6)
    assert made_equal(touching, OPTIMAL.with_limits(swing=Swing(a1=40.0))).cones_deg is None
    assert "leg 1 has no length at home" in refusal(
        lambda: changed(touching, cones_deg=(30.0,) * 6)
    )


def test_narrow_cones_leave_nodes() -> None:
    case = TableCase(changed(OCTAHEDRAL, cones_deg=(1.0,) * 6))
    assert len(case.node_positions) > 100
    assert case.measurements["mean_transmission_index"] == pytest.approx(0.936, abs=2e-3)


def test_indices_know_no_stroke() -> None:
    longer = changed(OCTAHEDRAL, longest_mm=(1e5,) * 6)
    for name in ("inverse_condition", "manipulability", "transmission_index"):
        values = [getattr(each.home_poses, name) for each in (longer, OCTAHEDRAL)]
        assert values[0] == pytest.approx(values[1], rel=1e-12)


def test_tables_measure_the_same_things_as_designs() -> None:
    values, infinite = values_of(Case(OPTIMAL), TABLE_MEASURES)
    assert not infinite
    assert values["mean_transmission_index"] == pytest.approx(0.165, abs=1e-3)


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_file_gives_the_table_back(table: SixLegged, tmp_path: Path) -> None:
    path = tmp_path / "table.json"
    path.write_bytes(msgspec.json.encode(table))
    assert load_table(path) == load_table(table.name) == table


HAL = """\
# [TRAJ] LINEAR_UNITS = inch
loadrt genhexkins
setp genhexkins.base.0.x -22.950
setp genhexkins.base.0.y  13.250   # of the first
# setp genhexkins.base.0.y  99
setp genhexkins.platform.5.y  -4.884
setp genhexkins.limit-iterations 120
"""


def test_settings_of_linuxcnc_are_read() -> None:
    default = TABLES["LinuxCNC default"]
    table = decode_table(HAL.replace("# [TRAJ] ", "").encode(), "machine.hal")
    np.testing.assert_allclose(table.base_mm, default.base_mm, atol=1e-9)
    np.testing.assert_allclose(table.platform_mm, default.platform_mm, atol=1e-9)
    assert "inches, 33 of 36 of them its defaults; assumed are a level home at z" in table.source
    metric = decode_table(b"setp genhexkins.base.3.z 1.5\nsetp genhexkins.base.4.z 1.5", "m.hal")
    np.testing.assert_allclose(np.array(metric.base_mm)[3:5, 2], 1.5)
    np.testing.assert_allclose(
        np.array(metric.base_mm)[:, :2] * 25.4, np.array(default.base_mm)[:, :2]
    )
    for text, words in (
        ("setp genhexkins.base.6.x 1", r"genhexkins.base.6.x is unknown; legs are 0 to 5"),
        ("setp genhexkins.base.0.x here", "genhexkins.base.0.x must be a number; got 'here'"),
        ("setp genhexkins.base.0.x nan", "genhexkins.base.0.x must be a finite number; got nan"),
        ("setp motion.x 1", "no table on six legs: give JSON with base_mm"),
        (
            "setp genhexkins.base.0.x\nsetp genhexkins.base.0.y 1",
            "'setp genhexkins.base.0.x' cannot",
        ),
        ("setp genhexkins.base.0.x 1\nLINEAR_UNITS = cm", "LINEAR_UNITS is cm; give one of mm"),
        ("# LINEAR_UNITS = inch\nLINEAR_UNITS = mm", "LINEAR_UNITS is inch and mm; give one"),
        ("", "empty or truncated"),
    ):
        assert words in refusal(decode_table, text.encode(), "machine.hal")


@pytest.mark.parametrize(
    ("line", "unit"),
    [
        ("LINEAR_UNITS = mm", 1.0),
        ("LINEAR_UNITS = imperial", 25.4),
        ("# LINEAR_UNITS = Inch", 25.4),
        ("# LINEAR_UNITS = inch or mm: choose one", 1.0),
        ("LINEAR_UNITS = inch  # of the INI file", 25.4),
    ],
)
def test_unit_of_settings_is_that_of_its_line(line: str, unit: float) -> None:
    text = f"{line}\n  genhexkins.base.0.x = -22.5\nsetp genhexkins.base.0.y\t1.3e1\r\n"
    table = decode_table(text.encode(), "machine.hal")
    np.testing.assert_allclose(table.base_mm[0][:2], (-22.5 * unit, 13.0 * unit))
    assert "34 of 36 of them its defaults" in table.source


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("base_mm", [[0, 0, 0]] * 5, "base_mm"),
        ("longest_mm", [1e7] * 6, "must not exceed 100000"),
        ("longest_mm", [300.0] * 6, "leg 1 has 304.138 mm at home, which must lie within"),
        ("shortest_mm", [-1.0] * 6, "shortest_mm -1"),
        ("cones_deg", [0.0] * 6, "cones_deg are half-angles above 0"),
        ("base_mm", [[200.0, 0, 0]] * 6, "every pose is singular"),
        ("home", {"position_mm": [0, 0, 250], "quaternion": [0, 0, 0, 0]}, "must not be all zeros"),
        ("platform", [], "platform is unknown, did you mean platform_mm?"),
        ("name", " ", "name must be one printable line"),
        ("source", "\x1b[31m", "source must be one printable line"),
    ],
)
def test_table_that_nobody_builds_is_refused(field: str, value: object, words: str) -> None:
    fields = msgspec.to_builtins(OCTAHEDRAL) | {field: value}
    if field == "base_mm" and words.startswith("every"):
        fields |= {"shortest_mm": [1.0] * 6, "longest_mm": [900.0] * 6}
    assert words in refusal(decode_table, msgspec.json.encode(fields), "table.json")


def test_unknown_table_is_refused_with_the_names_of_all() -> None:
    for name in ("hexapod", "long" * 100):
        assert "the packaged tables are Dietmaier, Griffis and Duffy" in refusal(load_table, name)
    positions, turns = np.zeros((4, 3)), np.tile(np.eye(3), (5, 1, 1))
    assert "do not broadcast" in refusal(TablePoses, CIRCLES, positions, turns)
    assert "nodes on an axis must lie within 2" in refusal(
        lambda: TableCase(CIRCLES, nodes=0).node_positions
    )
    assert "home must be of type TableHome" in refusal(lambda: changed(CIRCLES, home=(0.0,) * 3))
    with pytest.raises(InputError):
        CIRCLES.forward([1.0, 2.0])
