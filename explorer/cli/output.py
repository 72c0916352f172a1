"""The output of commands: one JSON object, or text in aligned columns, and blocks as such text.

The text has no colours, and its numbers have ASCII minus signs, so that they can be pasted back.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import PurePath
from textwrap import indent
from typing import Any

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer.cli.streams import write
from explorer.measures.blocks import block as kinds
from explorer.measures.snapshot import Snapshot
from explorer.mechanism.configuration import tool_position
from explorer.mechanism.design import Design
from explorer.mechanism.folds import FOLDS, to_folds
from explorer.mechanism.pose import Pose, Triple
from explorer.mechanism.tilt_torsion import tilt_torsion_of
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_ascii


def write_json(answer: Mapping[str, object]) -> None:
    """Write the one JSON object of a command: plain values, structs, arrays and paths.

    Numbers that are not finite, such as the clearance of legs that share a joint, are null.
    """
    # By the standard library again, since its text is ASCII.
    write(json.dumps(json.loads(msgspec.json.encode(answer, enc_hook=_plain))) + "\n")


def _plain(value: Any) -> object:
    """Convert a value that JSON cannot hold: a path or an array."""
    return str(value) if isinstance(value, PurePath) else value.tolist()


def attributes(of: object, names: str) -> dict[str, Any]:
    """Return attributes of a value by their names, which spaces separate."""
    return {name: getattr(of, name) for name in names.split()}


def tool_json(pose: Pose, tool: Triple | None) -> dict[str, object]:
    """Return the position of the tool in a pose, nothing if the tool is None."""
    return {} if tool is None else {"tool_position": tool_position(pose, tool)}


def pose_json(pose: Pose, tool: Triple | None = None) -> dict[str, object]:
    """Return positions, quaternion, and in degrees azimuth, tilt, torsion and folds of a pose."""
    return {
        "position": pose.position,
        **tool_json(pose, tool),
        "quaternion": pose.quaternion,
        "tilt_torsion": tilt_torsion_of(pose.rotation),
        "folds": folds_in_degrees(pose.position, pose.rotation),
    }


def folds_in_degrees(position: ArrayLike, rotation: ArrayLike) -> FloatArray:
    """Return the fold coordinates of poses as `--folds` takes them, shape (..., 6)."""
    folds = to_folds(position, rotation)
    folds[..., 1:] = np.degrees(folds[..., 1:])
    return folds


def limits_json(snapshot: Snapshot) -> dict[str, object]:
    """Return whether a pose is within the limits, and the limits that it violates."""
    violations = [str(violation) for violation in snapshot.violations]
    return {"within_limits": not violations, "violations": violations}


def limits_lines(snapshot: Snapshot, subject: str = "") -> Iterator[str]:
    """Yield whether a pose is within the limits, after a subject, and the limits it violates."""
    kept = "within the limits, but singular" if snapshot.is_singular else "within the limits"
    yield f"{subject}{'outside the limits:' if snapshot.violations else kept}"
    yield from (f"  {violation}" for violation in snapshot.violations)


def table(rows: Sequence[Sequence[str]], align: str) -> str:
    """Return rows of equally many cells as aligned columns, with a letter "<" or ">" for each."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            f"{cell:{side}{width}}" for cell, side, width in zip(row, align, widths, strict=True)
        ).rstrip()
        for row in rows
    )


def figure(value: float, size: float = 0.0) -> str:
    """Return a number with six significant digits; rounding errors of terms of a size read 0."""
    return format_ascii(value, 6, size=size, padded=True)


def lengths(design: Design, value: float, size: float = 0.0) -> tuple[str, str]:
    """Return a length in design units and in millimetres, as `figure` writes it."""
    return figure(value, size), figure(value * design.unit_mm, size * design.unit_mm)


def figures(values: Iterable[float]) -> list[str]:
    """Return numbers of equal unit with six significant digits."""
    numbers = list(values)
    size = max(map(abs, numbers), default=0.0)
    return [figure(number, size) for number in numbers]


def degrees(values: Iterable[float]) -> list[str]:
    """Return angles in degrees with three decimals each, never a negative zero."""
    return [f"{value:z.3f}°" for value in values]


def heading(design: Design) -> str:
    """Return the line that names the design and its unit."""
    # A name from a file may hold control sequences, which must not reach a terminal.
    name = "".join(letter if letter.isprintable() else "?" for letter in design.name)
    return f"{name} (1 unit = {design.unit_mm:g} mm, reach {design.reach:.6g})"


def assumed_lines(assumed: Sequence[str]) -> Iterator[str]:
    """Yield the line that says which typical values are assumed, if any are."""
    if assumed:
        yield f"assumed, since the design states none: {'; '.join(assumed)}"


def pose_table(design: Design, pose: Pose, tool: Triple | None = None) -> str:
    """Return position, quaternion, angles and folds of a pose, and where its tool is."""
    angles = pose.yaw_pitch_roll
    r, *folds = folds_in_degrees(pose.position, pose.rotation).tolist()
    positions = [("position", _position(design, pose.position))]
    if tool is not None:
        positions.append(("tool position", _position(design, tool_position(pose, tool))))
    return table(
        [
            *positions,
            ("quaternion", "  ".join(figures(pose.quaternion))),
            ("yaw pitch roll", "  ".join(degrees(angles))),
            ("azimuth tilt torsion", "  ".join(degrees(tilt_torsion_of(pose.rotation)))),
            (" ".join(FOLDS), "  ".join([figure(r), *degrees(folds)])),
        ],
        "<<",
    )


def _position(design: Design, position: Triple) -> str:
    """Return a position in design units and in millimetres."""
    millimetres = [value * design.unit_mm for value in position]
    size = max(map(abs, millimetres))
    in_mm = ", ".join(format_ascii(value, 6, size=size) for value in millimetres)
    return f"{'  '.join(figures(position))}  [{in_mm} mm]"


def radii_line(design: Design) -> str:
    """Return the line of the radii of the legs, in design units."""
    return f"radii of the legs  {'  '.join(f'{radius:.6g}' for radius in design.limits.leg_radii)}"


DISAGREES = "its volume does not agree with the exact one"
"""The remark on a mesh that `explorer.workspace.solids.solids` rejects."""


def block_lines(blocks: Iterable[kinds.Block]) -> Iterator[str]:
    """Yield blocks as lines, each below an empty one."""
    for block in blocks:
        yield ""
        match block:
            case kinds.Statement(title, words):
                yield f"{text_of(title)}{': ' if title and words else ''}{text_of(words)}"
            case kinds.Facts(title, facts, hint):
                rows = [(fact.name, text_of(fact.words), text_of(fact.remark)) for fact in facts]
                yield from (title, *[hint] * bool(hint), table(rows, "<<<"))
            case kinds.Table(title, _, hint, _):
                yield from (title, *[hint] * bool(hint), _table(block))
            case kinds.Split(title, names, shares):
                parts = (
                    f"{name} {_share(share)}" for name, share in zip(names, shares, strict=True)
                )
                yield f"{title}: {', '.join(parts)}"


def text_of(words: kinds.Words) -> str:
    """Return words with the numbers in them as text."""
    text = ""
    for part in kinds.parts_of(words):
        match part:
            case str():
                text += part
            case kinds.Number():
                text += f"{_figure(part.value, part.size or part.span, '∞')}{part.unit}"
            case kinds.Vector():
                text += f"{'  '.join(figures(part.values))}{part.unit}"
            case kinds.Share():
                text += _share(part.value)
    return text


def _share(share: float | None) -> str:
    return kinds.Share(share).text(1).replace("\N{NO-BREAK SPACE}", " ").replace("∞", "infinite")


def _figure(value: float, size: float, infinite: str) -> str:
    return figure(value, size) if math.isfinite(value) else infinite.replace("∞", "infinite")


def _table(block: kinds.Table) -> str:
    """Return a table without its bars."""
    columns: list[list[str]] = []
    align = ""
    for column in block.columns:
        match column:
            case kinds.Names(_, words, _):
                cells = [text_of(each) for each in words]
            case kinds.Column():
                cells = [_figure(value, column.size, column.infinite) for value in column.values]
                if not column.has_one_unit:
                    around = zip(column.around, cells, strict=True)
                    cells = [f"{before}{text}{unit}" for (before, unit), text in around]
            case kinds.Shares(_, values):
                cells = [_share(value) for value in values]
            case kinds.Bars():
                continue
        columns.append([kinds.head_of(column), *cells])
        align += "<" if isinstance(column, kinds.Names) else ">"
    return table(list(zip(*columns, strict=True)), align)


def end_lines(design: Design, start: Pose, end: Pose, tool: Triple | None) -> Iterator[str]:
    """Yield the two ends of a move or a path."""
    for name, pose in (("from", start), ("to", end)):
        yield from (name, indent(pose_table(design, pose, tool), "  "))
