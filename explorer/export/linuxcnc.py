"""The configuration for LinuxCNC: kinematics around the kernel, HAL and INI files and a README.

The templates in the folder `linuxcnc` hold everything but the numbers of the design.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal

import numpy as np

from explorer import __version__
from explorer.errors import NoAnswerError
from explorer.export.controller import LIMIT_NAMES, fill_template, kernel_files
from explorer.mechanism.built_machine import BuiltMachine
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import GUIDE_ROWS, JOINTS, Design
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import margins, mode_of
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import drop_rounding
from explorer.statics.accuracy import IS_TILT, SOURCES, UNITS, drawing_values
from explorer.workspace.limits.valid_poses import violations

LINUXCNC_FILES = (
    *("README.txt", "flagged44.ini", "flagged44.hal", "flagged44.tbl"),
    "flagged44kins.comp",
)
"""The files besides those of the kernel."""

AXES = "XYZABC"

# Ranges of A, B and C in degrees. Beyond ±90 the angle B repeats poses; A and C may go on beyond a
# half turn.
ANGLES = ((-360.0, 360.0), (-90.0, 90.0), (-360.0, 360.0))

# Seconds in which X, Y and Z cross the reach, and in which axes and joints come to their speed.
CROSS_SECONDS, START_SECONDS = 8.0, 0.1

# X, Y and Z may cut corners by the reach over this number.
BLENDS = 20_000.0

# Significant digits of the larger end of a range; both are rounded outwards.
LIMIT_DIGITS = 12

# No joint is faster than three times X, Y and Z, even if all six axes move at their speeds at once.
JOINT_SPEED_RATIO = 3.0


def linuxcnc_files(design: Design, machine: BuiltMachine | None = None) -> dict[str, bytes]:
    """Return the files of the configuration of a design, with its kernel, by their names.

    The component has the deviations of a machine that was built of it, if one is given.

    Raises:
        NoAnswerError: The home pose, in which LinuxCNC begins, breaks limits or is singular.
    """
    _check_home(design)
    pose, unit = design.home_pose, design.unit_mm
    home = unit * inverse(design, pose.position, pose.rotation)
    angles = pose.yaw_pitch_roll[::-1]
    at = np.array([*(unit * np.array(pose.position)), *angles])
    world = list(map(_number, at, [*3 * [unit * design.reach], *3 * [360.0]]))
    axes, joints = axis_ranges(design), joint_ranges(design)
    linear, angular = axis_speeds(design)
    deviations = drawing_values(design, (machine or BuiltMachine(design)).deviations).tolist()
    parameters = [name.replace(" ", "_") for name in SOURCES]
    speeds, slack = 3 * [linear] + 3 * [angular], unit * design.tolerance
    fields = {
        "name": design.name,
        "version": __version__,
        "mode": mode_of(margins(pose.position, pose.rotation)),
        "signs": ", ".join("positive" if sign > 0 else "negative" for sign in design.home_signs),
        "names": "\n".join(f'    "{name.lower().replace("_", " ")}",' for name in LIMIT_NAMES),
        "parameters": "\n".join(
            f'param rw float {name} = {value!r} "Deviation in {unit_name}";'
            for name, unit_name, value in zip(parameters, UNITS, deviations, strict=True)
        ),
        "deviations": "\n".join(
            f"        {'DEGREE * ' if is_tilt else ''}hal->{name},"
            for name, is_tilt in zip(parameters, IS_TILT, strict=True)
        ),
        "home": " ".join(world),
        "move": " ".join(map("".join, zip(AXES, world, strict=True))),
        "blend": _number(float(f"{unit * design.reach / BLENDS:.1g}")),
        "linear": _number(linear),
        "angular": _number(angular),
        "jog": _number(linear / 2.0),
        "jog_angular": _number(angular / 2.0),
        "feed": _number(30.0 * linear),
        "joint": _number(JOINT_SPEED_RATIO * linear),
        "linear_acceleration": _number(linear / START_SECONDS),
        "angular_acceleration": _number(angular / START_SECONDS),
        "axis_rows": _table(AXES, axes, at),
        "joint_rows": _table(JOINTS, joints, home),
        "axis_sections": "\n".join(
            f"[AXIS_{axis}]\n{_range_lines(row, each, speed)}"
            for axis, row, each, speed in zip(
                AXES, axes, 3 * [slack] + 3 * [0.0], speeds, strict=True
            )
        ),
        "joint_sections": "\n".join(
            f"[JOINT_{index}]\n# {name}\nTYPE = LINEAR\n"
            f"{_range_lines(row, slack, JOINT_SPEED_RATIO * linear)}"
            f"HOME = {_number(at)}\nHOME_OFFSET = {_number(at)}\nHOME_SEQUENCE = 0\n"
            for index, (name, row, at) in enumerate(zip(JOINTS, joints, home, strict=True))
        ),
    }
    own = {name: fill_template(f"linuxcnc/{name}.in", fields) for name in LINUXCNC_FILES}
    return own | kernel_files(design, machine)


def axis_ranges(design: Design) -> FloatArray:
    """Return the ranges of X, Y and Z in mm and of A, B and C in degrees, shape (6, 2).

    Without a box of the design, X, Y and Z have the ranges in which b4 stays with the longest legs
    1 and 4, whatever the orientation.
    """
    if design.limits.box is not None:
        lows, highs = np.array(design.limits.box)
    else:
        from_a1 = design.length_range("l1")[1] + math.hypot(*design.b1)
        from_a3, a3 = design.length_range("l4")[1], np.array((*design.a3, 0.0))
        lows = np.maximum(-from_a1, a3 - from_a3)
        highs = np.minimum(from_a1, a3 + from_a3)
    return np.vstack([design.unit_mm * np.column_stack([lows, highs]), ANGLES])


def joint_ranges(design: Design) -> FloatArray:
    """Return the ranges of the joints in mm, shape (6, 2).

    Without a range of the guide, a carriage has the one that no pose within the axes leaves.
    """
    ranges = np.empty((len(JOINTS), 2))
    low, high = axis_ranges(design)[0] / design.unit_mm
    for index, name in enumerate(JOINTS):
        if index not in GUIDE_ROWS:
            ranges[index] = design.length_range(name)
        elif design.limits.guide is not None:
            ranges[index] = design.limits.guide
        else:
            radius = abs(design.b2 if name == "d1" else design.b3)
            ranges[index] = low - radius, high + radius
    return design.unit_mm * ranges


def axis_speeds(design: Design) -> tuple[float, float]:
    """Return speeds of X, Y and Z in mm/s and of A, B and C in degrees/s, to begin with.

    The three angles together move no point of the platform faster than the linear speed.
    """
    linear = float(f"{design.unit_mm * design.reach / CROSS_SECONDS:.2g}")
    radius = design.unit_mm * float(np.linalg.norm(design.platform_points, axis=1).max())
    return linear, float(f"{math.degrees(linear / (3.0 * radius)):.2g}")


def _check_home(design: Design) -> None:
    pose = design.home_pose
    if np.abs(margins(pose.position, pose.rotation)).min() <= design.tolerance:
        raise NoAnswerError(
            "LinuxCNC begins in the home pose, which is singular, so that no assembly mode is its "
            "own; choose another home pose"
        )
    (broken,) = violations(Configuration.at(design, pose))
    if broken:
        words = "; ".join(each.words(design.millimetres) for each in broken)
        raise NoAnswerError(
            f"LinuxCNC begins in the home pose, which breaks limits: {words}. Choose a home pose "
            "within the limits"
        )


def _number(value: float, size: float = 0.0, digits: int = 15) -> str:
    """Return a number of significant digits without a power of ten, which G-code cannot have.

    The size is that of the numbers from which it was computed, see `drop_rounding`.
    """
    value = drop_rounding(value, size)
    return np.format_float_positional(value, digits, fractional=False, trim="-")


def _range_lines(row: FloatArray, slack: float, speed: float) -> str:
    """Return the lines of a range and of a speed.

    The range is wider by the slack and rounded outwards, so that a home pose at an end lies in it.
    """
    decimals = LIMIT_DIGITS - 1 - math.floor(math.log10(max(slack, *np.abs(row))))
    low, high = (
        f"{Decimal(float(end)).quantize(Decimal(1).scaleb(-decimals), rounding).normalize() + 0:f}"
        for end, rounding in ((row[0] - slack, ROUND_FLOOR), (row[1] + slack, ROUND_CEILING))
    )
    return (
        f"MIN_LIMIT = {low}\nMAX_LIMIT = {high}\n"
        f"MAX_VELOCITY = {_number(speed)}\nMAX_ACCELERATION = {_number(speed / START_SECONDS)}\n"
    )


def _table(names: Iterable[str], ranges: FloatArray, home: FloatArray) -> str:
    """Return rows of a text: the name, the least value, that at home, the greatest."""
    rows = np.column_stack([ranges[:, 0], home, ranges[:, 1]])
    sizes = np.abs(rows).max(axis=1)
    return "\n".join(
        f"    {name:<5}{''.join(f'{_number(each, size, 9):>14}' for each in row)}"
        for name, row, size in zip(names, rows, sizes, strict=True)
    )
