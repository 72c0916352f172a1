"""The closest pair of legs, and the legs as capsules of their radii."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.scene.labels import add_label
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import Balls, Rods, add_lines
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import OUTLINE, TUBE
from explorer.legs.clearance import PAIRS, leg_axes, pair_name
from explorer.numerics.number_text import format_number

CAPSULE_OPACITY = 0.22


class ClearanceScene(ScenePart):
    """The shortest line between the axes of the closest legs, and a capsule for each leg."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._line = add_lines(scene, "/clearance/line", 1, OUTLINE, 4.0)
        self._label = add_label(scene, "/clearance/label", "0", visible=False)
        self._rods = Rods(scene, "/clearance/rods", [TUBE] * 4, opacity=CAPSULE_OPACITY)
        self._ends = Balls(scene, "/clearance/ends", [TUBE] * 8, opacity=CAPSULE_OPACITY)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the closest pair and the capsules of this frame."""
        state, snapshot = placed.frame.state, placed.frame.snapshot
        radii = placed.scale * np.array(state.design.limits.leg_radii)
        has_radii = state.view.legs and not state.view.is_twin and bool(radii.any())
        for part in (self._rods, self._ends):
            yield from part.show(has_radii)
        if has_radii:
            axes = placed.scale * leg_axes(snapshot)
            yield from self._rods.between(axes[:, 0], axes[:, 1], radii)
            yield from self._ends.at(axes.reshape(-1, 3), np.repeat(radii, 2))
        shown = state.view.clearance and not state.view.is_twin
        yield self._line, "visible", shown
        yield self._label, "visible", shown
        if shown:
            clearances = snapshot.clearances
            pair = int(clearances.closest)
            ends = placed.scale * clearances.points[pair]
            yield self._line, "points", ends[None].astype(np.float32)
            yield self._label, "position", tuple(ends.mean(axis=0).tolist())
            clearance = format_number(float(clearances.clearance[pair]), 3, size=state.design.reach)
            yield self._label, "text", f"legs {pair_name(PAIRS[pair])}: {clearance}"
