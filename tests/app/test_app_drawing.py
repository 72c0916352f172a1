"""What is drawn, looked at without a browser: colours, shapes, cameras, the sketch."""

from __future__ import annotations

import itertools
import re
import threading
from types import SimpleNamespace
from typing import Any, cast
from xml.etree import ElementTree as ET

import msgspec
import numpy as np
import pytest
from hypothesis import given, strategies as st
from limited_designs import scaled_design

from explorer.app.features.singularity.feature import measures_table
from explorer.app.scene.camera import (
    FIELD_OF_VIEW,
    FIRST_ASPECT,
    REMEMBERED,
    VIEWS,
    Cameras,
    ViewName,
    are_in_picture,
    are_out_of_sight,
    framing,
    has_perspective,
    places_in_picture,
)
from explorer.app.scene.placing import Placed, around
from explorer.app.scene.shapes import cylinder, plate, sphere, turn_z_to
from explorer.app.scene.surfaces import COLLIDING, PLAIN
from explorer.app.state.frame import Frame
from explorer.app.state.state import open_state
from explorer.app.state.view import LengthName, View
from explorer.mechanism import rgb as colours
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.mechanism.rgb import OUTLINE, Rgb
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.number_text import format_fitted
from explorer.page.look import read_file, read_stylesheet
from explorer.singularity.colours import FAR_WARNINGS, proximity_colour

OPTIMAL = PRESETS["paper-optimal"]

# Of panels, of the scene, and of fields within panels, as viser draws them.
LIGHT = {"panel": "#ffffff", "scene": "#ffffff", "field": "#ffffff"}
DARK = {"panel": "#242424", "scene": "#141414", "field": "#2e2e2e"}


def rgb(colour: str) -> Rgb:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue


def luminance(colour: Rgb) -> float:
    """Return the relative luminance as WCAG 2 defines it."""
    shares = [value / 255.0 for value in colour]
    linear = [s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: Rgb, other: Rgb) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("name", ["grey", "within", "close", "beyond"])
def test_words_are_legible_in_both_themes(name: str) -> None:
    found = re.search(rf"--ex-{name}: light-dark\((#\w+), (#\w+)\)", read_stylesheet())
    assert found is not None
    for colour, backgrounds in zip(found.groups(), (LIGHT, DARK), strict=True):
        for place, background in backgrounds.items():
            assert contrast(rgb(colour), rgb(background)) >= 4.5, f"{colour} on a {place}"


def test_lines_of_charts_and_alerts_are_seen_in_both_themes() -> None:
    for chart in ("BLUE", "TEAL", "VIOLET", "ORANGE", "NEUTRAL"):
        for backgrounds in (LIGHT, DARK):
            assert contrast(getattr(colours, chart), rgb(backgrounds["panel"])) >= 3.0
    assert contrast(OUTLINE, rgb(LIGHT["panel"])) >= 3.0


def as_deuteranope(colour: Rgb) -> FloatArray:
    """Return the colour as seen without green cones (Viénot, Brettel and Mollon 1999)."""
    linear = (np.array(colour) / 255.0) ** 2.2
    matrix = [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]]
    return np.clip(matrix @ linear, 0.0, 1.0) ** (1 / 2.2) * 255.0


def test_luminance_grows_on_either_side_towards_the_warning_length() -> None:
    below, above = (
        [proximity_colour(x) for x in np.linspace(*ends, 30)]
        for ends in ((0.0, 0.99), (1.0, FAR_WARNINGS))
    )
    assert below == sorted(below, key=luminance)
    assert above == sorted(above, key=luminance, reverse=True)
    # Either side is told from the other without green cones.
    apart = [np.linalg.norm(as_deuteranope(a) - as_deuteranope(b)) for a in below for b in above]
    assert min(apart) > 60.0
    # So are collisions from limits, in grey too.
    assert np.linalg.norm(as_deuteranope(COLLIDING) - as_deuteranope(PLAIN)) > 60.0
    assert luminance(PLAIN) > 2.0 * luminance(COLLIDING)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.5])
@pytest.mark.parametrize("design", PRESETS.values(), ids=str)
def test_view_holds_the_whole_mechanism_and_little_more(
    design: Design, view: ViewName, aspect: float
) -> None:
    points = around(np.array(list(Placed(Frame(open_state(design))).points.values())))
    eye, target = framing(points, view, aspect)
    distance = float(np.linalg.norm(target - eye))
    forward = (target - eye) / distance
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    seen = points - eye
    # Without perspective all is as large as at the target.
    depth = seen @ forward if view == "isometric" else np.full(len(points), distance)
    half = np.tan(0.5 * FIELD_OF_VIEW)
    across = np.abs(seen @ right) / (half * aspect * depth)
    upward = np.abs(seen @ np.cross(right, forward)) / (half * depth)
    assert depth.min() > 0.0
    assert 0.9 < max(across.max(), upward.max()) <= 1.0


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3), st.sampled_from(["mm", "design units"]))
def test_squares_of_the_ground_have_the_size_of_their_label(
    factor: float, unit_mm: float, lengths: LengthName
) -> None:
    design = scaled_design(PRESETS["paper-optimal"], factor)
    design = msgspec.structs.replace(design, unit_mm=unit_mm)
    state = open_state(design, view=View(lengths=lengths))
    placed = Placed(Frame(state))
    size = f"{placed.square_in_unit:.6e}"
    assert float(size[0]) in (1.0, 2.0, 5.0)
    assert size[1:8] == ".000000"
    # Along the base's axis lie as many squares as a2 is millimetres, or design units, away.
    drawn = float(np.linalg.norm(placed.points["a2"] - placed.points["a1"]))
    shown = (unit_mm if lengths == "mm" else 1.0) * float(
        np.linalg.norm(placed.frame.snapshot.points.a2)
    )
    assert drawn / placed.square == pytest.approx(shown / placed.square_in_unit)
    assert 0.5 <= placed.square <= 2.0


@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=1, max_size=8))
def test_rod_points_in_its_direction(directions: list[tuple[float, float, float]]) -> None:
    array = np.array(directions)
    lengths = np.linalg.norm(array, axis=1)
    wxyz = turn_z_to(array)
    assert np.allclose(np.linalg.norm(wxyz, axis=1), 1.0)
    for quaternion, direction, length in zip(wxyz, array, lengths, strict=True):
        if length > 1e-6:
            w, x, y, z = quaternion.tolist()
            turned = Pose((0.0, 0.0, 0.0), (w, x, y, z)).rotation[:, 2]
            assert np.allclose(turned, direction / length, atol=1e-6)


def closed_volume(vertices: FloatArray, faces: IntArray) -> float:
    """Return the volume by the divergence theorem; positive if all faces look outwards."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def test_primitive_meshes_are_closed_and_look_outwards() -> None:
    assert closed_volume(*cylinder()) == pytest.approx(np.pi, rel=0.02)
    assert closed_volume(*sphere()) == pytest.approx(4.0 / 3.0 * np.pi, rel=0.02)
    square = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
    expected = 0.5 * (4 * 3 + 2 * (4 + 3) * 0.5 + np.pi * 0.25)
    assert closed_volume(*plate(square, 0.5, 1.0, 1.5)) == pytest.approx(expected, rel=0.01)


def test_small_share_is_not_shown_as_zero() -> None:
    assert format_fitted(0.0308, 1.0, 5) == "0.0308"
    assert format_fitted(1.651e-9, 1.0, 5) == "1.65 × 10⁻⁹"
    assert format_fitted(0.0, 1.0, 5) == "0.0000"
    thin = msgspec.structs.replace(OPTIMAL, b3=OPTIMAL.b2 + 1e-6)
    text = re.sub(r"<[^>]+>", " ", measures_table(Frame(open_state(thin))))
    # Below a millionth, as its power of ten says.
    assert re.search(r"1/cond J\s+[1-9]\S* × 10⁻[⁷⁸⁹]", text)


# Height of type of 11 pixels from the top of b to the bottom of y, and width of a character.
TYPE_HEIGHT, CHARACTER = 11.0, 6.4
SHARES = {"start": 0.0, "middle": 0.5, "end": 1.0}


def test_texts_of_the_sketch_are_within_it_and_do_not_overlap() -> None:
    drawing = ET.fromstring(read_file("sketch.svg"))
    boxes: list[tuple[float, float, float, float]] = []
    for text in drawing.iter("text"):
        x, y, width = *(float(text.attrib[name]) for name in "xy"), CHARACTER * len(text.text or "")
        left = x - SHARES[text.attrib["text-anchor"]] * width
        assert -0.1 <= left <= left + width <= float(drawing.attrib["width"])
        assert 0.5 * TYPE_HEIGHT <= y <= float(drawing.attrib["height"]) - 0.5 * TYPE_HEIGHT
        boxes.append((left, left + width, y - 0.5 * TYPE_HEIGHT, y + 0.5 * TYPE_HEIGHT))
    assert len(boxes) == 15
    for one, other in itertools.combinations(boxes, 2):
        across = min(one[1], other[1]) - max(one[0], other[0])
        down = min(one[3], other[3]) - max(one[2], other[2])
        assert min(across, down) <= 0.1, (one, other)


def test_dimensions_of_the_sketch_are_the_variables_of_the_optimum_to_scale() -> None:
    drawn: dict[str, float] = {}
    for group in ET.fromstring(read_file("sketch.svg")).iter("g"):
        line = group[2].attrib
        dx, dy = (float(line[f"{axis}2"]) - float(line[f"{axis}1"]) for axis in "xy")
        drawn[group.attrib["data-variable"]] = dx if dy == 0.0 else -dy
    values = dict(zip(VARIABLES, OPTIMAL.variables, strict=True))
    for names in (VARIABLES[:2], VARIABLES[2:]):
        # One scale for each figure.
        scale = drawn[names[0]] / values[names[0]]
        for name in names:
            assert drawn.pop(name) == pytest.approx(scale * values[name], abs=0.3)
    assert not drawn


POINTS = np.random.default_rng(5).uniform(-6.0, 9.0, (20, 3))
# Of viser, before it is told where to begin.
UNTOLD = np.array([3.0, 3.0, 3.0])
FIRST = framing(POINTS, "isometric", FIRST_ASPECT)[0]


class Browser:
    """A browser, as far as cameras know one; at first it may miss where its camera is put."""

    client_id = 5

    class Camera:
        """Of the browser, as the server knows it."""

        aspect = 0.7
        fov = 0.6
        up_direction = (0.0, 0.0, 1.0)
        position = UNTOLD
        look_at = np.zeros(3)

        def __init__(self) -> None:
            self.updated: Any = print

        def on_update(self, callback: Any) -> None:
            self.updated = callback

    def __init__(self) -> None:
        self.camera = Browser.Camera()
        self.puts: list[FloatArray] = []

    def put(self, _: Any, eye: FloatArray, *__: Any) -> None:
        """Take note of where the camera is put; whether it goes there is another matter."""
        self.puts.append(eye)

    def tell(self, position: FloatArray) -> None:
        self.camera.position = position
        self.camera.updated(None)


@pytest.fixture
def browser(monkeypatch: pytest.MonkeyPatch) -> Any:
    made = Browser()
    monkeypatch.setattr("explorer.app.scene.camera.put_camera", made.put)
    return made


@pytest.fixture
def cameras(browser: Any) -> Cameras:
    first: Any = SimpleNamespace()
    cameras = Cameras(first, lambda: POINTS)
    cameras.frame_first()
    assert np.allclose(first.position, FIRST)
    cameras.connected(browser)
    return cameras


EYE = framing(POINTS, "isometric", 0.7)[0]


@pytest.mark.parametrize("missed", [0, 1, REMEMBERED + 3])
@pytest.mark.parametrize("start", [UNTOLD, FIRST])
def test_camera_of_a_browser_that_missed_its_place_is_put_there_again(
    cameras: Cameras, browser: Any, missed: int, start: FloatArray
) -> None:
    for _ in range(missed):
        puts = len(browser.puts)
        browser.tell(start)
        assert not cameras.stands(browser)
        # At once, since nothing may follow.
        assert len(browser.puts) == puts + 1
        assert np.allclose(browser.puts[-1], EYE)
    browser.tell(EYE * (1.0 + 1e-7))
    assert cameras.stands(browser)


def test_camera_is_put_last_for_the_shape_that_its_browser_told_last(browser: Any) -> None:
    """While its panels are laid out a browser tells of several, each heard on its own thread."""
    others: list[threading.Thread] = []

    def points() -> FloatArray:
        # Another shape is told while this one is framed.
        if browser.camera.aspect == 1.6:
            browser.camera.aspect = 0.9
            others.append(threading.Thread(target=browser.camera.updated, args=(None,)))
            others[-1].start()
            others[-1].join(0.1)
        return POINTS

    cameras = Cameras(cast("Any", SimpleNamespace()), points)
    cameras.frame_first()
    cameras.connected(browser)
    browser.camera.aspect = 1.6
    browser.tell(EYE)
    for other in others:
        other.join()
    assert np.allclose(browser.puts[-1], framing(POINTS, "isometric", 0.9)[0])


def test_camera_that_somebody_moved_is_left_alone(cameras: Cameras, browser: Any) -> None:
    elsewhere = np.array([1.0, -30.0, 2.0])
    browser.tell(elsewhere)
    assert cameras.stands(browser)
    cameras.look_again(browser)
    browser.camera.aspect = 1.4
    browser.tell(elsewhere)
    assert len(browser.puts) == 1


@given(
    st.tuples(st.floats(0.0, 6.3), st.floats(-1.1, 1.1)),
    st.floats(0.4, 2.5),
    st.integers(0, 2**32 - 1),
    st.floats(0.01, 100.0),
)
def test_framed_points_are_in_the_picture_and_not_from_closer(
    angles: tuple[float, float], aspect: float, seed: int, size: float
) -> None:
    azimuth, elevation = angles
    flat = np.array([np.cos(azimuth), np.sin(azimuth), np.tan(elevation)])
    points = size * np.random.default_rng(seed).uniform(-6.0, 9.0, (20, 3))
    eye, target = framing(points, flat, aspect)

    def places(points: FloatArray, eye: FloatArray) -> FloatArray:
        return places_in_picture(points, eye, target, FIELD_OF_VIEW, aspect)

    assert are_in_picture(places(points, eye))
    closer = target + 0.85 * (eye - target)
    assert not are_in_picture(places(points, closer))
    # Whoever comes closer to a part still sees something, unlike from far away or beside it.
    assert not are_out_of_sight(places(points, closer))
    assert are_out_of_sight(places(points, target + 8.0 * (eye - target)))
    assert are_out_of_sight(places(points + 9.0 * np.cross(eye - target, (0.0, 0.0, 1.0)), eye))
    # Nothing behind a camera is in its picture, if it has perspective.
    if has_perspective(target - eye):
        behind = 2.0 * eye - target + 0.0 * points
        assert not are_in_picture(places(behind, eye))
        assert are_out_of_sight(places(behind, eye))


@pytest.mark.parametrize("axis", [*np.eye(3), *-np.eye(3)], ids=str)
def test_camera_has_no_perspective_along_an_axis_alone(axis: FloatArray) -> None:
    upright = axis + [0.0, -1e-4, 0.0] if axis[2] else axis
    assert not has_perspective(3.0 * upright)
    assert has_perspective(3.0 * (upright + 0.01 * np.array([0.3, 0.5, 0.8])))


def test_camera_follows_what_leaves_its_picture_and_keeps_its_direction(
    browser: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    points, first = POINTS.copy(), SimpleNamespace()

    def look(_: Any, eye: FloatArray, target: FloatArray, __: float) -> None:
        browser.puts.append(eye)
        browser.camera.look_at = target
        browser.tell(eye)

    def count_puts_with(factor: float) -> int:
        points[:] *= factor
        cameras.follow([browser])
        return len(browser.puts)

    browser.camera.fov = FIELD_OF_VIEW
    cameras = Cameras(cast("Any", first), lambda: points)
    monkeypatch.setattr("explorer.app.scene.camera.put_camera", look)
    cameras.frame_first()
    cameras.connected(browser)
    assert count_puts_with(1.0) == 1
    # The user turns it to where everything is seen.
    eye, target = framing(points, np.array([-1.0, -0.4, 0.3]), 0.7)
    browser.camera.look_at = target
    browser.tell(target + 1.2 * (eye - target))
    assert count_puts_with(1.1) == 1
    assert count_puts_with(2.0) == 2
    towards = (browser.camera.position - browser.camera.look_at) / (eye - target)
    assert np.ptp(towards) < 1e-9
    # The user comes closer to look at a part, and stays there.
    browser.tell(browser.camera.look_at + 0.3 * (eye - target))
    assert count_puts_with(1.5) == 2
    # Whatever it looks at, it finds a mechanism that has become tiny or huge.
    for times, factor in enumerate((1e-4, 1e4, 1e3, 1e-3), 3):
        assert count_puts_with(factor) == times
        camera = browser.camera
        assert are_in_picture(
            places_in_picture(points, camera.position, camera.look_at, FIELD_OF_VIEW, 0.7)
        )
