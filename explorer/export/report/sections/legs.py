"""The section on the legs: their clearances, here and over the workspace."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.blocks import elements
from explorer.export.report.data import ReportData
from explorer.export.report.markup import element, paragraph
from explorer.legs.clearance import PAIRS
from explorer.measures.blocks.clearances import pose_clearances, workspace_clearances
from explorer.workspace.accessible.workspace import AccessibleWorkspace, PairCost


def legs_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the clearances of the legs."""
    least, accessible = data.least, data.accessible
    if isinstance(accessible, AccessibleWorkspace):
        pairs = accessible.pairs
    else:
        rows = zip(PAIRS, least.clearance.tolist(), least.bound.tolist(), strict=True)
        pairs = [PairCost(*row, blocked_volume=0.0) for row in rows]
    yield element("h2", "Legs")
    yield paragraph(
        f"The first table is of {data.pose_words}. A pair that shares a joint has no clearance."
    )
    yield from elements(pose_clearances(data.snapshot))
    yield from elements(workspace_clearances(pairs, data.design))
