"""The sections on the mechanism, its singularities, the clearances of its legs, and its parts."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.errors import ExplorerError
from explorer.export.drawings import markup
from explorer.export.drawings.markup import Cell, Row, element, number
from explorer.export.drawings.mechanism import three_views
from explorer.export.report.data import ReportData
from explorer.legs.clearance import PAIRS
from explorer.measures.blocks import singularity as blocks
from explorer.measures.blocks.block import Facts, Statement
from explorer.measures.blocks.clearances import pose_clearances, workspace_clearances
from explorer.measures.verdict import verdict
from explorer.mechanism.design import JOINTS
from explorer.mechanism.pose import Triple, yaw_pitch_roll_from_rotation
from explorer.motion.masses import DENSITY
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.singularity.colours import WARN_SHARE
from explorer.singularity.ellipsoids import performance, singularity_free_ball
from explorer.workspace.accessible.workspace import AccessibleWorkspace, PairCost
from explorer.workspace.least_clearance import least_clearances
from explorer.workspace.limits.table import joint_ranges, limits_in_force

_MEANINGS = {
    "a3x": "a3 in the base, along the guide",
    "a3y": "a3 in the base, across the guide",
    "b1x": "b1 in the platform, along the line b2b3",
    "b1y": "b1 in the platform, across it",
    "b2": "b2 on the platform’s line, from b4",
    "b3": "b3 on the platform’s line, from b4",
    "|a3|": "reach",
}
_JOINTS = {
    "l1": "leg 1, from a1 to b1",
    "d1": "carriage of leg 2 on the guide",
    "d2": "leg 2, across the guide to b2",
    "d3": "carriage of leg 3 on the guide",
    "d4": "leg 3, across the guide to b3",
    "l4": "leg 4, from a3 to b4",
}


def requirement_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the requirement and its check; nothing without a requirement."""
    needed, check = data.requirement, data.check
    if needed is None or check is None:
        return
    yield element("h2", "Requirement")
    edges, load = " × ".join(map(format_number, needed.box_mm)), needed.payload
    what = f"{needed.name}: a box of {edges} mm for the tool, with home at its centre"
    turn = format_number(data.design.required_yaw)
    what += f", turned by {turn}° about z" if data.design.required_yaw else ""
    what += f", at every tilt up to {format_number(needed.tilt_deg)}°" if needed.tilt_deg else ""
    what += f", with {format_number(load.mass_kg)} kg" if load.mass_kg else ""
    what += f" and a force of {format_number(load.force_n)} N at the tool" if load.force_n else ""
    yield markup.paragraph(f"{what}.")
    if isinstance(check, ExplorerError):
        yield markup.paragraph(f"It cannot be checked: {check}.", class_="note")
        return
    missed, count = len(check.missed), len(check.demands)
    verdict_words = f"{missed} of {count} demands are missed" if missed else "All demands are kept"
    yield markup.paragraph(element("b", f"{verdict_words}."), class_="note" if missed else None)
    rows = [
        (
            each.words,
            *(
                (number(value, 4), each.unit if each.unit == "°" else f" {each.unit}")
                if each.worst or each.limit
                else ""
                for value in (each.worst, each.limit, each.spare)
            ),
            "missed" if not each.kept else "proven" if each.proven else each.remark or "kept",
        )
        for each in check.demands
    ]
    heads = ("demand", "worst value", "limit", "spare", "over the box and every tilt")
    yield markup.table(heads, rows, "<>>><", "The check of the design")


def mechanism_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the mechanism."""
    yield element("h2", "Mechanism")
    yield markup.paragraph(
        "A fixed base and a moving platform, joined by four legs with six actuators. Leg 1 starts "
        "at a1 and leg 4 at a3; legs 2 and 3 start at carriages on the guide, the base’s x-axis. "
        "b4 is the platform’s origin."
    )
    yield markup.illustration(
        three_views(data.snapshot),
        f"The mechanism in {data.pose_words}, in three views at one scale (third angle). "
        "Colours show how near each element of the two flags is to its incidence: "
        f"orange where its margin is below the warning length of {100.0 * WARN_SHARE:g} % of the "
        "reach, or the nearest singular pose is nearer than a third of it; blue beyond.",
    )
    values = zip(_MEANINGS.items(), (*data.design.variables, data.design.reach), strict=True)
    rows = [_lengths(data, (element("b", k), f" {word}"), value) for (k, word), value in values]
    heads = ("design variable", "units", "mm")
    variables = markup.table(heads, rows, "<>>", "Design variables X")
    yield element("div", variables, _pose(data), class_="pair")
    yield _joints(data)
    yield _limits(data)
    yield from _required_box(data)
    broken = data.snapshot.violations
    if broken:
        words = f"This pose breaks limits: {'; '.join(map(str, broken))}."
        yield markup.paragraph(words, class_="note")


def _lengths(data: ReportData, name: Cell, value: float) -> Row:
    """Return a row with a length in design units and in millimetres."""
    unit, reach = data.design.unit_mm, data.design.reach
    return name, number(value, size=reach), number(unit * value, size=unit * reach)


def point_rows(data: ReportData, name: str, point: Triple) -> Iterator[Row]:
    """Yield the rows of a point's coordinates."""
    for axis, value in zip("xyz", point, strict=True):
        yield _lengths(data, f"{axis} of {name}", value)


def angle_rows(rotation: FloatArray, of: str = "") -> Iterator[Row]:
    """Yield the rows of yaw, pitch and roll of a rotation (3, 3), and the words that follow."""
    angles = yaw_pitch_roll_from_rotation(rotation).tolist()
    for name, angle in zip(("yaw", "pitch", "roll"), angles, strict=True):
        yield f"{name}{of}", (number(angle, size=180.0), "°"), ""


def _pose(data: ReportData) -> Element:
    pose = data.snapshot.pose
    rows = [*point_rows(data, "b4", pose.position), *angle_rows(data.rotation)]
    turn = zip("wxyz", pose.quaternion, strict=True)
    rows += [(f"quaternion {name}", number(value, size=1.0), "") for name, value in turn]
    return markup.table(("", "units", "mm"), rows, "<>>", "Home pose" if data.is_home else "Pose")


def _joints(data: ReportData) -> Element:
    ranges = joint_ranges(data.design)
    rows: list[Row] = []
    for name, value in zip(JOINTS, data.snapshot.joints.tolist(), strict=True):
        ends = ranges.get(name)
        bounds = [("none" if ends is None else ends[k] * data.design.unit_mm) for k in (0, 1)]
        rows.append((*_lengths(data, (element("b", name), f" {_JOINTS[name]}"), value), *bounds))
    heads = ("joint", "units", "mm", "minimum, mm", "maximum, mm")
    return markup.table(heads, rows, "<>>>>", f"Joints in {data.pose_words}, and their limits")


def _limits(data: ReportData) -> Element:
    # Signs and angles have no length.
    rows: list[Row] = [
        (symbols, demand.words(), demand.words(data.design.unit_mm) if demand.has_length else "")
        for symbols, demand in limits_in_force(data.design)
    ]
    for leg, radius in enumerate(data.design.limits.leg_radii, 1):
        rows.append(_lengths(data, f"radius of leg {leg}", radius))
    return markup.table(("limit", "units", "mm"), rows, "<>>", "Limits in force")


def _required_box(data: ReportData) -> Iterator[Element]:
    """Yield the required box of positions of the tool, if the design states one."""
    box, unit = data.design.required_box, data.design.unit_mm
    if box is None:
        return
    rows: list[Row] = [
        (axis, low, high, low * unit, high * unit)
        for axis, low, high in zip("xyz", *box, strict=True)
    ]
    heads = ("of the tool", "from, units", "to, units", "from, mm", "to, mm")
    yield markup.table(heads, rows, "<>>>>", "Required box")
    if data.design.required_yaw:
        turn = format_number(data.design.required_yaw)
        words = f"The table has the box before it is turned by {turn}° about z, about its centre."
        yield markup.paragraph(words)


def singularity_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on singularities."""
    snapshot, unit = data.snapshot, data.design.millimetres
    here = verdict(snapshot)
    yield element("h2", "Singularities")
    yield markup.paragraph(f"All values are those in {data.pose_words}.")
    certified = min(nearest.bound for nearest in snapshot.nearest)
    regular = (
        blocks.free_ball(snapshot, singularity_free_ball(data.at), "b4"),
        blocks.regular_distance(certified, unit),
    )
    yield from markup.elements(
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
    ellipsoids = blocks.ellipsoids(performance(data.design, data.at), "b4")
    yield element("div", *markup.elements(ellipsoids), class_="pair")


def legs_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the clearances of the legs."""
    accessible = data.accessible
    if isinstance(accessible, AccessibleWorkspace):
        pairs = accessible.pairs
    else:
        least = least_clearances(data.workspace)
        rows = zip(PAIRS, least.clearance.tolist(), least.bound.tolist(), strict=True)
        pairs = [PairCost(*row, blocked_volume=0.0) for row in rows]
    yield element("h2", "Legs")
    yield markup.paragraph(
        f"The first table is of {data.pose_words}. A pair that shares a joint has no clearance."
    )
    yield from markup.elements(pose_clearances(data.snapshot))
    yield from markup.elements(workspace_clearances(pairs, data.design))


def parts_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the prototype."""
    yield element("h2", "Prototype")
    bill = data.bill
    if isinstance(bill, ExplorerError):
        yield markup.paragraph(f"Its parts cannot be made: {bill}.", class_="note")
        return
    yield markup.paragraph(
        f"Parts sized from the design, of {format_number(DENSITY, 6)} kg/m³ (printed PLA): ",
        number(bill.mass * 1000.0, 4),
        " g in all.",
    )
    actuators = [
        (str(leg.leg), *_numbers(*leg.stroke, *leg.required, leg.diameter, leg.mass * 1000.0))
        for leg in bill.actuators
    ]
    parts = [
        (item.name, *_numbers(*item.size, item.volume / 1000.0, item.mass * 1000.0))
        for item in bill.items
    ]
    yield markup.table(
        ("leg", "from, mm", "to, mm", "limits from, mm", "to, mm", "Ø, mm", "mass, g"),
        actuators,
        "<>>>>>>",
        "Actuators: strokes, and the strokes that the limits require",
    )
    heads = ("part", "x, mm", "y, mm", "z, mm", "volume, cm³", "mass, g")
    yield markup.table(heads, parts, "<>>>>>", "Bill of parts")


def _numbers(*values: float) -> list[Element]:
    return [number(value, 4) for value in values]
