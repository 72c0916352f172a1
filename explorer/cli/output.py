"""The output of commands: one JSON object, or text in aligned columns.

The text has no colours, and its numbers have ASCII minus signs, so that they can be pasted back.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from explorer.cli.streams import write
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, yaw_pitch_roll_from_rotation
from explorer.numerics.number_text import format_ascii, format_fixed

if TYPE_CHECKING:
    from explorer.workspace.solids.solid import Solid


def write_json(answer: Mapping[str, object]) -> None:
    """Write the one JSON object of a command to standard output.

    Args:
        answer: Plain values, lists and mappings; arrays as lists, no NaN or infinity.
    """
    write(json.dumps(answer, allow_nan=False) + "\n")


def write_lines(*lines: str) -> None:
    """Write lines of text to standard output."""
    write("\n".join(lines) + "\n")


def table(rows: Sequence[Sequence[str]], align: str) -> str:
    """Return rows as lines of aligned columns.

    Args:
        rows: Rows of cells, all of the same length.
        align: One letter per column, "<" or ">".
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            f"{cell:{side}{width}}" for cell, side, width in zip(row, align, widths, strict=True)
        ).rstrip()
        for row in rows
    )


def figure(value: float, size: float = 0.0) -> str:
    """Return a number with six significant digits.

    Args:
        value: Number to write.
        size: Magnitude of the terms that it is computed from; rounding errors of it read 0.
    """
    return format_ascii(value, 6, size=size, padded=True)


def figures(values: Iterable[float]) -> list[str]:
    """Return numbers of equal unit with six significant digits."""
    listed = list(values)
    size = max(map(abs, listed), default=0.0)
    return [figure(value, size) for value in listed]


def degrees(values: Iterable[float]) -> list[str]:
    """Return angles in degrees with three decimals each, never a negative zero."""
    return [f"{format_fixed(value, 3)}°" for value in values]


def millimetres(design: Design, values: Iterable[float]) -> str:
    """Return lengths in design units as millimetres in brackets."""
    listed = [value * design.unit_mm for value in values]
    size = max(map(abs, listed), default=0.0)
    return f"[{', '.join(format_ascii(value, 6, size=size) for value in listed)} mm]"


def heading(design: Design) -> str:
    """Return the line that names the design and its unit."""
    # A name from a file may hold control sequences, which must not reach a terminal.
    name = "".join(letter if letter.isprintable() else "?" for letter in design.name)
    return f"{name} (1 unit = {design.unit_mm:g} mm, reach {design.reach:.6g})"


def pose_table(design: Design, pose: Pose) -> str:
    """Return three lines: position, quaternion and angles of a pose."""
    angles = yaw_pitch_roll_from_rotation(pose.rotation).tolist()
    position = f"{'  '.join(figures(pose.position))}  {millimetres(design, pose.position)}"
    return table(
        [
            ("position", position),
            ("quaternion", "  ".join(figures(pose.quaternion))),
            ("yaw pitch roll", "  ".join(degrees(angles))),
        ],
        "<<",
    )


DISAGREES = "its volume does not agree with the exact one"
"""The remark on a mesh that `explorer.workspace.solids.agreement` rejects."""


def mesh_json(solid: Solid) -> dict[str, object]:
    """Return the measures of a mesh as plain values."""
    return {
        "volume": solid.volume,
        "triangles": len(solid.faces),
        "watertight": solid.is_watertight,
    }
