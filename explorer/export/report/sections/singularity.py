"""The section on singularities: margins, measures, the nearest poses, performance."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.blocks import elements
from explorer.export.report.data import ReportData
from explorer.export.report.markup import element, paragraph
from explorer.measures.blocks.block import Facts, Statement
from explorer.measures.blocks.singularity import (
    LOOKS,
    conditioning,
    ellipsoids,
    free_ball,
    freedoms,
    margin_table,
    nearest_poses,
    regular_distance,
    tetrahedra,
)
from explorer.measures.verdict import verdict


def singularity_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on singularities."""
    snapshot, unit = data.snapshot, data.design.unit_mm
    here = verdict(snapshot)
    yield element("h2", "Singularities")
    yield paragraph(f"All values are those in {data.pose_words}.")
    regular = free_ball(snapshot, data.ball, "b4"), regular_distance(data.certified, unit)
    yield from elements(
        (
            Statement(here.title, here.reason(unit), LOOKS[here.kind]),
            *freedoms(snapshot),
            margin_table(snapshot),
            tetrahedra(snapshot),
            conditioning(snapshot),
            Facts("Around the pose", regular),
            nearest_poses(snapshot),
        )
    )
    yield element("div", *elements(ellipsoids(data.performance, "b4")), class_="pair")
