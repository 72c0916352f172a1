"""The section on precision: errors of the tool, what causes them, and what the payload bends."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.blocks import elements
from explorer.export.report.data import ReportData
from explorer.export.report.markup import Row, element, number, paragraph, range_of, table
from explorer.measures.blocks.precision import deflections, tool_errors


def precision_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on precision; nothing of a design that is exact and rigid."""
    precision = data.precision
    if precision is None:
        return
    yield element("h2", "Precision")
    yield paragraph(
        "How far the tool is from where it should be: by the errors of the actuators and the "
        "tolerances of the dimensions, and because what holds the payload gives way. The model is "
        f"linear, without preload. All values are those in {data.pose_words}."
    )
    yield from elements(tool_errors(precision))
    if data.case.is_elastic:
        yield _stiffness(data)
    payload = data.design.payload
    load = "the payload’s weight" if payload.mass_kg else "no load"
    if payload.force_n:
        weight = f"{load} and " if payload.mass_kg else ""
        load = f"{weight}the payload’s force in its worst direction"
    yield from elements(deflections(precision, load, has_force=True))


def _stiffness(data: ReportData) -> Element:
    design, six = data.design, data.design.actuators.stiffness_n_mm
    rows: list[Row] = [
        ("stiffness of an actuator", "rigid" if six is None else range_of(six, "N/mm"))
    ]
    if design.struts.outer_mm is None:
        rows.append(("struts of legs 2 and 3", "rigid"))
    else:
        # In newton square metres, from square millimetres.
        bending = 1e-6 * design.struts.bending_stiffness
        rows.append(("bending stiffness EI of a strut", (number(bending, 4), " N m²")))
        tube = number(design.struts.outer_mm, 4), " × ", number(design.struts.inner_mm, 4), " mm"
        rows.append(("outer and inner diameter of a strut", tube))
        rows.append(("its Young’s modulus", (number(design.struts.modulus_gpa, 4), " GPa")))
    return table((), rows, align="<>", caption="What gives way")
