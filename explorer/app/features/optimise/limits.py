"""The limits of a design that are in force, in words with units."""

from __future__ import annotations

from collections.abc import Iterator

from explorer.app.widgets.markup import caption, dim, row
from explorer.mechanism.design import Design
from explorer.numerics.number_text import format_number
from explorer.workspace.limits.limit import DIGITS
from explorer.workspace.limits.table import limits_in_force

HINT = "They hold throughout a search; the tab Design changes them."


def limits_table(design: Design) -> str:
    """Return the limits in force as HTML, a row for those of equal words."""
    rows = "".join(row(dim(name), text) for name, text in limit_rows(design))
    return (
        f'<div class="ex-after" title="{HINT}">{caption("Limits in force, in design units")}'
        f'<table class="ex-limits">{rows}</table></div>'
    )


def limit_rows(design: Design) -> Iterator[tuple[str, str]]:
    """Yield the symbols and the words of the limits that are in force."""
    for symbols, demand in limits_in_force(design):
        yield symbols, demand.words()
    radii = design.limits.leg_radii
    if any(radii):
        ends = sorted({min(radii), max(radii)})
        yield "leg radii", " to ".join(format_number(end, DIGITS) for end in ends)
