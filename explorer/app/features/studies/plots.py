"""The two plots of the open study, and what hands do in them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any, cast

import viser

from explorer.app.browser.viser_gaps import element_id, run_script
from explorer.app.features.studies.actions import BrushAxis, BrushBox
from explorer.app.features.studies.feed import PlotJson, StudyDrawing
from explorer.app.features.studies.plot_events import SCRIPT, Boxed, Brushed, Picked, event_of
from explorer.app.session.session import Session, Who
from explorer.app.widgets.assigning import Update

# Height over width.
PARALLEL_ASPECT, SCATTER_ASPECT = 0.33, 0.4
HINT = 'Plots of studies need the extra study: pip install "flagged-explorer[study]"'
EMPTY = '{"data":[],"layout":{}}'


class StudyPlots:
    """Parallel lines above, a scatter plot below.

    They are made when they are first needed: each browser is then sent Plotly, some 5 MB.

    Args:
        server: Whose browsers show them.
        tab: In which they are.
        session: That brushes are posted to.
        pick: Opens the design with an index in the open study.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        tab: viser.GuiTabHandle,
        session: Session,
        pick: Callable[[int, Who], None],
    ) -> None:
        self._server = server
        self._tab = tab
        self._session = session
        self._pick = pick
        self.inbox = server.gui.add_text("What is done in plots", "")
        self.inbox.on_update(self._heard)
        identity = element_id(self.inbox)
        # Wherever viser puts it: all that holds nothing else is out of sight.
        self.hides = (
            f'<style>div:has(> div label[for="{identity}"]):not(:has(button, .js-plotly-plot))'
            "{position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%);"
            "visibility:hidden}</style>"
        )
        self.handles: tuple[viser.GuiPlotlyHandle, viser.GuiPlotlyHandle] | None = None

    @property
    def is_possible(self) -> bool:
        """Whether Plotly is installed."""
        return find_spec("plotly") is not None

    @property
    def inbox_id(self) -> str:
        """The id of the input that events go to."""
        return element_id(self.inbox)

    def updates(self, drawing: StudyDrawing | None) -> Iterator[Update]:
        """Yield what makes the plots show a drawing."""
        plots = None if drawing is None else drawing.plots
        if plots is not None and self.handles is None and self.is_possible:
            self.handles = self._made()
        if self.handles is None:
            return
        for handle in self.handles:
            yield handle, "visible", plots is not None
        if plots is not None:
            for handle, plot in zip(self.handles, plots, strict=True):
                yield handle, "figure", plot

    def _made(self) -> tuple[viser.GuiPlotlyHandle, viser.GuiPlotlyHandle]:
        gui = self._server.gui
        # viser asks a figure for nothing but its JSON.
        empty = cast("Any", PlotJson(EMPTY))
        # Below what was there before them, above what came after.
        order = self.inbox.order
        with self._tab:
            above = gui.add_plotly(empty, aspect=PARALLEL_ASPECT, order=order + 0.1)
            below = gui.add_plotly(empty, aspect=SCATTER_ASPECT, order=order + 0.2)
        run_script(self._server, SCRIPT)
        return above, below

    def _heard(self, event: viser.GuiEvent[viser.GuiTextHandle]) -> None:
        told = event_of(self.inbox.value)
        if event.client_id is None or told is None:
            return
        # What was done in the plot of another study is over.
        if told.study != self._session.state.studies.name:
            return
        match told:
            case Picked(index=index):
                self._pick(index, event.client_id)
            case Brushed(axis=axis, ranges=ranges):
                self._session.do(BrushAxis(axis, ranges), who=event.client_id)
            case Boxed(axes=(across, up), box=box):
                self._session.do(BrushBox(across, up, box), who=event.client_id)
