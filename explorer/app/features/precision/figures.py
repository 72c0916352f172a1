"""The figures of precision in a pose, as HTML."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from explorer.app.widgets.charts import BLUE, ORANGE, TEAL, VIOLET
from explorer.app.widgets.colours import Rgb, css
from explorer.app.widgets.markup import caption, dim, meter, row, swatch, table
from explorer.mechanism.design import JOINTS
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_column, format_decimals, format_number
from explorer.statics.accuracy import RMS_ERRORS
from explorer.statics.compliance import is_elastic
from explorer.statics.error_sources import SOURCES
from explorer.statics.tool_precision import GROUPS, ToolPrecision

DIGITS = 3
# Number of sources of errors that are listed by themselves.
LISTED = 8
ACTUATOR, DIMENSION = BLUE, ORANGE
# Parts in the order of `ComplianceShares`.
PARTS: tuple[tuple[str, Rgb], ...] = (("guide", TEAL), ("struts", VIOLET), ("actuators", BLUE))
KINDS = {
    "worst": "The largest for all combinations of signs of the errors, each at its largest",
    "RMS": f"Root mean square of {RMS_ERRORS}",
}
SHARES_HINT = (
    "Parts of the work that the load does: on the actuators d1 and d3 along the guide, on the "
    "bending struts of legs 2 and 3, and on the actuators l1, d2, d4 and l4."
)


def millimetres(value: float) -> str:
    """Return a length in words."""
    return f"{format_number(value, DIGITS, infinite='∞')} mm"


def degrees(radians: float) -> str:
    """Return an angle in words."""
    return f"{format_number(float(np.degrees(radians)), DIGITS, infinite='∞')}°"


def headline(precision: ToolPrecision) -> Iterator[str]:
    """Yield the worst error of the tool in large words, or why there is none."""
    if not precision.has_errors:
        yield '<div class="ex-status">The design states no errors</div>'
        return
    if not precision.is_regular:
        yield '<div class="ex-status ex-beyond">Errors are infinite here</div>'
        yield '<div class="ex-beyond">The pose is singular.</div>'
        return
    unit, worst = precision.loaded.design.unit_mm, precision.worst()
    moved, turned = unit * float(worst.displacement), float(worst.turn)
    yield f'<div class="ex-status">Tool within ±{millimetres(moved)}, ±{degrees(turned)}</div>'


def errors(precision: ToolPrecision) -> Iterator[str]:
    """Yield the worst and the RMS errors, and the sources of the largest."""
    unit = precision.loaded.design.unit_mm
    bounds = precision.bounds
    stated = [name for name, sources in GROUPS.items() if bounds[sources].any()]
    if len(stated) == 2:
        # One of the two is all.
        stated = stated[:1]
    rows: list[str] = []
    for name in stated:
        worst, rms = precision.worst(GROUPS[name]), precision.rms(GROUPS[name])
        for kind, error in (("worst", worst), ("RMS", rms)):
            figures = millimetres(unit * float(error.displacement)), degrees(float(error.turn))
            rows.append(row(dim(f"{name}, {kind}"), *figures, hint=KINDS[kind]))
    yield caption("Error of the tool", "Displacement of the tool point, and turn of the tool.")
    yield table(rows)
    moved, turned = unit * precision.alone.displacement, np.degrees(precision.alone.turn)
    yield caption(
        "By source",
        "What each actuator at its largest error, and each dimension at its tolerance, does alone.",
    )
    yield f'<div class="ex-shares ex-sources">{table(source_rows(moved, turned))}</div>'


def source_rows(moved: FloatArray, turned: FloatArray) -> Iterator[str]:
    """Yield the rows of the sources with the largest displacements, and one of the rest.

    Args:
        moved: Displacement of the tool by each source, shape (29,), in mm.
        turned: Turn of the tool, shape (29,), in degrees.
    """
    order: list[int] = np.lexsort([-turned, -moved]).tolist()
    ranked = [index for index in order if moved[index] > 0.0 or turned[index] > 0.0]
    listed = ranked[:LISTED]
    most = float(moved.max()) or 1.0
    lengths = format_column(moved[listed].tolist(), DIGITS)
    angles = format_column(turned[listed].tolist(), DIGITS)
    for index, length, angle in zip(listed, lengths, angles, strict=True):
        colour = ACTUATOR if index < len(JOINTS) else DIMENSION
        bar = meter(100.0 * float(moved[index]) / most, colour)
        yield row(dim(SOURCES[index]), f"{length} mm", f"{angle}°", bar)
    if len(ranked) > LISTED:
        rest = float(moved[ranked[LISTED]])
        yield row(dim(f"{len(ranked) - LISTED} more"), f"≤ {format_number(rest, 2)} mm", "", "")


def deflections(precision: ToolPrecision) -> Iterator[str]:
    """Yield the deflection of the tool under the load, its shares, and what gives way most."""
    design = precision.loaded.design
    if not is_elastic(design):
        yield caption("Deflection")
        yield dim(
            "Rigid: the design states no stiffness of its actuators and no tubes for its struts."
        )
        return
    yield caption(
        "Deflection under the load",
        "Displacement and turn of the tool under the load and the weights of the tab Forces.",
    )
    if not precision.is_regular:
        yield '<div class="ex-beyond">It is infinite: the pose is singular.</div>'
        return
    unit, moved = design.unit_mm, precision.deflection
    total, turn = unit * math.hypot(*moved[:3].tolist()), math.hypot(*moved[3:].tolist())
    along = ", ".join(format_column((unit * moved[:3]).tolist(), DIGITS))
    about = ", ".join(format_column(np.degrees(moved[3:]).tolist(), DIGITS))
    rows = [
        row(dim("displacement"), f"<b>{millimetres(total)}</b>", dim(along)),
        row(dim("turn"), f"<b>{degrees(turn)}</b>", dim(about)),
    ]
    force = design.payload.force_n
    if force > 0.0:
        most = unit * precision.largest_displacement
        hint = "The payload's force acts besides, in the direction that deflects the tool most."
        rows.append(row(dim("with the process force"), f"≤ {millimetres(most)}", "", hint=hint))
    yield table(rows)
    shares = [float(share) for share in precision.shares]
    if not np.isnan(shares).any():
        yield stacked(shares)
    yield from principal_rows(precision)


def stacked(shares: list[float]) -> str:
    """Return the shares of guide, struts and actuators as one bar with words below it."""
    parts = [(name, colour, share) for (name, colour), share in zip(PARTS, shares, strict=True)]
    bars = "".join(
        f'<span style="--share:{100.0 * share:.2f}%;--colour:{css(colour)}"></span>'
        for _, colour, share in parts
    )
    words = "".join(
        f"<span>{swatch(colour)} {name} {format_decimals(100.0 * share, 0)}&nbsp;%</span>"
        for name, colour, share in parts
    )
    return (
        f'<div class="ex-stack" title="{SHARES_HINT}">{bars}</div>'
        f'<div class="ex-flow">{words}</div>'
    )


def principal_rows(precision: ToolPrecision) -> Iterator[str]:
    """Yield the six principal directions of the compliance."""
    unit, principal = precision.loaded.design.unit_mm, precision.principal
    per_moment = float(np.degrees(1.0)) * 1e3 / unit
    for title, hint, values, name, axes in (
        (
            "Softest directions of a force",
            "Displacement of the tool per force, softest first, and the direction of the force.",
            unit * principal.displacement,
            "mm/N",
            principal.force_directions,
        ),
        (
            "Softest directions of a moment",
            "Turn of the tool per moment, softest first, and the axis of the moment.",
            per_moment * principal.turn,
            "°/(N m)",
            principal.moment_directions,
        ),
    ):
        yield caption(title, hint)
        texts = [format_number(value, DIGITS) for value in values.tolist()]
        yield table(
            row(f"{text} {name}", dim(", ".join(format_decimals(part, 2) for part in axis)))
            for text, axis in zip(texts, axes.tolist(), strict=True)
        )
