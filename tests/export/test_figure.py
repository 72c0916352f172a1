"""Figures for papers: points where a pinhole sees them, nearer parts on top, sizes in mm."""

from __future__ import annotations

import itertools
import math
import re
from xml.etree.ElementTree import Element, fromstring

import numpy as np
import pytest
from numpy.typing import ArrayLike

import explorer
from explorer.errors import InputError, NoAnswerError
from explorer.export.drawings.figure import figure_svg
from explorer.export.drawings.mechanism import Projection
from explorer.numerics.arrays import FloatArray

PRESET = explorer.PRESETS["paper-optimal"]
HOME = explorer.evaluate(PRESET, PRESET.home_pose)
SVG = "{http://www.w3.org/2000/svg}"
POINTS = ("a1", "a3", "b1", "b2", "b3", "b4")
"""The points with dots, in the order in which these are drawn."""


def seen(points: ArrayLike, eye: FloatArray, target: FloatArray) -> FloatArray:
    """Return where a pinhole at an eye sees points, at unit distance: right and downwards."""
    x, y, z = target - eye
    heading, pitch = math.atan2(y, x), math.atan2(z, math.hypot(x, y))
    # Forward, left and up are the axes after a turn about z and one about the new y.
    (c, s), (k, n) = ((math.cos(a), math.sin(a)) for a in (heading, pitch))
    turn = np.array([[c * k, s * k, n], [-s, c, 0.0], [-c * n, -s * n, k]])
    forward, left, up = turn @ (np.asarray(points, dtype=np.float64) - eye).T
    return -np.stack([left, up], axis=-1) / forward[:, None]


def similarity(paper: FloatArray, flat: FloatArray) -> float:
    """Return the scale of the figure of some points; the figure is as exact as it must be."""
    ones = np.ones(len(flat))
    matrix = np.vstack(
        [np.stack([flat[:, k], ones * (k == 0), ones * (k == 1)], -1) for k in (0, 1)]
    )
    found, *_ = np.linalg.lstsq(matrix, paper.T.ravel(), rcond=None)
    np.testing.assert_allclose(matrix @ found, paper.T.ravel(), atol=1e-6 * np.ptp(paper))
    assert found[0] > 0.0
    return float(found[0])


def figure(snapshot: explorer.Snapshot, eye: FloatArray, target: FloatArray) -> Element:
    view = Projection.of_camera(eye, target, perspective=True)
    return fromstring(figure_svg(snapshot, view))


def of_class(root: Element, name: str) -> list[Element]:
    return [each for each in root.iter() if each.get("class", "").split(" ")[0] == name]


def ends_of(each: Element) -> FloatArray:
    return np.array([[float(each.get(f"{axis}{k}", "")) for axis in "xy"] for k in (1, 2)])


def dots(root: Element) -> FloatArray:
    return np.array(
        [[float(c.get("cx", "")), float(c.get("cy", ""))] for c in root.iter(f"{SVG}circle")]
    )


def cameras(count: int, seed: int) -> list[tuple[explorer.Snapshot, FloatArray, FloatArray]]:
    """Return mechanisms with their platforms above the base, and cameras around and below them."""
    random = np.random.default_rng(seed)
    found: list[tuple[explorer.Snapshot, FloatArray, FloatArray]] = []
    while len(found) < count:
        pose = explorer.Pose.of_yaw_pitch_roll(
            random.uniform((0.0, -10.0, 6.0), (20.0, 20.0, 18.0)), random.uniform(-80.0, 80.0, 3)
        )
        snapshot = explorer.evaluate(PRESET, pose)
        if min(snapshot.points.b1[2], snapshot.points.b3[2], pose.position[2]) > 0.5:
            away = random.normal(size=3)
            target = random.uniform((5.0, -5.0, 2.0), (15.0, 10.0, 10.0))
            found.append(
                (snapshot, target + random.uniform(50, 90) * away / np.linalg.norm(away), target)
            )
    return found


def test_end_points_are_where_a_pinhole_sees_them() -> None:
    for snapshot, eye, target in cameras(12, seed=1):
        root = figure(snapshot, eye, target)
        points = snapshot.points._asdict()
        flat = seen([points[name] for name in POINTS], eye, target)
        scale = similarity(dots(root), flat)
        on_guide = np.array([1.0, 0.0, 0.0])
        bases = points["a1"], points["b2"] * on_guide, points["b3"] * on_guide, points["a3"]
        drawn = [ends_of(each) for each in of_class(root, "rod")]
        expected = [
            dots(root)[0] + scale * (seen(pair, eye, target) - flat[0])
            for pair in zip(bases, (points[name] for name in ("b1", "b2", "b3", "b4")), strict=True)
        ]
        for each in expected:
            assert min(float(np.abs(one - each).max()) for one in drawn) < 1e-6 * 340.0


def test_nearer_parts_are_drawn_over_farther_ones() -> None:
    crossings = 0
    for snapshot, eye, target in cameras(30, seed=2):
        root = figure(snapshot, eye, target)
        order = [*root.iter()]
        points, normal = snapshot.points, snapshot.rotation[:, 2]
        rods = of_class(root, "rod")
        guide = np.array([1.0, 0.0, 0.0])
        tips = (points.b1, points.b2, points.b3, points.b4)
        bases = (points.a1, points.b2 * guide, points.b3 * guide, points.a3)
        flat = [seen(pair, eye, target) for pair in zip(bases, tips, strict=True)]
        at = similarity(dots(root), seen([getattr(points, name) for name in POINTS], eye, target))
        start = dots(root)[0] - at * seen([points.a1], eye, target)[0]
        places = [
            order.index(min(rods, key=lambda rod: np.abs(ends_of(rod) - start - at * each).max()))
            for each in flat
        ]
        plates = [(order.index(of_class(root, "base")[0]), points.a1, np.array([0.0, 0.0, 1.0]))]
        plates.append((order.index(of_class(root, "platform")[0]), points.b4, normal))
        for leg, (base, tip) in enumerate(zip(bases, tips, strict=True)):
            middle = 0.5 * (base + tip)
            for place, point, axis in plates:
                # Whether the ray to the eye passes through the plane.
                hidden = ((middle - point) @ axis) * ((eye - point) @ axis) < 0.0
                assert (places[leg] < place) is bool(hidden)
        for i, j in itertools.combinations(range(4), 2):
            u, w = tips[i] - bases[i], tips[j] - bases[j]
            ray = np.stack([u, eye - bases[j], -w], axis=-1)
            if abs(np.linalg.det(ray)) < 1e-9:
                continue
            share, depth, other = np.linalg.solve(ray, eye - bases[i])
            if 0.01 < share < 0.99 and 0.01 < other / depth < 0.99:
                crossings += 1
                assert (places[i] > places[j]) is bool(depth < 1.0)
    assert crossings > 8


@pytest.mark.parametrize("width", [85.0, 170.0])
@pytest.mark.parametrize("perspective", [True, False])
def test_scale_bar_has_the_length_of_its_words(width: float, perspective: bool) -> None:
    target = np.array([9.0, 2.0, 5.0])
    view = Projection.of_camera(
        target + np.array([0.0, -60.0, 0.0]), target, perspective=perspective
    )
    root = fromstring(figure_svg(HOME, view, width))
    assert root.get("width") == f"{width:g}mm"
    left, top, across, down = map(float, root.get("viewBox", "").split())
    assert across / width == pytest.approx(down / float(root.get("height", "")[:-2]), rel=1e-3)
    (path,) = of_class(root, "bar")
    length = float(re.findall(r"h([\d.]+)", path.get("d", ""))[0])
    (words,) = (each.text for each in of_class(root, "small") if "mm" in (each.text or ""))
    assert ("at b4" in str(words)) is perspective
    depth = 60.0 + HOME.pose.position[1] - 2.0 if perspective else 1.0
    flat = np.array([HOME.points.a1, HOME.points.b1, HOME.points.b4])
    if perspective:
        scale = similarity(
            dots(root),
            seen([getattr(HOME.points, name) for name in POINTS], target - [0, 60, 0], target),
        )
    else:
        across_b = dots(root)[5] - dots(root)[2]
        scale = float(np.linalg.norm(across_b) / np.linalg.norm((flat[2] - flat[1])[[0, 2]]))
    units = float(str(words).split()[0]) / PRESET.unit_mm
    assert length == pytest.approx(scale / depth * units, rel=1e-5)
    assert 0.1 * across < length <= 0.25 * across
    for x, y in dots(root).tolist():
        assert left < x < left + across
        assert top < y < top + down


def test_labels_are_text_within_the_figure_and_tetrahedra_can_be_left_out() -> None:
    (snapshot, eye, target) = cameras(1, seed=5)[0]
    root = figure(snapshot, eye, target)
    named = {each.text for each in of_class(root, "label")}
    assert named == {"a1", "a2", "a3", "b1", "b2", "b3", "b4", "d1", "d3"}
    assert len(of_class(root, "tetrahedron")) == 18
    view = Projection.of_camera(eye, target, perspective=True)
    root = fromstring(figure_svg(snapshot, view, tetrahedra=(False, True, False)))
    assert {each.get("class") for each in of_class(root, "tetrahedron")} == {"tetrahedron is-2"}


def test_camera_among_the_parts_and_odd_widths_are_refused() -> None:
    inside = Projection.of_camera(
        np.array([10.0, 3.0, 4.0]), np.array([10.0, 9.0, 4.0]), perspective=True
    )
    with pytest.raises(NoAnswerError, match="move it away"):
        figure_svg(HOME, inside)
    for width in (10.0, 4000.0, math.nan):
        with pytest.raises(InputError, match="40 to 400 mm wide"):
            figure_svg(HOME, inside, width)
