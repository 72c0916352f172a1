"""The box that an optimisation requires within the workspace, where it is now."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.app.features.optimise.problem import wished_box
from explorer.app.scene.placing import Placed
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import JOINT
from explorer.numerics.arrays import FloatArray
from explorer.optimise.problem import Box

# The twelve edges of a cube by its corners, whose bits are the axes.
EDGES = tuple((a, a | 1 << axis) for a in range(8) for axis in range(3) if not a >> axis & 1)


# Of a coordinate that is drawn.
FARTHEST = 1e30


class RequiredBox:
    """Its edges; hidden while no box is required."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._edges = scene.add_line_segments(
            "/required_box",
            np.zeros((len(EDGES), 2, 3)),
            JOINT,
            thickness=2.0,
            thickness_units="screen",
            visible=False,
        )

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws it in this frame."""
        box = box_shown(placed.frame.state)
        yield self._edges, "visible", box is not None
        if box is not None:
            yield self._edges, "points", single(edges_of(box), placed.scale)


def box_shown(state: State) -> Box | None:
    """Return the box of the run that is looked at, else the one that is asked for, if any."""
    run = state.optimisation.run
    if run is not None and run.iterates and not run.accepted:
        if run.problem.demands.required_box is None:
            return None
        return run.problem.required_box_at((run.best or run.iterates[-1]).values)
    return wished_box(state) if state.optimisation.wish.needs_box else None


def edges_of(box: Box) -> FloatArray:
    """Return the edges of a box, shape (12, 2, 3)."""
    lows, highs = box
    corners = np.array([[(lows, highs)[c >> a & 1][a] for a in range(3)] for c in range(8)])
    return corners[np.array(EDGES)]


def single(points: FloatArray, scale: float) -> NDArray[np.float32]:
    """Return scaled points in single precision; those beyond it lie at its end, out of sight."""
    # Bounded first, lest a coordinate that is a number becomes none.
    farthest = FARTHEST / scale
    return (scale * np.clip(np.nan_to_num(points), -farthest, farthest)).astype(np.float32)
