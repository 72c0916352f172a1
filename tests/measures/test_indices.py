"""The indices of poses, against the screws of the mechanism written out, in any frame."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from numpy.testing import assert_allclose
from strategies import Case, all_cases, ordinary_cases, singular_cases, uniform_rotations

from explorer.measures.catalogue import measure_design
from explorer.measures.measure import Case as MeasuredCase
from explorer.measures.snapshot import PoseIndices, evaluate
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray

OPTIMAL = PRESETS["paper-optimal"]


def indices_of(case: Case) -> PoseIndices:
    return PoseIndices(case.design, case.position, case.rotation)


def wrenches_of(case: Case, turn: FloatArray, origin: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the points and the unit forces of the six actuators in another frame, each (6, 3)."""
    points = case.at.points
    a1, guide = np.zeros(3), np.array([1.0, 0.0, 0.0])
    struts = [b - (b @ guide) * guide for b in (points.b2, points.b3)]
    forces = [points.b1 - a1, guide, struts[0], guide, struts[1], points.b4 - points.a3]
    at = [points.b1, points.b2, points.b2, points.b3, points.b3, points.b4]
    units = np.array([force / np.linalg.norm(force) for force in forces])
    return (np.array(at) - origin) @ turn.T, units @ turn.T


@given(ordinary_cases(), uniform_rotations())
def test_transmissions_are_those_of_reciprocal_screws_in_any_frame(
    case: Case, turn: FloatArray
) -> None:
    assume(case.regularity > 1e-3)
    points, forces = wrenches_of(case, turn, np.array([3.0, -7.0, 2.0]))
    wrenches = np.hstack([forces, np.cross(points, forces)])
    for i, transmission in enumerate(indices_of(case).transmissions):
        # The twist on which the wrenches of the five locked actuators have no power.
        velocity, turning = np.linalg.svd(np.delete(wrenches, i, axis=0))[2][-1].reshape(2, 3)
        at_point = velocity + np.cross(turning, points[i])
        power = abs(float(forces[i] @ at_point))
        assert transmission == pytest.approx(power / np.linalg.norm(at_point), rel=1e-6)


@given(ordinary_cases(), uniform_rotations())
def test_indices_of_j_are_those_of_screws_along_other_axes(case: Case, turn: FloatArray) -> None:
    assume(case.joints[[0, 2, 4, 5]].all())
    points, forces = wrenches_of(case, turn, case.position)
    rates = np.hstack([forces, np.cross(points, forces) / case.design.reach])
    values, found = np.linalg.svd(rates)[1], indices_of(case)
    assert found.smallest_singular_value == pytest.approx(values[-1], abs=1e-12 * values[0])
    assert found.inverse_condition == pytest.approx(values[-1] / values[0], abs=1e-12)
    squared = float(np.linalg.det(rates @ rates.T))
    size = values[0] ** 12
    assert found.manipulability**2 == pytest.approx(squared, rel=1e-6, abs=1e-12 * size)


@given(ordinary_cases())
def test_transmissions_of_legs_1_and_4_follow_from_margins(case: Case) -> None:
    assume(case.regularity > 1e-6)
    first, *_, last = indices_of(case).transmissions.tolist()
    delta1, _, delta3 = np.abs(case.margins).tolist()
    l1, l4 = case.joints[[0, 5]].tolist()
    assert first == pytest.approx(delta1 / l1, rel=1e-6)
    assert last == pytest.approx(
        abs(case.design.a3[1]) * delta3 / (l4 * math.hypot(*case.position[1:])), rel=1e-6
    )


@given(all_cases())
def test_indices_are_from_0_to_1_and_transmission_does_not_depend_on_the_unit(case: Case) -> None:
    found = indices_of(case)
    for values in (found.transmissions, found.inverse_condition):
        assert ((values >= 0.0) & (values <= 1.0 + 1e-9)).all()
    assert found.transmission_index == found.transmissions.min()
    assert found.smallest_singular_value >= 0.0
    assert found.manipulability >= 0.0
    assert_allclose(indices_of(case.scaled(2.0)).transmissions, found.transmissions, rtol=1e-9)


@given(singular_cases())
def test_indices_in_a_singular_pose_are_0(case: Case) -> None:
    found = indices_of(case)
    assert found.transmission_index < 1e-9
    assert found.inverse_condition < 1e-9
    assert found.smallest_singular_value < 1e-9 * found.singular_values[0]
    assert found.manipulability < 1e-9 * found.singular_values[0] ** 6


def test_indices_over_the_workspace_are_those_of_its_nodes() -> None:
    case = MeasuredCase(OPTIMAL)
    every, positions = case.node_indices, case.at_nodes.positions
    least = ("inverse_condition", "transmission_index", "smallest_singular_value", "manipulability")
    for name in least:
        values = getattr(every, name)
        one = getattr(evaluate(OPTIMAL, Pose.of(positions[7], case.rotation)), name)
        assert values[7] == pytest.approx(one, rel=1e-9)
        assert measure_design(case, [f"worst_{name}"])[f"worst_{name}"] == values.min()
    for name in least[:2]:
        mean = measure_design(case, [f"mean_{name}"])[f"mean_{name}"]
        assert mean == pytest.approx(float(getattr(every, name).mean()), rel=1e-12)
