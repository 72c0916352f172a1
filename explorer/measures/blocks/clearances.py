"""The clearances of the legs: in a pose, on a move and in a workspace."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from explorer.legs.clearance import PAIRS, pair_name
from explorer.measures.blocks import block
from explorer.measures.snapshot import Snapshot
from explorer.mechanism.configuration import tool_offset
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import Unit

if TYPE_CHECKING:
    from explorer.legs.moves import MoveClearance
    from explorer.workspace.accessible.workspace import PairCost

# Digits of the largest clearance: the least one, of fewer digits, is what matters.
DIGITS = 5
CLEARANCE = "The distance of the axes less both radii; where it is negative, the legs collide."


def names_of(pairs: Iterable[bool]) -> str:
    """Return the names of some pairs of legs, given as truths as in `PAIRS`."""
    return ", ".join(pair_name(pair) for pair, is_in in zip(PAIRS, pairs, strict=True) if is_in)


def verdict(
    clearance: FloatArray, bound: FloatArray, design: Design, unit: Unit, where: str = ""
) -> block.Statement:
    """Return whether legs collide, touch or are clear, and the least clearance, in words.

    Clearances and their lower bounds, shape (6,), are in design units. The words for where that is
    follow a blank.
    """
    title, look = f"Legs are clear{where}", "within"
    if (clearance < 0.0).any():
        title, look = f"Legs {names_of(clearance < 0.0)} collide{where}", "beyond"
    elif (bound <= 0.0).any():
        title, look = f"Legs {names_of(bound <= 0.0)} touch{where}", "close"
    pair = int(clearance.argmin())
    least = block.quantity(float(clearance[pair]), unit, 3, size=design.reach)
    return block.Statement(
        title, (f"Least clearance: legs {pair_name(PAIRS[pair])}, ", least), look
    )


def _table(
    title: str,
    values: FloatArray,
    design: Design,
    unit: Unit,
    before: Iterable[block.Names | block.Column] = (),
    after: Iterable[block.Names | block.Column] = (),
    hint: str = CLEARANCE,
) -> block.Table:
    """Return a table of clearances; where there is room, in design units too."""
    reach = design.reach
    columns = (
        block.Names("legs", [pair_name(pair) for pair in PAIRS]),
        *before,
        block.Column("clearance", values.tolist(), " units", DIGITS, size=reach, infinite="joined",
                     wide=True),
        block.Column("clearance", (unit.factor * values).tolist(), f" {unit.name}", DIGITS,
                     size=unit.factor * reach, infinite="joined"),
        *after,
    )  # fmt: skip
    looks: list[block.Look | None] = [
        "beyond" if value < 0.0 else None for value in values.tolist()
    ]
    return block.Table(title, columns, hint, looks)


def _points(head: str, points: FloatArray) -> block.Names:
    words = [("(", block.Vector(point), ")") for point in points.tolist()]
    return block.Names(head, words, wide=True)


def pose_clearances(snapshot: Snapshot, unit: Unit | None = None) -> Iterator[block.Block]:
    """Yield whether legs collide in a pose, and the clearance of each pair; in mm unless told."""
    legs, design = snapshot.clearances, snapshot.design
    unit = unit or design.millimetres
    yield verdict(legs.clearance, legs.clearance, design, unit)
    apart = block.Column("axes apart", legs.distance.tolist(), " units", infinite="", wide=True)
    points = (
        _points("closest point of the first", legs.points[:, 0]),
        _points("of the second", legs.points[:, 1]),
    )
    yield _table("Clearance here", legs.clearance, design, unit, (apart,), points)


def move_clearances(
    move: MoveClearance, design: Design, unit: Unit | None = None
) -> Iterator[block.Block]:
    """Yield whether legs collide on a move, by the exact test and the paper's, and where."""
    unit = unit or design.millimetres
    yield verdict(move.clearance, move.bound, design, unit, " on the way")
    steps = "one step" if move.steps == 1 else f"{move.steps} steps"
    overlap = "no overlap" if move.is_free else f"overlap of {names_of(move.overlaps)}"
    yield block.Statement("", f"The paper's test in {steps}, without radii: {overlap}.")
    apart = np.isfinite(move.clearance)
    swept = np.where(apart, np.where(move.overlaps, "overlap", "free"), "")
    positions, rotations = move.poses
    places = np.where(apart, 100.0 * move.share, np.inf).tolist()
    yield _table(
        "Least clearance on the way, and where on the way",
        move.clearance,
        design,
        unit,
        (block.Names("swept tetrahedra", swept.tolist()),),
        (
            block.Column("never below", move.bound.tolist(), " units", infinite="", wide=True),
            block.Column("at", places, " %", 3, infinite=""),
            _points(
                "b4 there" if move.tool is None else "tool there",
                positions + tool_offset(rotations, move.tool),
            ),
        ),
    )


def workspace_clearances(
    pairs: Sequence[PairCost], design: Design, unit: Unit | None = None
) -> Iterator[block.Block]:
    """Yield whether legs collide in a workspace, and what each pair blocks; nothing if it is empty.

    The pairs are in the order of `PAIRS`; lengths are in mm unless another unit is given.
    """
    unit = unit or design.millimetres
    clearance = np.array([pair.clearance for pair in pairs])
    if not np.isfinite(clearance).any():
        return
    yield verdict(clearance, clearance, design, unit, " in the workspace")
    if (least := float(clearance.min())) > 0.0:
        radius = block.quantity(0.5 * least, unit, 3)
        yield block.Statement("", ("No two legs collide if all radii grow by up to ", radius, "."))
    bounds, blocked = [pair.bound for pair in pairs], [pair.blocked_volume for pair in pairs]
    cubic = unit.to_power(3, design.reach**3)
    values = [cubic.factor * volume for volume in blocked]
    column = block.Column("blocked alone", values, f" {cubic.name}")
    certified = block.Column("certified", bounds, " units", DIGITS, infinite="", wide=True)
    yield _table(
        "Least clearance in the workspace",
        clearance,
        design,
        unit,
        after=(certified, column) if any(blocked) else (certified,),
        hint="Of all positions within the limits at this orientation; certified is a lower bound. "
        "A pair blocks alone the positions at which it collides, and those that it cuts off from "
        "the start.",
    )
