"""Three charts of a run over its iterates: the objective, the volume, the worst constraint."""

from __future__ import annotations

import math
from collections.abc import Iterator
from html import escape
from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from explorer.app.state.state import Run
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.charts import BLUE, FONT, ORANGE, add_chart, line
from explorer.app.widgets.colours import css
from explorer.measures.catalogue import CATALOGUE
from explorer.numerics.number_text import format_number
from explorer.optimise import curves
from explorer.optimise.outcome import Iterate
from explorer.optimise.problem import Problem

HEIGHT = 96
# Padding of an axis beyond the values, as a share of their span.
PADDING = 0.12


class Curve(NamedTuple):
    """The content of a chart.

    Attributes:
        caption: Name of the values, with the last one.
        values: One value for each iterate; NaN for an infinite one.
        level: Value to compare the others with, or None.
        powers: Whether the values are exponents of ten.
    """

    caption: str
    values: NDArray[np.float64]
    level: float | None
    powers: bool = False


class OptimisePlots:
    """Captions and charts in a folder; hidden until there is a run."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._folder = gui.add_folder("Course of the search", visible=False)
        with self._folder:
            self._charts = [self._add(gui) for _ in range(3)]

    def _add(self, gui: viser.GuiApi) -> tuple[viser.GuiHtmlHandle, viser.GuiUplotHandle]:
        caption = gui.add_html("", visible=False)
        return caption, add_chart(gui, _series(), _axes(), height=HEIGHT, padding=(6, 14, 0, 0))

    def updates(self, run: Run | None) -> Iterator[Update]:
        """Yield the updates that show a run."""
        shown = [] if run is None else curves_of(run)
        yield self._folder, "visible", bool(shown)
        for index, (caption, chart) in enumerate(self._charts):
            curve = shown[index] if index < len(shown) else None
            yield caption, "visible", curve is not None
            yield chart, "visible", curve is not None
            if curve is not None:
                yield caption, "content", _caption(curve.caption)
                yield chart, "scales", _scales(curve)
                yield chart, "data", data_of(curve)


def curves_of(run: Run) -> list[Curve]:
    """Return the curves of the present start; once the run has ended, of the best one."""
    if not run.iterates:
        return []
    which = (run.best or run.iterates[-1]).run
    iterates = [iterate for iterate in run.iterates if iterate.run == which]
    if not iterates:
        return []
    return [
        Curve(_name(run.problem, iterates[-1], curve), curve.values, curve.level, curve.powers)
        for curve in curves.curves_of(run.problem, iterates)
    ]


def _name(problem: Problem, last: Iterate, curve: curves.Curve) -> str:
    """Return the name of the values of a curve, with the last one."""
    if curve.kind == "spare":
        return f"Worst constraint, broken below 0: {last.worst or 'none'}"
    if curve.kind == "volume":
        target = "" if curve.level is None else f", required {format_number(curve.level, 6)}"
        return f"Volume (units³): {format_number(last.volume, 6)}{target}"
    if curve.powers:
        value = format_number(last.value, 2, size=1.0)
        return f"log10 of F = |1 − V / V′|; F = {value}"
    name = curves.CALLED[problem.objective].capitalize()
    unit = CATALOGUE[curves.GOALS[problem.objective]].unit_in("units")
    return f"{name}{f' ({unit})' if unit else ''}: {format_number(last.value, 6)}"


def data_of(curve: Curve) -> tuple[NDArray[np.float64], ...]:
    """Return the columns of a chart: iterations, values, and the level or nothing."""
    x = np.arange(len(curve.values), dtype=np.float64)
    level = np.full(len(x), np.nan if curve.level is None else curve.level)
    return x, curve.values, level


def _caption(text: str) -> str:
    return f'<div class="ex-note ex-dim ex-cut">{escape(text)}</div>'


def _series() -> tuple[uplot.Series, ...]:
    values: uplot.Series = {
        "label": "value",
        "stroke": css(BLUE),
        "width": 2.0,
        # uPlot shows points only where they do not touch.
        "points": {"size": 5, "fill": css(BLUE)},
    }
    return values, line("level", ORANGE, width=1.0, dash=(4, 4))


def _scales(curve: Curve) -> dict[str, uplot.Scale]:
    last = max(1.0, len(curve.values) - 1.0)
    levels = [] if curve.level is None else [curve.level]
    heights = [value for value in (*curve.values.tolist(), *levels) if math.isfinite(value)]
    low, high = min(heights, default=0.0), max(heights, default=0.0)
    if curve.powers:
        low = math.floor(low)
        edges = float(low), float(max(math.ceil(high), low + 1))
    else:
        room = PADDING * (high - low) or 0.05 * abs(high) or 1.0
        edges = low - room, high + room
    return {"x": {"time": False, "range": (0.0, last)}, "y": {"range": edges}}


def _axes() -> tuple[uplot.Axis, uplot.Axis]:
    return (
        {"gap": 3, "ticks": {"size": 4}, "font": FONT, "size": 20, "space": 40},
        {"gap": 3, "ticks": {"size": 4}, "font": FONT, "size": 50, "space": 16},
    )
