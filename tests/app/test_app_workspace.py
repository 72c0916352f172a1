"""The panel of the workspace: its volume, what it shows, the cut, the map and files."""

from __future__ import annotations

import html
import itertools
import json
import re
from dataclasses import replace
from typing import Any, Literal

import msgspec
import numpy as np
import pytest
from desk import CLIENT, Desk
from services import StubDownloads, services_for
from workspace_feeds import drawing_of, follow

from explorer.app.features.feature import Services
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.files import FORMATS, WorkspaceFiles
from explorer.app.features.workspace.orientation import workspace_rotation
from explorer.app.features.workspace.panel import SHOWN, WorkspacePanel
from explorer.app.features.workspace.slice_map import cut_loops, map_picture
from explorer.app.features.workspace.volume import VolumeFeed
from explorer.app.features.workspace.words import volume_headline
from explorer.app.state.actions import Set, SetAngle, SetPosition, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.export.report.drawings.slices import Slices
from explorer.measures.verdict import warnings
from explorer.mechanism.design import Swing
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose, rotation_from_yaw_pitch_roll
from explorer.numerics.number_text import format_number
from explorer.singularity.jacobian import inverse_condition, jacobian
from explorer.workspace.limits.constraints import HalfSpace
from explorer.workspace.position_bands import position_bands
from explorer.workspace.slices.outline import slice_outline
from explorer.workspace.slices.volume import workspace_volume
from explorer.workspace.solids.solids import cut_solid, workspace_solid

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
Axis = Literal["x", "y", "z"]
AXES: tuple[Axis, ...] = ("x", "y", "z")


def with_workspace(state: State, **changes: Any) -> State:
    return Set("view.workspace", replace(state.view.workspace, **changes)).apply(state)


# The volume


def test_volume_is_known_while_the_solid_is_not_shown() -> None:
    services, first = services_for(), opened(OPTIMAL)
    feed = services.get(VolumeFeed)
    assert feed.text.words == "–"
    assert "computing" in volume_headline(Frame(first), feed)
    for state in (first, SetVariable("a3x", 17.0).apply(first)):
        feed.follow(Frame(state))
        assert not feed.text.is_current
        follow(services, state)
        expected = workspace_volume(state.design, state.pose.rotation)
        assert services.get(WorkspaceFeed).drawing is None
        assert feed.text.is_current
        assert feed.text.words == f"{format_number(expected.volume, 6)} units³"
        words = volume_headline(Frame(state), feed)
        assert feed.text.words in words
        # One unit of the design is a centimetre.
        litres = format_number(expected.volume, 4), format_number(0.001 * expected.volume, 4)
        assert f"{litres[0]} cm³ ({litres[1]} l)" in words
        assert "±" in words


def test_volume_is_that_of_the_orientation_that_is_chosen() -> None:
    services, state = services_for(), SetAngle(1, 20.0).apply(opened(OPTIMAL))
    texts = [services.get(VolumeFeed).text.words]
    for orientation in ("pose", "home"):
        chosen = with_workspace(state, orientation=orientation)
        follow(services, chosen)
        expected = workspace_volume(OPTIMAL, workspace_rotation(Frame(chosen))).volume
        texts.append(services.get(VolumeFeed).text.words)
        assert texts[-1] == f"{format_number(expected, 6)} units³"
        assert f"in the {'present' if orientation == 'pose' else 'home'} orientation" in (
            volume_headline(Frame(chosen), services.get(VolumeFeed))
        )
    assert len(set(texts)) == 3


def test_volume_is_requested_before_the_drawing_and_once_only() -> None:
    services, state = services_for(), with_workspace(opened(OPTIMAL), solid=True)
    # Neither another position nor another colour changes it.
    for other in (state, SetPosition(2, 8.0).apply(state), with_workspace(state, colour="margin")):
        worker = follow(services, other)
    tasks = [order.task.__name__ for order in worker.orders]
    assert tasks == ["measure_volume", "draw_workspace", "draw_workspace"]


def test_empty_workspace_names_what_empties_it_instead_of_a_volume() -> None:
    limits = msgspec.structs.replace(OPTIMAL.limits, l1=(0.0, 1.0), box=((10.0,) * 3, (11.0,) * 3))
    services, state = services_for(), Set("design.limits", limits).apply(opened(OPTIMAL))
    follow(services, state)
    words = volume_headline(Frame(state), services.get(VolumeFeed))
    assert "The workspace is empty" in words
    assert services.get(VolumeFeed).text.words == "empty"
    assert "l1 maximum" in words
    assert drawing_of(with_workspace(state, solid=True, cut="x")).slice_map is None


# What is shown


@pytest.mark.parametrize("name", list(SHOWN))
def test_chip_switches_what_is_shown_on_and_off(services: Services, desk: Desk, name: str) -> None:
    panel = WorkspacePanel(services)
    before = desk.state.view.workspace
    desk.press(services.buttons, "workspace.show", name)
    assert desk.state.view.workspace == replace(before, **{name: not getattr(before, name)})
    pressed = f'data-value="{name}"[^>]*aria-pressed="true"'
    content = [str(v) for _, n, v in panel.updates(Frame(desk.state)) if n == "content"]
    is_on = not getattr(before, name)
    assert any(re.search(pressed, each) for each in content) is is_on
    desk.press(services.buttons, "workspace.show", name)
    assert desk.state.view.workspace == before


def test_region_sets_the_start_of_the_paths(services: Services, desk: Desk) -> None:
    panel = WorkspacePanel(services)
    chosen = next(
        handle
        for handle, _, _ in panel.updates(Frame(desk.state))
        if getattr(handle, "label", "") == "Region"
    )
    for words, expected in (
        ("accessible from the present position", ("accessible", "pose")),
        ("accessible from home", ("accessible", "home")),
        ("within the limits", ("limits", "home")),
    ):
        desk.use(chosen, words)
        view = desk.state.view.workspace
        assert (view.region, view.start) == expected
        shown_words = {
            v for h, n, v in panel.updates(Frame(desk.state)) if h is chosen and n == "value"
        }
        assert shown_words <= {words}


# The cut


def test_cut_shows_the_solid_and_goes_through_its_middle_on_every_axis(
    services: Services, desk: Desk
) -> None:
    WorkspacePanel(services)
    desk.session.do(Set("view.workspace.solid", False))
    for axis in AXES:
        desk.session.do(Set("view.workspace.level", 3.0))
        desk.press(services.buttons, "workspace.cut", axis)
        state = desk.state
        assert state.view.workspace.solid
        drawing = drawing_of(state)
        assert drawing.extent is not None
        low, high = (float(end["xyz".index(axis)]) for end in drawing.extent)
        assert drawing.level == pytest.approx(0.5 * (low + high))
        # The same axis again leaves the level where it is.
        desk.session.do(Set("view.workspace.level", 3.0))
        desk.press(services.buttons, "workspace.cut", axis)
        assert desk.state.view.workspace.level == 3.0
    desk.press(services.buttons, "workspace.cut", "none")
    assert desk.state.view.workspace.cut is None


def test_slider_of_the_cut_spans_the_extent_and_follows_the_design(services: Services) -> None:
    state = with_workspace(opened(OPTIMAL), solid=True, cut="y")
    for changed in (state, SetVariable("a3x", 14.0).apply(state)):
        follow(services, changed)
        extent = drawing_of(changed).extent
        assert extent is not None
        low, high = (float(end[1]) for end in extent)
        found: dict[str, Any] = {
            name: value
            for handle, name, value in services.get(WorkspacePanel).updates(Frame(changed))
            if getattr(handle, "label", "") == "Cut at"
        }
        assert (found["min"], found["max"]) == pytest.approx((low, high), abs=0.01)
        assert found["value"] == pytest.approx(0.5 * (low + high))
    # A level that the new workspace leaves out gives way to the middle.
    assert drawing_of(with_workspace(changed, level=high + 1.0)).level == found["value"]


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("name", list(PRESETS))
def test_extent_of_the_cut_is_that_of_the_limits_rather_than_of_facets(
    name: str, axis: Axis
) -> None:
    """A slice just within the extent is not empty, and one just beyond is."""
    design = PRESETS[name]
    drawing = drawing_of(with_workspace(opened(design), solid=True, cut=axis))
    assert drawing.extent is not None
    index = "xyz".index(axis)
    rotation = np.array(drawing.request.rotation)
    for end, outward in zip(drawing.extent, (-1.0, 1.0), strict=True):
        inner, outer = (
            slice_outline(design, rotation, axis, float(end[index]) + outward * off)
            for off in (-1e-3, 1e-3)
        )
        assert inner is not None
        assert outer is not None
        assert inner.loops
        assert outer.area == 0.0


@pytest.mark.parametrize("axis", AXES)
def test_switch_of_the_cut_keeps_the_other_side(services: Services, desk: Desk, axis: Axis) -> None:
    """By default the side is taken that faces the isometric camera, from +x, −y and +z."""
    WorkspacePanel(services)
    desk.press(services.buttons, "workspace.cut", axis)
    index = "xyz".index(axis)
    near = drawing_of(desk.state)
    desk.press(services.buttons, "workspace.cut", "flip")
    assert desk.state.view.workspace.flipped
    far = drawing_of(desk.state)
    assert near.level is not None
    # The camera's direction, by axis: see `explorer.app.scene.camera`.
    sign = (1.0, -1.0, 1.0)[index]
    for drawing, side in ((near, -sign), (far, sign)):
        corners = np.concatenate([shell.vertices for shell in drawing.surface.shells])[:, index]
        assert (side * (corners - near.level)).min() == pytest.approx(0.0, abs=1e-9)
    volumes: list[float] = []
    for side in (-1.0, 1.0):
        solid = workspace_solid(OPTIMAL, np.array(near.request.rotation), 0.1)
        volumes.append(
            cut_solid(solid, HalfSpace("cut", side * np.eye(3)[index], side * near.level)).volume
        )
    assert sum(volumes) == pytest.approx(solid.volume)


# The map


ORIENTATIONS = ((-73.1, 0.0, 0.0), (-40.0, 25.0, 10.0), (-60.0, -20.0, 35.0))


def facts_of(picture: str) -> dict[str, Any]:
    (data,) = re.findall(r'data-map="([^"]*)"', picture)
    return json.loads(html.unescape(data))


@pytest.mark.parametrize(("axis", "angles"), [*zip(AXES, ORIENTATIONS, strict=True)])
def test_map_has_its_place_and_its_margins_for_the_page(
    axis: Axis, angles: tuple[float, float, float]
) -> None:
    pose = Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), angles)
    state = with_workspace(opened(OPTIMAL, pose), solid=True, cut=axis)
    drawing = drawing_of(state)
    assert drawing.slice_map is not None
    picture = map_picture(drawing.slice_map, pose.position, OPTIMAL.reach)
    facts = facts_of(picture)
    assert facts["axis"] == "xyz".index(axis)
    assert facts["level"] == drawing.level
    points = np.random.default_rng(4).normal(0.0, 10.0, (50, 3))
    np.testing.assert_allclose(
        points @ np.array(facts["gradients"]).T, margins(points, pose.rotation), atol=1e-12
    )
    # Its own coordinates, placed in the picture, are the places that the page reads.
    (matrix,) = re.findall(r'<g transform="matrix\(([^)]*)\)" data-within', picture)
    a, b, c, d, e, f = map(float, matrix.split())
    left, bottom, scale = facts["place"]
    assert (b, c) == (0.0, 0.0)
    assert (e, f) == pytest.approx((left, bottom), rel=1e-5)
    own = drawing.slice_map.own_scale
    assert (a * own, d * own) == pytest.approx((scale, -scale), rel=1e-5)


@pytest.mark.parametrize("axis", AXES)
def test_map_has_the_exact_outline_of_the_slice(axis: Axis) -> None:
    drawing = drawing_of(with_workspace(opened(OPTIMAL), solid=True, cut=axis))
    drawn = drawing.slice_map
    assert drawn is not None
    rotation = np.array(drawing.request.rotation)
    outline = slice_outline(OPTIMAL, rotation, axis, drawn.level)
    assert outline is not None
    (data,) = re.findall(r'<path d="([^"]*)" class="edge"', drawn.markup)
    assert data.count("A") >= sum(e.centre is not None for loop in outline.loops for e in loop)
    corners = np.array(
        [
            [float(x) for x in each.split(",")]
            for each in re.findall(r"(-?[\d.]+,-?[\d.]+)(?=[MLAZ])", data)
        ]
    )
    expected = np.array([edge.end for loop in outline.loops for edge in loop])
    places = corners / drawn.own_scale + np.array(drawn.lows)
    for point in expected:
        assert np.linalg.norm(places - point, axis=1).min() < 2e-3


def test_map_with_limits_on_swings_has_an_outline_too() -> None:
    limits = msgspec.structs.replace(OPTIMAL.limits, swing=Swing(b4=50.0, a1=70.0))
    design = msgspec.structs.replace(OPTIMAL, limits=limits)
    drawing = drawing_of(with_workspace(opened(design), solid=True, cut="z"))
    assert drawing.slice_map is not None
    assert 'class="edge"' in drawing.slice_map.markup
    assert drawing.volume < 7000.0


def test_b4_is_a_cross_where_it_is_and_faint_beside_the_slice() -> None:
    state = opened(OPTIMAL)
    drawn = drawing_of(with_workspace(state, solid=True, cut="y")).slice_map
    assert drawn is not None
    for y, look in ((drawn.level, "ex-here"), (drawn.level + 1.0, "ex-here is-off")):
        pose = Pose((7.0, y, 6.0), state.pose.quaternion)
        picture = map_picture(drawn, pose.position, OPTIMAL.reach)
        assert f'class="{look}"' in picture
        left, bottom, scale = facts_of(picture)["place"]
        (x, across) = re.findall(r'd="M([\d.]+),([\d.]+)h10m-5,-5v10"', picture)[0]
        assert float(x) + 5.0 == pytest.approx(left + scale * (7.0 - drawn.lows[0]), abs=0.01)
        assert float(across) == pytest.approx(bottom - scale * (6.0 - drawn.lows[1]), abs=0.01)
    away = Pose((70.0, drawn.level, 6.0), state.pose.quaternion)
    assert "ex-here" not in map_picture(drawn, away.position, OPTIMAL.reach)


@pytest.mark.parametrize("angles", ORIENTATIONS)
def test_bands_of_the_condition_number_end_at_its_levels(
    angles: tuple[float, float, float],
) -> None:
    rotation = rotation_from_yaw_pitch_roll(angles)
    solid = workspace_solid(OPTIMAL, rotation, 0.1)
    extent = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    bands = position_bands(OPTIMAL, rotation, "condition", warn_below=1.0)
    warn = warnings(OPTIMAL.reach, 1.0).condition
    slices = Slices.of(OPTIMAL, rotation, extent, bands)
    level, ends = 5.0, (slices.lows[[0, 2]], slices.highs[[0, 2]])
    beyond = slices.beyond("y", level)
    errors: list[float] = []
    for share in (0.5, 1.0, 2.0):
        for polygon in beyond(share):
            inner = ((polygon > ends[0] + 1e-9) & (polygon < ends[1] - 1e-9)).all(axis=1)
            points = np.insert(polygon[inner], 1, level, axis=1)
            values = inverse_condition(jacobian(OPTIMAL, points, rotation), OPTIMAL.reach)
            errors.extend(np.abs(values / warn / share - 1.0).tolist())
    assert len(errors) > 100
    assert float(np.quantile(errors, 0.99)) < 0.05


@pytest.mark.parametrize("axis", range(3))
def test_polygons_around_a_cut_have_the_area_of_its_faces(axis: int) -> None:
    solid = workspace_solid(OPTIMAL, None, 0.1)
    level = (10.0, 5.0, 6.0)[axis]
    half = cut_solid(solid, HalfSpace("cut", np.eye(3)[axis], level))
    first, second = (k for k in range(3) if k != axis)
    loops = cut_loops(half, (first, second))
    outline = slice_outline(OPTIMAL, Frame(opened(OPTIMAL)).snapshot.rotation, "xyz"[axis], level)
    assert outline is not None
    # The shoelace formula.
    area = sum(
        0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
        for x, y in (loop.T for loop in loops)
    )
    assert abs(area) == pytest.approx(outline.area, rel=2e-3)
    assert cut_loops(solid, (first, second)) == []


@pytest.mark.parametrize(
    "text", ["", "[1,2]", "[1,2,3,4]", '["1",2,3]', "[1e999,2,3]", "[NaN,1,2]", "{}", "[1,2,1e13]"]
)
def test_press_without_a_position_goes_nowhere(services: Services, desk: Desk, text: str) -> None:
    WorkspacePanel(services)
    before = desk.state
    desk.press(services.buttons, "workspace.go", text)
    assert desk.state is before


# Files


def test_files_are_sent_in_the_format_that_is_asked_for(services: Services, desk: Desk) -> None:
    files, downloads = services.get(WorkspaceFiles), services.downloads
    assert isinstance(downloads, StubDownloads)
    for what, file_format in itertools.product(("workspace", "hull"), FORMATS):
        files.send(what, file_format, CLIENT.client_id)
        assert downloads.sent[-1] == (CLIENT.client_id, f"paper-optimal-{what}.{file_format}")
    desk.session.do(Set("view.workspace.region", "accessible"))
    assert desk.state.view.workspace.region == "accessible"
    files.send("hull", "stl", CLIENT.client_id)
    assert downloads.sent[-1][1] == "paper-optimal-accessible-hull.stl"
    files.send_hull_at_home("3mf", CLIENT.client_id)
    assert downloads.sent[-1][1] == "paper-optimal-hull.3mf"
