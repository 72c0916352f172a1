"""What of a workspace can be reached, for the worker: computed in stages, and kept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from explorer.app.session.feed import Stage
from explorer.app.session.worker import Line
from explorer.errors import ExplorerError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple
from explorer.numerics.stages import Watch, unwatched
from explorer.workspace.accessible.start import StartError
from explorer.workspace.accessible.workspace import (
    PairCost,
    ReachableWorkspace,
    reachable_workspace,
)

Rows: TypeAlias = tuple[tuple[float, ...], ...]
"""Of a matrix."""

# Workspaces that are kept, so that to cut or colour one takes no time.
KEPT = 4
# The most nodes of the paper's grid whose steps are looked at for a drawing.
MOST_LIVE_NODES = 200_000


@dataclass(frozen=True)
class Trouble:
    """Why nothing can be reached, and from which position something can, if from any."""

    reason: str
    nearest: Triple | None


@dataclass(frozen=True)
class Reached:
    """What of a workspace can be reached.

    Attributes:
        volume: In cubed design units.
        node_count: Of the paper's grid; None if the grid is too fine to be counted.
        pairs: What each pair of legs means for it, in the order of `PAIRS`.
        harmless_radius: By how much all radii may grow before any two legs collide.
    """

    volume: float
    node_count: int | None
    pairs: tuple[PairCost, ...]
    harmless_radius: float


_kept: dict[tuple[Design, Rows, Triple | None, float], ReachableWorkspace | Trouble] = {}


def reach_workspace(
    design: Design, rotation: Rows, start: Triple | None, tolerance: float, watch: Watch
) -> ReachableWorkspace | Trouble:
    """Return what can be reached; the newest few results are kept."""
    key = (design, rotation, start, tolerance)
    found = _kept.pop(key, None)
    if found is None:
        try:
            found = reachable_workspace(
                design,
                np.array(rotation),
                start=start,
                most_nodes=MOST_LIVE_NODES,
                tolerance=tolerance,
                watch=watch,
            )
        except ExplorerError as error:
            found = trouble_of(error)
    _kept[key] = found
    if len(_kept) > KEPT:
        del _kept[next(iter(_kept))]
    return found


def watch_of(line: Line | None) -> Watch:
    """Return what tells the parent each stage, and ends the task once the parent cancels it."""
    if line is None:
        return unwatched

    def watch(words: str, share: float) -> None:
        line.end_if_cancelled()
        line.tell(Stage(words, share))

    return watch


def trouble_of(error: ExplorerError) -> Trouble:
    """Return why nothing can be reached, from the error that says so."""
    nearest = error.nearest if isinstance(error, StartError) else None
    if nearest is None:
        return Trouble(str(error), None)
    x, y, z = nearest.tolist()
    return Trouble(str(error), (x, y, z))


def reached_of(found: ReachableWorkspace) -> Reached:
    """Return the numbers of a reachable workspace."""
    return Reached(
        found.reachable_volume, found.reachable_node_count, found.pairs, found.harmless_radius
    )
