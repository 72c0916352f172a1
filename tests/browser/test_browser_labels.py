"""Labels, axes and scale over the scene, and views without perspective, in a real page."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from likeness import decoded
from limited_designs import scaled_design
from server_clock import wait_until_drawn
from tab import Tab

from explorer.app.features.mechanism.marks import ARROW_LENGTH, HANDLE_NAME
from explorer.app.features.singularity.work import go_to_singularity
from explorer.app.scene.camera import VIEWS, ViewName, framing
from explorer.app.scene.placing import Placed
from explorer.app.screenshot import PATIENCE_SECONDS, SCENE_CANVAS
from explorer.app.state.actions import Set, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_angle, set_pose, set_position
from explorer.app.state.view import PrototypeView, View
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.arrays import FloatArray
from explorer.workspace.accessible.radii import with_radius

SIZE = (1280, 720)
ON_AXES: tuple[ViewName, ...] = ("front", "side", "top")
NAMES = ("a1", "a2", "a3", "b1", "b2", "b3", "b4")
# Labels as they are drawn, by name.
DRAWN = """() => Object.fromEntries(window.explorer.labels.drawn().map(
    ({ name, at, box }) => [name, { at, box, isHidden: window.explorer.labels.hidden().has(name) }]
))"""
SCALE = "window.explorer.labels.scale()"
IS_PARALLEL = "window.explorer.projection.isParallel(window.__viserMutable.camera)"
# Whether viser draws its own labels, which have boxes.
HAS_BOXES = """() => {
    let parent = null;
    window.__viserMutable.scene.traverse((each) => {
        if (each.material?.uniforms?.uLabelData) parent = each.parent;
    });
    return parent.visible;
}"""
# Where both canvases are, within a narrower room, as on paper, before any script knows of it.
ON_PAPER = """() => {
    const scene = document.querySelector("canvas[data-engine]"),
        labels = scene.nextElementSibling,
        { style } = labels.offsetParent;
    const before = style.cssText;
    style.width = "50%";
    const found = [scene, labels].map((each) => {
        const { x, y, width, height } = each.getBoundingClientRect();
        const fit = getComputedStyle(each).objectFit;
        return { box: [x, y, width, height], fit, ratio: each.width / each.height };
    });
    style.cssText = before;
    return found;
}"""
BARE = View(
    flags=False,
    bodies=False,
    legs=False,
    labels=False,
    grid=False,
    handle=False,
    tetrahedra=(False, False, False),
)


@pytest.fixture
def wide(tab: Tab) -> Tab:
    """The tab, in a window of the usual size."""
    tab.resize(SIZE)
    tab.settle()
    return tab


def show(tab: Tab, view: View) -> None:
    tab.running.page.session.do(Set("view", view))
    assert wait_until_drawn(tab.running.page)


def labels_of(tab: Tab) -> dict[str, Any]:
    """Return the labels that are drawn, after all that has been asked for."""
    tab.settle()
    return tab.page.evaluate(DRAWN)


def wait_for_hidden(tab: Tab, names: set[str], *, hidden: bool) -> dict[str, Any]:
    """Wait until the points of some labels are found to be hidden or not; return the labels."""
    tab.wait_for(
        lambda: all(labels_of(tab)[name]["isHidden"] == hidden for name in names),
        f"{names} {'hidden' if hidden else 'in sight'}",
    )
    return labels_of(tab)


def in_scene(tab: Tab, point: FloatArray) -> FloatArray:
    """Return where a point of the scene (3,) is in the canvas of the scene."""
    box = tab.page.locator(SCENE_CANVAS).bounding_box()
    assert box is not None
    return np.array(tab.on_screen(point)) - [box["x"], box["y"]]


def overlap(one: list[float], other: list[float]) -> bool:
    return all(one[k] < other[k + 2] and other[k] < one[k + 2] for k in (0, 1))


INITIAL = pytest.param("paper-initial", marks=pytest.mark.long)


@pytest.mark.parametrize("design", ["paper-optimal", INITIAL])
def test_labels_lie_apart_and_stand_at_their_points_in_every_view(wide: Tab, design: str) -> None:
    session = wide.running.page.session
    session.do(open_design(PRESETS[design]))
    start = wide.state.pose
    for view in VIEWS:
        session.do(set_pose(start))
        wide.look_from(view)
        assert not wide.page.evaluate(HAS_BOXES)
        for ghosts in (False, True):
            show(wide, View(ghosts=ghosts))
            labels = labels_of(wide)
            assert {name.rpartition("/")[2] for name in labels} >= set(NAMES), (view, ghosts)
            boxes = {name: label["box"] for name, label in labels.items()}
            centre = in_scene(wide, Placed(Frame(wide.state)).points["b4"])
            boxes[HANDLE_NAME] = [*(centre - 8.0).tolist(), *(centre + 8.0).tolist()]
            for (one, a), (other, b) in itertools.combinations(boxes.items(), 2):
                assert not overlap(a, b), (view, ghosts, one, other)
        # They move with the mechanism.
        session.do(set_position(2, 8.0))
        session.do(set_angle(1, 20.0))
        labels = labels_of(wide)
        points = Placed(Frame(wide.state)).points
        for name in NAMES:
            at = labels[f"/{'base' if name[0] == 'a' else 'platform'}/label/{name}"]["at"]
            np.testing.assert_allclose(at, in_scene(wide, points[name]), atol=1.0, err_msg=view)


def test_label_behind_a_body_is_pale_but_not_that_of_a_gap(wide: Tab) -> None:
    a1, b4, gap = "/base/label/a1", "/platform/label/b4", "/gaps/label/3"
    show(wide, replace(BARE, labels=True, bodies=True))
    wide.look_from("isometric")
    dark = darkest(wide, wait_for_hidden(wide, {a1}, hidden=False)[a1]["box"])
    # A small board between a1 and the eye.
    scene = wide.running.viser.scene
    eye = np.array(wide.client.camera.position)
    middle = Placed(Frame(wide.state)).points["a1"] + 0.3 * eye
    half = 0.15
    corners = middle + half * np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]])
    board = scene.add_mesh_simple(
        "/board", corners, np.array([[0, 1, 2], [0, 2, 3]]), color=(255, 255, 255), side="double"
    )
    try:
        labels = wait_for_hidden(wide, {a1}, hidden=True)
        assert darkest(wide, labels[a1]["box"]) > dark + 0.2
    finally:
        board.remove()
    wait_for_hidden(wide, {a1}, hidden=False)
    # Where δ3 vanishes b4, with the contact at the same place, is behind a leg that has a radius.
    show(wide, View())
    session = wide.running.page.session
    session.do(Set("design", with_radius(wide.state.design, 0.4)))
    session.do(go_to_singularity(3))
    assert not wait_for_hidden(wide, {b4}, hidden=True)[gap]["isHidden"]


def darkest(tab: Tab, box: list[float]) -> float:
    """Return the lightness of the darkest pixel that the canvas of the labels has in a box."""
    return tab.page.evaluate(
        """([left, top, right, bottom]) => {
            const { canvas } = window.__viserMutable;
            const labels = canvas.nextElementSibling;
            const copy = Object.assign(document.createElement("canvas"), {
                width: labels.width, height: labels.height,
            });
            const pen = copy.getContext("2d", { willReadFrequently: true });
            pen.drawImage(labels, 0, 0);
            const { data } = pen.getImageData(left, top, right - left, bottom - top);
            let least = 1;
            for (let k = 0; k < data.length; k += 4) {
                if (data[k + 3] > 250) least = Math.min(least, data[k] / 255);
            }
            return least;
        }""",
        box,
    )


def lengths(tab: Tab) -> tuple[float, float]:
    """Return the breadths, in pixels, of a red line near the eye and of a green one far away.

    Both are as long in the scene, across the picture, one above the middle and one below.
    """
    show(tab, BARE)
    camera = tab.client.camera
    target = np.array(camera.look_at)
    forward = target - np.array(camera.position)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    scene = tab.running.viser.scene
    lines = [
        scene.add_line_segments(
            f"/lines/{name}",
            (target + away * forward + 0.1 * away * up + 3.0 * np.array([[-right, right]])),
            np.full((1, 2, 3), colour),
            thickness=3.0,
            thickness_units="screen",
        )
        for name, away, colour in (("near", -9.0, (255, 0, 0)), ("far", 9.0, (0, 255, 0)))
    ]
    try:
        picture = decoded(tab.picture())
    finally:
        for line in lines:
            line.remove()
    # The axes in the corner have the same colours.
    picture = picture[:-120]
    reds, greens = picture[..., 0] - picture[..., 1], picture[..., 1] - picture[..., 0]
    # Tone mapping makes pure colours pale.
    return breadth(reds > 0.2), breadth(greens > 0.2)


def breadth(mask: Any) -> float:
    columns = np.flatnonzero(mask.any(axis=0))
    return float(columns[-1] - columns[0])


def test_views_along_an_axis_have_no_perspective_and_others_have_one(wide: Tab) -> None:
    for view in ON_AXES:
        wide.look_from(view)
        near, far = lengths(wide)
        assert near == pytest.approx(far, abs=2.0), view
        target = np.array(wide.client.camera.look_at)
        across = [1.0, 0.0, 0.0] if view != "side" else [0.0, 1.0, 0.0]
        half = in_scene(wide, target + 3.0 * np.array(across)) - in_scene(wide, target)
        assert near == pytest.approx(2.0 * half[0], abs=5.0), view
    wide.look_from("isometric")
    near, far = lengths(wide)
    distance = float(np.linalg.norm(np.subtract(*eye_and_target(wide))))
    assert near / far == pytest.approx((distance + 9.0) / (distance - 9.0), rel=0.03)


def eye_and_target(tab: Tab) -> tuple[FloatArray, FloatArray]:
    camera = tab.client.camera
    return np.array(camera.position), np.array(camera.look_at)


def test_view_along_an_axis_has_no_perspective_until_it_is_turned(wide: Tab) -> None:
    page = wide.page
    wide.look_from("front")
    # The handle moves the platform as far as the pointer goes.
    before = wide.state.pose
    placed = Placed(Frame(wide.state))
    tip = placed.points["b4"] + [0.0, 0.0, 0.7 * ARROW_LENGTH]
    page.mouse.move(*wide.on_screen(tip))
    page.mouse.down()
    page.mouse.move(*wide.on_screen(tip + [0.0, 0.0, 1.5]), steps=8)
    page.mouse.up()

    def is_moved() -> bool:
        by = placed.scale * (np.array(wide.state.pose.position) - before.position)
        return bool(np.allclose(by, [0.0, 0.0, 1.5], atol=0.1))

    wide.wait_for(is_moved, "the platform moved by the handle")
    wide.settle()
    box = page.locator(SCENE_CANVAS).bounding_box()
    assert box is not None
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.8 * box["height"]
    eye, target = eye_and_target(wide)
    page.mouse.move(x, y)
    page.mouse.wheel(0, -400)
    wide.wait_for(lambda: not np.allclose(eye_and_target(wide)[0], eye, atol=0.1), "a closer eye")
    # A drag with the right button shifts the picture.
    page.mouse.down(button="right")
    page.mouse.move(x + 60, y - 20, steps=4)
    page.mouse.up(button="right")
    wide.wait_for(lambda: not np.allclose(eye_and_target(wide)[1], target, atol=0.1), "a shift")
    wide.settle()
    assert page.evaluate(IS_PARALLEL)
    near, far = lengths(wide)
    assert near == pytest.approx(far, abs=2.0)
    wide.push("Fit")
    first, _ = framing(wide.running.page.corners(), "front", wide.client.camera.aspect)
    wide.wait_for(lambda: np.allclose(eye_and_target(wide)[0], first, atol=0.01), "the whole")
    assert page.evaluate(IS_PARALLEL)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 80, y, steps=4)
    page.mouse.up()
    wide.wait_for(lambda: not page.evaluate(IS_PARALLEL), "perspective")
    wide.look_from("top")
    assert page.evaluate(IS_PARALLEL)


@pytest.mark.parametrize("lengths", ["mm", "design units"])
@pytest.mark.parametrize(
    "factor", [47.0, *(pytest.param(f, marks=pytest.mark.long) for f in (0.003, 1.0))]
)
def test_scale_bar_has_the_length_that_it_names_at_any_distance(
    wide: Tab, factor: float, lengths: str
) -> None:
    design = scaled_design(PRESETS["paper-optimal"], factor)
    wide.running.page.session.do(open_design(design))
    wide.running.page.session.do(Set("view.lengths", lengths))
    assert wait_until_drawn(wide.running.page)
    placed, unit = Placed(Frame(wide.state)), wide.state.unit
    wide.look_from("isometric")
    scale = wide.page.evaluate(SCALE)
    assert scale["text"] == f"1 square = {placed.square_in_unit:,.6g} {unit.name}"
    wide.look_from("front")
    scale = wide.page.evaluate(SCALE)
    a1, a2 = (in_scene(wide, placed.points[name]) for name in ("a1", "a2"))
    pixels = (a2[0] - a1[0]) / unit.convert(float(placed.frame.snapshot.points.a2[0]))
    length = float(scale["text"].removesuffix(f" {unit.name}").replace(",", ""))
    assert scale["length"] == pytest.approx(length * pixels, rel=1e-3)
    assert 30.0 <= scale["length"] <= 100.0
    assert f"{length:e}"[0] in "125"
    # Nearer, the bar is about as long and stands for less.
    wide.page.evaluate("window.__viserMutable.cameraControl.dollyTo(3, false)")
    wide.wait_for(lambda: wide.page.evaluate(SCALE)["text"] != scale["text"], "another bar")
    wide.settle()
    closer = wide.page.evaluate(SCALE)
    assert float(closer["text"].removesuffix(f" {unit.name}").replace(",", "")) < length
    assert 30.0 <= closer["length"] <= 100.0
    # It is whole, or not there.
    wide.resize((683, 384))
    assert wide.page.evaluate(SCALE) is None


@pytest.mark.draws
def test_labels_and_axes_are_in_pictures_and_gone_while_the_prototype_is_exploded(
    wide: Tab,
) -> None:
    def opacity() -> FloatArray:
        wide.settle()
        pixels = wide.client.get_render(600, 640, transport_format="png", timeout=PATIENCE_SECONDS)
        return pixels[..., 3].astype(np.float64)

    wide.look_from("top")
    show(wide, BARE)
    bare = opacity()
    assert (bare[-100:, :100] > 200.0).any()
    assert not bare[:-100].any()
    show(wide, replace(BARE, labels=True))
    assert (opacity()[:-100] > 200.0).any()
    together = View(drawn_as="prototype")
    show(wide, together)
    assert len(labels_of(wide)) >= len(NAMES)
    show(wide, replace(together, prototype=PrototypeView(exploded=0.5)))
    assert labels_of(wide) == {}


@pytest.mark.draws
def test_mesh_changed_as_its_shadow_is_switched_off_is_drawn_anew(wide: Tab) -> None:
    """Three.js takes a geometry for updated that was replaced after its shadow was drawn."""
    show(wide, BARE)
    wide.look_from("top")
    viser, camera = wide.running.viser, wide.client.camera
    mesh = viser.scene.add_mesh_simple(
        "/growing", np.zeros((3, 3)), np.array([[0, 1, 2]]), color=(255, 0, 0)
    )
    viser.scene.configure_default_lights(cast_shadow=True)
    try:
        wide.picture()
        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) + camera.look_at
        with viser.atomic():
            mesh.vertices = corners.astype(np.float32)
            mesh.faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)
            viser.scene.configure_default_lights(cast_shadow=False)
        reds = decoded(wide.picture())
        assert (reds[..., 0] - reds[..., 1] > 0.3).sum() > 500
    finally:
        # The explorer has lights of its own.
        viser.scene.configure_default_lights(enabled=False, cast_shadow=False)
        mesh.remove()


@pytest.mark.parametrize("media", ["print", "screen"])
def test_labels_lie_on_their_points_whatever_room_paper_leaves_the_scene(
    wide: Tab, media: Literal["print", "screen"]
) -> None:
    wide.page.emulate_media(media=media)
    wide.settle()
    scene, labels = wide.page.evaluate(ON_PAPER)
    wide.page.emulate_media(media="screen")
    assert scene == labels
    # All of the scene is on the paper, in its own proportions.
    assert media == "screen" or scene["fit"] == "contain"
