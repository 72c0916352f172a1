"""Laws of every function of a pose: batches, empty batches, units, and refused poses."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refusal
from strategies import Case, ordinary_cases

from explorer import (
    PRESETS,
    Design,
    inverse,
    jacobian,
    leg_clearances,
    margins,
    rotation_from_quaternion,
    stratum,
)
from explorer.measures.snapshot import PoseIndices
from explorer.mechanism.configuration import WITHOUT_TOOL, Configuration
from explorer.mechanism.kinematics import determinant, tetrahedron_volumes
from explorer.numerics.arrays import FloatArray
from explorer.singularity.nearest import nearest_singular_poses

EYE = np.eye(3)


@dataclass(frozen=True)
class PoseFunction:
    """A function of a design, positions (..., 3) and rotations (..., 3, 3).

    It has the trailing axes of its result, and the exponent of length in the result's unit.
    """

    name: str
    value: Callable[[Design, Any, Any], Any]
    shape: tuple[int, ...]
    power: int


def homogeneous_jacobian(design: Design, p: FloatArray, r: FloatArray) -> FloatArray:
    return jacobian(design, p, r) / np.array([1.0] * 3 + [design.reach] * 3)


FUNCTIONS = (
    PoseFunction("inverse", inverse, (6,), 1),
    PoseFunction("margins", lambda _, p, r: margins(p, r), (3,), 1),
    PoseFunction("jacobian", homogeneous_jacobian, (6, 6), 0),
    PoseFunction("condition", lambda d, p, r: Configuration(d, p, r).inverse_condition, (), 0),
    PoseFunction("transmissions", lambda d, p, r: PoseIndices(d, p, r).transmissions, (6,), 0),
    PoseFunction("manipulability", lambda d, p, r: PoseIndices(d, p, r).manipulability, (), 0),
    PoseFunction(
        "determinant", lambda d, p, r: determinant(d, inverse(d, p, r), margins(p, r)), (), 3
    ),
    PoseFunction("volumes", lambda d, p, r: tetrahedron_volumes(d, margins(p, r)), (3,), 3),
    PoseFunction("stratum", lambda _, p, r: stratum(p, r), (4,), 0),
    PoseFunction(
        "nearest", lambda d, p, r: nearest_singular_poses(Configuration(d, p, r)).distance, (3,), 1
    ),
    PoseFunction(
        "clearance", lambda d, p, r: leg_clearances(Configuration(d, p, r)).clearance, (6,), 1
    ),
    PoseFunction(
        "points", lambda d, p, r: leg_clearances(Configuration(d, p, r)).points, (6, 2, 3), 1
    ),
)
each_function = pytest.mark.parametrize("function", FUNCTIONS, ids=lambda function: function.name)


@each_function
def test_pose_function_of_a_batch_equals_single_calls(function: PoseFunction) -> None:
    design, rng = PRESETS["paper-optimal"], np.random.default_rng(7)
    p = rng.uniform(-10.0, 10.0, (2, 1, 3))
    r = rotation_from_quaternion(rng.normal(size=(3, 4)))
    batch = function.value(design, p, r)
    assert batch.shape == (2, 3, *function.shape)
    for i, j in np.ndindex(2, 3):
        assert_allclose(batch[i, j], function.value(design, p[i, 0], r[j]), rtol=1e-9, atol=1e-12)
    empty = function.value(design, np.empty((0, 2, 3)), np.empty((0, 2, 3, 3)))
    assert empty.shape == (0, 2, *function.shape)


@given(ordinary_cases(), st.sampled_from([1e-3, 1e3]))
def test_pose_functions_in_another_unit_scale_by_their_power(case: Case, factor: float) -> None:
    other = case.scaled(factor)
    for function in FUNCTIONS:
        expected = function.value(case.design, case.position, case.rotation)
        value = function.value(other.design, other.position, other.rotation)
        scaled, atol = value / factor**function.power, 1e-9 * case.size**function.power
        assert_allclose(scaled, expected, rtol=1e-9, atol=atol, err_msg=function.name)


@given(ordinary_cases())
def test_another_tool_keeps_what_is_known_of_the_legs_and_changes_the_rest(
    case: Case,
) -> None:
    at, tool = case.at, case.position[::-1]
    known = {name: getattr(at, name) for name in WITHOUT_TOOL}
    assert np.isfinite(at.singular_values).all()
    other, anew = at.with_tool(tool), Configuration(case.design, case.position, case.rotation, tool)
    for name, value in known.items():
        assert getattr(other, name) is value
        assert_array_equal(np.vstack(value), np.vstack(getattr(anew, name)))
    for name in ("arm", "joint_arms", "jacobian", "singular_values", "tools"):
        assert_array_equal(getattr(other, name), getattr(anew, name))
    many = at.with_tool(np.tile(tool, (3, 1)))
    assert many.margins.shape == (3, 3)


@each_function
@pytest.mark.parametrize(
    ("position", "rotation"),
    [
        ([0.0, 1.0], EYE),
        ([0.0, 1.0, math.nan], EYE),
        ([0.0, math.inf, 1.0], EYE),
        *(([0.0, 1.0, 2.0], matrix) for matrix in (np.eye(2), 2.0 * EYE, -EYE, np.ones((3, 3)))),
        (np.zeros((2, 3)), np.broadcast_to(EYE, (3, 3, 3))),
    ],
)
def test_pose_function_of_an_unusable_pose_is_refused(
    function: PoseFunction, position: Any, rotation: Any
) -> None:
    refusal(function.value, PRESETS["paper-initial"], position, rotation)
