"""Tables by name, in JSON files and in settings of LinuxCNC, and the twin of a design.

LinuxCNC's `genhexkins` is set by lines such as `setp genhexkins.base.0.x -22.95`. They have no
unit, home or strokes, so that these are assumed, and the table's source tells how. A line of the
INI file beside them, `LINEAR_UNITS = inch`, makes the numbers inches.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import msgspec
import numpy as np

from explorer.errors import InputError
from explorer.files.json_text import decode_strictly, field_names, located_errors
from explorer.files.packaged import packaged_files
from explorer.files.writing import read_at_most
from explorer.measures.measure import longest_leg
from explorer.mechanism.design import LENGTHS, Design
from explorer.numerics.arrays import FloatArray, triple
from explorer.numerics.checks import number
from explorer.six_legged.table import SixLegged, TableHome, table_of

TWIN = (("a1", "b1"), ("a1", "b2"), ("a1", "b3"), ("a2", "b2"), ("a2", "b3"), ("a3", "b4"))
"""The six legs of the 6-4 twin, base point and platform point (the paper's Figure 1a)."""

FIELD = "base_mm"
"""A field that no other kind of file has."""

INCH = 25.4
EQUAL = "made equal to "
"""What a table's source says before the design to which it was made equal."""

# Height of the assumed home over the distance of the farthest base point from the origin, and the
# lengths of the legs over those at home.
HEIGHT, STROKE = 0.75, (0.5, 1.5)
SETTING = re.compile(r"^\s*setp\s+genhexkins\.(base|platform)\.(\w+)\.(\w+)\s+(\S+)", re.MULTILINE)
IN_INCHES = re.compile(r"^[#\s]*LINEAR_UNITS\s*=\s*in", re.MULTILINE | re.IGNORECASE)


def decode_table(data: bytes, source: str) -> SixLegged:
    """Return the table in a JSON text or in lines of a HAL file; errors name their source.

    Raises:
        InputError: The text is neither, has unknown, repeated or unusable fields, or its table is
            none that could be built.
    """
    if FIELD in field_names(data):
        return decode_strictly(data, SixLegged, source)
    with located_errors(data, SixLegged, source) as text:
        settings = SETTING.findall(text)
        if not settings:
            raise InputError(
                f"the file holds no table on six legs: give JSON with {FIELD}, platform_mm, "
                "shortest_mm, longest_mm and home, or lines of a HAL file such as "
                "setp genhexkins.base.0.x -22.95"
            )
        unit = INCH if IN_INCHES.search(text) else 1.0
        # What is not set has LinuxCNC's own number.
        default = TABLES["LinuxCNC default"]
        points = {
            "base": np.array(default.base_mm) * unit / INCH,
            "platform": np.array(default.platform_mm) * unit / INCH,
        }
        for part, leg, axis, value in settings:
            name = f"genhexkins.{part}.{leg}.{axis}"
            if leg not in tuple("012345") or axis not in tuple("xyz"):
                raise InputError(f"{name} is unknown; legs are 0 to 5, axes x, y and z")
            amount: float | str = value
            with contextlib.suppress(ValueError):
                amount = float(value)
            points[part][int(leg), "xyz".index(axis)] = unit * number(name, amount)
        words = "inches" if unit == INCH else "mm"
        return _by_home(points["base"], points["platform"], f"LinuxCNC's settings, in {words}")


def _by_home(base: FloatArray, platform: FloatArray, source: str) -> SixLegged:
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
        InputError: There is no such table or file, or the file holds none.
        StorageError: The file cannot be read.
    """
    if str(name_or_file) in TABLES:
        return TABLES[str(name_or_file)]
    path = Path(name_or_file)
    if not path.exists():
        raise InputError(
            f"no table and no file named {str(name_or_file)!r}; the tables are {', '.join(TABLES)}"
        )
    return decode_table(read_at_most(path), str(path))


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

    Each leg has the longest stroke of the design's l1, d2, d4 and l4, half of it to either side of
    its length at home, or from zero on if that is shorter. Each cone is the least of the design's
    swings; there are none if the design has none. The source of the table tells what was made.
    """
    ranges = [design.length_range(name) for name in LENGTHS]
    stroke = design.unit_mm * max(high - low for low, high in ranges)
    shortest = np.maximum(0.0, table.home_lengths - 0.5 * stroke)
    swings = [angle for angle in msgspec.structs.astuple(design.limits.swing) if angle is not None]
    cones = f"cones of {min(swings):g}°" if swings else "no cones"
    own = table.source.partition(EQUAL)[0].removesuffix("; ")
    words = f"{EQUAL}{design.name}: strokes of {stroke:.4g} mm about home's lengths, {cones}"
    return msgspec.structs.replace(
        table,
        shortest_mm=shortest,
        longest_mm=shortest + stroke,
        cones_deg=(min(swings),) * 6 if swings else None,
        source=f"{own}; {words}" if own else words,
    )


_FILES = packaged_files("tables", ".json")
TABLES: Mapping[str, SixLegged] = MappingProxyType(
    {
        table.name: table
        for table in (decode_strictly(file.read_bytes(), SixLegged, file.name) for file in _FILES)
    }
)
"""The packaged tables, by name."""
