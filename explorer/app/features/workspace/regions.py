"""A workspace's exact volume, and the parts of it: what is accessible, and what holds a load."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np

from explorer.errors import ExplorerError
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.numerics.search import Watch
from explorer.workspace.accessible.nodes import StartError
from explorer.workspace.accessible.workspace import (
    PairCost,
    accessible_workspace,
)
from explorer.workspace.carried_region import CarriedRegion, carried_region
from explorer.workspace.slices.volume import Volume, workspace_volume
from explorer.workspace.solids.solid import Solid

Rows: TypeAlias = tuple[tuple[float, ...], ...]
"""Rows of a matrix."""

Region = Literal["limits", "accessible", "held"]

# Number of cached workspaces, so that a cut or another colour takes no time.
CACHED = 4
# Most nodes of the paper's grid whose steps are checked for a drawing.
MOST_LIVE_NODES = 200_000


def rows_of(matrix: FloatArray) -> Rows:
    """Return the rows of a matrix (n, m) as plain numbers, which can be compared and hashed."""
    return tuple(tuple(row) for row in matrix.tolist())


@lru_cache(2 * CACHED)
def exact_volume(design: Design, rotation: Rows) -> Volume:
    """Return the exact volume of a workspace, computed once for its number and its drawing."""
    return workspace_volume(design, np.array(rotation))


@dataclass(frozen=True)
class Selection:
    """The workspace or the part of it that is drawn or exported; lengths in design units.

    Attributes:
        design: The manipulator.
        rotation: Rows of the matrix, platform to base.
        region: All that is within the limits, its accessible part, or the part that holds the load.
        start: Position where paths start; None for home.
        load: (F; M) at the tool point besides the payload, base axes, in N and N × unit; None if
            it does not matter.
    """

    design: Design
    rotation: Rows
    region: Region = "limits"
    start: Triple | None = None
    load: Six | None = None


@dataclass(frozen=True)
class Part:
    """The numbers of a part of a workspace.

    Attributes:
        volume: Volume in cubed design units.
        node_count: Number of accessible nodes of the paper's grid; None if the grid is too fine.
        pairs: Clearance and blocked volume of each pair of legs, in the order of `PAIRS`; () of the
            part that holds a load.
    """

    volume: float
    node_count: int | None = None
    pairs: tuple[PairCost, ...] = ()


@dataclass(frozen=True)
class Trouble:
    """Why nothing is accessible, or holds the load.

    Attributes:
        reason: Words for the page.
        nearest: Nearest position to start from; None if there is none.
    """

    reason: str
    nearest: Triple | None = None


_cache: dict[tuple[Selection, float], tuple[Part, Solid] | Trouble] = {}


def find_part(selection: Selection, tolerance: float, watch: Watch) -> tuple[Part, Solid] | Trouble:
    """Return the part of a workspace that a region names, or why there is none.

    The newest few are cached.

    Args:
        selection: The workspace; its region is "accessible" or "held".
        tolerance: Chord tolerance, in design units.
        watch: Called with each stage.
    """
    key = selection, tolerance
    result = _cache.pop(key, None)
    if result is None:
        find = _find_accessible if selection.region == "accessible" else _find_held
        result = find(selection, tolerance, watch)
    _cache[key] = result
    if len(_cache) > CACHED:
        del _cache[next(iter(_cache))]
    return result


def _find_accessible(
    selection: Selection, tolerance: float, watch: Watch
) -> tuple[Part, Solid] | Trouble:
    try:
        found = accessible_workspace(
            selection.design,
            np.array(selection.rotation),
            start=selection.start,
            most_nodes=MOST_LIVE_NODES,
            tolerance=tolerance,
            watch=watch,
        )
    except ExplorerError as error:
        return trouble_of(error)
    part = Part(found.accessible_volume, found.accessible_node_count, found.pairs)
    return part, found.solid


def trouble_of(error: ExplorerError) -> Trouble:
    """Return an error of the library as a trouble."""
    nearest = error.nearest if isinstance(error, StartError) else None
    if nearest is None:
        return Trouble(str(error))
    x, y, z = nearest.tolist()
    return Trouble(str(error), (x, y, z))


def _find_held(selection: Selection, tolerance: float, _: Watch) -> tuple[Part, Solid] | Trouble:
    load = (0.0,) * 6 if selection.load is None else selection.load
    held = carried_region(selection.design, np.array(selection.rotation), load, tolerance=tolerance)
    # Without a factor something holds the load, or the workspace is empty.
    if held.factor is None:
        return Part(held.held_volume), held.solid
    return Trouble(_reason(held, held.factor))


def _reason(held: CarriedRegion, factor: float) -> str:
    (part,) = held.solid.empty_because
    if factor >= 1.0:
        return "the positions that hold it are too few to be drawn"
    percent = format_number(100.0 * factor, 3)
    return (
        f"the best position found holds {percent} % of load and payload; {part} is at its limit "
        "there"
    )
