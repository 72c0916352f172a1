"""Paths over time: on the path, no actuator too fast, and the same read back from a table."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from tool_moves import tool_move

from explorer import PRESETS, InputError, Pose, inverse, rotation_from_quaternion as rotation_of
from explorer.export.tables import trajectory_csv
from explorer.paths.trajectory import trajectory

DESIGN = PRESETS["paper-optimal"]
HOME = DESIGN.home_pose


def random_path(seed: int, corners: int) -> list[Pose]:
    rng = np.random.default_rng(seed)
    return [
        Pose.of(rng.uniform(-10.0, 10.0, 3), Rotation.random(random_state=rng).as_matrix())
        for _ in range(corners)
    ]


@given(st.integers(0, 2**32), st.integers(2, 6), st.sampled_from((0.1, 50.0)), st.booleans())
def test_trajectory_random_path_has_even_samples_on_it(
    seed: int, corners: int, speed: float, has_tool: bool
) -> None:
    """Also on that of a tool, which goes straight from corner to corner."""
    path, tool = random_path(seed, corners), np.array([1.0, -2.0, 6.0]) * has_tool
    found = trajectory(DESIGN, path, speed=speed, samples=301, tool=tool if has_tool else None)
    assert found.time.shape == (301,)
    assert_allclose(np.diff(found.time), found.duration / 300.0, rtol=1e-9)
    assert (found.tool_position is not None) == has_tool
    assert (np.diff(found.at) > 0.0).all()
    assert (found.at[0], found.at[-1]) == (0.0, corners - 1.0)
    for index in range(0, 301, 25):
        move = min(int(found.at[index]), corners - 2)
        p, r = tool_move(path[move], path[move + 1], found.at[index] - move, tool)
        assert_allclose(found.position[index], p[0], atol=1e-11)
        assert_allclose(rotation_of(found.quaternion[index]), r[0], atol=1e-11)
        if found.tool_position is not None:
            assert_allclose(found.tool_position[index], p[0] + r[0] @ tool, atol=1e-11)
    joints = inverse(DESIGN, found.position, rotation_of(found.quaternion))
    assert_allclose(found.joints, joints, atol=1e-9)
    # No sudden change of sign.
    assert ((found.quaternion[1:] * found.quaternion[:-1]).sum(axis=-1) >= 0.0).all()


@given(st.integers(0, 2**32), st.sampled_from((0.1, 2.0)))
def test_trajectory_fastest_actuator_has_the_speed(seed: int, speed: float) -> None:
    found = trajectory(DESIGN, random_path(seed, 3), speed=speed, samples=2001)
    rates = np.abs(np.diff(found.joints, axis=0)).max(axis=-1) / np.diff(found.time)
    # Speeds are even over a thirty-second part of a move, and corners come between samples.
    assert np.median(rates) == pytest.approx(speed, rel=0.1)
    assert rates.mean() <= 1.02 * speed


def test_trajectory_speed_is_in_units_per_second() -> None:
    x, y, z = HOME.position
    # Along the guide both carriages go as far as the platform, and no leg goes farther.
    path = [HOME, Pose((x + 3.0, y, z), HOME.quaternion)]
    assert trajectory(DESIGN, path, speed=1.5).duration == pytest.approx(2.0)
    assert trajectory(DESIGN, path).duration == pytest.approx(3.0 / (0.1 * DESIGN.reach))


def test_trajectory_csv_reads_back_to_the_last_bit() -> None:
    found = trajectory(DESIGN, random_path(2, 3), samples=50)
    head, *rows = csv.reader(trajectory_csv(found).splitlines())
    joints = [f"{name} [10 mm]" for name in ("l1", "d1", "d2", "d3", "d4", "l4")]
    position = [f"{name} [10 mm]" for name in "xyz"]
    assert head == ["time_s", *joints, *position, "qw", "qx", "qy", "qz"]
    values = np.array([[float(word) for word in row] for row in rows])
    expected = (found.time[:, None], found.joints, found.position, found.quaternion)
    assert (values == np.concatenate(expected, axis=1)).all()
    of_tool = trajectory(DESIGN, random_path(2, 3), samples=9, tool=(0.0, 1.0, 2.0))
    head, *rows = csv.reader(trajectory_csv(of_tool).splitlines())
    assert head[-4:] == ["qz", *(f"tool_{axis} [10 mm]" for axis in "xyz")]
    assert of_tool.tool_position is not None
    assert [[float(word) for word in row[-3:]] for row in rows] == of_tool.tool_position.tolist()


def test_trajectory_bad_input_is_refused() -> None:
    with pytest.raises(InputError, match="two poses"):
        trajectory(DESIGN, [HOME])
    with pytest.raises(InputError, match="samples"):
        trajectory(DESIGN, [HOME, HOME], samples=1)
    for speed in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="speed"):
            trajectory(DESIGN, [HOME, HOME], speed=speed)
