"""What the scene shows of singularities, and the shadow on the ground; no browser."""

from __future__ import annotations

import asyncio
import functools
import itertools
import math
import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from desk import Desk, by_name, number, random_states, viewed
from incidence import distance_of_lines, distance_to_plane
from numpy.testing import assert_allclose
from scipy.spatial import ConvexHull

from explorer.app.features.feature import Services
from explorer.app.features.mechanism import bodies, marks
from explorer.app.features.mechanism.incidences import (
    DASHES,
    FADE_FROM,
    FARTHEST,
    INSET,
    Gaps,
    Tetrahedra,
    approaches,
    gap_text,
    visible_gaps,
)
from explorer.app.features.singularity.feature import SingularityPanel, distance_table
from explorer.app.features.singularity.work import go_to_singularity, go_to_stratum
from explorer.app.features.view.feature import TO_SUN, shadow_outlines
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import linear_colour, of_one_colour, plate
from explorer.app.state.actions import open_design
from explorer.app.state.frame import Frame
from explorer.app.state.moves import go_home, set_joint, set_pose
from explorer.app.state.state import State, open_state
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.margins import TETRAHEDRA
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import MARGIN_COLOURS, SINGULAR, proximity_colour
from explorer.singularity.strata import GENERIC, STRATA, incidences

OPTIMAL = PRESETS["paper-optimal"]
Drawn = dict[str, dict[str, Any]]


@functools.cache
def approaching(incidence: int) -> list[State]:
    """Return states from the home pose on to the nearest pose with an incidence."""
    start = open_state(OPTIMAL)
    goal = go_to_singularity(incidence).apply(start).pose
    a, b = np.array(start.pose.quaternion), np.array(goal.quaternion)
    b *= math.copysign(1.0, float(a @ b))
    states: list[State] = []
    for share in (0.0, 0.3, 0.6, 0.8, 0.9, 0.99, 0.9999):
        position = (1.0 - share) * np.array(start.pose.position) + share * np.array(goal.position)
        w, x, y, z = ((1.0 - share) * a + share * b).tolist()
        px, py, pz = position.tolist()
        states.append(set_pose(Pose((px, py, pz), (w, x, y, z))).apply(start))
    return [*states, set_pose(goal).apply(start)]


@functools.cache
def scenes() -> list[Placed]:
    """Return scenes of random poses, on the way to each incidence, and of every stratum."""
    singular = (go_to_stratum(w).apply(open_state(OPTIMAL)) for w in STRATA if w != GENERIC)
    near = itertools.chain.from_iterable(map(approaching, (1, 2, 3)))
    return [Placed(Frame(state)) for state in (*random_states(12, seed=5), *near, *singular)]


def draw(part: Gaps | Tetrahedra | bodies.Flags, scene: State | Placed) -> Drawn:
    placed = scene if isinstance(scene, Placed) else Placed(Frame(scene))
    return by_name(part.updates(placed))


def levels_of(state: State) -> tuple[float, float, float]:
    return Frame(state).verdict.levels


@pytest.fixture
def gaps(services: Services) -> Gaps:
    return services.get(Gaps)


@pytest.fixture
def tetrahedra(services: Services) -> Tetrahedra:
    return services.get(Tetrahedra)


# Gaps


def test_gap_lies_between_its_elements_with_the_exact_length() -> None:
    for placed in scenes():
        p, rotation = placed.points, placed.frame.snapshot.rotation
        # The line a1a2 is that of the guide, whatever the ends that are drawn.
        lines = (p["a1"], p["a1"] + [10.0, 0.0, 0.0]), (p["b4"], p["b4"] + 10.0 * rotation[:, 0])
        plane = p["b4"], p["b4"] + 10.0 * rotation[:, 0], p["b4"] + 10.0 * rotation[:, 1]
        lengths = (
            distance_to_plane(p["a1"], plane),
            distance_of_lines(*lines),
            abs(float(p["b4"][2])),
        )
        for index, each in visible_gaps(placed, None).items():
            if each.ends is None:
                continue
            base, platform = each.ends
            local = (platform - p["b4"]) @ rotation
            off = ((base, local[2:]), (base[1:], local[1:]), (base[2:], local))[index]
            assert max(float(np.abs(miss).max()) for miss in off) < 1e-6
            assert np.linalg.norm(platform - base) == pytest.approx(lengths[index], abs=1e-6)


def test_dashes_go_from_end_to_end_of_each_gap_in_the_colour_of_its_danger(gaps: Gaps) -> None:
    for placed in scenes():
        node, shown = draw(gaps, placed)["/gaps/dashes"], visible_gaps(placed, None)
        ends = {i: each.ends for i, each in shown.items() if not each.is_touching}
        ends = {i: each for i, each in ends.items() if each is not None}
        assert node["visible"] is bool(ends)
        for index, (base, platform) in ends.items():
            rows = slice(index * DASHES, (index + 1) * DASHES)
            points = node["points"][rows]
            assert_allclose(points[0, 0], base, atol=1e-4)
            assert_allclose(points[-1, 1], platform, atol=1e-4)
            colour = linear_colour(proximity_colour(shown[index].level))
            assert np.unique(node["colors"][rows].reshape(-1, 3), axis=0).tolist() == [list(colour)]


def test_contacts_are_marked_where_the_pose_is_singular_and_nowhere_else(gaps: Gaps) -> None:
    for placed in scenes():
        snapshot = placed.frame.snapshot
        node = draw(gaps, placed)["/gaps/contacts"]
        near = [*snapshot.gaps.base, *(snapshot.gaps.platform - snapshot.points.b4)]
        expected = {
            index
            for index in (i - 1 for i in incidences(snapshot.stratum))
            # Parallel lines meet nowhere, unless they coincide.
            if snapshot.gaps.lengths[index] < 1e-9
            and max(np.abs(near[index]).max(), np.abs(near[index + 3]).max())
            <= FARTHEST * OPTIMAL.reach
        }
        assert node["visible"] is bool(expected)
        if expected:
            assert set(np.flatnonzero(node["batched_scales"][:, 0] == 1.0).tolist()) == expected
            for index in expected:
                point = placed.scale * snapshot.gaps.base[index]
                assert_allclose(node["batched_positions"][index], point, atol=1e-5)


@pytest.mark.parametrize("incidence", [1, 2, 3])
def test_gap_fades_in_on_approach_with_margin_and_length_until_the_contact(
    gaps: Gaps, incidence: int
) -> None:
    *before, at = approaching(incidence)
    for state in before:
        placed = Placed(Frame(state))
        level = levels_of(state)[incidence - 1]
        presence = approaches(placed, None)[incidence - 1].presence
        label = draw(gaps, placed)[f"/gaps/label/{incidence}"]
        if level >= FADE_FROM:
            assert (presence, label["visible"]) == (0.0, False)
        elif level < 1.0:
            assert (presence, label["visible"]) == (1.0, True)
            told = label["text"].removeprefix(f"δ{incidence} ").removesuffix(" mm").split(" · ")
            snapshot = placed.frame.snapshot
            lengths = snapshot.margins[incidence - 1], snapshot.gaps.lengths[incidence - 1]
            for text, length in zip(told, lengths, strict=True):
                assert number(text) == pytest.approx(length * OPTIMAL.unit_mm, abs=5e-2)
        else:
            assert 0.0 < presence <= 1.0
    assert draw(gaps, at)[f"/gaps/label/{incidence}"]["text"] == f"δ{incidence} = 0"
    assert not any(node["visible"] for node in draw(gaps, open_state(OPTIMAL)).values())


# Parallel lines, far feet, and designs of any size


@pytest.mark.parametrize("angle", [1e-1, 1e-2, 1e-5, 1e-8, 1e-16, 0.0])
def test_parallel_lines_are_told_and_nothing_is_drawn_far_away(
    services: Services, gaps: Gaps, angle: float
) -> None:
    state = open_state(OPTIMAL, Pose((3.0, 4.0, 5.0), (1.0, 0.0, 0.0, 0.5 * angle)))
    placed = Placed(Frame(state))
    longest = (2.0 * FARTHEST + 1.0) * placed.reach
    nodes = draw(gaps, state)
    for name, node in nodes.items():
        for values in (node.get("points"), node.get("position"), node.get("batched_positions")):
            if values is not None:
                assert np.abs(np.asarray(values)).max() <= longest, name
    flags = draw(services.get(bodies.Flags), state)
    for root in ("/base", "/platform"):
        line = flags[f"{root}/flag/line"]
        assert abs(line["position"][0]) + line["scale"][2] <= 2.0 * longest
        assert np.abs(flags[f"{root}/flag/plane"]["vertices"]).max() <= longest
    assert nodes["/gaps/label/2"]["visible"] is True
    assert gap_text(placed, 1, approaches(placed, None)[1]).startswith("δ2 ")
    if angle == 0.0:
        assert nodes["/gaps/contacts"]["visible"] is False
        assert nodes["/gaps/label/2"]["text"] == "δ2 = 0, lines parallel"
        assert nodes["/gaps/dashes"]["visible"] is True


@pytest.mark.parametrize("factor", [1e-5, 1e4])
def test_designs_of_any_size_are_drawn_alike(factor: float) -> None:
    design = OPTIMAL.with_variables([factor * value for value in OPTIMAL.variables])
    for one in scenes()[::5]:
        state = one.frame.state
        x, y, z = (factor * np.array(state.pose.position)).tolist()
        scaled = set_pose(Pose((x, y, z), state.pose.quaternion)).apply(
            open_design(design).apply(state)
        )
        other = Placed(Frame(scaled))
        ratio = other.reach / one.reach
        for a, b in zip(approaches(one, None), approaches(other, None), strict=True):
            assert b.level == pytest.approx(a.level, rel=1e-6, abs=1e-9)
            assert (a.is_nearest, a.is_touching) == (b.is_nearest, b.is_touching)
            assert (a.ends is None) is (b.ends is None)
            if a.ends is not None and b.ends is not None:
                assert_allclose(b.ends, ratio * a.ends, rtol=1e-6, atol=1e-6)


# The camera


def test_camera_follows_near_gaps_and_not_the_pointer(services: Services, desk: Desk) -> None:
    gaps, home = services.get(Gaps), open_state(OPTIMAL)
    desk.press(services.buttons, "margins.hover", "1")
    assert len(gaps.corners(Placed(Frame(home)))) == 0
    near = Placed(Frame(approaching(2)[-2]))
    ends = approaches(near, None)[1].ends
    assert ends is not None
    assert_allclose(gaps.corners(near), ends)


# Tetrahedra


def test_one_tetrahedron_is_filled_near_a_singularity_and_none_far_from_all(
    tetrahedra: Tetrahedra,
) -> None:
    for placed in scenes():
        levels = placed.frame.verdict.levels
        nodes = draw(tetrahedra, placed)
        faces, edges = (
            nodes["/tetrahedra/faces"],
            [nodes[f"/tetrahedra/{i}/edges"] for i in (1, 2, 3)],
        )
        # That of the verdict is clear, and the others are paler.
        index = placed.frame.verdict.incidences[0] - 1
        clear = [
            np.array_equal(each["colors"], of_one_colour(colour, len(each["colors"])))
            for each, colour in zip(edges, MARGIN_COLOURS, strict=True)
        ]
        assert clear == [each == index for each in range(3)]
        assert faces["visible"] is (levels[index] < FADE_FROM)
        if levels[index] >= FADE_FROM:
            continue
        assert faces["color"] == proximity_colour(levels[index])
        corners = np.array([placed.points[name] for name in TETRAHEDRA[index]])
        off = np.linalg.norm(faces["vertices"] - corners, axis=1)
        size = np.linalg.norm(corners - corners.mean(axis=0), axis=1).max()
        assert off.max() <= INSET * size + 1e-4


@pytest.mark.parametrize("incidence", [1, 2, 3])
def test_row_that_is_pointed_at_fills_its_tetrahedron_until_the_pointer_leaves(
    services: Services, desk: Desk, incidence: int
) -> None:
    tetrahedra, gaps = services.get(Tetrahedra), services.get(Gaps)
    SingularityPanel(services)
    html = distance_table(Frame(desk.state))
    assert f'data-hover="margins.hover" data-value="{incidence}"' in html
    before, steps = desk.state, desk.session.history
    # What is switched off is shown too, while its row is pointed at.
    for state in (desk.state, viewed(desk.state, tetrahedra=(False, False, False))):
        desk.press(services.buttons, "margins.hover", str(incidence))
        nodes = draw(tetrahedra, state)
        assert nodes["/tetrahedra/faces"]["visible"] is True
        assert nodes[f"/tetrahedra/{incidence}/edges"]["visible"] is True
        placed = Placed(Frame(state))
        corners = [placed.points[name] for name in TETRAHEDRA[incidence - 1]]
        centre = nodes["/tetrahedra/faces"]["vertices"].mean(axis=0)
        assert_allclose(centre, np.mean(corners, axis=0), atol=1e-4)
        assert draw(gaps, state)[f"/gaps/label/{incidence}"]["visible"] is True
        desk.press(services.buttons, "margins.hover", "")
        assert draw(tetrahedra, state)["/tetrahedra/faces"]["visible"] is False
        assert not any(node["visible"] for node in draw(gaps, state).values())
    assert desk.state == before
    assert desk.session.history == steps


@pytest.mark.parametrize("incidence", [1, 2, 3])
def test_switch_of_a_tetrahedron_hides_its_edges_name_faces_and_gap(
    tetrahedra: Tetrahedra, gaps: Gaps, incidence: int
) -> None:
    shown = tuple(i != incidence for i in (1, 2, 3))
    for state in (approaching(incidence)[0], approaching(incidence)[-1]):
        off = viewed(state, tetrahedra=shown)
        nodes = draw(tetrahedra, off)
        assert nodes[f"/tetrahedra/{incidence}/edges"]["visible"] is False
        assert nodes[f"/tetrahedra/{incidence}/name"]["visible"] is False
        assert nodes["/tetrahedra/faces"]["visible"] is False
        assert draw(gaps, off)[f"/gaps/label/{incidence}"]["visible"] is False
        assert incidence - 1 not in visible_gaps(Placed(Frame(off)), None)
        # The other two stay.
        for other in {1, 2, 3} - {incidence}:
            assert nodes[f"/tetrahedra/{other}/edges"]["visible"] is True


def test_tetrahedron_that_fails_is_outlined_even_if_it_is_switched_off(
    tetrahedra: Tetrahedra,
) -> None:
    state = set_joint(0, 1000.0).apply(open_state(OPTIMAL))
    assert state.unclosed is not None
    nodes = draw(tetrahedra, viewed(state, tetrahedra=(False, False, False)))
    outlined = {i for i in range(3) if nodes[f"/tetrahedra/{i + 1}/edges"]["visible"]}
    assert outlined == {*state.unclosed.failing} != set()


# The gizmo


def test_gizmo_is_put_back_only_once_the_platform_has_followed_its_last_movement(
    services: Services, desk: Desk
) -> None:
    handle = marks.DragHandle(services)
    gizmo: Any = handle.handle

    def written() -> bool:
        return "position" in by_name(handle.updates(Placed(Frame(desk.state))))["/handle"]

    assert written()
    # A browser has moved it, and the session is yet to hear of that.
    gizmo.position, gizmo._impl_aux.last_updated = (8.0, 3.0, 9.5), time.time() + 1.0
    assert not written()
    for callback in gizmo._impl_aux.update_cb:
        asyncio.run(callback(SimpleNamespace(client_id=1)))
    assert desk.state.pose == handle.pose(desk.state)
    assert not written()
    desk.session.do(go_home())
    assert written()


# Colours


@pytest.mark.parametrize("colour", [(0, 0, 0), (255, 255, 255), SINGULAR, (90, 135, 90)])
def test_linear_colours_are_those_of_the_srgb_standard(colour: tuple[int, int, int]) -> None:
    linear = np.array(linear_colour(colour)) / 255.0
    # The inverse, from linear to sRGB.
    back = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert np.abs(255.0 * back - colour).max() < 6.0


# The shadow on the ground


GROUND = bodies.PLATE_TOP - bodies.PLATE_THICKNESS
POSES = (None, Pose.of_yaw_pitch_roll((9.0, 8.0, 7.5), (-38.0, 24.0, 8.0)))


def on_ground(points: FloatArray) -> FloatArray:
    """Return where rays of the sun through points (n, 3) meet the ground, (n, 2)."""
    steps = (points[:, 2] - GROUND) / TO_SUN[2]
    return (points - steps[:, None] * TO_SUN)[:, :2]


def area(points: FloatArray) -> float:
    return float(ConvexHull(points).volume)


@pytest.mark.parametrize("pose", POSES)
def test_shadow_of_plates_is_their_projection(pose: Pose | None) -> None:
    scene = Placed(Frame(open_state(OPTIMAL, pose)))
    base, platform, *_ = shadow_outlines(scene, GROUND)
    corners = np.array([scene.points[name][:2] for name in ("a1", "a2", "a3")])
    solid, _ = plate(corners, bodies.BASE_RADIUS, GROUND, bodies.PLATE_TOP)
    assert area(base) == pytest.approx(area(on_ground(solid)), rel=0.01)
    local, _ = bodies.platform_plate(scene)
    rotation = scene.frame.snapshot.rotation
    projected = on_ground(scene.points["b4"] + local @ rotation.T)
    # The plate counts as a sheet, so that its shadow lacks the rim of its thickness.
    assert area(platform) == pytest.approx(area(projected), rel=0.12)
    assert area(np.concatenate([platform, projected])) <= 1.02 * area(projected)
