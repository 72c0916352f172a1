"""The constant-orientation workspace: volumes, gradients and nodes against independent methods.

Volumes are compared with reference values (good to 1e-4), with a closed form in y under a
fine quadrature in x for both rows of Table 1 (converged to 1e-9), and with the columns of
another kernel (good to about 1e-4).
"""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import (
    REFERENCE,
    limited,
    ordinary_case,
    reference_case,
    scaled_design,
    troubled_case,
)
from long_cases import long_after
from scipy.spatial.transform import Rotation

import explorer.workspace.slices.volume as volumes
from explorer import PRESETS, Design, InputError, home_pose
from explorer.mechanism.design import LENGTHS, VARIABLES, Swing
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import YAW, constraints
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.integration import RESULTS, integrate_slices
from explorer.workspace.slices.nodes import column_lengths, count_nodes
from explorer.workspace.slices.volume import (
    bounds,
    home_rotation,
    workspace_nodes,
    workspace_volume,
)

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]


@pytest.mark.parametrize("index", long_after(8, range(len(REFERENCE["workspaces"]))))
def test_volume_of_reference_workspaces_is_theirs(index: int) -> None:
    design, rotation, volume = reference_case(index)
    assert workspace_volume(design, rotation).volume == pytest.approx(volume, rel=1e-4)


def height_field_volume(design: Design, panels: int) -> float:
    """Return the volume of a level workspace above z = 0 without minima, independently.

    Level, every ball and cylinder has its centre in the plane z = 0, so that the height over
    (x, y) is the least of the box and of roots of c - (y - y0)²: in y it has a closed form
    between the places where two of them are equal, in x it is left to Gauss-Legendre.
    """
    u, v = home_rotation(design)[:2, 0], home_rotation(design)[:2, 1]
    reach, (lows, highs) = design.reach, design.limits.box or pytest.fail("no box")
    balls = [-(design.b1[0] * u + design.b1[1] * v), np.array(design.a3)]
    nodes, weights = np.polynomial.legendre.leggauss(4)
    edges = np.linspace(lows[0], highs[0], panels + 1)
    width = (highs[0] - lows[0]) / panels
    x = (edges[:-1, None] + 0.5 * width * (nodes + 1.0)).ravel()
    rate = np.tile(0.5 * width * weights, panels)
    # Rows (y0, c) of each root, of shape (rows, x); the box is a root that is level.
    middles = np.array([*(ball[1] for ball in balls), -design.b2 * u[1], -design.b3 * u[1]])
    tube = np.full_like(x, reach**2)
    squares = np.stack([*(tube - (x - ball[0]) ** 2 for ball in balls), tube, tube])
    top = highs[2]
    ends = [np.full_like(x, lows[1]), np.full_like(x, highs[1])]
    for i in range(4):
        for level in (0.0, top * top):
            root = np.sqrt(np.maximum(0.0, squares[i] - level))
            ends += [middles[i] - root, middles[i] + root]
        for j in range(i):
            apart = middles[i] - middles[j]
            if apart:
                # c_i - (y - y_i)² = c_j - (y - y_j)² is linear in y.
                middle = 0.5 * (middles[i] + middles[j])
                ends.append(middle - 0.5 * (squares[i] - squares[j]) / apart)
    y = np.sort(np.clip(np.stack(ends), lows[1], highs[1]), axis=0)
    a, b = y[:-1], y[1:]
    heights = squares[:, None] - (0.5 * (a + b)[None] - middles[:, None, None]) ** 2
    lowest = heights.argmin(axis=0)
    least = np.take_along_axis(heights, lowest[None], axis=0)[0]
    y0, c = middles[lowest], np.take_along_axis(squares, lowest, axis=0)
    inner = _root_integral(b - y0, c) - _root_integral(a - y0, c)
    inner = np.where(least > top * top, top * (b - a), np.where(least > 0.0, inner, 0.0))
    return float((rate * inner.sum(axis=0)).sum())


def _root_integral(t: FloatArray, c: FloatArray) -> FloatArray:
    """Return the integral of sqrt(c - t²) from 0."""
    r = np.sqrt(np.maximum(c, 1e-300))
    t = np.clip(t, -r, r)
    return 0.5 * (t * np.sqrt(np.maximum(0.0, c - t * t)) + c * np.arcsin(t / r))


@pytest.mark.parametrize("row", REFERENCE["table1"], ids=lambda row: str(row["name"]))
def test_volume_of_table_1_rows_is_that_of_a_height_field(row: dict[str, Any]) -> None:
    design = PRESETS[row["name"]]
    independent = height_field_volume(design, 2000)
    found = workspace_volume(design).volume
    assert found == pytest.approx(independent, rel=1e-7)
    assert found == pytest.approx(row["exact_volume"], rel=1e-6)


@pytest.mark.parametrize("row", REFERENCE["table1"], ids=lambda row: str(row["name"]))
def test_nodes_of_table_1_rows_are_the_reference_ones(row: dict[str, Any]) -> None:
    nodes = workspace_nodes(PRESETS[row["name"]])
    assert nodes.count == row["node_count"]
    assert nodes.step == pytest.approx(row["step"], rel=1e-12)
    assert nodes.volume == pytest.approx(row["node_volume"], rel=1e-12)
    np.testing.assert_allclose(nodes.extent or (), row["extent"], rtol=1e-12, atol=1e-12)


def test_node_volume_of_the_optimum_is_the_paper_s() -> None:
    assert workspace_nodes(OPTIMAL).volume == 7992.0
    # The printed extents of the initial row, to their digits.
    lows, highs = workspace_nodes(PRESETS["paper-initial"]).extent or pytest.fail("empty")
    assert [round(end, 3) for end in highs] == [10.052, 10.770, 9.334]
    assert [round(end, 3) for end in lows] == [0.0, -5.026, 0.0]


@pytest.mark.parametrize("seed", range(4))
def test_nodes_counted_satisfy_every_limit(seed: int) -> None:
    design, rotation = ordinary_case(seed)
    step = 0.7
    nodes = workspace_nodes(design, rotation, step)
    index = np.stack(np.meshgrid(*[np.arange(-45.0, 46.0)] * 3, indexing="ij"), axis=-1)
    grid = np.asarray(step * index.reshape(-1, 3), dtype=np.float64)
    kept = np.all([limit.slack(grid) >= 0.0 for limit in constraints(design, rotation)], axis=0)
    assert nodes.count == int(kept.sum())
    if nodes.extent is not None:
        inside = grid[kept]
        np.testing.assert_allclose(nodes.extent, [inside.min(axis=0), inside.max(axis=0)])


@pytest.mark.parametrize("seed", range(5))
def test_volume_is_the_sum_of_columns(seed: int) -> None:
    design, rotation = ordinary_case(seed)
    region, many = region_of(constraints(design, rotation)), 500
    assert len(region.cones) == 0
    lows, highs = bounds(region)
    total = np.zeros(1)
    column_lengths(many * many, *region.rows, lows, highs, many, total)
    volume = float(total[0] * (highs[0] - lows[0]) * (highs[1] - lows[1])) / many**2
    assert volume == pytest.approx(workspace_volume(design, rotation).volume, rel=1e-3)


def varied(design: Design, rotation: FloatArray, name: str, by: float) -> tuple[Design, FloatArray]:
    """Return the design or the rotation with one parameter of a gradient changed."""
    limits = design.limits
    if name in VARIABLES:
        return with_added(design, name, by), rotation
    if name == YAW:
        return design, Rotation.from_rotvec([0.0, 0.0, by]).as_matrix() @ rotation
    if name == "margin":
        return limited(design, margin=(limits.margin or 0.0) + by), rotation
    words = name.split()
    end = 0 if words[-1] == "minimum" else 1
    if words[0] in LENGTHS or words[0] == "guide":
        ends = list(getattr(limits, words[0]))
        ends[end] += by
        return limited(design, **{words[0]: tuple(ends)}), rotation
    assert words[0] == "box"
    box = [list(each) for each in limits.box or pytest.fail("no box")]
    box[end]["xyz".index(words[1])] += by
    return limited(design, box=(tuple(box[0]), tuple(box[1]))), rotation


def with_added(design: Design, variable: str, by: float) -> Design:
    return design.with_variable(variable, design.variables[VARIABLES.index(variable)] + by)


@pytest.mark.parametrize("seed", range(6))
def test_volume_gradient_is_that_of_central_differences(seed: int) -> None:
    design, rotation = ordinary_case(seed)
    found = workspace_volume(design, rotation)
    assert {*VARIABLES, YAW, "margin", "l1 maximum", "d2 minimum"} <= set(found.gradient)
    largest = max(map(abs, found.gradient.values()))
    for name, rate in found.gradient.items():
        ahead, behind = (
            workspace_volume(*varied(design, rotation, name, by)).volume for by in (1e-5, -1e-5)
        )
        assert rate == pytest.approx((ahead - behind) / 2e-5, abs=1e-5 * largest), name


@pytest.mark.parametrize("name", ["a3x", "a3y"])
def test_volume_gradient_by_a3_includes_maxima_at_the_reach(name: str) -> None:
    home = home_pose(OPTIMAL)
    design = msgspec.structs.replace(OPTIMAL, home=home)
    rate, step = workspace_volume(design).gradient[name], 1e-4
    ahead, behind = (workspace_volume(with_added(design, name, by)) for by in (step, -step))
    assert rate == pytest.approx((ahead.volume - behind.volume) / (2.0 * step), rel=1e-6)


@pytest.mark.parametrize("seed", range(2))
def test_kernels_interpreted_and_compiled_have_the_same_results(seed: int) -> None:
    design, rotation = ordinary_case(seed)
    region = region_of(constraints(limited(design, swing=Swing(a1=50.0, b2=60.0)), rotation))
    lows, highs = bounds(region)
    step = float((highs - lows).max()) / 12.0
    first = np.ceil(lows / step)
    counts = (np.floor(highs / step) - first + 1).astype(np.int64)

    def run(*, compiled: bool) -> list[FloatArray]:
        volume, grid, lengths = np.zeros(RESULTS), np.zeros(7, dtype=np.int64), np.zeros(1)
        rates = np.zeros((len(region.circles) + len(region.planes), 4))
        ends = (region.low, region.high)
        calls: list[tuple[Any, tuple[Any, ...]]] = [
            (integrate_slices, (*region.rows[:2], *ends, volumes.quadrature(), volume, rates)),
            (count_nodes, (*region.rows, np.array(ends), 1e-9, first, counts, step, grid)),
            (column_lengths, (*region.rows, lows, highs, 12, lengths)),
        ]
        for kernel, arguments in calls:
            if compiled:
                assert kernel.ready
                kernel(1, *arguments)
            else:
                kernel.__wrapped__(*arguments)
        return [volume, rates, grid.astype(np.float64), lengths]

    for one, other in zip(run(compiled=True), run(compiled=False), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12 * np.abs(one).max())


@pytest.mark.parametrize(("seed", "s"), [(0, 1e-9), (1, 1e3)])
def test_volume_of_a_scaled_design_scales_with_the_cube(seed: int, s: float) -> None:
    design, rotation = ordinary_case(seed)
    larger = scaled_design(design, s)
    found, large = (workspace_volume(each, rotation) for each in (design, larger))
    assert large.volume == pytest.approx(found.volume * s**3, rel=1e-9)
    for name, rate in found.gradient.items():
        power = 3 if name == YAW else 2
        assert large.gradient[name] == pytest.approx(rate * s**power, rel=1e-6, abs=1e-6 * s**power)
    count = workspace_nodes(design, rotation, 0.5).count
    assert workspace_nodes(larger, rotation, 0.5 * s).count == count


@pytest.mark.parametrize(
    ("limits", "because"),
    [
        ({"gap": 50.0}, ("gap |d1 − d3|",)),
        ({"margin": 19.0}, ("box z maximum", "margin δ3")),
        *(({name: (5.0, 5.0)}, (f"{name} minimum", f"{name} maximum")) for name in LENGTHS),
        ({"l1": (30.0, 40.0)}, ("l1 minimum", "box x maximum")),
        ({"d4": (0.0, 0.0)}, ("d4 maximum",)),
        ({"guide": (100.0, 101.0)}, ("d3 minimum", "box x maximum")),
        ({"box": ((0.0, 0.0, 50.0), (1.0, 1.0, 51.0))}, ("box z minimum",)),
        ({"box": ((3.0, 3.0, 3.0), (3.0, 9.0, 9.0))}, ("box x minimum", "box x maximum")),
        ({"swing": Swing(a1=1.0, b4=1.0), "l1": (13.0, None)}, ()),
    ],
)
def test_workspace_empty_names_the_limits_that_empty_it(
    limits: dict[str, Any], because: tuple[str, ...]
) -> None:
    design = limited(OPTIMAL, **limits)
    found = workspace_volume(design)
    assert found.volume == 0.0
    names = found.empty_because
    assert names == because if because else any(name.startswith("swing") for name in names)
    # Nodes lie on boundaries too, but never apart from the region.
    assert workspace_nodes(design).count == 0 or because == ("box x minimum", "box x maximum")


def test_workspace_of_parallel_lines_is_empty_unless_no_margin_is_demanded() -> None:
    level = np.eye(3)
    assert workspace_volume(OPTIMAL, level).empty_because == ("margin δ2",)
    assert workspace_volume(limited(OPTIMAL, margin=None), level).volume > 1000.0


def test_balls_that_are_equal_count_once() -> None:
    rotation = home_rotation(OPTIMAL)
    # The centre of l1 is -R b1: put a3 there, and the balls of l1 and l4 are one.
    b1x, b1y = (-(rotation.T @ [*OPTIMAL.a3, 0.0]))[:2].tolist()
    design = msgspec.structs.replace(OPTIMAL, b1=(b1x, b1y), home=home_pose(OPTIMAL))
    without = workspace_volume(limited(design, l4=(0.0, 1e3))).volume
    assert workspace_volume(design).volume == pytest.approx(without, rel=1e-12)


@pytest.mark.parametrize("seed", long_after(40, range(150)))
def test_volume_of_extreme_designs_is_that_of_random_positions(seed: int) -> None:
    design, rotation = troubled_case(seed)
    r = home_rotation(design) if rotation is None else rotation
    limits = constraints(design, r)
    found = workspace_volume(design, r)
    assert found.volume >= 0.0
    assert math.isfinite(found.volume)
    assert bool(found.empty_because) == (found.volume == 0.0)
    lows, highs = bounds(region_of(limits))
    if not (lows < highs).all():
        assert found.volume == 0.0
        return
    many = 20_000
    p = lows + np.random.default_rng(seed).random((many, 3)) * (highs - lows)
    share = float(np.all([limit.slack(p) >= 0.0 for limit in limits], axis=0).mean())
    expected = found.volume / float(np.prod(highs - lows))
    # Five standard deviations, and what columns may be off.
    spread = 5.0 * math.sqrt(max(expected * (1.0 - expected), 1.0 / many) / many)
    assert share == pytest.approx(expected, abs=spread + 1e-3 * expected)


@pytest.mark.parametrize("step", [0.0, math.nan, 1e-3])
def test_nodes_with_an_unusable_step_are_refused(step: float) -> None:
    with pytest.raises(InputError, match="node"):
        workspace_nodes(OPTIMAL, step=step)


def test_workspace_with_an_invalid_rotation_is_refused() -> None:
    for measure in (workspace_volume, workspace_nodes):
        with pytest.raises(InputError, match="rotation"):
            measure(OPTIMAL, 2.0 * np.eye(3))
