"""How close the legs come to each other: in the pose, in the last move, and as they grow."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import viser

from explorer.app.features.legs.feed import RadiusFeed
from explorer.app.features.legs.radius_plot import RadiusPlot
from explorer.app.session.session import Session
from explorer.app.state.actions import SetView
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Controls
from explorer.app.widgets.markup import BEYOND, DIM, WITHIN, format_number
from explorer.legs.clearance import PAIRS

BOX = (
    '<div style="padding:4px 12px 8px;font-size:12.5px;line-height:1.45;'
    'font-variant-numeric:tabular-nums">'
)
TABLE = '<table style="width:100%;border-collapse:collapse">'
RIGHT = '<td style="text-align:right">'


class LegsPanel:
    """The table of clearances, and on request that of the last move and the radius curve."""

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._pose = gui.add_html("")
        self._controls = Controls(gui, session)
        with gui.add_folder("Last move"):
            self._controls.checkbox(
                "Swept tetrahedra",
                "Draw what the legs swept from where the last move began, and compare the "
                "paper's test for interference with the exact one.",
                lambda frame: frame.state.view.swept,
                lambda state, on: SetView(replace(state.view, swept=on)),
            )
            self._move = gui.add_html("", visible=False)
        with gui.add_folder("Thicker legs"):
            self._controls.checkbox(
                "Volume against radius",
                "Draw how much of the workspace can be reached if all four legs have one "
                "radius; the orientation and the start are those of the tab Workspace.",
                lambda frame: frame.state.view.radius_curve,
                lambda state, on: SetView(replace(state.view, radius_curve=on)),
            )
            self._plot = RadiusPlot(gui)

    def updates(self, frame: Frame, feed: RadiusFeed) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield self._pose, "content", clearance_table(frame)
        yield from self._controls.updates(frame)
        yield self._move, "visible", frame.state.view.swept
        if frame.state.view.swept:
            yield self._move, "content", move_table(frame)
        yield from self._plot.updates(frame, feed)


def clearance_table(frame: Frame) -> str:
    """Return the clearances of the six pairs as HTML."""
    found = frame.snapshot.clearances
    clearances = found.clearance.tolist()
    collides = min(clearances) < 0.0
    word, colour = ("Legs collide", BEYOND) if collides else ("Legs are clear", WITHIN)
    unit = frame.state.design.unit_mm
    closest = int(found.closest)
    rows = "".join(
        _row(index, clearance, unit, closest == index) for index, clearance in enumerate(clearances)
    )
    return (
        f"{BOX}{_status(word, colour)}"
        f'<div style="{DIM};margin-bottom:4px">Clearance: distance of the axes less the radii</div>'
        f'{TABLE}<tr style="{DIM}"><td>legs</td>{RIGHT}units</td>{RIGHT}mm</td></tr>'
        f"{rows}</table></div>"
    )


def move_table(frame: Frame) -> str:
    """Return the last move by both tests, the paper's and the exact one, as HTML."""
    move = frame.last_move
    if move is None:
        return (
            f'{BOX}<div style="{DIM}">Nothing is swept. Move the platform: a whole drag, up to '
            "its first pause, is one move.</div></div>"
        )
    clearances = move.clearance.tolist()
    if move.is_clear:
        exact, colour = "Clear all the way", WITHIN
    else:
        word = "collide" if min(clearances) < 0.0 else "touch"
        exact, colour = f"Legs {word} on the way", BEYOND
    rows = "".join(
        _move_row(
            PAIRS[index],
            clearance,
            float(move.share[index]),
            overlaps=bool(move.overlaps[index]),
            is_closest=move.closest == index,
        )
        for index, clearance in enumerate(clearances)
    )
    overlapping = [
        f"{i} – {j}" for (i, j), is_so in zip(PAIRS, move.overlaps, strict=True) if is_so
    ]
    paper = f"overlap of {', '.join(overlapping)}" if overlapping else "no overlap"
    return (
        f"{BOX}{_status(exact, colour)}"
        f'<div style="margin-bottom:4px">By the paper\'s test, in one step: {paper}</div>'
        f'<div style="{DIM};margin-bottom:4px">Least clearance on the straight way, and how far '
        "along it</div>"
        f'{TABLE}<tr style="{DIM}"><td>legs</td><td>swept</td>{RIGHT}units</td>{RIGHT}at</td></tr>'
        f"{rows}</table></div>"
    )


def _status(word: str, colour: str) -> str:
    return (
        f'<div style="font-size:15px;font-weight:600;color:{colour};margin-bottom:6px">{word}</div>'
    )


def _row(index: int, clearance: float, unit_mm: float, is_closest: bool) -> str:
    first, second = PAIRS[index]
    if math.isinf(clearance):
        units, millimetres = "joined", ""
    else:
        units, millimetres = format_number(clearance), format_number(clearance * unit_mm)
    weight = "font-weight:600;" if is_closest else ""
    colour = f"color:{BEYOND};" if clearance < 0.0 else ""
    return (
        f'<tr style="{weight}{colour}"><td style="padding:1px 0">{first} – {second}</td>'
        f"{RIGHT}{units}</td>{RIGHT}{millimetres}</td></tr>"
    )


def _move_row(
    legs: tuple[int, int], clearance: float, share: float, *, overlaps: bool, is_closest: bool
) -> str:
    first, second = legs
    if math.isinf(clearance):
        swept, least, at = "", "joined", ""
    else:
        swept = f'<span style="color:{BEYOND}">overlap</span>' if overlaps else "free"
        least, at = format_number(clearance), f"{100.0 * share:.0f} %"
    weight = "font-weight:600;" if is_closest else ""
    colour = f"color:{BEYOND};" if clearance < 0.0 else ""
    return (
        f'<tr style="{weight}{colour}"><td style="padding:1px 0">{first} – {second}</td>'
        f"<td>{swept}</td>{RIGHT}{least}</td>{RIGHT}{at}</td></tr>"
    )
