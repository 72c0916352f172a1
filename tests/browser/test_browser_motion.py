"""All that moves with the platform is drawn in one pose, in each frame of a real page."""

from __future__ import annotations

import math
from typing import TypedDict

import numpy as np
from tab import Tab

from explorer.app.features.mechanism.folds import fold_arcs, leaf_corners
from explorer.app.features.mechanism.incidences import EDGES, INSET
from explorer.app.features.view.feature import ground_of, shadow_outlines
from explorer.app.scene.placing import Placed
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_pose
from explorer.app.state.state import open_state
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.margins import TETRAHEDRA
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray

DESIGN = PRESETS["paper-optimal"]
# Poses that follow one another at once, before the page has drawn them.
AT_ONCE = 8

# Note what each frame draws, right before it is drawn.
WATCH = """() => {
    const { scene, nodeRefFromName: nodes } = window.__viserMutable;
    const meshOf = (name) => {
        const found = [];
        nodes[name].traverse((each) => each.geometry && found.push(each));
        return found[0];
    };
    const vertices = (name) => Array.from(meshOf(name).geometry.attributes.position.array);
    const starts = (name) =>
        Array.from(meshOf(name).geometry.attributes.instanceStart.data.array);
    const matrix = new nodes["/platform"].matrix.constructor();
    const before = scene.onBeforeRender;
    const frames = [];
    scene.onBeforeRender = (...all) => {
        before(...all);
        const rod = meshOf("/legs/actuators").getMatrixAt(7, matrix).elements;
        frames.push({
            platform: nodes["/platform"].position.toArray(),
            handle: nodes["/handle"].position.toArray(),
            rod_end: [0, 1, 2].map((axis) => rod[12 + axis] + rod[8 + axis]),
            edges: starts("/tetrahedra/1/edges"),
            shadow: vertices("/shadow"),
            leaf: vertices("/leaves/1"),
            arcs: starts("/leaves/arcs"),
        });
    };
    window.explorer.stopWatching = () => {
        scene.onBeforeRender = before;
        return frames;
    };
}"""


class Drawn(TypedDict):
    """What one frame drew, in scene units."""

    platform: list[float]
    handle: list[float]
    rod_end: list[float]
    edges: list[float]
    shadow: list[float]
    leaf: list[float]
    arcs: list[float]


def pose_at(share: float) -> Pose:
    turn = 2.0 * math.pi * share
    position = (10.0 + 2.0 * math.sin(turn), 5.0 + math.cos(turn), 9.0 + math.sin(2.0 * turn))
    return Pose.of_yaw_pitch_roll(position, (-73.0, 5.0 * math.sin(turn), 0.0))


def test_fast_motion_is_drawn_in_one_pose_in_each_frame(tab: Tab) -> None:
    poses = [pose_at(share) for share in np.linspace(0.0, 3.0, 80).tolist()]
    tab.running.page.session.do(set_pose(poses[0]))
    tab.running.page.session.do(Set("view.leaves", True))
    tab.picture()
    tab.page.evaluate(WATCH)
    for start in range(0, len(poses), AT_ONCE):
        for pose in poses[start : start + AT_ONCE]:
            tab.running.page.session.do(set_pose(pose))
        assert tab.running.page.session.wait_until_idle()
        tab.settle()
    frames: list[Drawn] = tab.page.evaluate("window.explorer.stopWatching()")
    scenes = [Placed(Frame(open_state(DESIGN, pose))) for pose in poses]
    places = np.array([scene.points["b4"] for scene in scenes])
    seen: set[int] = set()
    for frame in frames:
        index = int(np.linalg.norm(places - frame["platform"], axis=1).argmin())
        scene = scenes[index]
        seen.add(index)
        b4 = scene.points["b4"]
        np.testing.assert_allclose(frame["platform"], b4, atol=1e-5)
        np.testing.assert_allclose(frame["handle"], b4, atol=1e-5)
        np.testing.assert_allclose(frame["rod_end"], b4, atol=1e-5)
        corners: FloatArray = np.array([scene.points[name] for name in TETRAHEDRA[0]])
        inner = corners + INSET * (corners.mean(axis=0) - corners)
        edges: FloatArray = inner[EDGES]
        np.testing.assert_allclose(frame["edges"], edges.ravel(), atol=1e-5)
        np.testing.assert_allclose(frame["leaf"], leaf_corners(scene)[1].ravel(), atol=1e-5)
        _, arcs = fold_arcs(scene)
        drawn_arcs = np.reshape(frame["arcs"], (3, -1, 2, 3))[:, 1:, 0]
        np.testing.assert_allclose(drawn_arcs, arcs, atol=1e-5)
        outlines = np.ravel(shadow_outlines(scene, ground_of(scene)))
        drawn = np.reshape(frame["shadow"], (-1, 3))[: outlines.size // 2, :2]
        np.testing.assert_allclose(drawn.ravel(), outlines, atol=1e-5)
    assert len(seen) >= len(poses) // AT_ONCE
