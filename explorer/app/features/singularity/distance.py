"""The three margins with their danger: fold, value, nearest singular pose, least turn, a button.

While a pointer rests on a margin, the scene shows its incidence.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from html import escape
from typing import get_args

import viser

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.incidences import HOVER, hovered_margin
from explorer.app.features.singularity.actions import GoToSingularity
from explorer.app.inputs.controls import Controls
from explorer.app.state.folds import FIRST_FOLD
from explorer.app.state.frame import Frame
from explorer.app.state.view import Ghost
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.colours import (
    FAR_WARNINGS,
    MARGIN_COLOURS,
    SINGULAR,
    css,
    proximity_colour,
)
from explorer.app.widgets.markup import box, margin_name, meter, swatch
from explorer.measures.blocks.block import Column, head_of
from explorer.measures.blocks.singularity import margin_table
from explorer.mechanism.folds import FOLD_LINES, FOLDS
from explorer.mechanism.margins import INCIDENCES, TETRAHEDRA, signs_of
from explorer.numerics.number_text import format_decimals

GHOSTS: tuple[Ghost, ...] = get_args(Ghost)
GO = "singular.go"
GO_HINT = "Move the mechanism to the nearest pose with this incidence."
# Length of a dial's needle in pixels.
NEEDLE = 15.0
FOLD_HINT = "The fold on a dial: a red end is flat, and a flat fold is a singular pose."


class DistancePanel:
    """The table of the three margins, and the ghost of the nearest singular pose."""

    def __init__(self, services: Services) -> None:
        gui, buttons = services.gui, services.buttons
        self._session = services.session
        services.get(hovered_margin)
        self._table = gui.add_html("")
        self._controls = Controls(gui, services.session)
        self._controls.dropdown(
            "Ghost",
            "Draw the nearest pose with an incidence, and the displacements of b1 to b4 to it.",
            GHOSTS,
            "view.singular.ghost",
        )
        buttons.on(GO, self._go, values={"1", "2", "3"})
        for incidence in (1, 2, 3):
            buttons.offer(f"Singularity › Go to δ{incidence} = 0", GO_HINT, GO, str(incidence))

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield self._table, "content", distance_table(frame)
        yield from self._controls.updates(frame)

    def _go(self, value: str, client: viser.ClientHandle) -> None:
        self._session.do(GoToSingularity(int(value)), who=client.client_id)


def distance_table(frame: Frame) -> str:
    """Return the margins with their nearest singular poses as HTML, the nearest one in bold."""
    columns = margin_table(frame.snapshot).columns
    numbers = [each for each in columns if isinstance(each, Column) and not each.wide]
    named = [(head_of(each), each.hint) for each in numbers]
    heads = [("fold", FOLD_HINT), ("", ""), *named, ("", "")]
    head = "".join(f'<span title="{escape(hint)}">{name}</span>' for name, hint in heads)
    cells = zip(*(each.texts for each in numbers), strict=True)
    rows = "".join(_margin(frame, index, texts) for index, texts in enumerate(cells))
    return box(f'<div class="ex-margins"><div class="ex-dim ex-small">{head}</div>{rows}</div>')


def _margin(frame: Frame, index: int, texts: tuple[str, ...]) -> str:
    snapshot, level = frame.snapshot, frame.verdict.levels[index]
    distances, colour = snapshot.nearest_distances, proximity_colour(level)
    hint = f"{INCIDENCES[index]}, where the tetrahedron {' '.join(TETRAHEDRA[index])} is flat"
    go = press_button(
        GO,
        index + 1,
        "Go",
        hint=GO_HINT,
        label=f"Go to δ{index + 1} = 0",
        class_name="ex-link",
        hover=HOVER,
        is_disabled=snapshot.nearest[index].distance == 0.0,
    )
    is_least = distances[index] == min(distances)
    numbers = "".join(f"<span>{text}</span>" for text in texts)
    return (
        f'<div class="ex-margin-row" data-hover="{HOVER}" data-value="{index + 1}">'
        f"{fold_dial(frame, index)}<div{' class=ex-strong' if is_least else ''}>"
        f"{margin_name(index + 1)}{numbers}{go}</div>"
        f'<div class="ex-danger" title="{escape(hint)}">{swatch(colour)}'
        f'<span class="ex-dim ex-small ex-fill">{INCIDENCES[index]}</span>'
        f"{meter(min(100.0, 100.0 * level / FAR_WARNINGS), colour, look='ex-meter is-thin')}"
        "</div></div>"
    )


def fold_dial(frame: Frame, index: int) -> str:
    """Return the fold of a margin, by the margin's index, as a needle on half a circle, as HTML.

    The half is the upper one for a positive fold, the lower one for a negative fold.
    """
    fold = frame.folds[FIRST_FOLD + index]
    x, y = NEEDLE * math.cos(math.radians(fold)), -NEEDLE * math.sin(math.radians(fold))
    side = signs_of(frame.state.mode)[index] if fold == 0.0 else math.copysign(1.0, fold)
    top, sweep = (-NEEDLE - 2.0, 0) if side > 0.0 else (-4.0, 1)
    angle = f"{format_decimals(fold, 1)}°"
    hint = (
        f"Fold {FOLDS[FIRST_FOLD + index]} at the {FOLD_LINES[index]}: {angle}; flat at 0° and "
        f"{'' if side > 0.0 else '−'}180°, with {INCIDENCES[index]}"
    )
    return (
        f'<span class="ex-dial" title="{escape(hint)}" '
        f'style="--colour:{css(MARGIN_COLOURS[index])};--end:{css(SINGULAR)}">'
        f'<svg viewBox="-20 {top:g} 40 {NEEDLE + 6.0:g}" aria-hidden="true">'
        f'<path d="M{NEEDLE:g} 0A{NEEDLE:g} {NEEDLE:g} 0 0 {sweep} -{NEEDLE:g} 0Z"/>'
        f'<circle cx="{NEEDLE:g}" r="2.5"/><circle cx="-{NEEDLE:g}" r="2.5"/>'
        f'<path d="M0 0L{x:.2f} {y:.2f}"/></svg>{angle}</span>'
    )
