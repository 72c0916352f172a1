"""The nodes of a grid that are accessible from a position without a collision of legs.

They form a connected component of a graph. Its nodes keep all limits, and its edges are steps
between neighbours that are certified free of collisions (`explorer.legs.moves`). The grid
extends beyond the limits, so that a surface of collision can be followed up to them. The position
that they start from is checked before it is used.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from explorer.errors import InputError
from explorer.legs.clearance import PAIRS, leg_clearances
from explorer.legs.moves import pairs_are_clear
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.number_text import Unit
from explorer.numerics.search import descend
from explorer.workspace.limits.valid_poses import violations
from explorer.workspace.slices.volume import check_node_count, node_range
from explorer.workspace.workspace import Workspace

ALL_PAIRS = tuple(range(len(PAIRS)))
# Clearance, over the reach, below which legs touch at a node.
SLACK = 1e-9
# Search for the nearest valid position: cells on each axis, number of the nearest nodes from
# which a descent starts, and clearance over the reach.
CELLS = 40
STARTS = 6
CLEAR = 1e-6
# Largest number of nodes of the paper's grid, all steps of which are checked.
MOST_PAPER_NODES = 2_000_000


@dataclass(frozen=True)
class Grid:
    """A grid of positions.

    Attributes:
        lows: Position of the first node, shape (3,), in design units.
        step: Distance between neighbours on each axis, shape (3,), in design units.
        counts: Numbers of nodes on the axes.
    """

    lows: FloatArray
    step: FloatArray
    counts: tuple[int, int, int]

    @cached_property
    def positions(self) -> FloatArray:
        """The nodes, shape (nx, ny, nz, 3)."""
        return self.lows + self.step * np.stack([*np.indices(self.counts)], axis=-1)

    def cell_around(self, position: FloatArray, wider: int = 0) -> tuple[slice, slice, slice]:
        """Return the nodes of the cell that holds a position, and of `wider` cells around it."""
        first = np.floor((position - self.lows) / self.step).astype(np.int64)
        ends = np.clip([first - wider, first + 2 + wider], 0, self.counts)
        x, y, z = map(slice, *ends.tolist())
        return x, y, z


def make_grid(lows: FloatArray, highs: FloatArray, nodes: int, beyond: int) -> Grid:
    """Make a grid over a box, with `nodes` on each axis, the first and last of them on its faces.

    `beyond` is the number of further nodes on either side.
    """
    step = (highs - lows) / (nodes - 1)
    count = nodes + 2 * beyond
    return Grid(lows - beyond * step, step, (count, count, count))


def make_cell_grid(lows: FloatArray, highs: FloatArray, cells: int) -> Grid:
    """Make the grid of the centres of a box's cells, `cells` on each axis, at least 2."""
    step = (highs - lows) / cells
    return Grid(lows + 0.5 * step, step, (cells, cells, cells))


@dataclass(frozen=True)
class Survey:
    """The limits and collisions of a grid of positions at one orientation.

    Attributes:
        workspace, grid: What is surveyed.
        within: Whether a node keeps all limits, shape (nx, ny, nz).
        clearance: Clearance of each pair of legs at each node, shape (nx, ny, nz, 6).
        first, second: Flat indices of the two nodes of each step along an axis, shape (m,).
        clear: Whether a pair is certified free of collision on a step, shape (m, 6).
    """

    workspace: Workspace
    grid: Grid
    within: BoolArray
    clearance: FloatArray
    first: IntArray
    second: IntArray
    clear: BoolArray

    def accessible_from(self, start: FloatArray, pairs: Sequence[int] = ALL_PAIRS) -> BoolArray:
        """Return which nodes are accessible within the limits, shape (nx, ny, nz).

        The start, shape (3,), keeps all limits and clearances. Only some pairs may count.
        """
        return self._component(self.nodes_near(start, pairs), self.within, pairs)

    def extend(self, accessible: BoolArray, pairs: Sequence[int] = ALL_PAIRS) -> BoolArray:
        """Return the accessible nodes, and those beyond the limits that clear steps lead to.

        Of the nodes within the limits only the accessible ones count, so that nothing but
        collisions separates the result from other nodes, at the limits and beyond.
        """
        return self._component(accessible, accessible | ~self.within, pairs)

    def nodes_near(self, start: FloatArray, pairs: Sequence[int] = ALL_PAIRS) -> BoolArray:
        """Return the nodes near a position to which a straight move is clear."""
        reached = np.zeros(self.within.shape, dtype=np.bool_)
        for wider in range(3):
            cell = self.grid.cell_around(start, wider)
            near = self.grid.positions[cell]
            clear = moves_are_clear(self.workspace, start, near)
            reached[cell] = clear[..., list(pairs)].all(axis=-1) & self.within[cell]
            if reached.any():
                break
        return reached

    def _component(self, seeds: BoolArray, allowed: BoolArray, pairs: Sequence[int]) -> BoolArray:
        """Return the allowed nodes that clear steps connect with seeds."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        shape, allowed = allowed.shape, allowed.ravel()
        clear = self.clear[:, list(pairs)].all(axis=-1)
        usable = clear & allowed[self.first] & allowed[self.second]
        ends = self.first[usable], self.second[usable]
        graph = coo_array(
            (usable[usable].astype(np.int8), ends), shape=(allowed.size, allowed.size)
        )
        _, labels = connected_components(graph, directed=False)
        with_seed = labels[seeds.ravel() & allowed]
        return np.asarray((np.isin(labels, with_seed) & allowed).reshape(shape))


def moves_are_clear(workspace: Workspace, start: FloatArray, end: FloatArray) -> BoolArray:
    """Return which pairs of legs certainly stay apart on moves between positions, (..., 6)."""
    rotation = workspace.rotation
    return pairs_are_clear(workspace.design, start, rotation, end, rotation)


def survey(workspace: Workspace, grid: Grid) -> Survey:
    """Check limits and collisions at the nodes and on the steps of a grid of positions."""
    positions = grid.positions
    slack = SLACK * workspace.design.reach
    satisfied = workspace.satisfies(positions)
    clearance = leg_clearances(workspace.at(positions)).clearance
    index = np.arange(math.prod(grid.counts)).reshape(grid.counts)
    ends = [
        (np.delete(index, -1, axis).ravel(), np.delete(index, 0, axis).ravel()) for axis in range(3)
    ]
    first, second = (np.concatenate(side) for side in zip(*ends, strict=True))
    length = np.repeat(grid.step, [len(one) for one, _ in ends])
    flat = clearance.reshape(-1, len(PAIRS))
    a, b = flat[first], flat[second]
    # At a fixed orientation a clearance changes by no more than the position does. This decides
    # most steps: they are certainly clear, or an end is not clear.
    clear = a + b > (1.0 + SLACK) * length[:, None]
    ends_clear = (a > slack) & (b > slack)
    doubtful = np.flatnonzero((~clear & ends_clear).any(axis=-1))
    nodes = positions.reshape(-1, 3)
    start, end = nodes[first[doubtful]], nodes[second[doubtful]]
    clear[doubtful] |= moves_are_clear(workspace, start, end)
    within = np.asarray(satisfied.all(axis=-1))
    return Survey(workspace, grid, within, clearance, first, second, clear & ends_clear)


class InvalidStartError(InputError):
    """A start that breaks a limit or at which legs collide.

    Attributes:
        nearest: Nearest valid position at the same orientation, shape (3,); None without any.
        in_millimetres: The message with lengths in mm; its own are in design units.
    """

    def __init__(self, message: str, nearest: FloatArray | None, in_millimetres: str) -> None:
        super().__init__(message)
        self.nearest, self.in_millimetres = nearest, in_millimetres


def check_start(workspace: Workspace, position: FloatArray) -> None:
    """Raise `InvalidStartError` unless a position (3,) keeps the limits and no legs collide.

    Its message names the limits or the pairs of legs, and the nearest valid position.
    """
    (broken,) = violations(workspace.at(position))
    if not broken:
        return
    nearest = nearest_clear_position(workspace, position)

    def words(unit: Unit | None) -> str:
        faults = "; ".join(each.words(unit) for each in broken)
        remedy = "no valid position is found at this orientation"
        if nearest is not None:
            place = _text_of(nearest, unit)
            remedy = f"the nearest valid position at this orientation is {place}"
        return f"no position is accessible from {_text_of(position, unit)}: {faults}; {remedy}"

    raise InvalidStartError(words(None), nearest, words(workspace.design.millimetres))


def _text_of(position: FloatArray, unit: Unit | None) -> str:
    factor, name = (1.0, "") if unit is None else (unit.factor, f" {unit.name}")
    return "(" + ", ".join(f"{factor * x:.6g}" for x in position) + f"){name}"


def count_nodes(
    workspace: Workspace, start: FloatArray, step: float, most: int | None
) -> tuple[int, int] | tuple[None, None]:
    """Count the nodes of the paper's grid within the limits, and the accessible ones.

    Both counts are None if the grid has more nodes than `most`.
    """
    first, counts = node_range(workspace.region, step)
    if most is not None and float(np.prod(counts)) > most:
        return None, None
    check_node_count(counts, step, MOST_PAPER_NODES)
    if not counts.all():
        return 0, 0
    x, y, z = counts.astype(int).tolist()
    surveyed = survey(workspace, Grid(first * step, np.full(3, step), (x, y, z)))
    within = int(surveyed.within.sum())
    is_valid = workspace.is_valid(start)
    return within, int(surveyed.accessible_from(start).sum()) if is_valid else 0


def nearest_clear_position(workspace: Workspace, position: FloatArray) -> FloatArray | None:
    """Return the nearest position within the limits at which no legs collide, shape (3,).

    It is the best of the local optima near the nearest free nodes of a grid; None if no node
    of the grid is free.
    """
    box, reach = workspace.region.box, workspace.design.reach
    if box is None:
        return None
    nodes = make_cell_grid(*box, CELLS).positions.reshape(-1, 3)
    nodes = nodes[workspace.is_valid(nodes)]
    if not len(nodes):
        return None
    nodes = nodes[np.linalg.norm(nodes - position, axis=1).argsort()[:STARTS]]

    def slacks_at(p: FloatArray) -> FloatArray:
        clearance = leg_clearances(workspace.at(p * reach)).clearance / reach
        spare: FloatArray = np.asarray(np.minimum(clearance, 1.0), dtype=np.float64) - CLEAR
        return np.concatenate([workspace.slacks(p * reach) / reach, spare])

    best = nodes[0]
    for node in nodes:
        candidate = descend_towards(position, slacks_at, node, reach)
        nearer = np.linalg.norm(candidate - position) < np.linalg.norm(best - position)
        if nearer and workspace.is_valid(candidate):
            best = candidate
    return best


def descend_towards(
    position: FloatArray,
    spare: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    unit: float,
) -> FloatArray:
    """Return where a descent of the distance from a position leads; the start if it fails.

    What is spare of the limits, a function of positions over a unit of length, stays positive.
    """

    def squared_distance(p: FloatArray) -> tuple[float, FloatArray]:
        away = p - position / unit
        return float(away @ away), 2.0 * away

    found = descend(squared_distance, spare, start / unit)
    return start if found is None else unit * found
