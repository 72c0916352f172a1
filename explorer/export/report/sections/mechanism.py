"""What a report tells of the mechanism: the design variables, its limits, the pose."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.drawings.mechanism import sheet
from explorer.export.report.findings import Findings
from explorer.export.report.markup import (
    Cell,
    element,
    figure,
    illustration,
    paragraph,
    table,
    written,
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


def mechanism_section(found: Findings) -> Iterator[Element]:
    """Yield the section."""
    yield element("h2", "Mechanism")
    yield paragraph(
        "A fixed base and a moving platform, joined by four legs with six actuators. Leg 1 starts "
        "at a1 and leg 4 at a3; legs 2 and 3 start at carriages on the guide, the base’s x-axis. "
        "b4 is the platform’s origin."
    )
    yield illustration(
        sheet(found.snapshot),
        f"The mechanism in {pose_words(found)}, in three views at one scale (third angle). "
        "Colours tell how near each element of the two flags is to its incidence: "
        f"orange where its margin is below the warning length of {100.0 * WARN_SHARE:g} % of the "
        "reach, or the nearest singular pose is nearer than a third of it; blue beyond.",
    )
    yield element("div", _variables(found), _pose(found), class_="pair")
    yield _joints(found)
    yield _limits(found)
    broken = found.snapshot.violations
    if broken:
        yield paragraph(f"This pose breaks limits: {'; '.join(map(str, broken))}.", class_="note")


def pose_words(found: Findings) -> str:
    """Return what the pose of a report is called."""
    return "its home pose" if found.is_home else "the pose of this report"


def _variables(found: Findings) -> Element:
    unit = found.design.unit_mm
    rows: list[tuple[Cell, ...]] = [
        ((element("b", name), f" {_MEANINGS[name]}"), value, figure(value * unit))
        for name, value in zip(VARIABLES, found.design.variables, strict=True)
    ]
    rows.append(((element("b", "|a3|"), " reach"), found.design.reach, found.design.reach * unit))
    return table(
        ("design variable", "units", "mm"), rows, align="<>>", caption="Design variables X"
    )


def _pose(found: Findings) -> Element:
    unit, pose = found.design.unit_mm, found.snapshot.pose
    rows: list[tuple[Cell, ...]] = [
        (f"{axis} of b4", value, value * unit)
        for axis, value in zip("xyz", pose.position, strict=True)
    ]
    angles = yaw_pitch_roll_from_rotation(found.snapshot.rotation).tolist()
    rows += [
        (name, (figure(angle), "°"), "")
        for name, angle in zip(("yaw", "pitch", "roll"), angles, strict=True)
    ]
    rows += [
        (f"quaternion {name}", value, "")
        for name, value in zip("wxyz", pose.quaternion, strict=True)
    ]
    name = "Home pose" if found.is_home else "Pose"
    return table(("", "units", "mm"), rows, align="<>>", caption=name)


def _joints(found: Findings) -> Element:
    design, unit = found.design, found.design.unit_mm
    rows: list[tuple[Cell, ...]] = []
    for name, value in zip(JOINTS, found.snapshot.joints.tolist(), strict=True):
        if name in LENGTHS:
            low, high = design.length_range(name)
            ends = (figure(low * unit), figure(high * unit))
        elif design.limits.guide is not None:
            low, high = design.limits.guide
            ends = (figure(low * unit), figure(high * unit))
        else:
            ends = ("none", "none")
        rows.append(((element("b", name), f" {_JOINTS[name]}"), value, value * unit, *ends))
    return table(
        ("joint", "units", "mm", "minimum, mm", "maximum, mm"),
        rows,
        align="<>>>>",
        caption=f"Joints in {pose_words(found)}, and their limits",
    )


def _limits(found: Findings) -> Element:
    limits, unit = found.design.limits, found.design.unit_mm
    rows: list[tuple[Cell, ...]] = []
    if limits.box is not None:
        for axis, low, high in zip("xyz", *limits.box, strict=True):
            words = (figure(low), " to ", figure(high))
            rows.append(
                (f"box of b4, {axis}", words, (figure(low * unit), " to ", figure(high * unit)))
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
        rows.append(("|κ|, at least, signs as at home", limits.margin, limits.margin * unit))
    for leg, radius in enumerate(limits.leg_radii, 1):
        rows.append((f"radius of leg {leg}", radius, radius * unit))
    for name in limits.swing.__struct_fields__:
        angle = getattr(limits.swing, name)
        if angle is not None:
            rows.append((f"swing at {name}, at most", f"{written(angle)}°", ""))
    return table(("limit", "units", "mm"), rows, align="<>>", caption="Further limits")
