"""Design files: JSON, read strictly, the presets, and typical values for what a design leaves out.

Unknown fields are refused, so that a misspelt limit is never silently ignored, and so are
repeated fields. Schema 1 has a part of the fields of schema 2, and both are read. The presets are
both rows of the paper's Table 1, and a machine that can be built, found for a requirement. Typical
precision and stiffness are those of a small machine with ball screws and milled parts; the page and
the commands say where they are assumed.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import msgspec

from explorer.errors import DesignError
from explorer.files.json_text import check_unique_fields, located_errors
from explorer.files.packaged import packaged_files
from explorer.files.writing import broken_link
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Tolerances
from explorer.mechanism.pose import Triple

# Largest accepted size of a design file, in bytes.
LARGEST_FILE = 1_000_000
SCHEMA, READ_SCHEMAS = 2, (1, 2)


class _Versioned(msgspec.Struct):
    """The schema of a design file; a file without the field is of the present schema."""

    schema: int = SCHEMA


def decode_design(data: bytes, source: str) -> Design:
    """Return the design in a JSON text, UTF-8 or UTF-16; errors name its source.

    Raises:
        DesignError: The text is not JSON, is of another schema, or has unknown fields,
            repeated fields or unusable values.
    """
    if len(data) > LARGEST_FILE:
        raise DesignError(f"{source}: a design file has at most 1 MB")
    with located_errors(data, Design, source, DesignError) as text:
        schema = msgspec.json.decode(text, type=_Versioned).schema
        if schema not in READ_SCHEMAS:
            raise DesignError(
                f"the file has schema {schema}, of another version of the explorer; this one reads "
                "schemas 1 and 2"
            )
        fields = msgspec.json.decode(text, type=dict[str, Any])
        design = msgspec.convert(fields | {"schema": SCHEMA}, Design)
        check_unique_fields(text)
        return design


def encode_design(design: Design) -> bytes:
    """Return the design as indented JSON, which `decode_design` reads back unchanged."""
    return msgspec.json.format(msgspec.json.encode(design), indent=2) + b"\n"


def load_design(preset_or_file: str) -> Design:
    """Return a preset by name, or the design in a file.

    Raises:
        DesignError: There is no such preset or file, or the file holds no design.
    """
    preset = PRESETS.get(preset_or_file)
    if preset is not None:
        return preset
    path = Path(preset_or_file)
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        link = broken_link(path)
        if isinstance(error, FileNotFoundError) and not link:
            raise DesignError(
                f"no preset and no file named {preset_or_file!r}; the presets are "
                f"{', '.join(PRESETS)}"
            ) from None
        reason = link or getattr(error, "strerror", None) or str(error)
        raise DesignError(f"cannot read {preset_or_file!r}: {reason}") from None
    return decode_design(data, preset_or_file)


_FILES = packaged_files("presets", ".json")
PRESETS: Mapping[str, Design] = MappingProxyType(
    {each.name: each for each in (decode_design(file.read_bytes(), file.name) for file in _FILES)}
)
"""The designs of both rows of the paper's Table 1, by name."""

ERROR = 0.05
"""Typical positioning error of an actuator to either side, in mm."""
STIFFNESS = 1000.0
"""Typical stiffness of an actuator, in N/mm."""
OUTER, INNER = 12.0, 10.0
"""Typical diameters of the struts' tubes, in mm."""
LENGTH, TILT = 0.1, 0.1
"""Typical tolerances of lengths in mm and of tilts in degrees."""


def typical_machine(design: Design) -> tuple[Design, tuple[str, ...]]:
    """Return a design with typical values in place of those that it leaves out, and words for each.

    Errors of the actuators count as left out if all six are zero, tolerances if all 25 are. There
    are no words for a design that states everything.
    """
    assumed: list[str] = []
    actuators, struts, tolerances = design.actuators, design.struts, design.tolerances
    if not any(actuators.error_mm):
        actuators = msgspec.structs.replace(actuators, error_mm=(ERROR,) * 6)
        assumed.append(f"errors of the actuators {ERROR:g} mm")
    if actuators.stiffness_n_mm is None:
        actuators = msgspec.structs.replace(actuators, stiffness_n_mm=(STIFFNESS,) * 6)
        assumed.append(f"stiffness of the actuators {STIFFNESS:g} N/mm")
    if struts.outer_mm is None:
        struts = msgspec.structs.replace(struts, outer_mm=OUTER, inner_mm=INNER)
        assumed.append(f"struts of tube {OUTER:g} × {INNER:g} mm, {struts.modulus_gpa:g} GPa")
    if not any(tolerances.stated):
        each: Triple = (LENGTH, LENGTH, LENGTH)
        tilts = TILT, TILT
        tolerances = Tolerances(each, each, each, tilts, each, each, each, each, tilts)
        assumed.append(f"tolerances {LENGTH:g} mm and {TILT:g}°")
    filled = msgspec.structs.replace(
        design, actuators=actuators, struts=struts, tolerances=tolerances
    )
    return filled, tuple(assumed)
