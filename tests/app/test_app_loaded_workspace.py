"""The workspace under the load of the page and by the precision of the tool.

Bands on its surface, the part that holds the load, files.
"""

from __future__ import annotations

import io
import itertools
import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
import trimesh
from desk import CLIENT, Desk
from machines import six
from mesh_files import mesh_of, read_3mf
from services import StubDownloads, services_for
from workspace_feeds import drawing_of, follow

from explorer.app.features.feature import Services
from explorer.app.features.workspace.feed import WorkspaceFeed, workspace_request
from explorer.app.features.workspace.files import FORMATS, WorkspaceFiles
from explorer.app.features.workspace.panel import COLOUR, WorkspacePanel
from explorer.app.features.workspace.slice_map import map_picture
from explorer.app.features.workspace.tasks import STEP, WorkspaceDrawing, export_mesh
from explorer.app.features.workspace.words import drawing_words, legend, load_words
from explorer.app.scene.bands import AT_LIMIT, PLAIN
from explorer.app.state.actions import Open, Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.state.view import ForcesView
from explorer.errors import InputError
from explorer.mechanism.design import Design, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Actuators, Guide, Payload, Struts, Tool
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.statics.accuracy import worst_error
from explorer.statics.compliance import compliance, deflection, stiffness_of
from explorer.statics.reactions import limit_shares, reactions
from explorer.statics.weights import design_weights, payload_wrench
from explorer.workspace.held import held_workspace
from explorer.workspace.limits.constraints import constraints, slacks
from explorer.workspace.position_bands import SHARE_COLOURS, SHARES, STEP_COLOURS

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
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


def shown(design: Design = LOADED, forces: ForcesView = FORCES, **changes: Any) -> State:
    view = opened(design).view
    workspace = replace(view.workspace, solid=True, **changes)
    return Set("view", replace(view, forces=forces, workspace=workspace)).apply(opened(design))


def shares_at(design: Design, points: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the largest shares of a limit at positions (n, 3), by reactions."""
    tool, weights = design.tool.position, design_weights(design)
    held = reactions(design, points, rotation, np.array(LOAD), tool, weights)
    return np.asarray(limit_shares(design, held).max(axis=-1))


def panel_text(panel: WorkspacePanel, state: State) -> str:
    """Return the markup of the panel in a state."""
    return "".join(str(v) for _, name, v in panel.updates(Frame(state)) if name == "content")


# The bands


def singular_within() -> tuple[Design, Pose]:
    """Return a design and a pose whose workspace has all three singular planes within."""
    limits = Limits(box=((0.0, -12.0, -10.0), (20.0, 22.0, 18.0)), margin=None)
    return (
        msgspec.structs.replace(LOADED, limits=limits),
        Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), (-60.0, 20.0, 30.0)),
    )


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
@pytest.mark.parametrize("is_singular", [False, True])
def test_surface_lies_in_the_bands_of_the_shares(is_singular: bool, cut: Any) -> None:
    """Random points on every triangle have the share of its colour, also beside singular planes."""
    state = shown(colour="share", cut=cut)
    design = state.design
    if is_singular:
        design, pose = singular_within()
        state = replace(state, design=design, pose=pose)
    drawing = drawing_of(state)
    rotation = np.array(drawing.request.rotation)
    bands = dict(zip(SHARE_COLOURS, itertools.pairwise((0.0, *SHARES, math.inf)), strict=True))
    assert share_off(drawing, bands, lambda at: shares_at(design, at, rotation), 0.02) < 2e-3
    # Triangles end at the planes that pass through the surface, in the last band.
    crossed = 0
    last = drawing.surface.shells[0]
    assert last.colour == SHARE_COLOURS[-1]
    corners = np.concatenate([shell.vertices for shell in drawing.surface.shells])
    for normal in planes_of_singularity(rotation):
        sides = corners @ normal
        if sides.min() < -0.1 and sides.max() > 0.1:
            crossed += 1
            assert np.abs(last.vertices @ normal).min() < 1e-9
            across = last.vertices[last.faces] @ normal
            assert ((across > -1e-9).all(axis=1) | (across < 1e-9).all(axis=1)).all()
    assert (crossed > 1) == is_singular


@pytest.mark.parametrize("cut", [None, "y"])
@pytest.mark.parametrize("colour", ["force", "bending", "error", "deflection"])
def test_surface_lies_in_the_bands_of_its_measure(colour: Any, cut: Any) -> None:
    design = OPTIMAL if colour in ("force", "bending") else PRECISE
    drawing = drawing_of(shown(design, colour=colour, cut=cut))
    rotation, tool = np.array(drawing.request.rotation), design.tool.position

    def measure(points: FloatArray) -> FloatArray:
        if colour == "error":
            return worst_error(design, points, rotation, six([0.05] * 6), tool).displacement
        if colour == "deflection":
            # The payload's force of any direction does not count.
            wrench = LOAD + payload_wrench(design, rotation)
            soft = compliance(design, points, rotation, *stiffness_of(design), tool)
            return design.unit_mm * np.linalg.norm(deflection(soft, wrench)[:, :3], axis=-1)
        found = reactions(design, points, rotation, np.array(LOAD))
        if colour == "force":
            return np.asarray(np.abs(found.actuators).max(axis=-1))
        return np.asarray(0.01 * found.bending.max(axis=-1))

    bands = dict(
        zip(STEP_COLOURS, itertools.pairwise(sorted((*drawing.levels, 0.0))), strict=False)
    )
    assert share_off(drawing, bands, measure, 0.03) < 5e-3
    assert len(drawing.surface.shells) > 3


def test_precision_of_an_ideal_design_asks_for_what_it_needs(services: Services) -> None:
    panel = WorkspacePanel(services)

    def told(design: Design, colour: str) -> str:
        state = shown(design, colour=colour)
        request = workspace_request(Frame(state))
        assert request is not None
        assert request.colour == (colour if design is PRECISE else "plain")
        return panel_text(panel, state)

    assert "The actuators of the design have no errors" in told(OPTIMAL, "error")
    assert "The design is rigid" in told(OPTIMAL, "deflection")
    for colour, title in (
        ("error", "Worst error of the tool (mm)"),
        ("deflection", "Deflection under the load (mm)"),
    ):
        words = told(PRECISE, colour)
        assert title in words
        assert "no errors" not in words
        assert "rigid" not in words
        assert ("0.5 kg of payload" in words) == (colour == "deflection")
        assert "in any direction" not in words


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
        request = workspace_request(Frame(shown(limited, **changes)))
        changed = workspace_request(Frame(shown(limited, forces=other, **changes)))
        assert request is not None
        assert (request != changed) is is_loaded
        if is_loaded:
            assert request.load == LOAD


def test_payload_without_a_weight_loads_nothing_but_its_force() -> None:
    weightless = replace(FORCES, weighed="none")
    request = workspace_request(Frame(shown(forces=weightless, region="held")))
    assert request is not None
    assert request.design.payload == Payload(0.0, (1.0, 0.0, 1.0), 5.0)
    weighty = workspace_request(Frame(shown(region="held")))
    assert weighty is not None
    assert weighty.design.payload == LOADED.payload


def test_words_say_what_has_no_weight_over_the_workspace() -> None:
    load = "Load: (3, 0, −40) N at the tool, (0, 0.2, 0) N m"
    force, weightless = "5 N in any direction", "platform and legs count as weightless"
    none, everything = replace(FORCES, weighed="none"), replace(FORCES, weighed="payload and legs")
    assert load_words(shown(forces=none)) == f"{load}, {force}"
    assert load_words(shown()) == f"{load}, 0.5 kg of payload, {force}"
    expected = f"{load}, 0.5 kg of payload, {force}; {weightless}"
    assert load_words(shown(forces=everything)) == expected


def test_legend_has_the_ends_of_the_bands_with_their_unit() -> None:
    words = legend("share", 1.0, None)
    assert "Largest share of a limit (%)" in words
    assert all(f">{text}</span>" in words for text in ("0", "25", "50", "75", "100", "∞"))
    drawing = drawing_of(shown(OPTIMAL, colour="force", cut="x"))
    words = legend("force", 1.0, drawing)
    assert "Largest actuator force (N)" in words
    assert all(f">{level:,g}</span>" in words for level in drawing.levels[1:])
    # Levels are not known before a drawing of that colour.
    assert ">100</span>" not in legend("bending", 1.0, drawing)


def test_share_of_a_design_without_limits_offers_what_needs_none(
    services: Services, desk: Desk
) -> None:
    desk.session.do(Open(OPTIMAL))
    desk.session.do(Set("view", shown(OPTIMAL, colour="share").view))
    panel = WorkspacePanel(services)
    request = workspace_request(Frame(desk.state))
    assert request is not None
    assert request.colour == "plain"
    assert "has no limits of forces" in panel_text(panel, desk.state)
    desk.press(services.buttons, COLOUR, "largest actuator force")
    assert desk.state.view.workspace.colour == "force"
    assert "has no limits of forces" not in panel_text(panel, desk.state)


# The part that holds the load


@pytest.fixture(scope="module")
def feed() -> WorkspaceFeed:
    """The feed after it has drawn the part that holds the load."""
    services = services_for()
    follow(services, shown(region="held"))
    return services.get(WorkspaceFeed)


@pytest.fixture(scope="module")
def drawing(feed: WorkspaceFeed) -> WorkspaceDrawing:
    assert feed.drawing is not None
    return feed.drawing


def test_part_that_holds_the_load_is_drawn_and_measured(
    feed: WorkspaceFeed, drawing: WorkspaceDrawing
) -> None:
    assert drawing.trouble is None
    rotation = np.array(drawing.request.rotation)
    expected = held_workspace(LOADED, rotation, LOAD).held_volume
    assert drawing.held_volume == pytest.approx(expected, rel=5e-3)
    assert 0.1 < expected / drawing.volume < 0.9
    words = drawing_words(Frame(shown(region="held")), feed)
    assert "hold the load" in words
    assert f"{100.0 * (drawing.held_volume or 0.0) / drawing.volume:.2f} %" in words
    assert "(3, 0, −40) N at the tool, (0, 0.2, 0) N m, 0.5 kg of payload" in words
    assert {shell.colour for shell in drawing.surface.shells} == {PLAIN, AT_LIMIT}
    for shell in drawing.surface.shells:
        shares = shares_at(LOADED, shell.vertices, rotation)
        assert np.quantile(shares, 0.99) < 1.02
        if shell.colour == AT_LIMIT:
            assert np.quantile(shares, 0.1) > 0.99


def test_map_leaves_out_the_positions_that_do_not_hold_the_load() -> None:
    drawing = drawing_of(shown(region="held", cut="x"))
    assert drawing.slice_map is not None
    picture = map_picture(drawing.slice_map, opened(LOADED).position, LOADED.reach)
    assert "load not held" in picture
    assert 'class="is-blocked"' in picture
    assert "not held" in legend("plain", 1.0, drawing)


def test_surface_that_holds_the_load_has_no_colour_beyond_the_limit() -> None:
    for cut in (None, "y"):
        drawing = drawing_of(shown(region="held", colour="share", cut=cut))
        colours = {shell.colour for shell in drawing.surface.shells}
        assert SHARE_COLOURS[-1] not in colours
        assert SHARE_COLOURS[-2] in colours
    whole = drawing_of(shown(colour="share"))
    assert SHARE_COLOURS[-1] in {shell.colour for shell in whole.surface.shells}


def test_map_of_the_part_in_one_colour_shows_the_share(services: Services) -> None:
    def picture(region: str, colour: str) -> str:
        drawing = drawing_of(shown(region=region, colour=colour, cut="y"))
        assert drawing.slice_map is not None
        return map_picture(drawing.slice_map, opened(LOADED).position, LOADED.reach)

    assert picture("held", "plain") == picture("held", "share")
    assert picture("limits", "plain") == picture("limits", "margin")
    panel = WorkspacePanel(services)
    for region, words in (("held", "Largest share of a limit"), ("limits", "Smallest |δ|")):
        state = shown(region=region, cut="y")
        follow(services, state)
        assert words in panel_text(panel, state)


def test_load_that_nothing_holds_names_the_part_and_the_share_that_is_held(
    services: Services,
) -> None:
    weak = msgspec.structs.replace(LOADED, actuators=Actuators(push_n=(2, 2, 2, 2, 2, 2)))
    state = shown(weak, region="held")
    follow(services, state)
    drawing = services.get(WorkspaceFeed).drawing
    assert drawing is not None
    assert drawing.trouble is not None
    assert re.search(r"payload; actuator \w+ is at its limit there", drawing.trouble.reason)
    text = panel_text(WorkspacePanel(services), state)
    assert text.count("No position holds the load") == 1
    # All within the limits is drawn instead.
    assert drawing.mesh_volume == pytest.approx(drawing.volume, rel=0.02)
    rotation = np.array(drawing.request.rotation)
    held = held_workspace(weak, rotation, LOAD)
    assert held.factor is not None
    assert held.best is not None
    # The factor is that of the best position, and no random one is much better.
    assert 1.0 / held.factor == pytest.approx(shares_at(weak, held.best[None], rotation)[0])
    limits = constraints(weak, rotation)
    points = np.random.default_rng(1).uniform((0, -12, 0), (20, 22, 18), (10_000, 3))
    points = points[(slacks(limits, points) >= 0.0).all(axis=-1)]
    assert shares_at(weak, points, rotation).min() > 0.999 / held.factor
    assert slacks(limits, held.best).min() > -0.1


# Files


def read_mesh(data: bytes, file_format: str) -> Any:
    """Return the mesh of a file as one of trimesh."""
    if file_format == "3mf":
        meshes = read_3mf(data).GetMeshObjects()
        assert meshes.MoveNext()
        return mesh_of(meshes.GetCurrentMeshObject())
    untyped: Any = trimesh
    mesh = untyped.load(io.BytesIO(data), file_type=file_format, force="mesh", process=False)
    if file_format == "stl":
        # Triangles of STL share no vertices.
        mesh.merge_vertices()
    return mesh


@pytest.mark.parametrize("what", ["workspace", "hull"])
@pytest.mark.parametrize("file_format", [name for name in FORMATS if name != STEP])
def test_part_that_holds_the_load_is_exported_as_a_closed_mesh(
    drawing: WorkspaceDrawing, what: str, file_format: str
) -> None:
    data = export_mesh(
        LOADED, drawing.request.rotation, 0.02, "held", None, LOAD, what, file_format
    )
    mesh = read_mesh(data, file_format)
    assert mesh.is_watertight
    # GLB is in metres, all others in millimetres.
    unit = LOADED.unit_mm * (1e-3 if file_format == "glb" else 1.0)
    volume = float(mesh.volume) / unit**3
    assert drawing.held_volume is not None
    if what == "workspace":
        assert volume == pytest.approx(drawing.held_volume, rel=5e-3)
    else:
        assert volume > drawing.held_volume


def test_files_that_cannot_be_written_say_why(drawing: WorkspaceDrawing) -> None:
    rows = drawing.request.rotation
    with pytest.raises(InputError, match="along which a part takes its limit consists of facets"):
        export_mesh(LOADED, rows, 0.1, "held", None, LOAD, "workspace", STEP)
    heavy = (0.0, 0.0, -1e6, 0.0, 0.0, 0.0)
    with pytest.raises(InputError, match="nothing holds the load: the best position found holds"):
        export_mesh(LOADED, rows, 0.1, "held", None, heavy, "workspace", "stl")


def test_file_has_the_region_in_its_name(services: Services, desk: Desk) -> None:
    files, downloads = services.get(WorkspaceFiles), services.downloads
    assert isinstance(downloads, StubDownloads)
    desk.session.do(Set("view.workspace.region", "held"))
    files.send("workspace", "3mf", CLIENT.client_id)
    assert downloads.sent[-1][1] == "paper-optimal-workspace-that-holds-the-load.3mf"
