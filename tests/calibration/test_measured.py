"""What is measured in poses, from the points themselves, and motions that no measurement sees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measured_machines import BAR, POSES, TARGETS, TYPICAL, WALLS, design_itself
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from explorer import BuiltMachine, Measurement
from explorer.calibration.poses import sample_poses
from explorer.calibration.unseen import frame_motions
from explorer.numerics.arrays import FloatArray

SAMPLE = sample_poses(TYPICAL, 7, seed=1)
TURN = Rotation.from_rotvec([0.3, -1.2, 2.0])


def values_of(kind: Measurement, unknowns: FloatArray | None = None) -> FloatArray:
    off = np.zeros(kind.unknowns) if unknowns is None else unknowns
    return kind.model(SAMPLE.position, SAMPLE.rotation, off)


def test_values_are_those_of_points_lengths_and_distances() -> None:
    for k, (p, r) in enumerate(zip(SAMPLE.position, SAMPLE.rotation, strict=True)):
        points = np.array([p + r @ place for place in TARGETS.points])
        assert_allclose(values_of(TARGETS)[k], points.ravel(), atol=1e-13)
        vector = Rotation.from_matrix(r).as_rotvec()
        assert_allclose(values_of(POSES)[k], [*p, *vector], atol=1e-13)
        length = np.linalg.norm(points[0] - BAR.base[0])
        assert_allclose(values_of(BAR)[k], [length], atol=1e-13)
        # A plane through a point of it, across its normal.
        normal, distance = WALLS.base[k % 3, :3], WALLS.base[k % 3, 3]
        foot = distance * normal / np.linalg.norm(normal)
        height = (points[0] - foot) @ normal / np.linalg.norm(normal)
        assert_allclose(values_of(WALLS)[k], [height], atol=1e-13)


def test_unknowns_move_points_balls_planes_and_the_frame() -> None:
    shift = np.array([0.1, -0.2, 0.3])
    for kind in (BAR, TARGETS, WALLS):
        moved = replace(kind, points=kind.points + shift)
        off = np.zeros(kind.unknowns)
        off[: kind.points.size] = np.tile(shift, len(kind.points))
        assert_allclose(values_of(kind, off), values_of(moved), atol=1e-13)
    assert BAR.unknowns == 6
    off = np.concatenate([np.zeros(3), shift])
    assert_allclose(values_of(BAR, off), values_of(replace(BAR, base=BAR.base + shift)), atol=1e-13)
    # Two tilts of a plane keep the length of its normal, its distance is the third.
    assert WALLS.unknowns == 12
    off = np.zeros(12)
    off[8] = 0.5
    farther = WALLS.base.copy()
    farther[1, 3] += 0.5
    assert_allclose(values_of(WALLS, off), values_of(replace(WALLS, base=farther)), atol=1e-13)
    off[6:9] = 0.02, -0.03, 0.0
    changed = values_of(WALLS, off) - values_of(WALLS)
    assert (changed[[0, 2, 3, 5, 6]] == 0.0).all()
    assert np.abs(changed[[1, 4]]).min() > 1e-3
    for kind in (POSES, TARGETS):
        free = replace(kind, in_base=False)
        assert free.unknowns == kind.unknowns + 6
        off = np.concatenate([np.zeros(kind.unknowns), TURN.as_rotvec(), shift])
        p, r = TURN.apply(SAMPLE.position) + shift, TURN.as_matrix() @ SAMPLE.rotation
        expected = kind.model(p, r, np.zeros(kind.unknowns))
        assert_allclose(values_of(free, off), expected, atol=1e-12)


@pytest.mark.parametrize("kind", [POSES, TARGETS, BAR, WALLS, replace(POSES, in_base=False)])
def test_slopes_are_those_of_moves(kind: Measurement) -> None:
    rng = np.random.default_rng(0)
    off = 0.01 * rng.normal(size=kind.unknowns)
    slopes = kind.slopes(SAMPLE.position, SAMPLE.rotation, off)
    here = values_of(kind, off)
    for size in (1e-3, 5e-4):
        twist, step = size * rng.normal(size=6), size * rng.normal(size=kind.unknowns)
        turned = Rotation.from_rotvec(twist[3:]).as_matrix() @ SAMPLE.rotation
        there = kind.model(SAMPLE.position + twist[:3], turned, off + step)
        linear = slopes @ np.concatenate([twist, step])
        assert_allclose(kind.differences(there, here), linear, atol=100.0 * size * size)


def test_turns_differ_by_the_shorter_way() -> None:
    here, there = np.zeros((2, 6)), np.zeros((2, 6))
    here[:, 3], there[:, 3] = np.pi - 0.01, [-np.pi + 0.01, np.pi - 0.03]
    assert_allclose(POSES.differences(there, here)[:, 3], [0.02, -0.02], atol=1e-12)


def test_aligned_values_are_those_of_the_base_frame() -> None:
    shift = np.array([200.0, -30.0, 4.0])
    for kind in (POSES, TARGETS):
        free = replace(kind, in_base=False)
        off = np.concatenate([np.zeros(kind.unknowns), TURN.as_rotvec(), shift])
        values = values_of(free, off)
        values[3] = np.nan
        aligned = replace(free, values=values).align(SAMPLE.position, SAMPLE.rotation)
        assert np.isnan(aligned.values[3]).all()
        rest = np.arange(len(values)) != 3
        off = aligned.differences(aligned.values, values_of(kind))
        assert_allclose(off[rest], 0.0, atol=1e-10)


def test_frame_motions_move_frames_and_nothing_else() -> None:
    size = 1e-5
    exact = design_itself().inverse(SAMPLE.position, SAMPLE.rotation)
    for name, motion in frame_motions(TYPICAL, POSES).items():
        machine = BuiltMachine(TYPICAL, size * motion)
        p, r = SAMPLE.position, SAMPLE.rotation
        body, *kind = name.split()
        unit = size * np.eye(3)["xyz".index(name[-1])] if body != "guide" else np.zeros(3)
        turn = Rotation.from_rotvec(unit if "turn" in kind else np.zeros(3)).as_matrix()
        shift = np.zeros(3) if "turn" in kind else unit
        if body == "base":
            p, r = p @ turn.T + shift, turn @ r
        elif body == "platform":
            r = r @ turn.T
            p = p - r @ shift
        off = machine.inverse(p, r) - exact
        # The motions are those to first order.
        assert np.abs(off).max() < 3e-9
        assert np.abs(design_itself().inverse(p, r) - exact).max() > size / 20.0 or body == "guide"
