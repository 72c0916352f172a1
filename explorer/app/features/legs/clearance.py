"""How close the legs come: the closest pair, and the legs as thick as they are."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import Balls, Rods
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import OUTLINE, TUBE
from explorer.legs.clearance import PAIRS, leg_axes
from explorer.numerics.number_text import format_number

CAPSULE_OPACITY = 0.22


class ClearanceScene:
    """The line between the closest two axes, and capsules of the radii of the legs."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._line = scene.add_line_segments(
            "/clearance/line",
            np.zeros((1, 2, 3)),
            OUTLINE,
            thickness=4.0,
            thickness_units="screen",
            visible=False,
        )
        self._label = scene.add_label("/clearance/label", "0", visible=False)
        self._rods = Rods(scene, "/clearance/rods", [TUBE] * 4, opacity=CAPSULE_OPACITY)
        self._ends = Balls(scene, "/clearance/ends", [TUBE] * 8, opacity=CAPSULE_OPACITY)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws the clearance of this frame."""
        state, snapshot = placed.frame.state, placed.frame.snapshot
        radii = placed.scale * np.array(state.design.limits.leg_radii)
        thick = state.view.legs and not state.view.twin and bool(radii.any())
        for part in (self._rods, self._ends):
            yield from part.shown(thick)
        if thick:
            axes = placed.scale * leg_axes(
                state.design, np.array(state.pose.position), snapshot.rotation
            )
            yield from self._rods.between(axes[:, 0], axes[:, 1], radii)
            yield from self._ends.at(axes.reshape(-1, 3), np.repeat(radii, 2))
        shown = state.view.clearance and not state.view.twin
        yield self._line, "visible", shown
        yield self._label, "visible", shown
        if shown:
            found = snapshot.clearances
            pair = int(found.closest)
            ends = placed.scale * found.points[pair]
            first, second = PAIRS[pair]
            yield self._line, "points", ends[None].astype(np.float32)
            yield self._label, "position", tuple(ends.mean(axis=0).tolist())
            clearance = format_number(float(found.clearance[pair]), 3)
            yield self._label, "text", f"legs {first}–{second}: {clearance}"
