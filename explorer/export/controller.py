"""The kernel for controllers: the kinematics of one design as C99 source, in millimetres.

The templates `flagged44.h.in` and `flagged44.c.in` hold the formulas of `explorer.mechanism` and of
the limits; what is filled in here are the numbers of the design and the words about them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from string import Template

import numpy as np

from explorer import __version__
from explorer.files.packaged import packaged_file
from explorer.legs.clearance import PAIRS
from explorer.mechanism.built_machine import BuiltMachine
from explorer.mechanism.design import VARIABLES, Design, Swing
from explorer.mechanism.margins import margins, mode_of
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.statics.accuracy import IS_TILT
from explorer.workspace.limits import quantities
from explorer.workspace.limits.table import demands_of
from explorer.workspace.limits.valid_poses import Rules

ASCII = str.maketrans("\u2212", "-", "°")
KERNEL_FILES = ("flagged44.h", "flagged44.c")

LIMIT_NAMES = (
    *("X", "Y", "Z", "DELTA1", "DELTA2", "DELTA3", "D1", "D3", "GAP", "ORDER"),
    *("L1", "D2", "D4", "L4"),
    *(f"SWING_{joint.upper()}" for joint in Swing.__struct_fields__),
    *(f"LEGS_{first}{second}" for first, second in PAIRS),
)
"""The limits in the order of their bits: the quantities by their indices, which are in
`explorer.workspace.limits.quantities`, with an angle for each joint, and the pairs of legs. In C
each name begins with `F44_`."""


def kernel_files(design: Design, machine: BuiltMachine | None = None) -> dict[str, bytes]:
    """Return header and source of the kernel of a design, by the names of the files.

    They have the deviations of a machine that was built of it, if one is given.
    """
    unit, pose = design.unit_mm, design.home_pose
    deviations = (machine or BuiltMachine(design)).deviations
    rows, axes, words = limit_rows(design)
    radii, pair_words = pair_rows(design)
    variables = [unit * value for value in design.variables]
    fields = {
        **dict(zip(VARIABLES, map(_number, variables), strict=True)),
        # Without rounding, for people.
        **{name.upper(): f"{value:.10g}" for name, value in zip(VARIABLES, variables, strict=True)},
        # No name ends the comment that it stands in.
        "name": design.name.replace("*", "\u2217"),
        "version": __version__,
        "mode": mode_of(margins(pose.position, pose.rotation)),
        "position": _numbers(unit * np.array(pose.position)),
        "rotation": ",\n *             ".join(map(_numbers, pose.rotation + 0.0)),
        "size": _number(max(map(abs, variables))),
        "ranges": _table(rows),
        "deviations": _numbers(np.where(IS_TILT, deviations, unit * deviations)),
        "axes": _table(axes),
        "radii": _numbers(radii),
        "bits": "\n".join(
            # Compilers of some code pages warn of other letters than those of ASCII.
            f"    F44_{name} = 1u << {bit}, /* {text.translate(ASCII) or 'no limit'} */"
            for bit, (name, text) in enumerate(zip(LIMIT_NAMES, words + pair_words, strict=True))
        ),
    }
    return {name: fill_template(f"{name}.in", fields) for name in KERNEL_FILES}


def read_template(file: str) -> str:
    """Return the text of a file of the folder `templates`."""
    return packaged_file("export/templates", file).read_text("utf-8")


def fill_template(file: str, fields: Mapping[str, object]) -> bytes:
    """Return a file of the folder `templates` with fields filled in."""
    return Template(read_template(file)).substitute(fields).encode()


def limit_rows(design: Design) -> tuple[FloatArray, FloatArray, list[str]]:
    """Return ranges (20, 2), axes of the swings (6, 3) and words of the limits of a design.

    The ranges are in millimetres and radians, widened by the tolerance, infinite without a limit.
    They are in the order of `LIMIT_NAMES` without the pairs of legs. The axes are unit vectors in
    the base (a1, a3) or on the platform (b1 to b4). Axes are zero and words empty without a limit.
    """
    swings = Swing.__struct_fields__
    count = quantities.ANGLE + len(swings)
    ranges = np.tile([-math.inf, math.inf], (count, 1))
    axes, words = np.zeros((len(swings), 3)), [""] * count
    for demand in demands_of(design):
        row, index, unit = np.array(demand.row(design)), demand.quantity, design.unit_mm
        if demand.angle is not None:
            swing = swings.index(demand.name.removeprefix("swing "))
            axes[swing] = row[quantities.AXIS_X : quantities.AXIS_X + 3]
            index, unit = index + swing, 1.0
        ranges[index] = unit * row[[quantities.LOW, quantities.HIGH]]
        words[index] = demand.words(design.unit_mm)
    return ranges, axes, words


def pair_rows(design: Design) -> tuple[FloatArray, list[str]]:
    """Return the least distances of the axes of pairs of legs, shape (6,), in mm, and their words.

    A pair that shares a joint may touch: its distance is negative and its words are empty.
    """
    distances = design.unit_mm * Rules.of(design).row[quantities.RADII :]

    def words(least: float) -> str:
        apart = f"more than {format_number(least)} apart" if least else "do not touch"
        return "" if least < 0.0 else apart

    return distances, [*map(words, distances.tolist())]


def _number(value: float) -> str:
    """Return a number as C, with all its digits."""
    if math.isinf(value):
        return "HUGE_VAL" if value > 0.0 else "-HUGE_VAL"
    return repr(float(value))


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(map(_number, values))


def _table(rows: FloatArray) -> str:
    return "\n".join(f"    {{{_numbers(row)}}}," for row in rows.tolist())
