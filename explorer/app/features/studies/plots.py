"""The two plots of the open study, and the brushes and picks made in them.

viser's plots report nothing to the server. The script `plots` sends each of their events as a press
whose value is a line of JSON. The server draws brushes and picks, for every browser.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Annotated, Any, cast

import msgspec
import viser

from explorer.app.browser.browser_facts import decode_text
from explorer.app.browser.viser_gaps import run_script
from explorer.app.features.feature import Services
from explorer.app.features.studies.actions import BrushAxes
from explorer.app.features.studies.feed import PlotJson, StudyDrawing
from explorer.app.look import read_script
from explorer.app.session.session import Who
from explorer.app.state.studies import Brush
from explorer.app.widgets.assigning import Update

# Height over width.
PARALLEL_ASPECT, SCATTER_ASPECT = 0.28, 0.42
HINT = 'Plots of studies need the extra study: pip install "flagged-explorer[study]"'
EMPTY = '{"data":[],"layout":{}}'


class StudyPlots:
    """Parallel lines and a scatter plot.

    They are added when first needed, since each browser then loads Plotly, some 5 MB.

    Args:
        services: Services of the page.
        pick: Function that opens the design with an index in the open study.
        before: Elements of the tab after which the lines and the points come.
    """

    def __init__(
        self,
        services: Services,
        pick: Callable[[int, Who], None],
        before: tuple[viser.GuiHtmlHandle, viser.GuiHtmlHandle],
    ) -> None:
        self._server = services.server
        self._tab = services.tab
        self._session = services.session
        self._pick = pick
        self._before = before
        services.buttons.on("studies.plot", self._receive)
        self.handles: tuple[viser.GuiPlotlyHandle, viser.GuiPlotlyHandle] | None = None

    @property
    def is_possible(self) -> bool:
        """Whether Plotly is installed."""
        return find_spec("plotly") is not None

    def updates(self, drawing: StudyDrawing | None) -> Iterator[Update]:
        """Yield the updates that show a drawing."""
        plots = None if drawing is None else drawing.plots
        if plots is not None and self.handles is None and self.is_possible:
            self.handles = self._add()
        if self.handles is None:
            return
        for handle in self.handles:
            yield handle, "visible", plots is not None
        if plots is not None:
            for handle, plot in zip(self.handles, plots, strict=True):
                yield handle, "figure", plot

    def _add(self) -> tuple[viser.GuiPlotlyHandle, viser.GuiPlotlyHandle]:
        gui = self._server.gui
        # viser only calls `to_json` of a figure.
        empty = cast("Any", PlotJson(EMPTY))
        # Each plot comes between the elements before and after it.
        after_lines, after_points = (handle.order + 0.5 for handle in self._before)
        with self._tab or contextlib.nullcontext():
            lines = gui.add_plotly(empty, aspect=PARALLEL_ASPECT, order=after_lines)
            points = gui.add_plotly(empty, aspect=SCATTER_ASPECT, order=after_points)
        run_script(self._server, read_script("plots"))
        return lines, points

    def _receive(self, line: str, client: viser.ClientHandle) -> None:
        event = event_of(line)
        # An event in the plot of another study is out of date.
        if event is None or event.study != self._session.state.studies.name:
            return
        if event.index is not None:
            self._pick(event.index, client.client_id)
        elif event.brushes:
            self._session.do(BrushAxes(event.brushes), who=client.client_id)


class PlotEvent(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A click on a design in a plot, or a change of its brushes.

    Attributes:
        study: Name of the study of the plot.
        index: Index of the design; None for a brush.
        brushes: New ranges of axes; an axis without ranges is freed.
    """

    study: str
    index: Annotated[int, msgspec.Meta(ge=0, le=2**31)] | None = None
    brushes: tuple[Brush, ...] = ()


_DECODER = msgspec.json.Decoder(PlotEvent)


def event_of(line: str) -> PlotEvent | None:
    """Return the event in a line of JSON; None if the script did not write it."""
    return decode_text(line, _DECODER)
