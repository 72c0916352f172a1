"""The box that an optimisation requires within the workspace."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from explorer.app.features.feature import Services
from explorer.app.features.optimise.problem import requested_box
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import add_lines
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import JOINT
from explorer.measures.size import corners_of
from explorer.numerics.arrays import FloatArray
from explorer.optimise.demands import Box

# The twelve edges of a cube by its corners, whose bits are the axes.
EDGES = tuple((a, a | 1 << axis) for a in range(8) for axis in range(3) if not a >> axis & 1)
# Largest coordinate that is drawn.
FARTHEST = 1e30


class RequiredBox(ScenePart):
    """The edges of the required box, if there is one."""

    def __init__(self, services: Services) -> None:
        self._edges = add_lines(services.scene, "/required_box", len(EDGES), JOINT, 2.0)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the box of a frame."""
        box = box_shown(placed.frame.state)
        yield self._edges, "visible", box is not None
        if box is not None:
            yield self._edges, "points", single(edges_of(box), placed.scale)


def box_shown(state: State) -> Box | None:
    """Return the box of the present run, else that of the problem, if any."""
    run = state.optimisation.run
    if run is not None and run.iterates and not run.accepted:
        if run.problem.demands.required_box is None:
            return None
        return run.problem.required_box_at((run.best or run.iterates[-1]).values)
    return requested_box(state) if state.optimisation.request.needs_box else None


def edges_of(box: Box) -> FloatArray:
    """Return the edges of a box, shape (12, 2, 3)."""
    return corners_of(box)[np.array(EDGES)]


def single(points: FloatArray, scale: float) -> NDArray[np.float32]:
    """Return scaled points in single precision; those beyond it lie at its end, out of sight."""
    # The product of a large coordinate and the scale could overflow.
    farthest = FARTHEST / scale
    return (scale * np.clip(np.nan_to_num(points), -farthest, farthest)).astype(np.float32)
