"""Tables by name, in JSON files and in settings of LinuxCNC, and the twin of a design.

LinuxCNC's `genhexkins` is set by lines such as `setp genhexkins.base.0.x -22.95`, or
`genhexkins.base.0.x = -22.95`. They have no unit, home or strokes, so that these are assumed, and
the table's source tells how. A line of the INI file beside them, `LINEAR_UNITS = inch`, makes the
numbers inches.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import msgspec
import numpy as np

from explorer.errors import InputError, StorageError
from explorer.files.json_text import decode_strictly, field_names, located_errors
from explorer.files.packaged import packaged_files
from explorer.files.writing import read_at_most
from explorer.measures.measure import longest_leg
from explorer.mechanism.design import LENGTHS, Design
from explorer.numerics.arrays import FloatArray, triple
from explorer.numerics.checks import number
from explorer.six_legged.table import (
    LONGEST,
    LONGEST_SOURCE,
    MOST_CONE,
    SixLegged,
    TableHome,
    table_of,
)

TWIN = (("a1", "b1"), ("a1", "b2"), ("a1", "b3"), ("a2", "b2"), ("a2", "b3"), ("a3", "b4"))
"""The six legs of the 6-4 twin, base point and platform point (the paper's Figure 1a)."""

FIELD = "base_mm"
"""A field that no other kind of file has."""

INCH = 25.4

# Least stroke to which a table is made equal, in millimetres.
LEAST_STROKE = 1e-3

# Number of the settings. Height of the assumed home over the distance of the farthest base point
# from the origin, and the lengths of the legs over those at home.
COORDINATES, HEIGHT, STROKE = 36, 0.75, (0.5, 1.5)
SETTING = re.compile(r"(?:setp\s+)?genhexkins\.(base|platform)\.(\w+)\.(\w+)(?:\s*=\s*|\s+)(\S+)")
IS_SETTING = re.compile(r"\bgenhexkins\.(base|platform)\.")
LINEAR_UNITS = re.compile(r"LINEAR_UNITS\s*=\s*(\w+)", re.IGNORECASE)
UNITS = {"mm": 1.0, "metric": 1.0, "in": INCH, "inch": INCH, "imperial": INCH}


def decode_table(data: bytes, source: str) -> SixLegged:
    """Return the table in a JSON text or in lines of a HAL file; errors name their source.

    Raises:
        InputError: The text is neither, has unknown, repeated or unusable fields, or its table is
            none that could be built.
    """
    if FIELD in field_names(data):
        return decode_strictly(data, SixLegged, source)
    with located_errors(data, SixLegged, source) as text:
        settings, unit = _hal_settings(text)
        if not settings:
            raise InputError(
                f"the file holds no table on six legs: give JSON with {FIELD}, platform_mm, "
                "shortest_mm, longest_mm and home, or lines of a HAL file such as "
                "setp genhexkins.base.0.x -22.95"
            )
        # What is not set has LinuxCNC's own number.
        default = TABLES["LinuxCNC default"]
        points = {
            "base": np.array(default.base_mm) * unit / INCH,
            "platform": np.array(default.platform_mm) * unit / INCH,
        }
        for (part, leg, axis), value in settings.items():
            name = f"genhexkins.{part}.{leg}.{axis}"
            if leg not in tuple("012345") or axis not in tuple("xyz"):
                raise InputError(f"{name} is unknown; legs are 0 to 5, axes x, y and z")
            amount: float | str = value
            with contextlib.suppress(ValueError):
                amount = float(value)
            points[part][int(leg), "xyz".index(axis)] = unit * number(name, amount)
        words = f"LinuxCNC's settings, in {'inches' if unit == INCH else 'mm'}"
        if len(settings) < COORDINATES:
            words += f", {COORDINATES - len(settings)} of {COORDINATES} of them its defaults"
        return _with_assumed_home(points["base"], points["platform"], words)


def _hal_settings(text: str) -> tuple[dict[tuple[str, str, str], str], float]:
    """Return the settings in lines of a HAL file by part, leg and axis, and their millimetres."""
    settings: dict[tuple[str, str, str], str] = {}
    names: set[str] = set()
    for line in text.splitlines():
        words, _, comment = (part.strip() for part in line.partition("#"))
        if found := SETTING.fullmatch(words):
            part, leg, axis, value = found.groups()
            settings[part, leg, axis] = value
        elif IS_SETTING.search(words):
            raise InputError(
                f"the line {words[:60]!r} cannot be read; a setting is like setp "
                "genhexkins.base.0.x -22.95"
            )
        # No command of a HAL file, so that it may be a comment there.
        elif found := LINEAR_UNITS.fullmatch(words or comment):
            names.add(found[1].lower())
    units = {UNITS.get(name) for name in names} or {1.0}
    unit = units.pop()
    if units or unit is None:
        raise InputError(
            f"LINEAR_UNITS is {' and '.join(sorted(names))}; give one of {', '.join(UNITS)}"
        )
    return settings, unit


def _with_assumed_home(base: FloatArray, platform: FloatArray, source: str) -> SixLegged:
    """Return a table with an assumed home and strokes; its source tells them."""
    height = float(base[:, 2].mean()) + HEIGHT * float(np.linalg.norm(base, axis=1).max())
    legs = platform + [0.0, 0.0, height] - base
    lengths = np.linalg.norm(legs, axis=1)
    return table_of(
        name="genhexkins",
        base_mm=base,
        platform_mm=platform,
        shortest_mm=STROKE[0] * lengths,
        longest_mm=STROKE[1] * lengths,
        home=TableHome((0.0, 0.0, height)),
        source=f"{source}; assumed are a level home at z = {height:.4g} mm and legs of "
        f"{STROKE[0]:g} to {STROKE[1]:g} times their lengths there",
    )


def load_table(name_or_file: str | Path) -> SixLegged:
    """Return a packaged table by name, or the table in a JSON or HAL file.

    Raises:
        InputError: There is no such table, or the file cannot be read or holds none.
    """
    if str(name_or_file) in TABLES:
        return TABLES[str(name_or_file)]
    try:
        data = read_at_most(Path(name_or_file))
    except StorageError as error:
        raise InputError(f"{error}; the packaged tables are {', '.join(TABLES)}") from None
    return decode_table(data, str(name_or_file))


def six_four_twin(design: Design, a2x: float, longest: float | None = None) -> SixLegged:
    """Return the 6-4 twin of a design: each leg along the guide becomes two, from a1 and from a2.

    The 4-4 leaves a2x free. Every leg is at most as long as the design's longest one, if no other
    length is given; both are in design units. The modes of the twin are those of the design, by the
    signs of its margins.
    """
    flat = {"a2": (a2x, 0.0), "a3": design.a3, "b1": design.b1}
    flat |= {"b2": (design.b2, 0.0), "b3": (design.b3, 0.0)}
    base, platform = ([(*flat.get(pair[end], (0.0, 0.0)), 0.0) for pair in TWIN] for end in (0, 1))
    unit, home = design.unit_mm, design.home_pose
    return table_of(
        name=f"6-4, a2x = {a2x:.4g}",
        base_mm=unit * np.array(base),
        platform_mm=unit * np.array(platform),
        shortest_mm=(0.0,) * 6,
        longest_mm=(unit * (longest or longest_leg(design)),) * 6,
        home=TableHome(triple(unit * np.array(home.position)), home.quaternion),
    )


def made_equal(table: SixLegged, design: Design) -> SixLegged:
    """Return a table with the stroke and the cones of a design, so that both can be compared.

    Each leg has the longest stroke of the design's l1, d2, d4 and l4, which is a micrometre at
    least, half of it to either side of its length at home, or from zero on if that is shorter. Each
    cone is the least of the design's swings; there are none if the design has none, or a leg no
    length at home. The source of the table tells what was made.
    """
    ranges = [design.length_range(name) for name in LENGTHS]
    stroke = max(LEAST_STROKE, design.unit_mm * max(high - low for low, high in ranges))
    shortest = np.maximum(0.0, table.home_lengths - 0.5 * stroke)
    longest = np.minimum(shortest + stroke, LONGEST)
    swings = [angle for angle in msgspec.structs.astuple(design.limits.swing) if angle is not None]
    cone = min(*swings, MOST_CONE) if swings and table.home_lengths.all() else None
    cones = "no cones" if cone is None else f"cones of {cone:g}°"
    words = f"made equal to {design.name}: strokes of {stroke:.4g} mm about home's lengths, {cones}"
    return msgspec.structs.replace(
        table,
        shortest_mm=shortest,
        longest_mm=longest,
        cones_deg=None if cone is None else (cone,) * 6,
        source=f"{table.source[: LONGEST_SOURCE // 2]}; {words}" if table.source else words,
    )


_FILES = packaged_files("tables", ".json")
TABLES: Mapping[str, SixLegged] = MappingProxyType(
    {
        table.name: table
        for table in (decode_strictly(file.read_bytes(), SixLegged, file.name) for file in _FILES)
    }
)
"""The packaged tables, by name."""
