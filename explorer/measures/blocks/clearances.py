"""The clearances of the legs: in a pose, on a move and in a workspace."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from explorer.legs.clearance import PAIRS, pair_name
from explorer.measures.blocks.block import (
    Block,
    Column,
    Look,
    Names,
    Number,
    Statement,
    Table,
    Vector,
)
from explorer.measures.snapshot import Snapshot
from explorer.mechanism.configuration import tool_offset
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray

if TYPE_CHECKING:
    from explorer.legs.moves import MoveClearance
    from explorer.workspace.accessible.workspace import PairCost

# Digits of the largest clearance: the least one, of fewer digits, is what matters.
DIGITS = 5
CLEARANCE = "The distance of the axes less both radii; where it is negative, the legs collide."


def names_of(pairs: Iterable[bool]) -> str:
    """Return the names of some pairs of legs, given as truths as in `PAIRS`."""
    return ", ".join(pair_name(pair) for pair, is_in in zip(PAIRS, pairs, strict=True) if is_in)


def verdict(clearance: FloatArray, bound: FloatArray, design: Design, where: str = "") -> Statement:
    """Return whether legs collide, touch or are clear, and the least clearance.

    Args:
        clearance: Clearance of each pair in design units, shape (6,).
        bound: Lower bound of each, shape (6,).
        design: The manipulator.
        where: Words for where that is, after a blank.
    """
    title, look = f"Legs are clear{where}", "within"
    if (clearance < 0.0).any():
        title, look = f"Legs {names_of(clearance < 0.0)} collide{where}", "beyond"
    elif (bound <= 0.0).any():
        title, look = f"Legs {names_of(bound <= 0.0)} touch{where}", "close"
    pair = int(clearance.argmin())
    least, unit = float(clearance[pair]), design.unit_mm
    numbers = (
        Number(least, " units", 3, design.reach),
        ", ",
        Number(unit * least, " mm", 3, unit * design.reach),
    )
    return Statement(title, (f"Least clearance: legs {pair_name(PAIRS[pair])}, ", *numbers), look)


def _lengths(values: FloatArray, design: Design, *, wide: bool = False) -> tuple[Column, Column]:
    """Return clearances in design units and in millimetres, these `wide` or not."""
    reach, unit = design.reach, design.unit_mm
    return (
        Column("clearance", values.tolist(), " units", DIGITS, size=reach, infinite="joined"),
        Column("clearance", (unit * values).tolist(), " mm", DIGITS, size=unit * reach,
               infinite="", wide=wide),
    )  # fmt: skip


def _legs() -> Names:
    return Names("legs", [pair_name(pair) for pair in PAIRS])


def _looks(values: FloatArray) -> list[Look | None]:
    return ["beyond" if value < 0.0 else None for value in values.tolist()]


def _points(head: str, points: FloatArray) -> Names:
    return Names(head, [("(", Vector(point), ")") for point in points.tolist()], wide=True)


def pose_clearances(snapshot: Snapshot) -> Iterator[Block]:
    """Yield whether legs collide in a pose, and the clearance of each pair."""
    legs, design = snapshot.clearances, snapshot.design
    yield verdict(legs.clearance, legs.clearance, design)
    yield Table(
        "Clearance here",
        (
            _legs(),
            Column("axes apart", legs.distance.tolist(), " units", infinite="", wide=True),
            *_lengths(legs.clearance, design),
            _points("closest point of the first", legs.points[:, 0]),
            _points("of the second", legs.points[:, 1]),
        ),
        CLEARANCE,
        _looks(legs.clearance),
    )


def move_clearances(move: MoveClearance, design: Design) -> Iterator[Block]:
    """Yield whether legs collide on a move, by the exact test and the paper's, and where."""
    yield verdict(move.clearance, move.bound, design, " on the way")
    steps = "one step" if move.steps == 1 else f"{move.steps} steps"
    overlap = "no overlap" if move.is_free else f"overlap of {names_of(move.overlaps)}"
    yield Statement("", f"The paper's test in {steps}, without radii: {overlap}.")
    apart = np.isfinite(move.clearance)
    swept = np.where(apart, np.where(move.overlaps, "overlap", "free"), "")
    positions, rotations = move.poses
    yield Table(
        "Least clearance on the way, and where on the way",
        (
            _legs(),
            Names("swept tetrahedra", swept.tolist()),
            *_lengths(move.clearance, design, wide=True),
            Column("never below", move.bound.tolist(), " units", infinite="", wide=True),
            Column("at", np.where(apart, 100.0 * move.share, np.inf).tolist(), " %", 3,
                   infinite=""),
            _points("b4 there" if move.tool is None else "tool there",
                    positions + tool_offset(rotations, move.tool)),
        ),
        CLEARANCE,
        _looks(move.clearance),
    )  # fmt: skip


def workspace_clearances(pairs: Sequence[PairCost], design: Design) -> Iterator[Block]:
    """Yield whether legs collide in a workspace, and what each pair blocks; nothing if it is empty.

    Args:
        pairs: Least clearance and blocked volume of each pair, in the order of `PAIRS`.
        design: The manipulator.
    """
    clearance = np.array([pair.clearance for pair in pairs])
    if not np.isfinite(clearance).any():
        return
    yield verdict(clearance, clearance, design, " in the workspace")
    if (least := float(clearance.min())) > 0.0:
        radius = Number(0.5 * least, " units", 3)
        yield Statement("", ("No two legs collide if all radii grow by up to ", radius, "."))
    bounds, blocked = [pair.bound for pair in pairs], [pair.blocked_volume for pair in pairs]
    column = Column("blocked alone", blocked, " units³")
    yield Table(
        "Least clearance in the workspace",
        (
            _legs(),
            *_lengths(clearance, design),
            Column("certified", bounds, " units", DIGITS, infinite="", wide=True),
            *([column] if any(blocked) else ()),
        ),
        "Of all positions within the limits at this orientation; certified is a lower bound. A "
        "pair blocks alone the positions at which it collides, and those that it cuts off from the "
        "start.",
        _looks(clearance),
    )
