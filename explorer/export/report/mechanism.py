"""The sections on the mechanism and its prototype: variables, limits, pose and parts."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.drawings.markup import (
    Cell,
    Row,
    element,
    illustration,
    number,
    paragraph,
    table,
)
from explorer.export.drawings.mechanism import three_views
from explorer.export.report.data import Missing, ReportData
from explorer.export.simulation import DENSITY
from explorer.mechanism.design import JOINTS
from explorer.mechanism.pose import yaw_pitch_roll_from_rotation
from explorer.numerics.number_text import format_number
from explorer.singularity.colours import WARN_SHARE
from explorer.workspace.limits.table import joint_ranges, limits_in_force

_MEANINGS = {
    "a3x": "a3 in the base, along the guide",
    "a3y": "a3 in the base, across the guide",
    "b1x": "b1 in the platform, along the line b2b3",
    "b1y": "b1 in the platform, across it",
    "b2": "b2 on the platform’s line, from b4",
    "b3": "b3 on the platform’s line, from b4",
}
_JOINTS = {
    "l1": "leg 1, from a1 to b1",
    "d1": "carriage of leg 2 on the guide",
    "d2": "leg 2, across the guide to b2",
    "d3": "carriage of leg 3 on the guide",
    "d4": "leg 3, across the guide to b3",
    "l4": "leg 4, from a3 to b4",
}


def mechanism_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the mechanism."""
    yield element("h2", "Mechanism")
    yield paragraph(
        "A fixed base and a moving platform, joined by four legs with six actuators. Leg 1 starts "
        "at a1 and leg 4 at a3; legs 2 and 3 start at carriages on the guide, the base’s x-axis. "
        "b4 is the platform’s origin."
    )
    yield illustration(
        three_views(data.snapshot),
        f"The mechanism in {data.pose_words}, in three views at one scale (third angle). "
        "Colours show how near each element of the two flags is to its incidence: "
        f"orange where its margin is below the warning length of {100.0 * WARN_SHARE:g} % of the "
        "reach, or the nearest singular pose is nearer than a third of it; blue beyond.",
    )
    yield element("div", _variables(data), _pose(data), class_="pair")
    yield _joints(data)
    yield _limits(data)
    broken = data.snapshot.violations
    if broken:
        yield paragraph(f"This pose breaks limits: {'; '.join(map(str, broken))}.", class_="note")


def _lengths(data: ReportData, name: Cell, value: float) -> Row:
    """Return a row with a length in design units and in millimetres."""
    return name, value, value * data.unit_mm


def _variables(data: ReportData) -> Element:
    meanings = {**_MEANINGS, "|a3|": "reach"}
    values = (*data.design.variables, data.design.reach)
    rows = [
        _lengths(data, (element("b", name), f" {meaning}"), value)
        for (name, meaning), value in zip(meanings.items(), values, strict=True)
    ]
    heads = ("design variable", "units", "mm")
    return table(heads, rows, align="<>>", caption="Design variables X")


def _pose(data: ReportData) -> Element:
    pose = data.snapshot.pose
    rows = [
        _lengths(data, f"{axis} of b4", value)
        for axis, value in zip("xyz", pose.position, strict=True)
    ]
    angles = yaw_pitch_roll_from_rotation(data.snapshot.rotation).tolist()
    for name, angle in zip(("yaw", "pitch", "roll"), angles, strict=True):
        rows.append((name, (number(angle), "°"), ""))
    for name, value in zip("wxyz", pose.quaternion, strict=True):
        rows.append((f"quaternion {name}", value, ""))
    name = "Home pose" if data.is_home else "Pose"
    return table(("", "units", "mm"), rows, align="<>>", caption=name)


def _joints(data: ReportData) -> Element:
    unit = data.unit_mm
    ranges = joint_ranges(data.design)
    rows: list[Row] = []
    for name, value in zip(JOINTS, data.snapshot.joints.tolist(), strict=True):
        bounds = tuple(end * unit for end in ranges[name]) if name in ranges else ("none", "none")
        rows.append((*_lengths(data, (element("b", name), f" {_JOINTS[name]}"), value), *bounds))
    return table(
        ("joint", "units", "mm", "minimum, mm", "maximum, mm"),
        rows,
        align="<>>>>",
        caption=f"Joints in {data.pose_words}, and their limits",
    )


def _limits(data: ReportData) -> Element:
    rows: list[Row] = []
    for symbols, demand in limits_in_force(data.design):
        words, in_mm = demand.words(), demand.words(data.unit_mm)
        # Signs and angles have no length.
        rows.append((symbols, words, in_mm if demand.has_length else ""))
    for leg, radius in enumerate(data.design.limits.leg_radii, 1):
        rows.append(_lengths(data, f"radius of leg {leg}", radius))
    return table(("limit", "units", "mm"), rows, align="<>>", caption="Limits in force")


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
