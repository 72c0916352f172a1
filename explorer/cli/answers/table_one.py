"""The paper's Table 1 beside the counted nodes and the exact volumes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from explorer.cli.output import figure, table
from explorer.mechanism.design_file import PRESETS
from explorer.workspace.slices.volume import NodeCount, workspace_nodes, workspace_volume

Extent = tuple[tuple[float, float, float], tuple[float, float, float]]

WHY_THEY_DIFFER = (
    "The paper counts grid nodes, those on the boundary included, and takes each for a whole "
    "cell: cells of nodes near the boundary reach beyond it, so that a node volume exceeds the "
    "exact volume by about half a step over the surface."
)


@dataclass(frozen=True)
class Printed:
    """A row as the paper prints it.

    Attributes:
        extent: Extent of the workspace, lows then highs, in design units.
        volume: Node volume of the workspace in cubed design units; None if it is not printed.
    """

    extent: Extent
    volume: float | None


PRINTED: Mapping[str, Printed] = MappingProxyType(
    {
        "paper-initial": Printed(((0.0, -5.026, 0.0), (10.052, 10.770, 9.334)), None),
        "paper-optimal": Printed(((0.0, -12.0, 0.0), (20.0, 22.0, 18.0)), 7992.0),
    }
)
"""The rows by preset."""


@dataclass(frozen=True)
class Row:
    """A row of the table, as printed and as computed by this program."""

    name: str
    printed: Printed
    nodes: NodeCount
    volume: float


def compute_table_one() -> list[Row]:
    """Compute both rows of the table."""
    return [
        Row(name, printed, workspace_nodes(PRESETS[name]), workspace_volume(PRESETS[name]).volume)
        for name, printed in PRINTED.items()
    ]


def as_json(row: Row) -> dict[str, object]:
    """Return a row as plain values; null is not printed in the paper."""
    return {
        "design": row.name,
        "printed": {
            "extent": [list(ends) for ends in row.printed.extent],
            "node_volume": row.printed.volume,
        },
        "node_step": row.nodes.step,
        "node_count": row.nodes.count,
        "node_volume": row.nodes.volume,
        "extent": None if row.nodes.extent is None else [list(ends) for ends in row.nodes.extent],
        "volume": row.volume,
    }


def as_lines(row: Row) -> str:
    """Return a row as lines of text."""
    volume, nothing = row.printed.volume, "not printed"
    own = row.nodes.extent or ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    cells = [(row.name, "printed", "here")]
    for axis, low, high, own_low, own_high in zip("xyz", *row.printed.extent, *own, strict=True):
        cells.append((axis, f"{low:.3f} to {high:.3f}", f"{own_low:z.3f} to {own_high:z.3f}"))
    cells += [
        ("node step", nothing, figure(row.nodes.step)),
        ("nodes", nothing, str(row.nodes.count)),
        ("node volume", nothing if volume is None else figure(volume), figure(row.nodes.volume)),
        ("exact volume", nothing, figure(row.volume)),
        ("node / exact", "", f"{row.nodes.volume / row.volume:.4f}"),
    ]
    return table(cells, "<>>")
