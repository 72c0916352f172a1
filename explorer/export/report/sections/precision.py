"""The section on precision: errors of the tool, what causes them, and what the payload bends."""

from __future__ import annotations

import math
from collections.abc import Iterator
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.report.data import ReportData
from explorer.export.report.markup import (
    Cell,
    Row,
    element,
    number,
    numbers,
    paragraph,
    percentage,
    range_of,
    table,
    vector,
)
from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import RMS_ERRORS
from explorer.statics.error_sources import IS_TILT, SOURCES
from explorer.statics.tool_precision import GROUPS, ToolPrecision

RANKED = 10
"""Number of sources of errors that are listed, from the largest."""


def precision_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on precision; nothing of a design that is exact and rigid."""
    precision = data.precision
    if precision is None:
        return
    yield element("h2", "Precision")
    yield paragraph(
        "How far the tool is from where it should be: by the errors of the actuators and the "
        "tolerances of the dimensions, and because what holds the payload gives way. The model is "
        "linear, without preload."
    )
    if not precision.is_regular:
        yield paragraph("The pose is singular: nothing bounds the errors in it.", class_="note")
        return
    if precision.bounds.any():
        yield _errors(data, precision)
        yield _sources(data, precision)
    if data.case.is_elastic:
        yield element("div", _stiffness(data), _compliance(data, precision), class_="pair")
        if data.case.is_loaded:
            yield _deflection(data, precision)


def _errors(data: ReportData, precision: ToolPrecision) -> Element:
    stated = {name: part for name, part in GROUPS.items() if precision.bounds[part].any()}
    if len(stated) == 2:
        # One of the two is all.
        del stated["all"]
    errors = [(precision.worst(part), precision.rms(part)) for part in stated.values()]
    moved = [data.unit_mm * float(each.displacement) for pair in errors for each in pair]
    turned = [math.degrees(each.turn) for pair in errors for each in pair]
    columns = (numbers(moved[0::2]), numbers(moved[1::2]), numbers(turned[0::2]))
    rows = list(zip(stated, *columns, numbers(turned[1::2]), strict=True))
    heads = ("by the errors of", "at most, mm", "RMS, mm", "turn at most, °", "RMS, °")
    caption = (
        f"Errors of the tool in {data.pose_words}: the largest of all that the bounds allow, and "
        f"the root mean square of {RMS_ERRORS}"
    )
    return table(heads, rows, align="<>>>>", caption=caption)


def _sources(data: ReportData, precision: ToolPrecision) -> Element:
    moved = data.unit_mm * precision.alone.displacement
    turned = np.degrees(precision.alone.turn)
    listed = np.flatnonzero(precision.bounds).tolist()
    ranked = sorted(listed, key=lambda k: -moved[k])
    most = ranked[:RANKED]
    longest = max(float(moved[most[0]]), 1e-300)
    rows: list[Row] = [
        (element("b", SOURCES[k]), _bound(data, precision.bounds, k), shift, _bar(part), turn)
        for k, shift, part, turn in zip(
            most,
            numbers(moved[most].tolist()),
            (moved[most] / longest).tolist(),
            numbers(turned[most].tolist()),
            strict=True,
        )
    ]
    count = len(ranked)
    words = f"The largest {RANKED} of {count} sources" if count > RANKED else "Sources"
    caption = f"{words} of errors in {data.pose_words}, by how far each alone moves the tool"
    heads = ("source", "bound", "displacement, mm", "", "turn, °")
    return table(heads, rows, align="<>><>", caption=caption)


def _bound(data: ReportData, bounds: FloatArray, source: int) -> Cell:
    value = float(bounds[source])
    if IS_TILT[source]:
        return "± ", number(math.degrees(value), 4), "°"
    return "± ", number(data.unit_mm * value, 4), " mm"


def _bar(share: float) -> Element:
    """Return a bar whose length is a share of the longest one."""
    bar = element("rect", x=0.0, y=0.0, width=100.0 * share, height=7.0)
    return element("svg", bar, class_="bar", viewBox="0 0 100 7", preserveAspectRatio="none")


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


def _compliance(data: ReportData, precision: ToolPrecision) -> Element:
    principal = precision.principal
    forces = (data.unit_mm * principal.displacement).tolist()
    # Radians per newton and unit become degrees per newton metre.
    moments = (np.degrees(principal.turn) * 1e3 / data.unit_mm).tolist()
    rows: list[Row] = [
        (number(value, 4), unit, vector(axis))
        for values, axes, unit in (
            (forces, principal.force_directions.tolist(), "mm/N"),
            (moments, principal.moment_directions.tolist(), "°/(N m)"),
        )
        for value, axis in zip(values, axes, strict=True)
    ]
    caption = f"Compliance of the tool in {data.pose_words}, the softest direction first"
    return table(("per force or moment", "", "along x, y, z"), rows, align="><<", caption=caption)


def _deflection(data: ReportData, precision: ToolPrecision) -> Element:
    moved = data.unit_mm * precision.deflection[:3]
    turned = np.degrees(precision.deflection[3:])
    force = data.design.payload.force_n
    rows: list[Row] = [
        ("displacement", (number(float(np.linalg.norm(moved)), 4), " mm"), vector(moved.tolist())),
        ("turn", (number(float(np.linalg.norm(turned)), 4), "°"), vector(turned.tolist())),
    ]
    if force:
        direction = (np.array(precision.loaded.load[:3]) / force).tolist()
        rows.append(("direction of the force", "", vector(direction)))
    names = "guide: actuators d1 and d3", "bending of the struts", "actuators l1, d2, d4 and l4"
    for name, share in zip(names, precision.shares, strict=True):
        rows.append((f"share of the {name}", percentage(float(share)), ""))
    words = "its weight" if data.design.payload.mass_kg else ""
    if force:
        words += f"{words and ', and '}its force in its worst direction"
    caption = f"Deflection in {data.pose_words} under the payload: {words}"
    return table(("", "", "along x, y, z"), rows, align="<><", caption=caption)
