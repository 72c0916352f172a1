"""The section on the mechanism: design variables, limits and the pose."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.data import ReportData
from explorer.export.report.drawings.mechanism import three_views
from explorer.export.report.markup import (
    Cell,
    element,
    format_number,
    illustration,
    number,
    paragraph,
    table,
)
from explorer.mechanism.design import JOINTS, LENGTHS, VARIABLES
from explorer.mechanism.pose import yaw_pitch_roll_from_rotation
from explorer.singularity.colours import WARN_SHARE

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
        f"The mechanism in {pose_words(data)}, in three views at one scale (third angle). "
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


def pose_words(data: ReportData) -> str:
    """Return the words for the pose of a report."""
    return "its home pose" if data.is_home else "the pose of this report"


def _variables(data: ReportData) -> Element:
    unit = data.design.unit_mm
    rows: list[tuple[Cell, ...]] = [
        ((element("b", name), f" {_MEANINGS[name]}"), value, number(value * unit))
        for name, value in zip(VARIABLES, data.design.variables, strict=True)
    ]
    rows.append(((element("b", "|a3|"), " reach"), data.design.reach, data.design.reach * unit))
    return table(
        ("design variable", "units", "mm"), rows, align="<>>", caption="Design variables X"
    )


def _pose(data: ReportData) -> Element:
    unit, pose = data.design.unit_mm, data.snapshot.pose
    rows: list[tuple[Cell, ...]] = [
        (f"{axis} of b4", value, value * unit)
        for axis, value in zip("xyz", pose.position, strict=True)
    ]
    angles = yaw_pitch_roll_from_rotation(data.snapshot.rotation).tolist()
    rows += [
        (name, (number(angle), "°"), "")
        for name, angle in zip(("yaw", "pitch", "roll"), angles, strict=True)
    ]
    rows += [
        (f"quaternion {name}", value, "")
        for name, value in zip("wxyz", pose.quaternion, strict=True)
    ]
    name = "Home pose" if data.is_home else "Pose"
    return table(("", "units", "mm"), rows, align="<>>", caption=name)


def _joints(data: ReportData) -> Element:
    design, unit = data.design, data.design.unit_mm
    rows: list[tuple[Cell, ...]] = []
    for name, value in zip(JOINTS, data.snapshot.joints.tolist(), strict=True):
        if name in LENGTHS:
            low, high = design.length_range(name)
            ends = (number(low * unit), number(high * unit))
        elif design.limits.guide is not None:
            low, high = design.limits.guide
            ends = (number(low * unit), number(high * unit))
        else:
            ends = ("none", "none")
        rows.append(((element("b", name), f" {_JOINTS[name]}"), value, value * unit, *ends))
    return table(
        ("joint", "units", "mm", "minimum, mm", "maximum, mm"),
        rows,
        align="<>>>>",
        caption=f"Joints in {pose_words(data)}, and their limits",
    )


def _limits(data: ReportData) -> Element:
    limits, unit = data.design.limits, data.design.unit_mm
    rows: list[tuple[Cell, ...]] = []
    if limits.box is not None:
        for axis, low, high in zip("xyz", *limits.box, strict=True):
            words = (number(low), " to ", number(high))
            rows.append(
                (f"box of b4, {axis}", words, (number(low * unit), " to ", number(high * unit)))
            )
    else:
        rows.append(("box of b4", "none", "none"))
    rows.append(("gap |d1 − d3|, at least", limits.gap, limits.gap * unit))
    order = {"home": "as at home", "any": "no demand"}[limits.carriage_order]
    rows.append(("order of the carriages", order, ""))
    if limits.margin is None:
        rows.append(("margins", "no demand", ""))
    elif limits.margin == 0.0:
        rows.append(("margins", "signs as at home", ""))
    else:
        rows.append(("|δ|, at least, signs as at home", limits.margin, limits.margin * unit))
    for leg, radius in enumerate(limits.leg_radii, 1):
        rows.append((f"radius of leg {leg}", radius, radius * unit))
    for name in limits.swing.__struct_fields__:
        angle = getattr(limits.swing, name)
        if angle is not None:
            rows.append((f"swing at {name}, at most", f"{format_number(angle)}°", ""))
    return table(("limit", "units", "mm"), rows, align="<>>", caption="Further limits")
