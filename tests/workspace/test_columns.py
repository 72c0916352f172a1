"""Volumes by columns beside exact slices, finer columns and columns along another axis."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from long_cases import long_after
from machines import FULL, six
from scipy.spatial.transform import Rotation

from explorer import PRESETS, Actuators, Design, Guide, Limits, Payload, Pose, Struts, Tool
from explorer.mechanism.design import Swing
from explorer.numerics.arrays import FloatArray
from explorer.statics.load_cases import load_case
from explorer.workspace.limits.constraints import BallOrCylinder, Cone
from explorer.workspace.limits.region import Region, region_of
from explorer.workspace.slices.column_volume import ColumnVolume, volume_of_columns
from explorer.workspace.slices.volume import COLUMN_ERROR, region_volume
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]
TOLERANCE, FINE = 1e-3, 5e-5
NO_LOAD = np.zeros(6)


def random_design(rng: np.random.Generator) -> tuple[Design, FloatArray]:
    """Return a design with the signs of home, and an orientation."""
    a3 = rng.uniform(0.7, 1.3, 2) * OPTIMAL.a3
    turn = Rotation.from_rotvec(rng.normal(size=3) * 0.4).as_matrix()
    rotation = turn @ OPTIMAL.home_pose.rotation
    home = Pose.of(OPTIMAL.home_pose.position, rotation)
    design = msgspec.structs.replace(OPTIMAL, a3=(float(a3[0]), float(a3[1])), home=home)
    return design.with_limits(margin=0.0), rotation


def random_loaded(seed: int) -> tuple[Region, FloatArray, FloatArray]:
    """Return the region, the row of the load and the orientation of a random machine."""
    rng = np.random.default_rng(seed)
    design, rotation = random_design(rng)
    design = msgspec.structs.replace(
        design,
        tool=Tool((1.0, -1.0, 2.0)),
        payload=Payload(rng.uniform(0.1, 2.0), force_n=rng.uniform(1.0, 9.0) * (seed % 3 == 0)),
        actuators=Actuators(push_n=six(np.exp(rng.uniform(3.0, 5.0, 6)))),
        struts=Struts(moment_nm=float(np.exp(rng.uniform(0.5, 2.5)))),
        guide=Guide(force_n=float(np.exp(rng.uniform(3.0, 4.5)))),
    )
    load = rng.normal(size=6) * (9.0, 9.0, 9.0, 20.0, 20.0, 20.0) * (seed % 4 > 0)
    region = Workspace(design, rotation).region
    return region, load_case(design, rotation, load), rotation


def check(found: ColumnVolume, true: float, error: float) -> None:
    assert found.volume == pytest.approx(true, abs=found.error + error + 1e-12)
    assert found.error <= TOLERANCE * found.volume


@pytest.mark.parametrize("seed", long_after(12, range(60)))
def test_without_a_load_the_volume_is_that_of_slices(seed: int) -> None:
    design, rotation = random_design(np.random.default_rng(seed))
    region = Workspace(design, rotation).region
    volume, error, _ = region_volume(region)
    check(volume_of_columns(region, TOLERANCE), volume, error)


@pytest.mark.parametrize("seed", long_after(12, range(60)))
def test_with_a_load_the_volume_is_that_of_finer_columns(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    region, case, rotation = random_loaded(seed)
    found = volume_of_columns(region, TOLERANCE, case, rotation)
    monkeypatch.setattr("explorer.workspace.slices.column_volume.PANELS", 40)
    fine = volume_of_columns(region, FINE, case, rotation)
    check(found, fine.volume, fine.error)
    assert (found.box[0] <= fine.box[1]).all()


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("half_angle", [0.5, 1.2, 0.5 * np.pi, 2.5])
def test_with_a_cone_from_its_centre_a_ball_keeps_the_share_of_its_directions(
    half_angle: float, flat: bool
) -> None:
    rng = np.random.default_rng(int(10.0 * half_angle))
    centre, axis = rng.normal(size=3), rng.normal(size=3) * ((0.0, 1.0, 1.0) if flat else 1.0)
    axis /= np.linalg.norm(axis)
    ball = BallOrCylinder("", centre, 2.0, is_ball=True, inside=True)
    share = half_angle / np.pi if flat else 0.5 - 0.5 * np.cos(half_angle)
    region = region_of([ball, Cone("", centre, axis, half_angle, flat)])
    volume, error, gradient = region_volume(region)
    assert volume == pytest.approx(4.0 / 3.0 * np.pi * 8.0 * share, abs=error)
    assert error <= COLUMN_ERROR * volume
    assert not gradient


@pytest.mark.parametrize("half_angle", [40.0, 90.0, 120.0])
def test_with_cones_the_volume_is_that_of_finer_columns_and_of_a_grid(
    half_angle: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits = Limits(margin=0.0, box=OPTIMAL.limits.box, swing=Swing(a1=half_angle, b2=half_angle))
    design = msgspec.structs.replace(FULL, limits=limits)
    workspace = Workspace(design, OPTIMAL.home_pose.rotation)
    found = volume_of_columns(workspace.region, TOLERANCE)
    lows, highs = workspace.region.ends
    nodes = (np.indices((120,) * 3).reshape(3, -1).T + 0.5) / 120.0
    counted = workspace.contains(lows + (highs - lows) * nodes).mean() * np.prod(highs - lows)
    monkeypatch.setattr("explorer.workspace.slices.column_volume.PANELS", 40)
    fine = volume_of_columns(workspace.region, FINE)
    assert fine.volume > 100.0
    check(found, fine.volume, fine.error)
    assert fine.volume == pytest.approx(counted, rel=3e-3)


def test_a_load_that_is_held_nowhere_leaves_no_volume() -> None:
    region, case, rotation = random_loaded(1)
    case[9:15] = [1e4, 1e4, -1e4, 0.0, 0.0, 0.0]
    assert volume_of_columns(region, TOLERANCE, case, rotation).volume == 0.0


def test_a_part_between_columns_is_found_about_a_known_position() -> None:
    design = OPTIMAL.with_limits(margin=0.0, box=((0.0, -12.0, 0.0), (20.0, 22.0, 18.0)))
    rotation, about = design.home_pose.rotation, np.array([5.01, 3.01, 8.01])
    wide, cylinder = Workspace(design, rotation).limits, BallOrCylinder("", about, 0.02, True, True)
    region = region_of([*wide, cylinder])
    check(volume_of_columns(region, TOLERANCE, about=about), 4.0 / 3.0 * np.pi * 8e-6, 0.0)
