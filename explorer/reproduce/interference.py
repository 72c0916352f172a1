"""Claims on leg interference: the 4-4 beside its 6-4 twin, and the paper's optimum by itself."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial

import msgspec
import numpy as np

from explorer.legs.clearance import PAIRS, leg_clearances, pair_rows
from explorer.legs.interference import step_overlaps, tetrahedra_overlap
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.arrays import BoolArray, FloatArray, for_kernel
from explorer.reproduce.claim import Measurement, judge
from explorer.six_legged.files import six_four_twin
from explorer.six_legged.table import SixLegged, TablePoses
from explorer.workspace.workspace import Workspace

# In units of 1 mm, as the twin beside it.
OPTIMAL = msgspec.structs.replace(PRESETS["paper-optimal"], unit_mm=1.0)
ROTATION = OPTIMAL.home_pose.rotation
A2X = (5.0, 10.0, 15.0, OPTIMAL.reach)
"""Positions of a2 within the reach at which the twin is measured, in design units; the 4-4 does
not depend on it."""

BEYOND = 26.0
"""A position of a2 beyond the reach, for comparison."""

NODE_STEP = 1.0
LOWEST = (1.0, 2.0, 3.0)
"""Least z of the nodes over which a least clearance is taken, in design units. On the base plane
all legs come together, so that it falls to zero for every mechanism."""

FROM = 2.0
"""Least z of the nodes over which all else is measured, in design units."""

RADII = (0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8)
STEPS = (0.5, 1.0, 2.0)
"""Lengths of steps along x, y and z whose swept tetrahedra are tested; 2 is our reading of the step
of the optimum's nodes."""

# Clearance of legs that touch, in design units.
TOUCHING = 1e-9
# Share of colliding steps below which an interval counts as short enough.
RARE = 0.001

Collides = Callable[[FloatArray, FloatArray], BoolArray]


@dataclass(frozen=True)
class LegCollisions:
    """The clearances of thin legs of a mechanism over a workspace, and shares of its nodes.

    The least clearances are by the least z (`LOWEST`). The shares are those of nodes clearer than
    with the 4-4, of nodes without a collision (`RADII`), and of colliding steps (`STEPS`, axes).
    """

    name: str
    least: tuple[float, ...]
    median: float
    clearer: float | None
    free: tuple[float, ...]
    steps: tuple[tuple[float, ...], ...]


def measure_risk() -> Measurement:
    """Compare clearances and swept steps of the 4-4 and of its 6-4 twin over a workspace."""
    nodes = _nodes(NODE_STEP, LOWEST[0])
    pairs = leg_clearances(Configuration(OPTIMAL, nodes, ROTATION)).clearance
    four = pairs.min(axis=1)
    mechanisms = [_interference("4-4", nodes, four, four, _four_collides)]
    for a2x in (*A2X, BEYOND):
        twin = six_four_twin(OPTIMAL, a2x, BEYOND + OPTIMAL.reach)
        six = clearances(twin, nodes).min(axis=1)
        collides = partial(_six_collide, twin)
        mechanisms.append(_interference(twin.name, nodes, six, four, collides))
    ours, *twins, beyond = mechanisms
    apart = float(pairs[:, PAIRS.index((2, 3))].max())
    # Legs thinner than half the distance of legs 2 and 3 do not meet there. Twins with a2 within
    # the reach are compared; that beyond it is only reported.
    thin = [k for k, radius in enumerate(RADII) if 2.0 * radius < apart]
    thick = [k for k in range(len(RADII)) if k not in thin]

    def is_as_free(indices: Sequence[int]) -> bool:
        return all(ours.free[k] >= twin.free[k] for twin in twins for k in indices)

    least = [twin.least[1] for twin in twins]
    clearer = [twin.clearer or 0.0 for twin in twins]
    medians = [twin.median for twin in twins]
    words = {
        "apart": apart,
        "relation": "at least as many" if is_as_free(thin) else "not always as many",
        "z": LOWEST[1],
        "ours": ours,
        "least": (min(least), max(least)),
        "beyond": beyond,
        "a2x": BEYOND,
        "clearer": (min(clearer), max(clearer)),
        "medians": (min(medians), max(medians)),
    }
    values = {"legs_2_and_3_apart": apart, "mechanisms": [asdict(each) for each in mechanisms]}
    is_so = is_as_free(thin) and is_as_free(thick) and max(clearer) < 0.5
    condition = (
        f"for legs with radii below {0.5 * apart:.2f} units and a2 within the reach, at home's "
        "orientation, by the share of positions free of collisions"
    )
    is_within = thin and is_as_free(thin)
    return judge(is_so, words, values, _table(mechanisms), condition if is_within else "")


def measure_optimum() -> Measurement:
    """Test steps of the paper's optimum by swept tetrahedra, and its nodes by clearances."""
    nodes = _nodes(NODE_STEP, LOWEST[0])
    pairs = leg_clearances(Configuration(OPTIMAL, nodes, ROTATION)).clearance
    apart = float(pairs[:, PAIRS.index((2, 3))].min())
    of_table = _nodes(STEPS[-1], 0.0)
    clearance = leg_clearances(Configuration(OPTIMAL, of_table, ROTATION)).clearance.min(axis=1)
    touching = of_table[clearance < TOUCHING]
    steps = _shares_of_steps(nodes, _four_collides)
    touches = {"nodes": len(of_table), "highest": float(touching[:, 2].max(initial=0.0))}
    lines = [f"{'step':>8}" + "".join(f"{axis:>8}" for axis in "xyz")]
    for length, shares in zip(STEPS, steps, strict=True):
        lines.append(f"{length:8g}" + "".join(f"{share:8.1%}" for share in shares))
    shortest, longest = max(steps[0]), max(steps[-1])
    words = {
        "z": FROM,
        "shortest": shortest,
        "longest": longest,
        "steps": (STEPS[0], STEPS[-1]),
        "touching": len(touching),
        **touches,
    }
    values = {
        "steps": dict(zip(map(str, STEPS), steps, strict=True)),
        "apart": apart,
        "touching": {"count": len(touching), **touches},
    }
    if shortest < RARE < longest:
        return Measurement("not testable from the paper", words, values, tuple(lines))
    return judge(shortest == longest == len(touching) == 0, words, values, lines)


def _interference(
    name: str, nodes: FloatArray, clearance: FloatArray, four: FloatArray, collides: Collides
) -> LegCollisions:
    """Measure a mechanism with a least clearance at each node, beside that of the 4-4, (n,)."""
    high = nodes[:, 2] >= FROM
    return LegCollisions(
        name,
        tuple(float(clearance[nodes[:, 2] >= z].min()) for z in LOWEST),
        float(np.median(clearance[high])),
        None if clearance is four else float((clearance > four)[high].mean()),
        tuple(float((clearance[high] > 2.0 * radius).mean()) for radius in RADII),
        _shares_of_steps(nodes, collides),
    )


def _shares_of_steps(nodes: FloatArray, collides: Collides) -> tuple[tuple[float, ...], ...]:
    """Return the shares of colliding steps from nodes, by length as in `STEPS` and by axis."""
    starts = nodes[nodes[:, 2] >= FROM]

    def share(step: FloatArray) -> float:
        within = _within(starts + step)
        return float(collides(starts[within], (starts + step)[within]).mean())

    return tuple(tuple(share(length * axis) for axis in np.eye(3)) for length in STEPS)


def _four_collides(start: FloatArray, end: FloatArray) -> BoolArray:
    ends = (Configuration(OPTIMAL, position, ROTATION) for position in (start, end))
    return np.asarray(step_overlaps(*ends).any(axis=-1))


def pairs_of(table: SixLegged) -> list[tuple[int, int]]:
    """Return the pairs of legs of a table that share no joint."""
    ends = table.base_mm, table.platform_mm
    pairs = itertools.combinations(range(6), 2)
    return [(i, j) for i, j in pairs if all(p[i] != p[j] for p in ends)]


def clearances(table: SixLegged, position: FloatArray) -> FloatArray:
    """Return the distances of the axes of its pairs at home's orientation, shape (n, m)."""
    axes = TablePoses(table, position, ROTATION).ends
    distance, points = np.empty((len(axes), 6)), np.empty((len(axes), 6, 2, 3))
    found: list[FloatArray] = []
    for i, j in pairs_of(table):
        # The first pair of these legs.
        pair_rows(len(axes), for_kernel(axes[:, [i, j, i, j]]), distance, points)
        found.append(distance[:, 0].copy())
    return np.stack(found, axis=-1)


def _six_collide(table: SixLegged, start: FloatArray, end: FloatArray) -> BoolArray:
    """Return whether legs of a table collide on steps by the paper's test, shape (n,)."""
    one, two = (TablePoses(table, p, ROTATION).ends for p in (start, end))
    swept = np.stack([one[:, :, 0], two[:, :, 0], one[:, :, 1], two[:, :, 1]], axis=-2)
    overlaps = [tetrahedra_overlap(swept[:, i], swept[:, j]) for i, j in pairs_of(table)]
    return np.asarray(np.any(overlaps, axis=0))


def _table(mechanisms: Sequence[LegCollisions]) -> list[str]:
    heads = "".join(f"{f'z ≥ {z:g}':>8}" for z in LOWEST)
    lines = [f"{'':18}{'least clearance':^24}", f"{'':18}{heads}{'median':>9}{'clearer':>9}"]
    for each in mechanisms:
        clearer = "" if each.clearer is None else f"{each.clearer:.1%}"
        least = "".join(f"{value:8.3f}" for value in each.least)
        lines.append(f"{each.name:18}{least}{each.median:9.3f}{clearer:>9}".rstrip())
    lines += ["share of nodes without a collision, by the radius of all legs"]
    lines.append(f"{'':18}" + "".join(f"{radius:8g}" for radius in RADII))
    lines += [_shares_line(each.name, each.free) for each in mechanisms]
    lines += ["share of steps that collide by the paper's test, by length and axis"]
    lines.append(f"{'':18}" + "".join(f"{f'{s:g} {a}':>8}" for s in STEPS for a in "xyz"))
    lines += [_shares_line(each.name, sum(each.steps, ())) for each in mechanisms]
    return lines


def _shares_line(name: str, shares: Sequence[float]) -> str:
    return f"{name:18}" + "".join(f"{share:8.1%}" for share in shares)


def _nodes(step: float, lowest: float) -> FloatArray:
    """Return the nodes of a grid in the workspace of the optimum from a least z on, (n, 3)."""
    lows, highs = OPTIMAL.limits.box or ((-OPTIMAL.reach,) * 3, (OPTIMAL.reach,) * 3)
    axes = [np.arange(low, high + 0.5 * step, step) for low, high in zip(lows, highs, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    grid = grid[grid[:, 2] >= lowest]
    return grid[_within(grid)]


def _within(positions: FloatArray) -> BoolArray:
    return np.asarray(Workspace(OPTIMAL, ROTATION).satisfies(positions).all(axis=-1))
