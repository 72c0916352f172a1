"""The bar on top of the page, made of the parts that the features declare."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import get_args

from explorer.app.features.feature import Feature, Services, Side
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update

SIDES: tuple[Side, ...] = get_args(Side)


class Bar:
    """Shows the parts, side by side.

    Args:
        services: Services of the page.
        features: Features of the page.
    """

    def __init__(self, services: Services, features: Sequence[Feature]) -> None:
        declared = [part for feature in features for part in feature.bar]
        self._parts = [(each.side, each.part(services)) for each in declared]
        self._html = services.gui.add_html("")

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the bar show the frame."""
        sides = "".join(f"<div>{self._markup(side, frame)}</div>" for side in SIDES)
        yield self._html, "content", f'<div class="ex-bar">{sides}</div>'

    def _markup(self, side: Side, frame: Frame) -> str:
        return "".join(part(frame) for each, part in self._parts if each == side)
