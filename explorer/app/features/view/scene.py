"""The size of the ground's squares."""

from __future__ import annotations

from collections.abc import Iterator

from explorer.app.features.feature import Services
from explorer.app.scene.labels import add_label
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.widgets.assigning import Update


class GroundScale(ScenePart):
    """The side of the squares on the ground in millimetres.

    `labels.js` writes it in a corner of the scene, or draws a bar of such a length where that is
    the same at every depth.
    """

    def __init__(self, services: Services) -> None:
        self._label = add_label(services.scene, "/ground/scale", "")

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that write the size of the squares of this frame."""
        yield self._label, "visible", placed.frame.state.view.grid
        yield self._label, "text", f"{placed.square_mm:.6g}"
