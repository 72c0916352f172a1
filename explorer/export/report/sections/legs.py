"""The section on the legs: their clearances, here and over the workspace."""

from __future__ import annotations

import math
from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.data import Missing, ReportData
from explorer.export.report.markup import Cell, element, paragraph, table
from explorer.legs.clearance import PAIRS


def legs_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the clearances of the legs."""
    unit, at = data.design.unit_mm, data.snapshot.clearances
    least, accessible = data.least, data.accessible
    yield element("h2", "Legs")
    yield paragraph(
        "The clearance of a pair is the distance of the legs’ axes minus both radii; below zero "
        "they collide. The least clearance over the workspace at this orientation is computed by "
        "branch and bound. A pair that shares a joint has no clearance."
    )
    heads = ["legs", "here, units", "here, mm", "least, units", "least, mm"]
    rows: list[list[Cell]] = []
    for index, (first, second) in enumerate(PAIRS):
        rows.append([element("b", f"{first}–{second}")])
        for clearance in (float(at.clearance[index]), float(least.clearance[index])):
            rows[-1] += [_known(clearance), _known(clearance * unit)]
    if accessible is not None and not isinstance(accessible, Missing):
        heads.append("blocks, units³")
        for row, pair in zip(rows, accessible.pairs, strict=True):
            row.append(pair.blocked_volume)
    yield table(heads, rows, align="<" + ">" * (len(heads) - 1))


def _known(clearance: float) -> Cell:
    return clearance if math.isfinite(clearance) else "–"
