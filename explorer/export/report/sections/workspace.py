"""What a report tells of the workspace: pictures, slices, volumes, what bounds it."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.report.drawings.slice_drawing import legend, strip, through
from explorer.export.report.drawings.slices import Slices
from explorer.export.report.drawings.workspace_drawing import whole_and_cut
from explorer.export.report.findings import Findings, Missing
from explorer.export.report.markup import (
    Cell,
    count,
    element,
    figure,
    illustration,
    paragraph,
    table,
    written,
)
from explorer.export.report.sections.mechanism import pose_words
from explorer.workspace.solids.solid import Solid


def workspace_section(found: Findings) -> Iterator[Element]:
    """Yield the section."""
    yield element("h2", "Workspace")
    if found.volume.volume <= 0.0:
        causes = ", ".join(found.volume.empty_because)
        yield paragraph(
            f"The workspace is empty at this orientation because of {causes}: "
            "no position of b4 keeps all limits.",
            class_="note",
        )
        return
    yield paragraph(
        "All positions of b4 within the limits, at the orientation of ",
        f"{pose_words(found)}. The volume is integrated from exact slices and good to rounding; ",
        "the node volume is how the paper counts: nodes of a grid, boundary included, times step³.",
    )
    solid = found.solid
    if isinstance(solid, Missing):
        yield paragraph(f"There is no picture of it: {solid.reason}", class_="note")
    elif solid.is_empty:
        yield paragraph("It is too thin to be drawn.", class_="note")
    else:
        yield from _pictures(found, solid)
    yield _volumes(found)
    yield from _reachable(found)
    tables = [
        _extent(found),
        _bounding(solid) if isinstance(solid, Solid) and not solid.is_empty else None,
    ]
    yield element(
        "div",
        element("div", *tables),
        _gradient(found) if found.volume.gradient else None,
        class_="pair",
    )


def _pictures(found: Findings, solid: Solid) -> Iterator[Element]:
    extent = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    slices = Slices.of(found.design, found.snapshot.rotation, extent)
    snapshot = found.snapshot
    level = written(snapshot.pose.position[1], 4)
    yield illustration(
        whole_and_cut(snapshot, solid, slices),
        "The workspace about the mechanism: whole, and cut open at "
        f"y = {level} with the map of the cut, in the colours of the next figure.",
    )
    yield illustration(
        element(
            "div", through(slices, snapshot.pose.position), legend(slices, snapshot.design.unit_mm)
        ),
        "Slices through b4 (the cross), axes in design units, coloured by the smallest "
        "of the three margins. ",
        "Outlines are exact arcs and lines; bands are exact too, since margins are linear "
        "in the position."
        if slices.are_exact
        else "Limits on swings bound it, so the outlines are those of a fine grid.",
        " Where all is clear, thin lines follow every ",
        figure(slices.contour_step),
        " units of it.",
    )
    drawn, areas = strip(slices, "x")
    yield illustration(drawn, "Slices along the guide, at one scale, in the same colours.")
    if all(area is not None for _, area in areas):
        unit = snapshot.design.unit_mm
        yield table(
            ("slice at", *(f"x = {written(x, 4)}" for x, _ in areas)),
            [
                ("area, units²", *(figure(area or 0.0, 5) for _, area in areas)),
                ("area, cm²", *(figure((area or 0.0) * (0.1 * unit) ** 2, 5) for _, area in areas)),
            ],
            align="<" + ">" * len(areas),
        )


def _volumes(found: Findings) -> Element:
    centimetres = (0.1 * found.design.unit_mm) ** 3
    rows: list[tuple[Cell, ...]] = []

    def add(name: str, volume: float, *remark: Cell) -> None:
        rows.append((name, volume, volume * centimetres, *(remark or ("",))))

    exact = "exact" if found.volume.error <= 1e-6 * found.volume.volume else "to four digits"
    add("exact volume", found.volume.volume, exact)
    if isinstance(found.nodes, Missing):
        rows.append(("node volume", "–", "–", found.nodes.reason))
    else:
        nodes = found.nodes
        remark = (count(nodes.count), " nodes at multiples of ", figure(nodes.step), " units")
        add("node volume", nodes.volume, remark)
    if isinstance(found.hull_volume, Missing):
        rows.append(("convex hull", "–", "–", found.hull_volume.reason))
    else:
        add("convex hull", found.hull_volume, "of the mesh")
    reachable = found.reachable
    if reachable is not None and not isinstance(reachable, Missing):
        remark = ("without a collision of legs",)
        of, within = reachable.reachable_node_count, reachable.node_count
        if of is not None and within is not None:
            remark = (*remark, "; ", count(of), " of ", count(within), " nodes")
        add("reachable", reachable.reachable_volume, remark)
    return table(("volume", "units³", "cm³", ""), rows, align="<>><", caption="Volumes")


def _extent(found: Findings) -> Element | None:
    if isinstance(found.nodes, Missing) or found.nodes.extent is None:
        return None
    unit, (lows, highs) = found.design.unit_mm, found.nodes.extent
    extents: list[tuple[Cell, ...]] = [
        (
            axis,
            (figure(low), " to ", figure(high)),
            (figure(low * unit), " to ", figure(high * unit)),
        )
        for axis, low, high in zip("xyz", lows, highs, strict=True)
    ]
    return table(
        ("axis", "units", "mm"), extents, align="<>>", caption="Extent of the counted nodes"
    )


def _reachable(found: Findings) -> Iterator[Element]:
    if isinstance(found.reachable, Missing):
        yield paragraph(
            f"What can be reached without a collision is not known: {found.reachable.reason}.",
            class_="note",
        )


def _bounding(solid: Solid) -> Element:
    corners = solid.vertices[solid.faces]
    size = float(np.ptp(solid.vertices, axis=0).max())
    sides = (corners[:, 1:] - corners[:, :1]) / size
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    shares = np.bincount(solid.limit_of_face, areas, len(solid.limits)) / areas.sum()
    rows: list[tuple[Cell, ...]] = [
        (name, (figure(100.0 * share, 3), " %"))
        for share, name in sorted(zip(shares.tolist(), solid.limits, strict=True), reverse=True)
        if share > 0.0
    ]
    return table(("bounded by", "share of the surface"), rows, align="<>", caption="What bounds it")


def _gradient(found: Findings) -> Element:
    rows: list[tuple[Cell, ...]] = [(name, rate) for name, rate in found.volume.gradient.items()]
    return table(
        ("with", "units³ per unit; yaw per radian"),
        rows,
        align="<>",
        caption="How the volume moves",
    )
