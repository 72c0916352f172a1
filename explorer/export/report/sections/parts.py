"""The section on the prototype: its actuators and the bill of its parts."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.data import Missing, ReportData
from explorer.export.report.markup import element, number, paragraph, table
from explorer.export.simulation import DENSITY
from explorer.numerics.number_text import format_number


def parts_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the prototype."""
    yield element("h2", "Prototype")
    bill = data.bill
    if isinstance(bill, Missing):
        yield paragraph(f"Its parts cannot be made: {bill.reason}.", class_="note")
        return
    yield paragraph(
        f"Parts sized from the design, of {format_number(DENSITY, 6)} kg/m³ (printed PLA): ",
        number(bill.mass * 1000.0, 4),
        " g in all.",
    )
    actuators = [
        (str(leg.leg), *_rounded(*leg.stroke, *leg.required, leg.diameter, leg.mass * 1000.0))
        for leg in bill.actuators
    ]
    parts = [
        (item.name, *_rounded(*item.size, item.volume / 1000.0, item.mass * 1000.0))
        for item in bill.items
    ]
    yield table(
        ("leg", "from, mm", "to, mm", "limits from, mm", "to, mm", "Ø, mm", "mass, g"),
        actuators,
        align="<>>>>>>",
        caption="Actuators: strokes, and the strokes that the limits require",
    )
    heads = ("part", "x, mm", "y, mm", "z, mm", "volume, cm³", "mass, g")
    yield table(heads, parts, align="<>>>>>", caption="Bill of parts")


def _rounded(*values: float) -> list[Element]:
    return [number(value, 4) for value in values]
