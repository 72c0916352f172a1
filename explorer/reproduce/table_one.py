"""The claim of Table 1: the extents and volumes of the workspaces of its two designs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import NamedTuple

import msgspec
import numpy as np

from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.optimise.problem import YAW, varied
from explorer.reproduce.claim import Measurement
from explorer.workspace.slices.volume import (
    NodeCount,
    node_step_of,
    workspace_nodes,
    workspace_volume,
)

Extent = tuple[tuple[float, float, float], tuple[float, float, float]]

# Largest difference of an extent that the paper prints with three decimals.
PRINTED_TO = 1e-3
# Distance of a face from a plane of nodes, in steps, up to which nodes lie on it.
ON_NODE = 1e-9
YAWS = (-72.6, -73.0, -73.1, -73.2, -73.6, -75.0, -90.0)
"""Yaws at which the nodes of both designs are counted, in degrees."""


class Printed(NamedTuple):
    """A row as the paper prints it: lows and highs, and the node volume; None if not printed."""

    extent: Extent
    volume: float | None


PRINTED: Mapping[str, Printed] = {
    "paper-initial": Printed(((0.0, -5.026, 0.0), (10.052, 10.770, 9.334)), None),
    "paper-optimal": Printed(((0.0, -12.0, 0.0), (20.0, 22.0, 18.0)), 7992.0),
}
"""The rows by preset, lengths in design units."""


@dataclass(frozen=True)
class Row:
    """A row of Table 1 as it is measured: nodes with their extent, and the exact volume."""

    preset: str
    nodes: NodeCount
    exact: float

    @property
    def off(self) -> float:
        """Largest difference of an extent from the printed one."""
        return float(np.abs(np.subtract(_extent(self.nodes), PRINTED[self.preset].extent)).max())


def extents() -> Measurement:
    """Count the nodes of both designs by our reading, and compare extents and volume."""
    rows = [
        Row(name, workspace_nodes(PRESETS[name]), workspace_volume(PRESETS[name]).volume)
        for name in PRINTED
    ]
    optimal, initial = PRESETS["paper-optimal"], PRESETS["paper-initial"]
    by_yaw = {
        yaw: (workspace_nodes(varied(optimal, {YAW: yaw})).count, _initial_off(initial, yaw))
        for yaw in YAWS
    }
    as_scanned = msgspec.structs.replace(initial, b3=15.0, home=initial.home_pose)
    off = min(_initial_off(as_scanned, yaw) for yaw in range(-180, 180))
    return judge_table(rows, by_yaw, off, _beyond_box(optimal))


def judge_table(
    rows: Sequence[Row], by_yaw: Mapping[float, tuple[int, float]], off: float, beyond: float
) -> Measurement:
    """Return the measurement of Table 1.

    Args:
        rows: Rows in the order of `PRINTED`.
        by_yaw: By the yaw in degrees, the nodes of the optimum, and the largest difference of an
            extent of the initial design from the printed one.
        off: That difference with b3 = 15, as the scan has it, at the best whole degree of yaw.
        beyond: Volume of the parts of cells that lie beyond the flat faces of the optimum's box.
    """
    worst, optimal = max(row.off for row in rows), rows[-1]
    printed = PRINTED[optimal.preset].volume
    excess = optimal.nodes.volume - optimal.exact
    why = (
        "A node on the boundary counts as a whole cell, so that cells stand out of the workspace. "
        f"Where a face of the optimum's box lies on a plane of nodes it is half a cell: "
        f"{beyond:.0f} of the excess of {excess:.0f} units³."
    )
    near = [difference <= PRINTED_TO for _, difference in by_yaw.values()]
    text = (
        f"All extents of both rows agree within {worst:.4f} units, and the optimum's "
        f"{optimal.nodes.count} nodes times the cubed step are {optimal.nodes.volume:g}. Its exact "
        f"volume is {optimal.exact:.2f}; the node volume is {excess / optimal.exact:.1%} larger. "
        "The extents of the optimum are those of its box, whatever the yaw; the count depends on "
        "it: "
        + ", ".join(f"{count} at {yaw:g}°" for yaw, (count, _) in by_yaw.items())
        + f". The initial extents hold at {sum(near)} of these {len(near)} yaws. With b3 = 15, as "
        f"the scan has it, an extent differs by {off:.3f} or more at every whole degree of yaw."
    ).replace("-", "−")
    lines = [line for row in rows for line in _lines(row)]
    lines += ["", "by the yaw of the platform: nodes of the optimum, error of the initial extents"]
    lines += [f"  {yaw:7.1f}°  {count:5}  {error:9.4f}" for yaw, (count, error) in by_yaw.items()]
    values = {
        "table1": [
            {
                "design": row.preset,
                "printed": dict(zip(("extent", "node_volume"), PRINTED[row.preset], strict=True)),
                "node_step": row.nodes.step,
                "node_count": row.nodes.count,
                "node_volume": row.nodes.volume,
                "extent": row.nodes.extent,
                "volume": row.exact,
            }
            for row in rows
        ],
        "nodes_by_yaw": {f"{yaw:g}": count for yaw, (count, _) in by_yaw.items()},
        "note": why,
    }
    table = (*lines, "", *wrap(why, 88))
    if worst <= PRINTED_TO and optimal.nodes.volume == printed:
        condition = "by our reading, whose yaw and steps are fitted to the printed numbers"
        return Measurement(text, "confirmed within", values, table, condition)
    return Measurement(text, "not confirmed", values, table)


def _beyond_box(design: Design) -> float:
    """Return half a step times the area of the faces of the box on which nodes lie."""
    step = node_step_of(design)
    gradient = workspace_volume(design).gradient
    faces = [name for name in gradient if name.startswith("box ")]
    lows, highs = design.limits.box or ((), ())
    area = 0.0
    for name in faces:
        _, axis, end = name.split()
        bound = (lows if end == "minimum" else highs)["xyz".index(axis)]
        if abs(bound / step - round(bound / step)) < ON_NODE:
            area += abs(gradient[name])
    return 0.5 * step * area


def _extent(nodes: NodeCount) -> Extent:
    return nodes.extent or ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def _initial_off(design: Design, yaw: float) -> float:
    """Return the largest difference of an extent at a yaw from that of the initial row."""
    return Row("paper-initial", workspace_nodes(varied(design, {YAW: yaw})), 0.0).off


def _lines(row: Row) -> list[str]:
    printed, nodes = PRINTED[row.preset], row.nodes
    lines = [f"{row.preset:16}{'printed':>22}{'here':>22}"]
    for axis, low, high, own_low, own_high in zip(
        "xyz", *printed.extent, *_extent(nodes), strict=True
    ):
        given, own = f"{low:.3f} to {high:.3f}", f"{own_low:z.3f} to {own_high:z.3f}"
        lines.append(f"{axis:16}{given:>22}{own:>22}")
    text = "not printed" if printed.volume is None else f"{printed.volume:.2f}"
    lines.append(f"{'step':16}{'not printed':>22}{nodes.step:>22.4f}")
    lines.append(f"{'nodes':16}{'not printed':>22}{nodes.count:>22}")
    lines.append(f"{'node volume':16}{text:>22}{nodes.volume:>22.2f}")
    lines.append(f"{'exact volume':16}{'not printed':>22}{row.exact:>22.2f}")
    return lines
