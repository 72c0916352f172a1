"""The tolerances of a design as CSV, for its drawings."""

from __future__ import annotations

import csv
import io

import numpy as np

from explorer.statics.budget.costs import PARTS, SourceCosts
from explorer.statics.error_sources import IS_TILT, SOURCES

COLUMNS = (
    *("part", "error of", "unit", "tolerance"),
    *("mm per unit", "degrees per unit", "mm at tolerance", "degrees at tolerance", "share"),
)
"""The names of the columns: what an error of a unit, and one of the whole tolerance, does at the
tool, and the share in its worst displacement."""


def tolerance_csv(costs: SourceCosts) -> str:
    """Return the tolerances and their costs as CSV: a header, then a line per source of errors.

    The lines are sorted by part; a tolerance that may be any is empty. Numbers round-trip to the
    last bit.
    """
    numbers = (
        costs.displacement,
        costs.turn,
        costs.displacement_within,
        costs.turn_within,
        costs.shares,
    )
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for k in sorted(range(len(SOURCES)), key=lambda k: PARTS[k]):
        tolerance = float(costs.tolerances[k])
        writer.writerow(
            [
                PARTS[k],
                SOURCES[k],
                "degree" if IS_TILT[k] else "mm",
                repr(tolerance) if np.isfinite(tolerance) else "",
                *(repr(float(values[k])) for values in numbers),
            ]
        )
    return text.getvalue()
