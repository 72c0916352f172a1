"""The shadow on the ground, against points of the bodies that are projected one by one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from explorer.app.features.ground.ground import CORNERS, OUTLINES, shadow_outlines
from explorer.app.features.ground.lighting import TO_SUN
from explorer.app.features.mechanism.bodies import BASE_RADIUS, PLATE_THICKNESS, platform_plate
from explorer.app.features.mechanism.legs import PLATE_TOP
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import plate
from explorer.app.state.frame import Frame
from explorer.app.state.state import opened
from explorer.app.state.view import View
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray

GROUND = PLATE_TOP - PLATE_THICKNESS
POSES = (None, Pose.of_yaw_pitch_roll((9.0, 8.0, 7.5), (-38.0, 24.0, 8.0)))


def placed(pose: Pose | None, view: View | None = None) -> Placed:
    return Placed(Frame(opened(PRESETS["paper-optimal"], pose, view)))


def on_ground(points: FloatArray) -> FloatArray:
    """Return where rays of the sun through points (n, 3) meet the ground, (n, 2)."""
    steps = (points[:, 2] - GROUND) / TO_SUN[2]
    return (points - steps[:, None] * TO_SUN)[:, :2]


def area(points: FloatArray) -> float:
    return float(ConvexHull(points).volume)


@pytest.mark.parametrize("pose", POSES)
def test_shadow_of_plates_is_their_projection(pose: Pose | None) -> None:
    scene = placed(pose)
    base, platform, *_ = shadow_outlines(scene, GROUND)
    corners = np.array([scene.points[name][:2] for name in ("a1", "a2", "a3")])
    solid, _ = plate(corners, BASE_RADIUS, GROUND, PLATE_TOP)
    assert area(base) == pytest.approx(area(on_ground(solid)), rel=0.01)
    local, _ = platform_plate(scene)
    rotation = scene.frame.snapshot.rotation
    projected = on_ground(scene.points["b4"] + local @ rotation.T)
    # The plate counts as a sheet, so that its shadow lacks the rim of its thickness.
    assert area(platform) == pytest.approx(area(projected), rel=0.12)
    assert area(np.concatenate([platform, projected])) <= 1.02 * area(projected)


def test_shadow_outlines_are_convex_and_fit_their_mesh() -> None:
    for view, count in (
        (View(), 6),
        (View(bodies=False), 4),
        (View(legs=False), 2),
        (View(drawn_as="6-4 twin"), OUTLINES),
        (View(bodies=False, legs=False), 0),
    ):
        outlines = shadow_outlines(placed(None, view), GROUND)
        assert len(outlines) == count
        for outline in outlines:
            assert outline.shape == (CORNERS, 2)
            steps = np.roll(outline, -1, axis=0) - outline
            turns = steps[:, 0] * np.roll(steps[:, 1], -1) - steps[:, 1] * np.roll(steps[:, 0], -1)
            # Counterclockwise, so that the mesh is seen from above.
            assert turns.min() > -1e-9
