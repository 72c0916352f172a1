"""The paper's Table 1 beside the counted nodes and the exact volumes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from explorer.cli.output import figure, measure_text, table
from explorer.measures.case import Case
from explorer.measures.catalogue import CATALOGUE
from explorer.measures.measurements import measure_design
from explorer.mechanism.design_file import PRESETS

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

_MEASURES = ("node_step", "node_count", "node_volume", "volume")


def as_json() -> dict[str, object]:
    """Return both rows of the table as plain values; null is not printed in the paper."""
    rows: list[dict[str, object]] = []
    for name, printed in PRINTED.items():
        case = Case(PRESETS[name])
        row: dict[str, object] = {
            "design": name,
            "printed": {"extent": printed.extent, "node_volume": printed.volume},
            **measure_design(case, _MEASURES[:3]).values,
            "extent": case.paper_nodes.extent,
            "volume": case.volume.volume,
        }
        rows.append(row)
    return {"table1": rows, "note": WHY_THEY_DIFFER}


def as_lines() -> Iterator[str]:
    """Yield both rows of the table as lines of text."""
    yield "Table 1 of the paper, and the values of this program, in design units"
    for name, printed in PRINTED.items():
        case = Case(PRESETS[name])
        extent = case.paper_nodes.extent or ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        rows = [(name, "printed", "here")]
        for axis, low, high, own_low, own_high in zip("xyz", *printed.extent, *extent, strict=True):
            rows.append((axis, f"{low:.3f} to {high:.3f}", f"{own_low:z.3f} to {own_high:z.3f}"))
        for measure_name, value in measure_design(case, _MEASURES).values.items():
            measure = CATALOGUE[measure_name]
            printed_value = printed.volume if measure_name == "node_volume" else None
            text = "not printed" if printed_value is None else figure(printed_value)
            rows.append((measure.heading, text, measure_text(measure, value)))
        ratio = case.paper_nodes.volume / case.volume.volume
        yield from ("", table([*rows, ("node / exact", "", f"{ratio:.4f}")], "<>>"))
    yield from ("", WHY_THEY_DIFFER)
