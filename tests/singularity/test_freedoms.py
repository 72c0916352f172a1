"""The freedoms of a singular pose are turns about lines, and as many as J loses in rank."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose
from strategies import Case, all_cases

from explorer import PRESETS, Configuration, Pose, inverse, margins
from explorer.numerics.arrays import FloatArray
from explorer.singularity.freedoms import Freedoms, FreeTurn, freedoms
from explorer.singularity.nearest_stratum import nearest_in_stratum
from explorer.singularity.strata import GENERIC, STRATA, conditions, incidences

DESIGN = PRESETS["paper-optimal"]
SINGULAR = [w for w in STRATA if w != GENERIC]
# Essential conditions of the strata: a1 on the line b2b3, b4 on the guide, lines that coincide.
A1_ON_LINE, B4_ON_GUIDE, SAME_LINE = (1, 2, 1), (2, 1, 1), (2, 2, 2)


def poses_in(stratum: tuple[int, ...], count: int = 4) -> list[Pose]:
    rng = np.random.default_rng(5)
    starts = (
        Pose.of_yaw_pitch_roll(rng.uniform(-8.0, 15.0, 3), rng.uniform(-80.0, 80.0, 3))
        for _ in range(count)
    )
    return [nearest_in_stratum(DESIGN, start, stratum).pose for start in starts]


def joint_change(turn: FreeTurn, pose: Pose, angle: float) -> FloatArray:
    after = turn.move(pose, angle)
    return inverse(DESIGN, after.position, after.rotation) - inverse(
        DESIGN, pose.position, pose.rotation
    )


@pytest.mark.parametrize("stratum", SINGULAR)
def test_turn_changes_joints_by_the_square_of_its_angle_or_not_at_all(
    stratum: tuple[int, ...],
) -> None:
    for pose in poses_in(stratum):
        found = freedoms(Configuration.at(DESIGN, pose))
        assert 1 <= len(found.turns) <= found.count
        for turn in found.turns:
            assert turn.incidence in incidences(stratum)
            whole, half = (np.abs(joint_change(turn, pose, a)).max() for a in (2e-3, 1e-3))
            if turn.is_finite:
                for angle in (0.1, 1.0, -2.5):
                    assert np.abs(joint_change(turn, pose, angle)).max() < 1e-9 * DESIGN.reach
            else:
                assert whole == pytest.approx(4.0 * half, rel=1e-2)
                # A joint that changes at first order would change by some 1e-4 of the reach.
                assert whole < 1e-5 * DESIGN.reach


@pytest.mark.parametrize(
    ("stratum", "line"),
    [((3, 4, 2, 1), "b2b3"), ((4, 2, 3, 1), "a1b4"), ((4, 3, 1, 2), "guide")],
)
def test_one_incidence_leaves_one_turn_about_its_own_line_through_its_points(
    stratum: tuple[int, ...], line: str
) -> None:
    for pose in poses_in(stratum):
        found = freedoms(Configuration.at(DESIGN, pose))
        (turn,) = found.turns
        assert found.count == 1
        assert turn.line_name.endswith(line)
        assert not turn.is_finite
        on_line = {
            "b2b3": np.array(pose.position) + DESIGN.b3 * pose.rotation[:, 0],
            "a1b4": np.array(pose.position),
            "guide": np.array([1.0, 0.0, 0.0]),
        }[line]
        for point in (np.array(pose.position) if line == "b2b3" else np.zeros(3), on_line):
            assert_allclose(np.cross(point - turn.point, turn.direction), 0.0, atol=1e-9)
        # The fold that was flat is the only one that it changes.
        after = turn.move(pose, 0.1)
        change = margins(after.position, after.rotation) - margins(pose.position, pose.rotation)
        assert np.flatnonzero(np.abs(change) > 1e-9).tolist() == [turn.incidence - 1]


@pytest.mark.parametrize("stratum", [w for w in SINGULAR if SAME_LINE not in conditions(w)])
def test_freedoms_are_as_many_as_finite_differences_of_the_joints_lose_in_rank(
    stratum: tuple[int, ...],
) -> None:
    step = 1e-5
    for pose in poses_in(stratum, 2):
        p, r = np.array(pose.position), pose.rotation
        columns: list[FloatArray] = []
        for axis in np.eye(3):
            shifts = [inverse(DESIGN, p + s * step * DESIGN.reach * axis, r) for s in (1.0, -1.0)]
            turned = [pose.turn(p, s * step * axis) for s in (1.0, -1.0)]
            turns = [inverse(DESIGN, each.position, each.rotation) for each in turned]
            columns += [
                (one - other) / (2.0 * step * DESIGN.reach) for one, other in (shifts, turns)
            ]
        rank = np.linalg.matrix_rank(np.array(columns), 1e-6)
        assert freedoms(Configuration.at(DESIGN, pose)).count == 6 - rank


def test_turn_is_finite_where_a_point_of_one_flag_lies_on_the_line_of_the_other() -> None:
    for stratum in SINGULAR:
        described = set(conditions(stratum))
        for pose in poses_in(stratum, 1):
            is_finite = {
                turn.incidence: turn.is_finite
                for turn in freedoms(Configuration.at(DESIGN, pose)).turns
            }
            if described == {A1_ON_LINE}:
                assert is_finite == {1: True}
            elif described == {B4_ON_GUIDE}:
                assert is_finite == {3: True}
            elif SAME_LINE in described:
                assert is_finite == {1: True}


@pytest.mark.parametrize(
    ("end", "held"),
    [
        ((*DESIGN.b1, 0.0), (0.0, 0.0, 0.0)),
        ((DESIGN.b2, 0.0, 0.0), (7.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (*DESIGN.a3, 0.0)),
    ],
)
def test_leg_without_length_holds_its_end_and_leaves_no_freedom(
    end: tuple[float, ...], held: tuple[float, ...]
) -> None:
    rotation = Pose.of_yaw_pitch_roll((0.0, 0.0, 0.0), (40.0, 30.0, 20.0)).rotation
    pose = Pose.of(np.array(held) - rotation @ np.array(end), rotation)
    assert np.abs(inverse(DESIGN, pose.position, pose.rotation)).min() < 1e-12
    assert freedoms(Configuration.at(DESIGN, pose)) == Freedoms(0, ())


@given(all_cases())
def test_any_pose_has_freedoms_only_if_it_is_singular_and_turns_about_unit_vectors(
    case: Case,
) -> None:
    found = freedoms(case.at)
    assert len(found.turns) <= found.count <= 6
    if case.regularity > 1e-6:
        assert found.count == 0
    for turn in found.turns:
        assert np.linalg.norm(turn.direction) == pytest.approx(1.0)
        assert np.isfinite(turn.point).all()
