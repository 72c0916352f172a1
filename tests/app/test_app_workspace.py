"""The workspace on the page: its volume, the cut, the map, files, and what a load leaves of it."""

from __future__ import annotations

import html
import io
import itertools
import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import msgspec
import numpy as np
import pytest
import trimesh
from desk import CLIENT, Desk, ScriptedBrowser, markup_of
from machines import six
from services import StubDownloads, services_for
from workspace_feeds import drawing_of, follow

from explorer.app.features.feature import Services
from explorer.app.features.workspace import feeds
from explorer.app.features.workspace.feature import WorkspacePanel
from explorer.app.features.workspace.slice_map import map_picture
from explorer.app.features.workspace.words import drawing_words, volume_headline, volume_text
from explorer.app.features.workspace.work import STEP, Selection, WorkspaceDrawing, export_mesh
from explorer.app.scene.surfaces import AT_LIMIT, PLAIN
from explorer.app.state.actions import Set, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import set_position
from explorer.app.state.state import State, open_state
from explorer.app.state.view import ForcesView
from explorer.errors import InputError
from explorer.measures.blocks.block import UTILISATION_EDGES
from explorer.measures.position_bands import STEP_COLOURS, UTILISATION_COLOURS
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Actuators, Guide, Payload, Struts, Tool
from explorer.mechanism.margins import margins, planes_of_singularity
from explorer.mechanism.pose import Pose
from explorer.motion.weights import MovingBodies, payload_wrench
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import UNITS, format_number
from explorer.statics.accuracy import worst_error
from explorer.statics.compliance import compliance, deflection, stiffness_of
from explorer.statics.reactions import limit_shares, reactions
from explorer.workspace.carried_region import carried_region
from explorer.workspace.slices.outline import slice_outline
from explorer.workspace.slices.volume import workspace_volume
from explorer.workspace.workspace import Workspace

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
Axis = Literal["x", "y", "z"]
AXES: tuple[Axis, ...] = ("x", "y", "z")


def with_workspace(state: State, **changes: Any) -> State:
    return Set("view.workspace", replace(state.view.workspace, **changes)).apply(state)


# The volume


def test_volume_is_known_while_the_solid_is_not_shown() -> None:
    services, first = services_for(), open_state(OPTIMAL)
    feed = services.get(feeds.VOLUME_FEED)
    assert volume_text(feed.drawing, UNITS) == "–"
    assert "Computing" in volume_headline(Frame(first), feed)
    for state in (first, set_variable("a3x", 17.0).apply(first)):
        feed.follow(Frame(state))
        assert not feed.is_current
        follow(services, state)
        expected = workspace_volume(state.design, state.pose.rotation)
        assert services.get(feeds.WORKSPACE_FEED).drawing is None
        assert feed.is_current
        assert volume_text(feed.drawing, UNITS) == f"{format_number(expected.volume)} units³"
        words = volume_headline(Frame(state), feed)
        # One unit of the design is a centimetre.
        assert f"{format_number(expected.volume)} cm³" in words
        assert "units" not in words
        assert "±" in words


def test_volume_is_requested_before_the_drawing_and_once_only() -> None:
    services, state = services_for(), with_workspace(open_state(OPTIMAL), solid=True)
    # Neither another position nor another colour changes it.
    for other in (state, set_position(2, 8.0).apply(state), with_workspace(state, colour="margin")):
        worker = follow(services, other)
    tasks = [order.task.__name__ for order in worker.orders]
    assert tasks == ["measure_volume", "draw_workspace", "draw_workspace"]


def test_empty_workspace_names_what_empties_it_instead_of_a_volume() -> None:
    limits = msgspec.structs.replace(OPTIMAL.limits, l1=(0.0, 1.0), box=((10.0,) * 3, (11.0,) * 3))
    services, state = services_for(), Set("design.limits", limits).apply(open_state(OPTIMAL))
    follow(services, state)
    words = volume_headline(Frame(state), services.get(feeds.VOLUME_FEED))
    assert "The workspace is empty" in words
    assert "l1 maximum" in words
    assert drawing_of(with_workspace(state, solid=True, cut="x")).slice_map is None


# What is shown


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
        assert drawing.slice_map is not None
        assert drawing.slice_map.level == pytest.approx(0.5 * (low + high))
        # The same axis again leaves the level where it is.
        desk.session.do(Set("view.workspace.level", 3.0))
        desk.press(services.buttons, "workspace.cut", axis)
        assert desk.state.view.workspace.level == 3.0
    desk.press(services.buttons, "workspace.cut", "none")
    assert desk.state.view.workspace.cut is None


def test_slider_of_the_cut_spans_the_extent_and_follows_the_design(services: Services) -> None:
    state = with_workspace(open_state(OPTIMAL), solid=True, cut="y")
    for changed in (state, set_variable("a3x", 14.0).apply(state)):
        follow(services, changed)
        extent = drawing_of(changed).extent
        assert extent is not None
        low, high = (OPTIMAL.unit_mm * float(end[1]) for end in extent)
        found: dict[str, Any] = {
            name: value
            for handle, name, value in services.get(WorkspacePanel).updates(Frame(changed))
            if str(getattr(handle, "label", "")).startswith("Cut at")
        }
        assert (found["min"], found["max"]) == pytest.approx((low, high), abs=1.0)
        assert found["value"] == pytest.approx(0.5 * (low + high))
    # A level that the new workspace leaves out gives way to the middle.
    mapped = drawing_of(with_workspace(changed, level=high)).slice_map
    assert mapped is not None
    assert OPTIMAL.unit_mm * mapped.level == pytest.approx(found["value"])


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
    assert near.slice_map is not None
    # The camera's direction, by axis: see `explorer.app.scene.camera`.
    sign = (1.0, -1.0, 1.0)[index]
    for drawing, side in ((near, -sign), (far, sign)):
        corners = np.concatenate([shell.vertices for shell in drawing.surface.shells])[:, index]
        assert (side * (corners - near.slice_map.level)).min() == pytest.approx(0.0, abs=1e-9)


# The map


ORIENTATIONS = ((-73.1, 0.0, 0.0), (-40.0, 25.0, 10.0), (-60.0, -20.0, 35.0))


def facts_of(picture: str) -> dict[str, Any]:
    (data,) = re.findall(r'data-map="([^"]*)"', picture)
    return json.loads(html.unescape(data))


@pytest.mark.parametrize(("axis", "angles"), [*zip(AXES, ORIENTATIONS, strict=True)])
def test_map_has_its_place_for_the_page(axis: Axis, angles: tuple[float, float, float]) -> None:
    pose = Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), angles)
    state = with_workspace(open_state(OPTIMAL, pose), solid=True, cut=axis)
    drawing = drawing_of(state)
    assert drawing.slice_map is not None
    picture = map_picture(drawing.slice_map, pose.position, OPTIMAL.reach, UNITS)
    facts = facts_of(picture)
    assert facts["axis"] == "xyz".index(axis)
    assert facts["level"] == drawing.slice_map.level
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
    drawing = drawing_of(with_workspace(open_state(OPTIMAL), solid=True, cut=axis))
    drawn = drawing.slice_map
    assert drawn is not None
    rotation = np.array(drawing.request.rotation)
    outline = slice_outline(Workspace(OPTIMAL, rotation), axis, drawn.level)
    assert outline is not None
    (data,) = re.findall(r'<path d="([^"]*)" class="edge"', drawn.markup)
    assert data.count("A") >= sum(e.centre is not None for loop in outline for e in loop)
    corners = np.array(
        [
            [float(x) for x in each.split(",")]
            for each in re.findall(r"(-?[\d.]+,-?[\d.]+)(?=[MLAZ])", data)
        ]
    )
    expected = np.array([edge.end for loop in outline for edge in loop])
    places = corners / drawn.own_scale + np.array(drawn.lows)
    for point in expected:
        assert np.linalg.norm(places - point, axis=1).min() < 2e-3


def test_payload_that_does_not_count_has_no_inertia_either() -> None:
    body = Payload(0.5, (0.0, 0.0, 1.0), 3.0, (3.0, 4.0, 5.0))
    state = load_state(msgspec.structs.replace(LOADED, payload=body), ForcesView(weighed="none"))
    assert feeds.loaded_design(state).payload == body.with_mass(0.0)


@pytest.mark.parametrize(
    ("region", "colour"),
    [
        *(("limits", colour) for colour in ("plain", "margin", "condition", "share", "force")),
        ("held", "plain"),
    ],
)
def test_legend_names_the_measure_of_the_map_and_the_levels_of_its_bands(
    services: Services, region: str, colour: str
) -> None:
    state = load_state(region=region, colour=colour, cut="y")
    follow(services, state)
    text = markup_of(WorkspacePanel(services), state)
    mapped = drawing_of(state).slice_map
    assert mapped is not None
    name, read, factor = {
        "margin": ("Smallest |δ| (mm)", "min |δ|", LOADED.unit_mm),
        "condition": ("1 / cond J", "1 / cond J", 1.0),
        "share": ("Largest share of a limit (%)", "largest share of a limit", 100.0),
        "force": ("Largest actuator force (N)", "largest actuator force", 1.0),
    }[mapped.colouring.banded]
    assert f'<span class="ex-dim">{name}</span>' in text
    assert read in mapped.words_at((10.0, 5.0, 9.0), state.unit)
    ticks = text[text.index('class="ex-ticks') :].split("</div>")[0]
    marked = re.findall(r">([\d.,]+)<", ticks)
    levels = [level for level in mapped.colouring.bands.levels if math.isfinite(level)]
    texts = {format_number(factor * level, digits) for level in levels for digits in (2, 3)}
    assert len(marked) > 3
    assert {*marked} <= {*texts, "0"}


def test_b4_is_a_cross_where_it_is_and_faint_beside_the_slice() -> None:
    state = open_state(OPTIMAL)
    drawn = drawing_of(with_workspace(state, solid=True, cut="y")).slice_map
    assert drawn is not None
    for y, look in ((drawn.level, "ex-here"), (drawn.level + 1.0, "ex-here is-off")):
        pose = Pose((7.0, y, 6.0), state.pose.quaternion)
        picture = map_picture(drawn, pose.position, OPTIMAL.reach, UNITS)
        assert f'class="{look}"' in picture
        left, bottom, scale = facts_of(picture)["place"]
        (x, across) = re.findall(r'd="M([\d.]+),([\d.]+)h10m-5,-5v10"', picture)[0]
        assert float(x) + 5.0 == pytest.approx(left + scale * (7.0 - drawn.lows[0]), abs=0.01)
        assert float(across) == pytest.approx(bottom - scale * (6.0 - drawn.lows[1]), abs=0.01)
    away = Pose((70.0, drawn.level, 6.0), state.pose.quaternion)
    assert "ex-here" not in map_picture(drawn, away.position, OPTIMAL.reach, UNITS)


# Files


def test_files_are_sent_in_the_format_that_is_asked_for(services: Services, desk: Desk) -> None:
    downloads = services.downloads
    assert isinstance(downloads, StubDownloads)
    for what, file_format in itertools.product(("workspace", "hull"), feeds.FORMATS):
        feeds.send_workspace(services, what, file_format, CLIENT.client_id)
        assert downloads.sent[-1] == (CLIENT.client_id, f"paper-optimal-{what}.{file_format}")
    desk.session.do(Set("view.workspace.region", "accessible"))
    feeds.send_workspace(services, "hull", "stl", CLIENT.client_id)
    assert downloads.sent[-1][1] == "paper-optimal-accessible-hull.stl"
    desk.session.do(Set("view.workspace.region", "held"))
    feeds.send_workspace(services, "workspace", "3mf", CLIENT.client_id)
    assert downloads.sent[-1][1] == "paper-optimal-workspace-that-holds-the-load.3mf"


# Under the load of the page, and by the precision of the tool


LOADED = msgspec.structs.replace(
    OPTIMAL,
    tool=Tool((1.0, 0.0, 2.0)),
    payload=Payload(0.5, (1.0, 0.0, 1.0), 5.0),
    actuators=Actuators(push_n=(150, 200, 150, 200, 150, 150)),
    struts=Struts(moment_nm=4.0),
)
PRECISE = msgspec.structs.replace(
    LOADED,
    actuators=Actuators(error_mm=six([0.05] * 6), stiffness_n_mm=six([1000.0] * 6)),
    struts=Struts(outer_mm=12.0, inner_mm=10.0),
)
FORCES = ForcesView(force=(3.0, 0.0, -40.0), moment=(0.0, 0.2, 0.0))
# FORCES in N and N × unit.
LOAD = (3.0, 0.0, -40.0, 0.0, 20.0, 0.0)


def load_state(design: Design = LOADED, forces: ForcesView = FORCES, **changes: Any) -> State:
    """Return a design under the forces, with its workspace shown."""
    view = open_state(design).view
    workspace = replace(view.workspace, solid=True, **changes)
    return Set("view", replace(view, forces=forces, workspace=workspace)).apply(open_state(design))


def shares_at(design: Design, points: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the largest shares of a limit at positions (n, 3), by reactions."""
    tool, weights = design.tool.position, MovingBodies().with_payload(design)
    held = reactions(Configuration(design, points, rotation, tool), np.array(LOAD), weights)
    return np.asarray(limit_shares(design, held).max(axis=-1))


def measured(design: Design, colour: str, points: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the measure of a colouring at positions (n, 3), from what statics find there."""
    tool = design.tool.position
    if colour == "plain":
        return np.asarray(np.abs(margins(points, rotation)).min(axis=-1))
    if colour == "condition":
        return Configuration(design, points, rotation).inverse_condition
    if colour == "share":
        return shares_at(design, points, rotation)
    if colour == "error":
        return worst_error(design, points, rotation, six([0.05] * 6), tool).displacement
    if colour == "deflection":
        # The payload's force of any direction does not count.
        wrench = LOAD + payload_wrench(design, rotation)
        soft = compliance(design, points, rotation, *stiffness_of(design), tool)
        return design.unit_mm * np.linalg.norm(deflection(soft, wrench)[:, :3], axis=-1)
    found = reactions(Configuration(design, points, rotation), np.array(LOAD))
    of_parts = np.abs(found.actuators) if colour == "force" else 0.01 * found.bending
    return np.asarray(of_parts.max(axis=-1))


# The bands


def share_off(
    drawing: WorkspaceDrawing,
    bands: dict[Any, tuple[float, float]],
    measure: Callable[[FloatArray], FloatArray],
    tolerance: float,
) -> float:
    """Return the share of the area where a random point of a triangle is off its band."""
    random = np.random.default_rng(2)
    total = off = 0.0
    for shell in drawing.surface.shells:
        low, high = bands[shell.colour]
        corners = shell.vertices[shell.faces]
        weights = random.dirichlet([0.5, 0.5, 0.5], len(corners))
        values = measure((corners * weights[:, :, None]).sum(axis=1))
        sides = np.diff(corners, axis=1)
        areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        # Between its corners the end of a band is straight.
        is_off = (values < low * (1.0 - tolerance)) | (values > high * (1.0 + tolerance))
        off += float(areas[is_off].sum())
        total += float(areas.sum())
    return off / total


@pytest.mark.parametrize("cut", [None, "y"])
def test_surface_lies_in_the_bands_of_the_shares_also_beside_singular_planes(cut: Any) -> None:
    limits = Limits(box=((0.0, -12.0, -10.0), (20.0, 22.0, 18.0)), margin=None)
    design = msgspec.structs.replace(LOADED, limits=limits)
    pose = Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), (-60.0, 20.0, 30.0))
    drawing = drawing_of(replace(load_state(design, colour="share", cut=cut), pose=pose))
    rotation = np.array(drawing.request.rotation)
    bands = dict(
        zip(
            UTILISATION_COLOURS,
            itertools.pairwise((0.0, *UTILISATION_EDGES, math.inf)),
            strict=True,
        )
    )
    assert share_off(drawing, bands, lambda at: shares_at(design, at, rotation), 0.02) < 2e-3
    # Triangles end at the planes that pass through the surface, in the last band.
    crossed = 0
    last = drawing.surface.shells[0]
    assert last.colour == UTILISATION_COLOURS[-1]
    corners = np.concatenate([shell.vertices for shell in drawing.surface.shells])
    for normal in planes_of_singularity(rotation):
        sides = corners @ normal
        if sides.min() < -0.1 and sides.max() > 0.1:
            crossed += 1
            assert np.abs(last.vertices @ normal).min() < 1e-9
            across = last.vertices[last.faces] @ normal
            assert ((across > -1e-9).all(axis=1) | (across < 1e-9).all(axis=1)).all()
    assert crossed > 1


@pytest.mark.parametrize(
    ("colour", "cut"), [("force", None), ("bending", "y"), ("error", None), ("deflection", "y")]
)
def test_surface_lies_in_the_bands_of_its_measure(colour: Any, cut: Any) -> None:
    design = OPTIMAL if colour in ("force", "bending") else PRECISE
    drawing = drawing_of(load_state(design, colour=colour, cut=cut))
    rotation = np.array(drawing.request.rotation)
    bands = dict(
        zip(STEP_COLOURS, itertools.pairwise(sorted((*drawing.levels, 0.0))), strict=False)
    )
    assert share_off(drawing, bands, lambda at: measured(design, colour, at, rotation), 0.03) < 5e-3
    assert len(drawing.surface.shells) > 3


READINGS = {
    "plain": r"min \|δ\| ([\d.]+) \(δ[123]\)",
    "condition": r"1 / cond J ([\d.]+)",
    "share": r"largest share of a limit ([\d.]+) % \((?:actuator|bending of strut) \w+\)",
    "force": r"largest actuator force ([\d.]+) N \(actuator \w+\)",
    "bending": r"largest bending of a strut ([\d.]+) N m \(bending of strut [23]\)",
    "error": r"worst error of the tool ([\d.]+) mm",
    "deflection": r"deflection under the load ([\d.]+) mm",
}


@pytest.mark.parametrize(("colour", "reading"), READINGS.items())
def test_map_words_tell_the_measure_at_a_position(colour: str, reading: str) -> None:
    design = {"share": LOADED, "error": PRECISE, "deflection": PRECISE}.get(colour, OPTIMAL)
    mapped = drawing_of(load_state(design, colour=colour, cut="y")).slice_map
    assert mapped is not None
    rotation, digit = mapped.colouring.workspace.rotation, 0.005
    for x, z in ((12.5, 7.25), (3.0, 12.125), (9.0, 1.0)):
        words = mapped.words_at((x, mapped.level, z), UNITS)
        found = re.fullmatch(rf"x {x:.2f}, z {z:.2f} units: {reading}", words)
        assert found is not None, words
        at = np.array([[x, mapped.level, z]])
        (expected,) = measured(design, colour, at, rotation).tolist()
        factor = 100.0 if colour == "share" else 1.0
        assert float(found[1]) == pytest.approx(factor * expected, rel=digit, abs=digit)
    singular = mapped.words_at((9.0, mapped.level, 0.0), UNITS)
    if colour not in ("plain", "condition"):
        # No part has what is infinite in all.
        assert " ∞ " in singular
        assert "(" not in singular


def test_map_is_read_to_the_browser_that_asks(services: Services) -> None:
    state = with_workspace(open_state(OPTIMAL), solid=True, cut="y")
    follow(services, state)
    panel, asking = WorkspacePanel(services), ScriptedBrowser()
    client: Any = asking
    place = "[12.5,5,7.25]"
    # There is no map before the panel has shown it.
    services.buttons.press("workspace.read", place, client)
    assert asking.scripts == []
    assert "data-map" in markup_of(panel, state)
    for text in ("[12.5,5]", "[NaN,1,2]", place):
        services.buttons.press("workspace.read", text, client)
    (script,) = asking.scripts
    drawing = services.get(feeds.WORKSPACE_FEED).drawing
    assert drawing is not None
    assert drawing.slice_map is not None
    words = drawing.slice_map.words_at((12.5, 5.0, 7.25), UNITS)
    assert f'window.explorer.map("{place}", "{words}");' in script


def test_load_that_is_not_shown_changes_no_request() -> None:
    other = replace(FORCES, force=(0.0, 0.0, 7.0))
    limited = msgspec.structs.replace(PRECISE, guide=Guide(force_n=100.0))
    cases: tuple[tuple[dict[str, Any], bool], ...] = (
        ({"colour": "plain"}, False),
        ({"colour": "margin", "cut": "x"}, False),
        ({"region": "accessible"}, False),
        ({"colour": "error"}, False),
        ({"colour": "share"}, True),
        ({"colour": "force"}, True),
        ({"colour": "deflection"}, True),
        ({"region": "held"}, True),
    )
    for changes, is_loaded in cases:
        request = feeds.workspace_request(Frame(load_state(limited, **changes)))
        changed = feeds.workspace_request(Frame(load_state(limited, forces=other, **changes)))
        assert request is not None
        assert (request != changed) is is_loaded
        if is_loaded:
            assert request.load == LOAD


def test_payload_without_a_weight_loads_nothing_but_its_force() -> None:
    weightless = replace(FORCES, weighed="none")
    request = feeds.workspace_request(Frame(load_state(forces=weightless, region="held")))
    assert request is not None
    assert request.design.payload == Payload(0.0, (1.0, 0.0, 1.0), 5.0)
    weighty = feeds.workspace_request(Frame(load_state(region="held")))
    assert weighty is not None
    assert weighty.design.payload == LOADED.payload


@pytest.mark.parametrize(
    ("colour", "words"),
    [
        ("error", "The actuators of the design have no errors"),
        ("deflection", "The design is rigid"),
        ("share", "has no limits of forces"),
    ],
)
def test_colour_that_a_design_states_nothing_of_asks_for_what_it_needs(
    services: Services, desk: Desk, colour: str, words: str
) -> None:
    desk.session.do(open_design(OPTIMAL))
    desk.session.do(Set("view", load_state(OPTIMAL, colour=colour).view))
    panel = WorkspacePanel(services)
    request = feeds.workspace_request(Frame(desk.state))
    assert request is not None
    assert request.colour == "plain"
    assert words in markup_of(panel, desk.state)
    desk.session.do(Set("view.workspace.colour", "force"))
    assert words not in markup_of(panel, desk.state)


# The part that holds the load


@pytest.fixture(scope="module")
def feed() -> Any:
    """The feed after it has drawn the part that holds the load."""
    services = services_for()
    follow(services, load_state(region="held"))
    return services.get(feeds.WORKSPACE_FEED)


@pytest.fixture(scope="module")
def drawing(feed: Any) -> WorkspaceDrawing:
    assert feed.drawing is not None
    return feed.drawing


def test_part_that_holds_the_load_is_drawn_and_measured(
    feed: Any, drawing: WorkspaceDrawing
) -> None:
    assert drawing.trouble is None
    rotation = np.array(drawing.request.rotation)
    assert drawing.part is not None
    expected = carried_region(Workspace(LOADED, rotation), LOAD).held_volume
    assert drawing.part.volume == pytest.approx(expected, rel=5e-3)
    assert 0.1 < expected / drawing.volume < 0.9
    words = drawing_words(Frame(load_state(region="held")), feed)
    assert "hold the load" in words
    assert f"{round(100.0 * drawing.part.volume / drawing.volume, 2):g} %" in words
    assert "(3, 0, −40) N at the tool, (0, 0.2, 0) N m, 0.5 kg of payload" in words
    assert {shell.colour for shell in drawing.surface.shells} == {PLAIN, AT_LIMIT}
    for shell in drawing.surface.shells:
        shares = shares_at(LOADED, shell.vertices, rotation)
        assert np.quantile(shares, 0.99) < 1.02
        if shell.colour == AT_LIMIT:
            assert np.quantile(shares, 0.1) > 0.99


def test_load_that_nothing_holds_names_the_part(services: Services) -> None:
    weak = msgspec.structs.replace(LOADED, actuators=Actuators(push_n=(2, 2, 2, 2, 2, 2)))
    state = load_state(weak, region="held")
    follow(services, state)
    drawing = services.get(feeds.WORKSPACE_FEED).drawing
    assert drawing is not None
    assert drawing.trouble is not None
    assert re.search(r"payload; actuator \w+ is at its limit there", drawing.trouble.reason)
    text = markup_of(WorkspacePanel(services), state)
    assert text.count("No position holds the load") == 1
    # All within the limits is drawn instead.
    assert drawing.mesh_volume == pytest.approx(drawing.volume, rel=0.02)


def test_file_holds_the_part_that_holds_the_load_or_says_why_not(drawing: WorkspaceDrawing) -> None:
    held = Selection(LOADED, drawing.request.rotation, "held", load=LOAD)
    data = export_mesh(held, 0.02, "workspace", "stl")
    untyped: Any = trimesh
    volume = untyped.load(io.BytesIO(data), file_type="stl").volume / LOADED.unit_mm**3
    assert drawing.part is not None
    assert volume == pytest.approx(drawing.part.volume, rel=5e-3)
    with pytest.raises(InputError, match="along which a part takes its limit consists of facets"):
        export_mesh(held, 0.1, "workspace", STEP)
    heavy = replace(held, load=(0.0, 0.0, -1e6, 0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="nothing holds the load: the best position found holds"):
        export_mesh(heavy, 0.1, "workspace", "stl")
