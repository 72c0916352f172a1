"""Files of the machine that was built: its deviations, in mm and degrees, and its design's hash.

The hash is that of the six variables and the unit, on which deviations depend, so that names and
limits may change.
"""

from __future__ import annotations

import datetime as dt
import hashlib
import math
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from explorer.errors import InputError
from explorer.files.json_text import decode_strictly
from explorer.files.writing import read_at_most
from explorer.mechanism.built_machine import BuiltMachine
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Pair, Six
from explorer.mechanism.pose import Triple
from explorer.statics.accuracy import IS_TILT, drawing_values, from_drawing_values

MOST_SHARE, MOST_TILT = 0.1, 10.0
"""Largest deviations that a file may have: of lengths over the reach, and of angles in degrees."""


class PointDeviations(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Deviations in mm: a1, a3 and guide along base axes, b1 to b4 along platform axes."""

    a1: Triple
    a3: Triple
    guide: Triple
    b1: Triple
    b2: Triple
    b3: Triple
    b4: Triple


class MachineFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A machine that was built, as its file states it.

    Attributes:
        schema: Version of the file format.
        kind: The word by which the file is told from a design.
        design: Name of the design.
        design_sha256: Hash of its six variables and its unit.
        date: Day of the calibration, such as 2024-05-31.
        zeros_mm: True less read values of the joints (l1, d1, d2, d3, d4, l4), in millimetres.
        deviations_mm: Deviations of points, in millimetres.
        guide_tilt_deg: Turn of the guide about y and z through a1, in degrees.
        square_deg: Tilts of struts 2 and 3 along the guide, in degrees.
        unseen: Names of what the measurement did not show.
    """

    schema: Literal[1] = 1
    kind: Literal["machine"] = "machine"
    design: str
    design_sha256: str
    date: str
    zeros_mm: Six
    deviations_mm: PointDeviations
    guide_tilt_deg: Pair
    square_deg: Pair
    unseen: tuple[str, ...] = ()


def encode_machine(machine: BuiltMachine, unseen: tuple[str, ...]) -> bytes:
    """Return a machine of today as indented JSON, which `decode_machine` reads back."""
    design = machine.design
    values = drawing_values(design, machine.deviations).tolist()
    # The zeros, a1, a3 and the guide, its tilt, b1 to b4, and the struts.
    points = [tuple(values[k : k + 3]) for k in (6, 9, 12, 17, 20, 23, 26)]
    file = MachineFile(
        design=design.name,
        design_sha256=_hash(design),
        date=dt.date.today().isoformat(),
        zeros_mm=tuple(values[:6]),
        deviations_mm=PointDeviations(*points),
        guide_tilt_deg=tuple(values[15:17]),
        square_deg=tuple(values[29:]),
        unseen=unseen,
    )
    return msgspec.json.format(msgspec.json.encode(file), indent=2) + b"\n"


def decode_machine(data: bytes, source: str, design: Design) -> BuiltMachine:
    """Return the machine in a JSON text, which is one of a design; errors name its source.

    Raises:
        InputError: The text is not JSON, has unknown, repeated or unusable fields, or is of a
            machine of another design.
    """
    file = decode_strictly(data, MachineFile, source)
    if file.design_sha256 != _hash(design):
        raise InputError(
            f"{source} is of a machine of the design {file.design!r}, whose six variables or unit "
            f"are not those of {design.name!r}: give its design, or calibrate again"
        )
    a1, a3, guide, *platform = msgspec.structs.astuple(file.deviations_mm)
    parts = file.zeros_mm, a1, a3, guide, file.guide_tilt_deg, *platform, file.square_deg
    deviations = from_drawing_values(design, np.concatenate(parts))
    lengths, tilts = (np.abs(deviations[part]).max() for part in (~IS_TILT, IS_TILT))
    if lengths > MOST_SHARE * design.reach or tilts > math.radians(MOST_TILT):
        raise InputError(
            f"{source} deviates by more than anybody builds: lengths by up to "
            f"{MOST_SHARE * design.reach * design.unit_mm:.3g} mm, a tenth of the reach, and "
            f"angles by up to {MOST_TILT:g}° are possible"
        )
    return BuiltMachine(design, deviations)


def load_machine(path: str | Path, design: Design) -> BuiltMachine:
    """Return the machine of a design in a file.

    Raises:
        InputError: The file holds no machine, or one of another design.
        StorageError: The file cannot be read.
    """
    return decode_machine(read_at_most(Path(path)), str(path), design)


def _hash(design: Design) -> str:
    return hashlib.sha256(repr((*design.variables, design.unit_mm)).encode()).hexdigest()
