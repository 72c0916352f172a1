"""The machine that was identified, in words: what is seen, where it deviates, and its errors."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.calibration.identify import Calibration
from explorer.calibration.measurement import mean_squares
from explorer.measures.blocks import block
from explorer.numerics.arrays import lengths_of
from explorer.statics.accuracy import SOURCES, UNITS, drawing_values

DIGITS = 3


def calibration_blocks(found: Calibration) -> Iterator[block.Block]:
    """Yield the blocks that tell a calibration."""
    machine = found.machine

    def mm(length: float) -> block.Number:
        return block.Number(machine.design.unit_mm * length, " mm", DIGITS)

    for fault in found.faults:
        yield block.Statement("", fault, "beyond")
    if found.gains:
        before, after = mm(found.tool_before), mm(found.tool_after)
        yield block.Statement(
            "The tool", (before, " before, ", after, " after, RMS where nothing was measured")
        )
    seen = f"{found.seen} of {found.seen + len(found.unseen)} seen"
    yield block.Statement(seen, "; ".join(unseen_words(found.unseen)))
    a1, b4 = lengths_of(machine.defects).tolist()
    left_out = ", ".join(str(1 + k) for k in found.outliers.tolist()) or "none"
    yield block.Facts(
        "Measurement and machine",
        (
            block.Fact("a1 beside the guide", (mm(a1),)),
            block.Fact("b4 beside the line b2b3", (mm(b4),)),
            block.Fact(
                "allowance of the margins",
                (mm(machine.allowance),),
                "for both, which make no exact flags",
            ),
            block.Fact(
                "poses held out",
                (mm(found.by_machine.distance), " off"),
                (mm(found.by_design.distance), " by the design"),
            ),
            block.Fact(
                "χ²",
                (block.Number(found.chi_square), f" of {found.degrees_of_freedom} expected"),
            ),
            block.Fact("poses left out", left_out, "wrong, or their legs do not close"),
            block.Fact("beyond their tolerances", ", ".join(found.beyond) or "none"),
        ),
    )
    yield _residuals(found)
    values, errors = (
        drawing_values(machine.design, each).tolist()
        for each in (machine.deviations, np.sqrt(found.covariance.diagonal()))
    )
    units = [" mm" if unit == "mm" else "°" for unit in UNITS]
    yield block.Table(
        "Deviations",
        (
            block.Names("source", SOURCES),
            block.Column("deviation", values, units, DIGITS),
            block.Column("standard error", errors, units, DIGITS, before="± "),
        ),
        "Most likely deviations: true less read values of the joints, then true less drawn ones.",
    )


def _residuals(found: Calibration) -> block.Table:
    """Return the residuals of each pose, as numbers and as bars."""
    sizes = np.sqrt(mean_squares(found.residuals))
    known = np.flatnonzero(np.isfinite(sizes))
    left_out = np.isin(known, found.outliers)
    most = max(1.0, float(sizes[known[~left_out]].max(initial=0.0)))
    looks: list[block.Look | None] = ["beyond" if out else None for out in left_out]
    kinds: list[block.Kind] = ["actuator" for _ in known]
    return block.Table(
        "Residuals by pose",
        (
            block.Names("pose", [str(1 + k) for k in known]),
            block.Column("residual", sizes[known].tolist(), "σ", DIGITS),
            block.Bars(np.minimum(sizes[known] / most, 1.0).tolist(), kinds),
        ),
        "Root mean squares, in standard deviations of what was measured; 1 is expected.",
        looks,
    )


def unseen_words(unseen: tuple[str, ...]) -> Iterator[str]:
    """Yield what a measurement does not show, and what that means."""
    frames = {name.split()[0] for name in unseen if name not in SOURCES} - {"guide"}
    if any("with" in name for name in unseen):
        yield "the zeros of d1 and d3 cannot be told from the guide's x, which changes no pose"
    for frame in sorted(frames):
        yield f"where the {frame}'s own frame is: positions count from where it was drawn"
    yield from (name for name in unseen if name in SOURCES)
