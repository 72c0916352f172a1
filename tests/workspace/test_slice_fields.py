"""Fields over slices of the workspace, against the snapshot of each pose."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from explorer import PRESETS, InputError, Pose, evaluate, nearest_singularities
from explorer.singularity.ellipsoids import singular_plane_distances
from explorer.workspace.slices.fields import FIELDS, Field, field_at, slice_field

OPTIMAL = PRESETS["paper-optimal"]
HOME = OPTIMAL.home_pose


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_slice_field_has_the_value_of_each_position(field: Field, axis: str) -> None:
    result = slice_field(OPTIMAL, HOME.rotation, field, axis=axis, level=4.0, steps=9)
    assert result.values.shape == result.inside.shape == (len(result.rows), len(result.columns))
    assert max(result.values.shape) == 9
    for i, j in ((0, 0), (len(result.rows) // 2, len(result.columns) // 2), (-1, -1)):
        others = iter((result.columns[j], result.rows[i]))
        x, y, z = (4.0 if each == axis else float(next(others)) for each in "xyz")
        snapshot = evaluate(OPTIMAL, Pose((x, y, z), HOME.quaternion))
        expected = {
            "margin": float(np.abs(snapshot.margins).min()),
            "condition": snapshot.inverse_condition,
            "ball": float(singular_plane_distances((x, y, z), HOME.rotation).min()),
            "distance": min(each.distance for each in snapshot.nearest),
        }[field]
        assert result.values[i, j] == pytest.approx(expected, abs=1e-9)
        if not any(str(each).startswith("margin") for each in snapshot.violations):
            assert result.inside[i, j] == (not snapshot.violations)


def test_field_of_a_batch_equals_that_of_its_poses() -> None:
    positions = np.random.default_rng(0).uniform(-5.0, 5.0, (3, 4, 3))
    rotations = Rotation.random(12, random_state=1).as_matrix().reshape(3, 4, 3, 3)
    for field in FIELDS:
        assert field_at(OPTIMAL, positions, rotations, field).shape == (3, 4)
    distances = field_at(OPTIMAL, positions, rotations, "distance")
    alone = nearest_singularities(OPTIMAL, Pose.of(positions[1, 2], rotations[1, 2]))
    assert distances[1, 2] == pytest.approx(min(each.distance for each in alone))


def test_slice_field_of_unusable_arguments_is_refused() -> None:
    r = HOME.rotation
    with pytest.raises(InputError, match="no field"):
        slice_field(OPTIMAL, r, "colour", level=1.0)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="x, y or z"):
        slice_field(OPTIMAL, r, "margin", axis="w", level=1.0)
    with pytest.raises(InputError, match="steps"):
        slice_field(OPTIMAL, r, "margin", level=1.0, steps=1)
    with pytest.raises(InputError, match="extent"):
        slice_field(OPTIMAL, r, "margin", level=1.0, extent=([0, 0, 0], [1, 0, 1]))
    with pytest.raises(InputError, match="position"):
        field_at(OPTIMAL, [math.nan, 0, 0], r, "margin")
