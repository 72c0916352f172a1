"""The clearances of the legs in the pose and in the last move, and the effect of their radii."""

from __future__ import annotations

import math
from collections.abc import Iterator

from explorer.app.features.feature import Services
from explorer.app.features.legs.feed import RadiusFeed
from explorer.app.features.legs.radius_plot import RadiusPlot
from explorer.app.inputs.controls import Controls
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.markup import box, caption, dim, row, status, table
from explorer.legs.clearance import PAIRS, pair_name
from explorer.numerics.number_text import format_column, format_decimals

# Digits of the largest clearance: the least one, of fewer digits, is what matters.
DIGITS = 5


class LegsPanel:
    """The table of clearances, that of the last move, and the radius curve."""

    def __init__(self, services: Services) -> None:
        gui, self._feed = services.gui, services.get(RadiusFeed)
        self._pose = gui.add_html("")
        self._controls = Controls(gui, services.session)
        with gui.add_folder("Last move"):
            self._controls.checkbox(
                "Swept tetrahedra",
                "Draw the tetrahedra that the legs swept in the last move, and compare the paper's "
                "test for interference with the exact one.",
                "view.swept",
            )
            self._move = gui.add_html("", visible=False)
        with gui.add_folder("Leg radius"):
            self._controls.checkbox(
                "Volume against radius",
                "Draw the accessible volume over one radius of all four legs, for the orientation "
                "and the start of the tab Workspace.",
                "view.radius_curve",
            )
            self._plot = RadiusPlot(gui, services.get(RadiusFeed))

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield self._pose, "content", clearance_table(frame)
        yield from self._controls.updates(frame)
        yield self._move, "visible", frame.state.view.swept
        if frame.state.view.swept:
            yield self._move, "content", move_table(frame)
        yield from self._plot.updates(frame)


def clearance_table(frame: Frame) -> str:
    """Return the clearances of the six pairs as HTML."""
    clearances = frame.snapshot.clearances
    collides = bool(clearances.clearance.min() < 0.0)
    unit_mm, reach = frame.state.design.unit_mm, frame.state.design.reach
    values = clearances.clearance.tolist()
    units = format_column(values, DIGITS, size=reach, infinite="joined")
    millimetres = format_column(
        [unit_mm * value for value in values], DIGITS, size=unit_mm * reach, infinite=""
    )
    rows = (
        _row(
            index,
            values[index],
            units[index],
            millimetres[index],
            is_closest=index == int(clearances.closest),
        )
        for index in range(len(values))
    )
    return box(
        status("Legs collide", "beyond") if collides else status("Legs are clear", "within"),
        caption("Clearance here: distance of the axes less the radii"),
        table(rows, ("legs", "units", "mm")),
    )


def move_table(frame: Frame) -> str:
    """Return the last move by both tests, the paper's and the exact one, as HTML."""
    move = frame.last_move
    if move is None:
        return box(dim("No move yet. Move the platform: a drag without a pause is one move."))
    if move.is_clear:
        result = status("Clear all the way", "within")
    else:
        verb = "collide" if move.clearance.min() < 0.0 else "touch"
        result = status(f"Legs {verb} on the way", "beyond")
    pairs = ", ".join(
        pair_name(pair) for pair, overlaps in zip(PAIRS, move.overlaps, strict=True) if overlaps
    )
    paper = f"overlap of {pairs}" if pairs else "no overlap"
    rows: list[str] = []
    values = move.clearance.tolist()
    units = format_column(values, DIGITS, size=frame.state.design.reach, infinite="joined")
    for index, clearance in enumerate(values):
        cells = ("", units[index], "")
        if not math.isinf(clearance):
            swept = '<span class="ex-beyond">overlap</span>' if move.overlaps[index] else "free"
            cells = (
                swept,
                units[index],
                f"{format_decimals(100.0 * float(move.share[index]), 0)} %",
            )
        rows.append(_row(index, clearance, *cells, is_closest=move.closest == index))
    return box(
        result,
        f"<div>Paper's one-step test: {paper}</div>",
        caption("Minimum clearance on the straight path, and where on the path"),
        table(rows, ("legs", "swept", "units", "at")),
    )


def _row(index: int, clearance: float, *cells: str, is_closest: bool) -> str:
    look = "ex-beyond " * (clearance < 0.0) + "ex-strong" * is_closest
    return row(pair_name(PAIRS[index]), *cells, look=look.strip())
