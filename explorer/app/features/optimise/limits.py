"""The limits of a design that are in force, in words with units."""

from __future__ import annotations

from collections.abc import Iterator

from explorer.app.widgets.markup import caption, dim, row
from explorer.mechanism.design import LENGTHS, Design
from explorer.numerics.number_text import format_number

DIGITS = 5
HINT = "They hold throughout a search; the tab Design changes them."


def limits_table(design: Design) -> str:
    """Return the limits in force as HTML, a row for each kind."""
    rows = "".join(row(dim(name), text) for name, text in limit_rows(design))
    return (
        f'<div class="ex-after" title="{HINT}">{caption("Limits in force, in design units")}'
        f'<table class="ex-limits">{rows}</table></div>'
    )


def limit_rows(design: Design) -> Iterator[tuple[str, str]]:
    """Yield the name and the words of each kind of limit that is in force."""
    limits = design.limits
    ranges: dict[str, list[str]] = {}
    for name in LENGTHS:
        low, high = getattr(limits, name)
        least = f"{_number(low)} to " if low > 0.0 else "at most "
        most = _number(high) if high is not None else _reach(design)
        ranges.setdefault(f"{least}{most}", []).append(name)
    for text, names in ranges.items():
        yield ", ".join(names), text
    if limits.box is not None:
        sides = (
            f"{axis} {_number(low)} to {_number(high)}"
            for axis, low, high in zip("xyz", *limits.box, strict=True)
        )
        yield "b4", ", ".join(sides)
    if limits.guide is not None:
        yield "d1, d3", f"{_number(limits.guide[0])} to {_number(limits.guide[1])}"
    if limits.gap > 0.0:
        yield "|d1 − d3|", f"at least {_number(limits.gap)}"
    if limits.carriage_order == "home":
        yield "carriages", "in the order of home"
    if limits.margin is not None:
        least = f"at least {_number(limits.margin)}, " if limits.margin > 0.0 else ""
        yield "|δ1|, |δ2|, |δ3|" if least else "δ1, δ2, δ3", f"{least}signs of home"
    swing = limits.swing
    angles = [(name, getattr(swing, name)) for name in swing.__struct_fields__]
    cones = [f"{name} {_number(angle)}°" for name, angle in angles if angle is not None]
    if cones:
        yield "swing", f"at most {', '.join(cones)}"
    if any(limits.leg_radii):
        ends = sorted({min(limits.leg_radii), max(limits.leg_radii)})
        yield "leg radii", " to ".join(map(_number, ends))


def _reach(design: Design) -> str:
    return f"the reach |a3| = {_number(design.reach)}"


def _number(value: float) -> str:
    return format_number(value, DIGITS)
