"""Kernels of tilts, shares, forces and regions give the same interpreted and compiled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from machines import FULL

from explorer import PRESETS, Configuration, forward, inverse_dynamics
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import KERNELS, warm
from explorer.singularity.nearest import nearest_singular_poses
from explorer.statics.forces import actuator_forces
from explorer.statics.load_cases import largest_shares, limit_values, load_case, settle_on_limit
from explorer.workspace.orientations.share import orientation_share
from explorer.workspace.orientations.tilts import greatest_tilts, tilt_map, torsion_range
from explorer.workspace.slices.column_volume import volume_of_columns
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]
ROTATION = OPTIMAL.home_pose.rotation
POSITION = (10.0, 5.0, 9.0)


def positions() -> FloatArray:
    return np.random.default_rng(3).uniform((4.0, 1.0, 4.0), (16.0, 9.0, 14.0), (12, 3))


def joints() -> FloatArray:
    return Configuration(OPTIMAL, positions(), ROTATION).joints


def tilts() -> FloatArray:
    found = tilt_map(OPTIMAL, POSITION, azimuths=9)
    torsions = torsion_range(OPTIMAL, POSITION, azimuth=20.0, tilt=10.0)
    return np.array([*found.tilts, torsions.low, torsions.high])


def regions() -> FloatArray:
    case = load_case(FULL, ROTATION, np.zeros(6))
    # The last positions are beyond a singular plane.
    at = np.vstack([positions(), positions()[:3] * [1.0, 1.0, -0.1]])
    shares, parts = largest_shares(case, ROTATION, at)
    values = limit_values(case, ROTATION, np.arange(20), at)
    low, high = np.floor(at / 2.0) * 2.0, np.ceil(at / 2.0) * 2.0
    settled = settle_on_limit(case, ROTATION, 2, 0.7 * low + 0.3 * high, low, np.full(3, 2.0))
    return np.concatenate([shares, parts.astype(np.float64), values.ravel(), settled.ravel()])


def columns() -> FloatArray:
    region = Workspace(FULL.with_limits(margin=0.0), ROTATION).region
    case = load_case(FULL, ROTATION, np.zeros(6))
    found = volume_of_columns(region, 0.5, case, ROTATION)
    return np.array([found.volume, found.error, *found.box.ravel()])


CASES: dict[str, Callable[[], FloatArray]] = {
    "tilts": tilts,
    "greatest tilts": lambda: greatest_tilts(OPTIMAL, positions()[:2], azimuths=5),
    "share": lambda: np.array([orientation_share(OPTIMAL, POSITION, 200).share]),
    "regions": regions,
    "columns": columns,
    "forward": lambda: forward(OPTIMAL, joints()).position,
    "nearest": lambda: nearest_singular_poses(Configuration(OPTIMAL, positions(), ROTATION))[0],
    "forces": lambda: actuator_forces(OPTIMAL, positions(), ROTATION, np.arange(1.0, 7.0)),
    "motion": lambda: inverse_dynamics(
        OPTIMAL, positions(), ROTATION, np.arange(1.0, 7.0), np.arange(7.0, 1.0, -1.0)
    ),
}


@pytest.mark.parametrize("name", list(CASES))
def test_interpreted_and_compiled_kernels_agree(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    warm()
    compiled = CASES[name]()
    monkeypatch.setattr("explorer.numerics.compiled.MANY_ROWS", 10**9)
    for kernel in KERNELS:
        monkeypatch.setattr(kernel, "_compiled", None)
    np.testing.assert_allclose(CASES[name](), compiled, rtol=1e-9, atol=1e-9)
    assert not any(kernel.ready for kernel in KERNELS)
