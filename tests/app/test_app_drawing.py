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
from explorer.mechanism.design import Design, Limits
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


def test_a_margin_of_zero_is_singular_and_a_large_one_is_far() -> None:
    assert proximity_colour(0.0) == SINGULAR
    assert proximity_colour(FAR_WARNINGS) == proximity_colour(1e9) == FAR


@given(st.floats(0.0, 1e3))
def test_colour_depends_on_the_size_of_the_level(level: float) -> None:
    assert proximity_colour(level) == proximity_colour(-level)


def test_luminance_grows_on_either_side_towards_the_warning_length() -> None:
    below = [luminance(proximity_colour(x)) for x in np.linspace(0.0, 0.999, 30)]
    above = [luminance(proximity_colour(x)) for x in np.linspace(1.0, FAR_WARNINGS, 30)]
    assert below == sorted(below)
    assert above == sorted(above, reverse=True)


def test_warned_and_clear_are_told_apart_without_green_cones() -> None:
    warned = [as_deuteranope(proximity_colour(x)) for x in np.linspace(0.0, 0.99, 20)]
    clear = [as_deuteranope(proximity_colour(x)) for x in np.linspace(1.0, FAR_WARNINGS, 20)]
    assert min(float(np.linalg.norm(a - b)) for a in warned for b in clear) > 60.0


def test_collisions_are_told_from_limits_without_green_cones_and_in_grey() -> None:
    off = as_deuteranope(COLLIDING) - as_deuteranope(PLAIN)
    assert float(np.linalg.norm(off)) > 60.0
    assert luminance(PLAIN) > 2.0 * luminance(COLLIDING)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.5])
@pytest.mark.parametrize("design", PRESETS.values(), ids=str)
def test_every_view_holds_the_whole_mechanism(
    design: Design, view: ViewName, aspect: float
) -> None:
    points = around(np.array(list(Placed(Frame(opened(design))).points.values())))
    eye, target = framing(points, view, aspect)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    seen = points - eye
    # Without perspective all is as large as at the target.
    distance = float(np.linalg.norm(target - eye))
    depth = seen @ forward if view == "isometric" else np.full(len(points), distance)
    half = np.tan(0.5 * FIELD_OF_VIEW)
    across = np.abs(seen @ right) / (half * aspect * depth)
    upward = np.abs(seen @ up) / (half * depth)
    assert depth.min() > 0.0
    assert across.max() <= 1.0
    assert upward.max() <= 1.0
    # And no farther away than that needs.
    assert max(across.max(), upward.max()) > 0.9


@given(st.floats(1e-20, 1e20))
def test_scenes_are_about_ten_units_large_whatever_the_design(reach: float) -> None:
    step = round_step(reach / 10.0)
    assert 6.3 <= reach / step <= 15.9
    assert float(f"{step:.0e}"[0]) in (1.0, 2.0, 5.0)


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_squares_of_the_ground_are_as_large_as_they_are_said_to_be(
    factor: float, unit_mm: float
) -> None:
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
def test_number_fields_show_the_decimals_of_their_step(step: float, digits: int) -> None:
    assert decimals(step) == digits


@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=1, max_size=8))
def test_rods_point_where_they_should(directions: list[tuple[float, float, float]]) -> None:
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


def test_the_summary_names_what_the_pose_breaks_and_how_near_it_is() -> None:
    clear = summary(Frame(opened(OPTIMAL)))
    assert "Clear of singularities" in clear
    assert "Within all limits" in clear
    assert ">−9.00<" in distance_table(Frame(opened(OPTIMAL)))
    near = summary(Frame(opened(OPTIMAL, Pose.of_yaw_pitch_roll((10, 5, 0.5), (-73.1, 0, 0)))))
    assert "Near a singularity" in near
    flat = summary(Frame(opened(OPTIMAL, Pose.of_yaw_pitch_roll((10, 5, 0), (-73.1, 20, 0)))))
    assert "δ3 = 0: b4 on the base plane" in flat
    assert "Singular<" in flat
    outside = summary(Frame(opened(OPTIMAL, Pose.of_yaw_pitch_roll((10, 5, 19), (-73.1, 0, 0)))))
    assert "box z = 19 is above its maximum 18" in outside


def of_size(factor: float) -> Design:
    """Return the optimal design so many times as large, without limits."""
    a3, b1 = (tuple(factor * x for x in pair) for pair in (OPTIMAL.a3, OPTIMAL.b1))
    return msgspec.structs.replace(
        OPTIMAL, a3=a3, b1=b1, b2=factor * OPTIMAL.b2, b3=factor * OPTIMAL.b3, limits=Limits()
    )


@pytest.mark.parametrize(
    ("factor", "margin"),
    [
        (1e-4, "−0.000900"),
        (1.0, "−9.00"),
        (1e4, "−90,000"),
        (1e9, "−9 × 10⁹"),
    ],
)
def test_margins_are_told_to_the_same_share_of_every_size(factor: float, margin: str) -> None:
    pose = Pose.of_yaw_pitch_roll((10 * factor, 5 * factor, 9 * factor), (-73.1, 0, 0))
    html = distance_table(Frame(opened(of_size(factor), pose)))
    assert f">{margin}<" in html
    assert "units³" in html


def test_what_is_small_is_not_told_as_nothing() -> None:
    assert share(0.0308) == "0.0308"
    assert share(1.651e-9) == "1.65 × 10⁻⁹"
    assert share(0.0) == "0.0000"
    thin = msgspec.structs.replace(OPTIMAL, b3=OPTIMAL.b2 + 1e-6)
    text = re.sub(r"<[^>]+>", " ", measures_table(Frame(opened(thin))))
    # Below a millionth, as its power of ten says.
    assert re.search(r"1/cond J\s+[1-9]\S* × 10⁻[⁷⁸⁹]", text)
