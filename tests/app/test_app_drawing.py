"""What is drawn, looked at without a browser: colours, marks, framing, text."""

from __future__ import annotations

import re

import msgspec
import numpy as np
import pytest
from hypothesis import given, strategies as st
from limited_designs import scaled_design

from explorer.app.features.singularity.distance import distance_table
from explorer.app.features.singularity.panel import measures_table, summary
from explorer.app.inputs.tracks import decimals
from explorer.app.scene.bands import COLLIDING, PLAIN
from explorer.app.scene.camera import FIELD_OF_VIEW, VIEWS, ViewName, framing
from explorer.app.scene.part import around
from explorer.app.scene.placing import Placed, round_step
from explorer.app.scene.shapes import cylinder, plate, sphere, turned_to
from explorer.app.state.frame import Frame
from explorer.app.state.state import opened
from explorer.app.widgets.colours import FAR, FAR_WARNINGS, SINGULAR, Rgb, proximity_colour
from explorer.app.widgets.markup import share
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray, IntArray

OPTIMAL = PRESETS["paper-optimal"]


def luminance(colour: Rgb) -> float:
    """Return the relative luminance of an sRGB colour, 0 to 1."""
    linear = (np.array(colour) / 255.0) ** 2.2
    return float(linear @ [0.2126, 0.7152, 0.0722])


def as_deuteranope(colour: Rgb) -> FloatArray:
    """Return the colour as seen without green cones (Viénot, Brettel and Mollon 1999)."""
    linear = (np.array(colour) / 255.0) ** 2.2
    matrix = [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]]
    return np.clip(matrix @ linear, 0.0, 1.0) ** (1 / 2.2) * 255.0


@given(st.floats(0.0, 1e3))
def test_colour_depends_on_the_size_of_the_level(level: float) -> None:
    assert proximity_colour(level) == proximity_colour(-level)
    assert proximity_colour(0.0) == SINGULAR
    assert proximity_colour(FAR_WARNINGS + level) == FAR


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


def test_colours_of_collisions_and_limits_differ_without_green_cones_and_in_grey() -> None:
    off = as_deuteranope(COLLIDING) - as_deuteranope(PLAIN)
    assert float(np.linalg.norm(off)) > 60.0
    assert luminance(PLAIN) > 2.0 * luminance(COLLIDING)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.5])
@pytest.mark.parametrize("design", PRESETS.values(), ids=str)
def test_view_holds_the_whole_mechanism_and_little_more(
    design: Design, view: ViewName, aspect: float
) -> None:
    points = around(np.array(list(Placed(Frame(opened(design))).points.values())))
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


@given(st.floats(1e-20, 1e20))
def test_scenes_are_about_ten_units_large_whatever_the_design(reach: float) -> None:
    step = round_step(reach / 10.0)
    assert 6.3 <= reach / step <= 15.9
    assert float(f"{step:.0e}"[0]) in (1.0, 2.0, 5.0)


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_squares_of_the_ground_have_the_size_of_their_label(factor: float, unit_mm: float) -> None:
    design = scaled_design(PRESETS["paper-optimal"], factor)
    placed = Placed(Frame(opened(msgspec.structs.replace(design, unit_mm=unit_mm))))
    assert float(f"{placed.square_mm:.6e}"[0]) in (1.0, 2.0, 5.0)
    assert f"{placed.square_mm:.6e}"[1:8] == ".000000"
    # Along the base's axis lie as many squares as a2 is millimetres away.
    drawn = float(np.linalg.norm(placed.points["a2"] - placed.points["a1"]))
    real = unit_mm * float(np.linalg.norm(placed.frame.snapshot.points.a2))
    assert drawn / placed.square == pytest.approx(real / placed.square_mm)
    assert 0.5 <= placed.square <= 2.0


@pytest.mark.parametrize(("step", "digits"), [(1.0, 0), (0.1, 1), (0.001, 3), (10.0, 0), (0.25, 2)])
def test_number_field_shows_the_decimals_of_its_step(step: float, digits: int) -> None:
    assert decimals(step) == digits


@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=1, max_size=8))
def test_rod_points_in_its_direction(directions: list[tuple[float, float, float]]) -> None:
    array = np.array(directions)
    lengths = np.linalg.norm(array, axis=1)
    wxyz = turned_to(array)
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


@pytest.mark.parametrize(
    ("z", "pitch", "words"),
    [
        (9.0, 0, "Clear of singularities"),
        (9.0, 0, "Within all limits"),
        (0.5, 0, "Near a singularity"),
        (0.0, 20, "δ3 = 0: b4 on the base plane"),
        (0.0, 20, "Singular<"),
        (19.0, 0, "box z = 19 is above its maximum 18"),
    ],
)
def test_summary_names_broken_limits_and_nearness(z: float, pitch: float, words: str) -> None:
    pose = Pose.of_yaw_pitch_roll((10, 5, z), (-73.1, pitch, 0))
    assert words in summary(Frame(opened(OPTIMAL, pose)))


@pytest.mark.parametrize(
    ("factor", "margin"), [(1e-4, "−0.000900"), (1.0, "−9.00"), (1e4, "−90,000"), (1e9, "−9 × 10⁹")]
)
def test_margins_of_every_size_have_as_many_digits(factor: float, margin: str) -> None:
    pose = Pose.of_yaw_pitch_roll((10 * factor, 5 * factor, 9 * factor), (-73.1, 0, 0))
    html = distance_table(Frame(opened(scaled_design(OPTIMAL, factor), pose)))
    assert f">{margin}<" in html
    assert "units³" in html


def test_small_share_is_not_shown_as_zero() -> None:
    assert share(0.0308) == "0.0308"
    assert share(1.651e-9) == "1.65 × 10⁻⁹"
    assert share(0.0) == "0.0000"
    thin = msgspec.structs.replace(OPTIMAL, b3=OPTIMAL.b2 + 1e-6)
    text = re.sub(r"<[^>]+>", " ", measures_table(Frame(opened(thin))))
    # Below a millionth, as its power of ten says.
    assert re.search(r"1/cond J\s+[1-9]\S* × 10⁻[⁷⁸⁹]", text)
