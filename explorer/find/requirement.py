"""Requirements: what a machine must do, stated in mm, degrees, newtons, kilograms and seconds.

A requirement knows no design unit, so that it means the same beside every design. It asks for a box
of positions of the tool, with home's at its centre, at every tilt up to a limit: a turn of home's
orientation about any axis parallel to the base plane.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, get_args

import msgspec
from msgspec.structs import force_setattr as _set

from explorer.errors import DesignError, InputError
from explorer.files.json_text import decode_strictly
from explorer.files.writing import read_at_most
from explorer.mechanism.machine import unit_gravity
from explorer.mechanism.pose import Triple
from explorer.numerics import checks

Preference = Literal[
    "balanced", "small", "little-force", "stiff", "precise", "far-from-singular", "easy-to-build"
]
PREFERENCES: tuple[Preference, ...] = get_args(Preference)
"""The kinds of machines that may be preferred among those that keep a requirement."""

Freedom = Literal["orientation", "tool"]

MOST_TILT = 60.0
"""Largest tilt that may be required, in degrees."""

# Least margin over the diagonal of the box where none is stated.
LEAST_MARGIN = 0.02


class RequiredLoad(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A payload, and a force of any direction at the tool.

    Attributes:
        mass_kg: Mass, in kilograms.
        centre_mm: Centre of mass from b4 in the platform frame, in millimetres.
        force_n: Largest force of the process, in newtons.
    """

    mass_kg: float = 0.0
    centre_mm: Triple = (0.0, 0.0, 0.0)
    force_n: float = 0.0

    def __post_init__(self) -> None:
        _set(self, "mass_kg", checks.not_negative("payload.mass_kg", self.mass_kg))
        _set(self, "centre_mm", tuple(checks.numbers("payload.centre_mm", self.centre_mm, 3)))
        _set(self, "force_n", checks.not_negative("payload.force_n", self.force_n))


class RequiredLegs(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The legs that can be bought; None for what is not limited.

    Attributes:
        ratio: Longest over shortest length of each leg.
        longest_mm: Longest leg, in millimetres.
        push_n: Largest push of each actuator, in newtons.
        pull_n: Largest pull, in newtons; None for the same as the push.
        speed_mm_s: Largest speed of each actuator, in mm/s.
        acceleration_mm_s2: Largest acceleration of each actuator, in mm/s².
        stiffness_n_mm: Stiffness of each actuator, in N/mm; None for rigid ones.
        error_mm: Positioning error of each actuator to either side, in millimetres.
        diameter_mm: Diameter of the legs, in millimetres.
        apart_mm: Least distance between the surfaces of two legs, in millimetres.
    """

    ratio: float | None = None
    longest_mm: float | None = None
    push_n: float | None = None
    pull_n: float | None = None
    speed_mm_s: float | None = None
    acceleration_mm_s2: float | None = None
    stiffness_n_mm: float | None = None
    error_mm: float = 0.0
    diameter_mm: float = 0.0
    apart_mm: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            value, field = getattr(self, name), f"legs.{name}"
            if name in ("error_mm", "diameter_mm", "apart_mm"):
                _set(self, name, checks.not_negative(field, value))
            elif value is not None:
                most = checks.STIFFEST if name == "stiffness_n_mm" else checks.MOST
                _set(self, name, checks.positive(field, value, most))
        if self.ratio is not None and not self.ratio > 1.0:
            raise DesignError(
                f"legs.ratio is longest over shortest, above 1; got {self.ratio:g}", "legs.ratio"
            )


class RequiredMotion(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Speeds that the tool must have in every direction; 0 for none.

    Attributes:
        speed_mm_s: Speed of the tool, in mm/s.
        turning_deg_s: Rate of turning, in degrees per second.
    """

    speed_mm_s: float = 0.0
    turning_deg_s: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            _set(self, name, checks.not_negative(f"tool.{name}", getattr(self, name)))


class Requirement(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A requirement, as its file states it; None for what is not demanded.

    Attributes:
        schema: Version of the file format.
        kind: The word by which the file is told from a design.
        name: One printable line.
        box_mm: Edges of the box of positions of the tool, in millimetres.
        tilt_deg: Largest tilt, in degrees.
        payload: Payload and force.
        legs: The legs that can be bought.
        swing_deg: Half-angle, in degrees, of the cones of all six joints about the legs at home.
        prefer: Kind of machine that is preferred.
        gravity: Direction of gravity in the base frame, normalised.
        tool: Speeds of the tool.
        margin_mm: Least |δ1|, |δ2| and |δ3|, in millimetres; None for 2 % of the box's diagonal.
        transmission: Least transmission index, from 0 to 1.
        error_mm: Largest displacement of the tool by the actuators' errors, in millimetres.
        deflection_mm: Largest displacement of the tool by the load, in millimetres.
        move_s: Time of a move from rest to rest along each diagonal of the box, in seconds.
        hull_mm: Largest edge of the box about all joints over all poses, in millimetres.
        buildable: Whether the parts of the machine must fit into each other.
        free: What a search may choose besides the machine and the yaw of the box: the orientation
            of home, which is level with a free yaw otherwise, and the tool, which is b4 otherwise.

    Raises:
        DesignError: A value is out of range.
    """

    schema: Literal[1] = 1
    kind: Literal["requirement"] = "requirement"
    name: str = "requirement"
    box_mm: Triple
    tilt_deg: float = 0.0
    payload: RequiredLoad = RequiredLoad()
    legs: RequiredLegs = RequiredLegs()
    swing_deg: float | None = None
    prefer: Preference = "balanced"
    gravity: Triple = (0.0, 0.0, -1.0)
    tool: RequiredMotion = RequiredMotion()
    margin_mm: float | None = None
    transmission: float | None = None
    error_mm: float | None = None
    deflection_mm: float | None = None
    move_s: float | None = None
    hull_mm: float | None = None
    buildable: bool = False
    free: tuple[Freedom, ...] = ("orientation",)

    def __post_init__(self) -> None:
        _set(self, "name", checks.title("name", self.name))
        edges = checks.numbers("box_mm", self.box_mm, 3)
        _set(self, "box_mm", tuple(checks.positive("box_mm", edge) for edge in edges))
        tilt = checks.not_negative("tilt_deg", self.tilt_deg)
        if tilt > MOST_TILT:
            raise DesignError(f"tilt_deg must be at most {MOST_TILT:g}; got {tilt:g}", "tilt_deg")
        _set(self, "tilt_deg", tilt)
        if self.swing_deg is not None:
            swing = checks.positive("swing_deg", self.swing_deg)
            if swing >= 90.0:
                raise DesignError(f"swing_deg must be below 90; got {swing:g}", "swing_deg")
            _set(self, "swing_deg", swing)
        _set(self, "prefer", checks.one_of("prefer", self.prefer, PREFERENCES))
        _set(self, "gravity", unit_gravity(self.gravity))
        for name in ("transmission", "error_mm", "deflection_mm", "move_s", "hull_mm"):
            value = getattr(self, name)
            if value is not None:
                _set(self, name, checks.positive(name, value))
        if self.transmission is not None and self.transmission >= 1.0:
            raise DesignError(
                f"transmission must be below 1; got {self.transmission:g}", "transmission"
            )
        if self.margin_mm is not None:
            _set(self, "margin_mm", checks.not_negative("margin_mm", self.margin_mm))
        free = {checks.one_of("free", each, get_args(Freedom)) for each in self.free}
        _set(self, "free", tuple(each for each in get_args(Freedom) if each in free))

    @property
    def diagonal_mm(self) -> float:
        """The diagonal of the box, in millimetres."""
        return math.hypot(*self.box_mm)

    @property
    def least_margin_mm(self) -> float:
        """The least |δ| that is demanded, in millimetres."""
        return LEAST_MARGIN * self.diagonal_mm if self.margin_mm is None else self.margin_mm


def decode_requirement(data: bytes, source: str) -> Requirement:
    """Return the requirement in a JSON text; errors name its source.

    Raises:
        InputError: The text is not JSON, or has unknown, repeated or unusable fields.
    """
    return decode_strictly(data, Requirement, source)


def encode_requirement(requirement: Requirement) -> bytes:
    """Return a requirement as indented JSON, which `decode_requirement` reads back unchanged."""
    return msgspec.json.format(msgspec.json.encode(requirement), indent=2) + b"\n"


def load_requirement(path: str | Path) -> Requirement:
    """Return the requirement in a file.

    Raises:
        InputError: The file holds no requirement.
        StorageError: The file cannot be read.
    """
    return decode_requirement(read_at_most(Path(path)), str(path))


_LENGTHS = {"mm": 1.0, "cm": 10.0, "m": 1e3, "in": 25.4, "μm": 1e-3, "um": 1e-3}
_FORCES = {"N": 1.0, "kN": 1e3}
_SPEEDS = {f"{unit}/s": factor for unit, factor in _LENGTHS.items()}
_RATES = {f"{unit}2": factor for unit, factor in _SPEEDS.items()}
_STIFFNESSES = {f"{f}/{unit}": n / mm for f, n in _FORCES.items() for unit, mm in _LENGTHS.items()}
# Words of the columns of a data sheet, the fields that they mean, and the units of their values.
_COLUMNS: Mapping[str, tuple[str, Mapping[str, float]]] = {
    "push": ("push_n", _FORCES),
    "pull": ("pull_n", _FORCES),
    "force": ("push_n", _FORCES),
    "speed": ("speed_mm_s", _SPEEDS),
    "acceleration": ("acceleration_mm_s2", _RATES),
    "stiffness": ("stiffness_n_mm", _STIFFNESSES),
    "accuracy": ("error_mm", _LENGTHS),
    "error": ("error_mm", _LENGTHS),
    "diameter": ("diameter_mm", _LENGTHS),
    "ratio": ("ratio", {}),
    "stroke": ("stroke", _LENGTHS),
    "retracted": ("retracted", _LENGTHS),
}
# A word, a number after it, and what follows, which may be a unit or the next word.
_VALUE = re.compile(
    r"(?<![A-Za-z])([A-Za-z]+)\)?\s*[:=]?\s*(?:±|\+/?-)?\s*"
    r"((?:(?<=[\s:=])[-\u2212])?\d(?:[\d.,]*\d)?(?:[eE][-+]?\d+)?)(?=\s*([^\s,;]{0,20}))"
)
# A decimal comma; one before three digits may as well separate thousands.
_COMMA = re.compile(r"(?<=\d),(?=\d+$)(?!\d{3}$)|(?<=^0),(?=\d+$)")
MOST_ROW = 1000
"""Largest number of letters of a row of a data sheet."""


def legs_from_row(text: str, legs: RequiredLegs) -> RequiredLegs:
    """Return legs with the values of a row of a data sheet in place of their own.

    The row states each value as a word out of push, pull, force, speed, acceleration, stiffness,
    accuracy (or error), diameter and ratio, and a number with its unit, such as "push 300 N"; units
    that are left out are those of the fields. "stroke" and "retracted" give together the ratio and
    the longest leg.

    Raises:
        InputError: The row is too long, no value is found, or one is no number or in another unit.
    """
    if len(text) > MOST_ROW:
        raise InputError(f"a row has at most {MOST_ROW} letters; got {len(text)}: paste one alone")
    found = dict[str, float]()
    row = " ".join(unicodedata.normalize("NFKC", text).split())
    for word, number, following in _VALUE.findall(row):
        field, units = _COLUMNS.get(word.lower(), ("", {}))
        if not field:
            continue
        # The end of a sentence or a bracket is no part of a unit.
        after = following.rstrip(".)")
        if after in units:
            factor = units[after]
        elif not after or after.lower() in _COLUMNS:
            factor = 1.0
        else:
            allowed = f"in {', '.join(units)}" if units else "without a unit"
            raise InputError(f"{word} is given {allowed}; got {number} {after}")
        try:
            found[field] = factor * float(_COMMA.sub(".", number.replace("\N{MINUS SIGN}", "-")))
        except ValueError:
            raise InputError(f"{word} is a number such as 1500.5; got {number}") from None
    ends = [name for name in ("stroke", "retracted") if name in found]
    if len(ends) == 1:
        raise InputError(f"stroke and retracted give the legs only together; got {ends[0]} alone")
    if ends:
        stroke, retracted = (checks.positive(name, found.pop(name)) for name in ends)
        longest = stroke + retracted
        found |= {"ratio": longest / retracted, "longest_mm": longest}
    if not found:
        raise InputError(
            "no value in the row: name each, such as 'stroke 150 retracted 220 push 300 N speed "
            "50 mm/s'"
        )
    return msgspec.structs.replace(legs, **found)
