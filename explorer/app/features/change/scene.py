"""The mechanism before the last change of the design, as a ghost of lines."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.app.features.change.before import DesignChange
from explorer.app.features.feature import Services
from explorer.app.scene.outline import outline
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import add_lines
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import GHOST

# In scene units, of which the present mechanism is some ten large.
LARGEST = 1e6


class ChangeScene(ScenePart):
    """The outline of base, legs and platform before the change."""

    def __init__(self, services: Services) -> None:
        self._change = services.get(DesignChange)
        self._lines = add_lines(services.scene, "/change/before", 1, GHOST, 2.0)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the ghost of this frame."""
        before = self._change.before
        lines = None
        if before is not None:
            design, now = before.frame.state.design, placed.frame.state.design
            scale = placed.scale * design.unit_mm / now.unit_mm
            # A unit that grew beyond measure leaves nothing to see.
            if scale * design.reach < LARGEST:
                lines = scale * outline(before.frame.snapshot)
        yield self._lines, "visible", lines is not None
        if lines is not None:
            yield self._lines, "points", lines.astype(np.float32)
