"""The sections on singularities and on the clearances of the legs."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.drawings.markup import element, paragraph
from explorer.export.report.blocks import elements
from explorer.export.report.data import ReportData
from explorer.legs.clearance import PAIRS
from explorer.measures.blocks import singularity as blocks
from explorer.measures.blocks.block import Facts, Statement
from explorer.measures.blocks.clearances import pose_clearances, workspace_clearances
from explorer.measures.verdict import verdict
from explorer.singularity.ellipsoids import certified_radius, performance, singularity_free_ball
from explorer.workspace.accessible.workspace import AccessibleWorkspace, PairCost
from explorer.workspace.least_clearance import least_clearances


def singularity_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on singularities."""
    snapshot, unit = data.snapshot, data.design.unit_mm
    here = verdict(snapshot)
    yield element("h2", "Singularities")
    yield paragraph(f"All values are those in {data.pose_words}.")
    ball, certified = (
        singularity_free_ball(data.case.at),
        certified_radius(data.design, data.case.at),
    )
    regular = blocks.free_ball(snapshot, ball, "b4"), blocks.regular_distance(certified, unit)
    yield from elements(
        (
            Statement(here.title, here.reason(unit), blocks.LOOKS[here.kind]),
            *blocks.freedoms(snapshot),
            blocks.margin_table(snapshot),
            blocks.tetrahedra(snapshot),
            blocks.conditioning(snapshot),
            Facts("Around the pose", regular),
            blocks.nearest_poses(snapshot),
        )
    )
    yield element(
        "div",
        *elements(blocks.ellipsoids(performance(data.design, data.case.at), "b4")),
        class_="pair",
    )


def legs_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the clearances of the legs."""
    accessible = data.accessible
    if isinstance(accessible, AccessibleWorkspace):
        pairs = accessible.pairs
    else:
        least = least_clearances(data.design, data.case.rotation)
        rows = zip(PAIRS, least.clearance.tolist(), least.bound.tolist(), strict=True)
        pairs = [PairCost(*row, blocked_volume=0.0) for row in rows]
    yield element("h2", "Legs")
    yield paragraph(
        f"The first table is of {data.pose_words}. A pair that shares a joint has no clearance."
    )
    yield from elements(pose_clearances(data.snapshot))
    yield from elements(workspace_clearances(pairs, data.design))
