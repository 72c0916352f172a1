"""The accessible workspace: against moving legs, random positions, grids and other radii."""

from __future__ import annotations

import itertools
import math

import msgspec
import numpy as np
import pytest
from clear_moves import moves_are_clear
from limited_designs import limited, ordinary_case
from long_cases import long_after
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order
from threadpoolctl import threadpool_limits  # pyright: ignore[reportMissingTypeStubs]

from explorer import (
    PRESETS,
    Design,
    InputError,
    Pose,
    accessible_workspace,
    leg_clearances,
    rotation_from_yaw_pitch_roll,
    workspace_solid,
    workspace_volume,
)
from explorer.legs.clearance import PAIRS, distance_gradients
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Swing
from explorer.numerics.arrays import FloatArray
from explorer.workspace.accessible.nodes import Grid, check_start, nearest_clear_position, survey
from explorer.workspace.accessible.radii import radius_curve, with_radius
from explorer.workspace.least_clearance import least_clearances
from explorer.workspace.limits.constraints import slacks
from explorer.workspace.slices.volume import node_count_of
from explorer.workspace.workspace import Workspace

OPTIMAL, INITIAL = PRESETS["paper-optimal"], PRESETS["paper-initial"]
ROWS = (OPTIMAL, INITIAL)


def thick(design: Design, radius: float) -> Design:
    return with_radius(design, radius * design.reach)


def random_designs(count: int) -> list[Design]:
    """Return designs with radii in random orientations, each with a valid home."""
    found: list[Design] = []
    for seed in itertools.count():
        design = thick(ordinary_case(seed)[0], (0.0, 0.005, 0.02)[seed % 3])
        home = design.home_pose
        if (leg_clearances(Configuration.at(design, home)).clearance > 0.0).all():
            found.append(design)
        if len(found) == count:
            return found
    return found


@pytest.mark.parametrize("design", ROWS, ids=lambda d: d.name)
def test_accessible_workspace_with_thin_legs_loses_nodes_of_the_base_plane_alone(
    design: Design,
) -> None:
    found = accessible_workspace(design)
    assert found.accessible_volume == found.volume == workspace_volume(design).volume
    assert found.solid.volume == pytest.approx(workspace_solid(design).volume, rel=1e-12)
    assert all(pair.blocked_volume == 0.0 for pair in found.pairs)
    nodes = node_count_of(Workspace(design))
    assert found.node_count == nodes.count
    # What the paper's grid loses are the nodes of z = 0 where axes cross.
    r, step = design.home_pose.rotation, nodes.step
    flat = np.stack(np.meshgrid(*[np.arange(-20, 21)] * 2, [0], indexing="ij"), -1) * step
    within = (slacks(Workspace(design, r).limits, flat) >= -1e-9 * design.reach).all(axis=-1)
    near = 1e-9 * design.reach
    crossing = (leg_clearances(Configuration(design, flat, r)).clearance <= near).any(axis=-1)
    assert found.node_count is not None
    assert found.accessible_node_count is not None
    assert found.node_count - found.accessible_node_count == int((within & crossing).sum()) > 0


@pytest.mark.parametrize("design", long_after(6, random_designs(20)))
def test_accessible_solid_of_random_designs_holds_the_ends_of_clear_moves_alone(
    design: Design,
) -> None:
    found, r = accessible_workspace(design, nodes=20), design.home_pose.rotation
    solid = found.solid
    assert solid.is_watertight
    assert 0.0 < found.accessible_volume <= found.volume
    lows, highs = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    step = float(((highs - lows) / 19.0).max())
    points = np.random.default_rng(3).uniform(lows, highs, (150, 3))
    inside = np.array([solid.winding(p) > 0.5 for p in points])
    limits = Workspace(design, r).limits
    slack = slacks(limits, points).min(axis=-1)
    clearance = leg_clearances(Configuration(design, points, r)).clearance.min(axis=-1)
    assert (slack[inside] > -2.0 * solid.tolerance).all()
    # A rim of a wall thinner than the grid's step may be missed.
    assert (clearance[inside] < -0.25 * step).sum() <= 0.02 * len(points)
    home = np.array(design.home_pose.position)
    way = home + np.linspace(0.0, 1.0, 30)[:, None, None] * (points - home)
    led_to = (slacks(limits, way) >= solid.tolerance).all(axis=(0, 2)) & moves_are_clear(
        design, home, r, points, r, clearance=0.2 * step
    )
    assert (led_to & ~inside).sum() <= 0.02 * len(points)


@pytest.mark.parametrize(("design", "radius"), [(OPTIMAL, 0.01), (INITIAL, 0.0025)])
def test_accessible_volume_agrees_with_random_positions(design: Design, radius: float) -> None:
    design, r = thick(design, radius), design.home_pose.rotation
    found = accessible_workspace(design)
    rng = np.random.default_rng(5)
    lows, highs = design.limits.box or (-design.reach, design.reach)
    points = rng.uniform(lows, highs, (100_000, 3))
    points = points[(slacks(Workspace(design, r).limits, points) >= 0.0).all(axis=-1)]
    clear = (leg_clearances(Configuration(design, points, r)).clearance > 0.0).all(axis=-1)
    # In these designs everything that is clear hangs together.
    share, error = clear.mean(), clear.std() / math.sqrt(len(points))
    assert found.accessible_volume / found.volume == pytest.approx(share, abs=4.0 * error + 5e-4)


def test_accessible_solid_faces_name_their_limit_or_pair() -> None:
    design = thick(OPTIMAL, 0.01)
    solid = accessible_workspace(design, nodes=30).solid
    centres = solid.vertices[solid.faces].mean(axis=1)
    clearance = leg_clearances(Configuration(design, centres, design.home_pose.rotation)).clearance
    seen: set[str] = {solid.limits[index] for index in solid.limit_of_face.tolist()}
    offs: FloatArray = np.zeros(0)
    for pair, (i, j) in enumerate(PAIRS):
        own = solid.limit_of_face == solid.limits.index(f"legs {i}–{j}")
        offs = np.append(offs, np.abs(clearance[own, pair]))
    # Where legs 3 and 4 collide in these orientations 2 and 4 do too.
    assert {"legs 2–4", "l4 maximum"} <= seen
    # A quarter of a cell at the most where two walls meet.
    assert offs.max() < 0.4
    assert np.quantile(offs, 0.95) < 0.1


def test_blocked_volume_is_that_of_a_pair_alone() -> None:
    design = limited(OPTIMAL, leg_radii=(0.0, 0.2, 0.0, 0.2))
    found = accessible_workspace(design, nodes=30)
    blocked = {pair.legs: pair.blocked_volume for pair in found.pairs}
    alone = accessible_workspace(limited(OPTIMAL, leg_radii=(0.0, 0.0, 0.0, 0.4)), nodes=30)
    assert blocked[(2, 4)] > blocked[(3, 4)] > 0.0
    assert blocked[(1, 2)] == blocked[(1, 3)] == blocked[(2, 3)] == 0.0
    lost = found.volume - found.accessible_volume
    assert max(blocked.values()) <= lost <= sum(blocked.values())
    # The pair (2, 4) has the sum of radii 0.4 in both designs.
    again = {pair.legs: pair.blocked_volume for pair in alone.pairs}
    assert again[(2, 4)] == pytest.approx(blocked[(2, 4)], rel=1e-3)


def test_accessible_workspace_within_empty_limits_is_empty() -> None:
    found = accessible_workspace(limited(OPTIMAL, l1=(0.0, 1.0), l4=(0.0, 0.1)))
    assert found.volume == found.accessible_volume == found.accessible_node_count == 0
    assert found.solid.is_empty
    assert found.solid.empty_because
    assert radius_curve(
        Workspace(limited(OPTIMAL, l1=(0.0, 1.0), l4=(0.0, 0.1)))
    ).volumes.tolist() == [0.0]


HUNDREDTH = 0.01 * OPTIMAL.reach


@pytest.mark.parametrize(
    ("radii", "home", "words"),
    [
        ((0.0,) * 4, (10.0, 5.0, 19.0), r"box z = 19 is above its maximum 18; the nearest valid"),
        ((0.0, 0.4, 0.4, 0.0), (10.0, 5.0, 9.0), r"legs 2 and 3 overlap by 0.1306; no valid pos"),
        ((HUNDREDTH,) * 4, (10.0, -8.0, 0.3), r"legs 3 and 4 overlap by .* the nearest valid"),
    ],
)
def test_accessible_workspace_from_an_invalid_home_names_cause_and_remedy(
    radii: tuple[float, ...], home: tuple[float, float, float], words: str
) -> None:
    design = limited(OPTIMAL, leg_radii=radii)
    design = msgspec.structs.replace(design, home=Pose.of(home, OPTIMAL.home_pose.rotation))
    with pytest.raises(InputError, match=words):
        accessible_workspace(design)


def test_nearest_clear_position_has_no_nearer_one() -> None:
    r = OPTIMAL.home_pose.rotation
    above = np.array([10.0, 5.0, 19.0])
    assert nearest_clear_position(Workspace(OPTIMAL, r), above) == pytest.approx(
        [10.0, 5.0, 18.0], abs=1e-4
    )
    design, low = thick(OPTIMAL, 0.01), np.array([10.0, -8.0, 0.3])
    found = nearest_clear_position(Workspace(design, r), low)
    assert found is not None
    check_start(Workspace(design, r), found)
    best = float(np.linalg.norm(found - low))
    rng = np.random.default_rng(3)
    others = low + 0.98 * best * rng.uniform(-1.0, 1.0, (10_000, 3))
    others = others[np.linalg.norm(others - low, axis=1) < 0.98 * best]
    kept = (slacks(Workspace(design, r).limits, others) >= 0.0).all(axis=-1)
    assert not (
        kept & (leg_clearances(Configuration(design, others, r)).clearance > 0.0).all(axis=-1)
    ).any()


@pytest.mark.parametrize("nodes", [7, 161])
def test_accessible_workspace_with_a_grid_out_of_range_is_refused(nodes: int) -> None:
    with pytest.raises(InputError, match=f"within 8 to 160; got {nodes}"):
        accessible_workspace(OPTIMAL, nodes=nodes)
    with pytest.raises(InputError, match="at most"):
        accessible_workspace(OPTIMAL, node_step=1e-3)


def test_accessible_nodes_are_a_component_of_clear_steps() -> None:
    design, r = thick(INITIAL, 0.02), INITIAL.home_pose.rotation
    home = np.array(design.home_pose.position)
    grid = Grid(home - 4.5, np.full(3, 1.5), (7, 7, 7))
    found = survey(Workspace(design, r), grid)
    reached = found.accessible_from(home)
    nodes = grid.positions.reshape(-1, 3)
    # All steps again, each by itself, and a search over them from the home's node.
    first, second = np.nonzero(np.isclose(np.abs(nodes[:, None] - nodes).sum(axis=-1), 1.5))
    clear = moves_are_clear(design, nodes[first], r, nodes[second], r)
    kept = clear & found.within.ravel()[first] & found.within.ravel()[second]
    graph = coo_array((np.ones(int(kept.sum())), (first[kept], second[kept])), (343, 343))
    order = breadth_first_order(graph.tocsr(), 171, directed=False, return_predecessors=False)
    assert np.flatnonzero(reached).tolist() == sorted(order.tolist())
    assert 0 < len(order) < int(found.within.sum())


@pytest.mark.parametrize("seed", long_after(3, range(8)))
def test_least_clearances_below_a_demand_are_those_of_all_positions(seed: int) -> None:
    design, rotation = ordinary_case(seed)
    design, demand = limited(design, swing=Swing(a1=50.0, b3=70.0)), 0.05 * design.reach
    every = least_clearances(Workspace(design, rotation))
    found = least_clearances(Workspace(design, rotation), 0.1 * demand, below=demand)
    assert np.isfinite(found.clearance[every.clearance < 0.89 * demand]).all()
    assert np.isinf(found.clearance[every.clearance > demand]).all()
    is_near = np.isfinite(found.clearance)
    assert (slacks(Workspace(design, rotation).limits, found.position[is_near]) >= 0.0).all()
    assert found.clearance[is_near] == pytest.approx(every.clearance[is_near], abs=0.11 * demand)


@pytest.mark.parametrize(("design", "margin"), [(OPTIMAL, 0.0), (INITIAL, 0.5)])
def test_least_clearances_at_random_positions_hold(design: Design, margin: float) -> None:
    design = limited(design, margin=margin, leg_radii=(0.1, 0.2, 0.3, 0.4))
    r = design.home_pose.rotation
    found = least_clearances(Workspace(design))
    assert (found.bound <= found.clearance).all()
    limits = Workspace(design, r).limits
    assert (slacks(limits, found.position) >= -1e-8 * design.reach).all()
    own = leg_clearances(Configuration(design, found.position, r)).clearance
    # Axes that are as good as crossing are said to cross.
    assert np.diagonal(own) == pytest.approx(found.clearance, abs=2e-9 * design.reach)
    rng = np.random.default_rng(8)
    points = design.reach * rng.uniform(-1.2, 1.2, (60_000, 3))
    points = points[(slacks(limits, points) >= 0.0).all(axis=-1)]
    assert len(points) > 300
    sampled = leg_clearances(Configuration(design, points, r)).clearance.min(axis=0)
    assert (found.clearance <= sampled + 1e-12).all()


def test_least_clearances_have_the_same_last_digits_with_any_number_of_threads() -> None:
    rng = np.random.default_rng(0)
    for _ in range(4):
        factors = 1.0 + 0.1 * rng.normal(size=6)
        design = OPTIMAL.with_variables((OPTIMAL.variables * factors).tolist())
        found: list[list[float]] = []
        for count in (1, 2, 4):
            with threadpool_limits(count, "blas"):
                least = least_clearances(Workspace(design), margin=0.5)
            found.append([*least.clearance.tolist(), *least.position.ravel().tolist()])
        assert found[0] == found[1] == found[2]


def test_distance_gradients_agree_with_finite_differences() -> None:
    rng = np.random.default_rng(2)
    design, r = OPTIMAL, rotation_from_yaw_pitch_roll((-60.0, 20.0, 10.0))
    p = np.array([10.0, 5.0, 9.0]) + rng.uniform(-4.0, 4.0, (200, 3))
    gradient = distance_gradients(Configuration(design, p, r))
    step, differences = 1e-5, np.zeros_like(gradient)
    for axis in range(3):
        off = step * np.eye(3)[axis]
        up, down = (
            leg_clearances(Configuration(design, p + s * off, r)).distance for s in (1.0, -1.0)
        )
        differences[..., axis] = (up - down) / (2.0 * step)
    # Where closest points jump from one end to another a difference means nothing.
    assert np.quantile(np.abs(gradient - differences), 0.98) < 1e-6
    assert np.linalg.norm(gradient, axis=-1).max() <= 1.0 + 1e-12


@pytest.mark.parametrize("design", long_after(1, ROWS))
def test_radius_curve_agrees_with_solids(design: Design) -> None:
    curve = radius_curve(Workspace(design))
    exact = workspace_volume(design).volume
    assert curve.volumes[0] == pytest.approx(exact, rel=5e-3)
    assert (np.diff(curve.volumes) <= 0.0).all()
    assert curve.volumes[-1] < curve.volumes[0]
    assert curve.harmless == curve.harmless_bound == 0.0
    for share in (0.25, 0.9):
        radius = share * float(curve.radii[-1])
        solid = accessible_workspace(with_radius(design, radius)).accessible_volume
        assert np.interp(radius, curve.radii, curve.volumes) == pytest.approx(solid, rel=5e-3)


def test_harmless_radius_blocks_nothing_and_a_larger_one_does() -> None:
    design = limited(OPTIMAL, margin=1.0)
    curve = radius_curve(Workspace(design), cells=20)
    assert 0.0 < curve.harmless_bound <= curve.harmless
    under, over = (with_radius(design, share * curve.harmless) for share in (0.98, 1.5))
    untouched = accessible_workspace(under)
    assert untouched.accessible_volume == pytest.approx(untouched.volume, rel=1e-6)
    touched = accessible_workspace(over, nodes=40)
    assert touched.accessible_volume < touched.volume * (1.0 - 1e-6)
