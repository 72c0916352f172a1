"""Regions of a workspace: its accessible part, and the part that holds a load, each cached."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from explorer.errors import ExplorerError
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.numerics.stages import Watch
from explorer.workspace.accessible.start import StartError
from explorer.workspace.accessible.workspace import (
    AccessibleWorkspace,
    PairCost,
    accessible_workspace,
)
from explorer.workspace.held import HeldWorkspace, held_workspace

Rows: TypeAlias = tuple[tuple[float, ...], ...]
"""Rows of a matrix."""

# Number of cached workspaces, so that a cut or another colour takes no time.
CACHED = 4
# Most nodes of the paper's grid whose steps are checked for a drawing.
MOST_LIVE_NODES = 200_000


def rows_of(matrix: FloatArray) -> Rows:
    """Return the rows of a matrix (n, m) as plain numbers, which can be compared and hashed."""
    return tuple(tuple(row) for row in matrix.tolist())


@dataclass(frozen=True)
class Trouble:
    """Why nothing is accessible, or holds the load.

    Attributes:
        reason: Words for the page.
        nearest: Nearest position to start from; None if there is none.
    """

    reason: str
    nearest: Triple | None


@dataclass(frozen=True)
class AccessiblePart:
    """The numbers of the accessible part of a workspace.

    Attributes:
        volume: Volume in cubed design units.
        node_count: Number of nodes of the paper's grid; None if the grid is too fine.
        pairs: Clearance and blocked volume of each pair of legs, in the order of `PAIRS`.
    """

    volume: float
    node_count: int | None
    pairs: tuple[PairCost, ...]


_cache: dict[tuple[Design, Rows, Triple | None, float], AccessibleWorkspace | Trouble] = {}


def find_accessible(
    design: Design, rotation: Rows, start: Triple | None, tolerance: float, watch: Watch
) -> AccessibleWorkspace | Trouble:
    """Return the accessible workspace, or why there is none; cache the newest few."""
    key = (design, rotation, start, tolerance)
    result = _cache.pop(key, None)
    if result is None:
        try:
            result = accessible_workspace(
                design,
                np.array(rotation),
                start=start,
                most_nodes=MOST_LIVE_NODES,
                tolerance=tolerance,
                watch=watch,
            )
        except ExplorerError as error:
            result = trouble_of(error)
    _cache[key] = result
    if len(_cache) > CACHED:
        del _cache[next(iter(_cache))]
    return result


def trouble_of(error: ExplorerError) -> Trouble:
    """Return an error of the library as a trouble."""
    nearest = error.nearest if isinstance(error, StartError) else None
    if nearest is None:
        return Trouble(str(error), None)
    x, y, z = nearest.tolist()
    return Trouble(str(error), (x, y, z))


def accessible_part(workspace: AccessibleWorkspace) -> AccessiblePart:
    """Return the numbers of an accessible workspace."""
    return AccessiblePart(
        workspace.accessible_volume,
        workspace.accessible_node_count,
        workspace.pairs,
    )


@lru_cache(CACHED)
def hold_load(design: Design, rotation: Rows, load: Six, tolerance: float) -> HeldWorkspace:
    """Return the part of a workspace that holds a load; cache the newest few."""
    return held_workspace(design, np.array(rotation), load, tolerance=tolerance)


def trouble_holding(held: HeldWorkspace) -> Trouble | None:
    """Return why nothing holds a load; None if something does, or the workspace is empty."""
    if held.factor is None:
        return None
    (part,) = held.solid.empty_because
    if held.factor >= 1.0:
        return Trouble("the positions that hold it are too few to be drawn", None)
    percent = format_number(100.0 * held.factor, 3)
    return Trouble(
        f"the best position found holds {percent} % of load and payload; {part} is at its limit "
        "there",
        None,
    )
