"""What a report tells of the prototype: its actuators, and the bill of its parts."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.findings import Findings, Missing
from explorer.export.report.markup import element, figure, paragraph, table, written
from explorer.export.simulation import DENSITY


def parts_section(found: Findings) -> Iterator[Element]:
    """Yield the section on the prototype."""
    yield element("h2", "Prototype")
    bill = found.bill
    if isinstance(bill, Missing):
        yield paragraph(f"Its parts cannot be made: {bill.reason}.", class_="note")
        return
    yield paragraph(
        f"Parts sized from the design, of {written(DENSITY)} kg/m³ (printed PLA): ",
        figure(bill.mass * 1000.0, 4),
        " g in all.",
    )
    yield table(
        ("leg", "from, mm", "to, mm", "limits from, mm", "to, mm", "Ø, mm", "mass, g"),
        [
            (
                str(each.leg),
                *(figure(value, 4) for value in (*each.stroke, *each.asked)),
                figure(each.diameter, 4),
                figure(each.mass * 1000.0, 4),
            )
            for each in bill.actuators
        ],
        align="<>>>>>>",
        caption="Actuators: what they reach, and what the limits ask for",
    )
    yield table(
        ("part", "x, mm", "y, mm", "z, mm", "volume, cm³", "mass, g"),
        [
            (
                item.name,
                *(figure(value, 4) for value in item.size),
                figure(item.volume / 1000.0, 4),
                figure(item.mass * 1000.0, 4),
            )
            for item in bill.items
        ],
        align="<>>>>>",
        caption="Bill of parts",
    )
