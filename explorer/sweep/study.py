"""Studies: the designs, their measures and the objectives, in one JSON document.

It is read as strictly as a design file. A decoded study is complete: it holds the design itself in
place of the name of a preset, so that it means the same wherever it is read.
"""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, cast, get_args

import msgspec
from msgspec.structs import force_setattr as _set

from explorer.errors import InputError
from explorer.files.json_text import decode_strictly
from explorer.files.packaged import packaged_files
from explorer.files.writing import read_at_most
from explorer.measures.catalogue import measures_in
from explorer.mechanism.design import VARIABLES, Design, Pair
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.checks import instance, number, one_of, positive, title, two, whole
from explorer.numerics.number_text import format_apart
from explorer.optimise import problem as problems
from explorer.sweep.machine import MACHINE
from explorer.workspace.least_clearance import DEFAULT_NODES, FEWEST_NODES, MOST_NODES

Method = Literal["sobol", "latin-hypercube", "grid"]
Sense = Literal["min", "max"]

RADIUS = "radius"

NAMES = (*VARIABLES, problems.YAW, problems.REACH, RADIUS, *MACHINE)
"""The variables of a study: those of X, the yaw of home in degrees, one maximum for all four
lengths, one radius for all four legs, and those of the machine."""

# The longest Sobol sequence has as many points.
MOST_DESIGNS = 2**30
# A hypercube is made as a whole, in each process.
MOST_IN_HYPERCUBE = 1_000_000
MOST_IN_CHUNK = 100_000
LARGEST_SEED = 2**31 - 1

DEFAULT_MEASURES = ("volume", "reach", "worst_margin", "clearance", "inverse_condition")


class Sampling(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The sampling of the ranges of the variables.

    Attributes:
        method: A scrambled Sobol sequence, a Latin hypercube, or a full grid.
        count: Number of designs; of a grid the number of values of each variable, or of all.
        seed: Seed of the scrambling or the hypercube; a grid has none.

    Raises:
        InputError: No designs, too many, or a seed out of range.
    """

    method: Method = "sobol"
    count: int | dict[str, int]
    seed: int = 0

    def __post_init__(self) -> None:
        _set(self, "method", one_of("sampling.method", self.method, get_args(Method)))
        _set(self, "seed", whole("sampling.seed", self.seed, 0, LARGEST_SEED))
        if isinstance(self.count, dict):
            if self.method != "grid":
                raise InputError(
                    f"sampling.count must be one number for {self.method}; only a grid takes "
                    "one for each variable"
                )
            counts = {
                str(name): whole(f"sampling.count.{name}", count, 1, MOST_DESIGNS)
                for name, count in self.count.items()
            }
            _set(self, "count", counts)
        else:
            _set(self, "count", whole("sampling.count", self.count, 1, MOST_DESIGNS))


class Objective(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A measure or variable that is to be small or large.

    Attributes:
        measure: The name of its column.
        sense: "min" or "max".

    Raises:
        InputError: Another sense.
    """

    measure: str
    sense: Sense

    def __post_init__(self) -> None:
        _set(self, "measure", str(self.measure))
        _set(self, "sense", one_of("the sense of an objective", self.sense, get_args(Sense)))


class Study(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A study of many designs.

    Attributes:
        schema: Version of the file format.
        name: Name of the study.
        design: Design that is varied, or the name of a preset, which becomes the design. Its
            home's position is that of all designs.
        variables: Range of each variable by name, out of `NAMES`.
        sampling: Sampling of the ranges.
        measures: Measures, out of `measures_in("studies")`.
        nodes: Nodes on each axis of the grid for margins and clearances.
        clearance_margin: Least |δ| at which clearances count, in design units; None for a 20th
            of the design's reach.
        objectives: Objectives of the Pareto front.
        chunk: Number of designs of one task and one part of the results.

    Raises:
        InputError: Something is unknown, empty, named twice or out of range.
    """

    schema: Literal[1] = 1
    name: str = "untitled"
    design: Design | str
    variables: dict[str, Pair]
    sampling: Sampling
    measures: tuple[str, ...] = DEFAULT_MEASURES
    nodes: int = DEFAULT_NODES
    clearance_margin: float | None = None
    objectives: tuple[Objective, ...] = ()
    chunk: int = 64

    def __post_init__(self) -> None:
        _set(self, "schema", whole("schema", self.schema, 1, 1))
        _set(self, "name", title("name", self.name))
        _set(self, "design", _complete(self.design))
        _set(self, "variables", _ranges(self.variables))
        _set(self, "measures", tuple(map(str, self.measures)))
        self._check_ranges()
        self._check_sampling()
        self._check_measures()
        _set(self, "nodes", whole("nodes", self.nodes, FEWEST_NODES, MOST_NODES))
        if self.clearance_margin is not None:
            _set(self, "clearance_margin", positive("clearance_margin", self.clearance_margin))
        _set(self, "chunk", whole("chunk", self.chunk, 1, MOST_IN_CHUNK))
        _set(self, "objectives", tuple(self.objectives))
        for objective in self.objectives:
            if objective.measure not in (*self.variables, *self.measures):
                raise InputError(
                    f"the objective {objective.measure!r} is neither measured nor a variable of "
                    f"the study; there are {', '.join((*self.variables, *self.measures))}"
                )
        _check_unique("objectives", [objective.measure for objective in self.objectives])

    @property
    def base(self) -> Design:
        """The design that is varied, with its home pose."""
        return cast("Design", self.design)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each variable of a grid."""
        count = self.sampling.count
        if isinstance(count, dict):
            return tuple(count[name] for name in self.variables)
        return (count,) * len(self.variables)

    @property
    def count(self) -> int:
        """Number of designs."""
        if self.sampling.method == "grid":
            return math.prod(self.shape)
        return cast("int", self.sampling.count)

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return -(-self.count // self.chunk)

    def rows_of(self, chunk: int) -> range:
        """Return the indices of the designs of a chunk."""
        return range(chunk * self.chunk, min((chunk + 1) * self.chunk, self.count))

    def _check_ranges(self) -> None:
        for name, (low, _) in self.variables.items():
            if name == RADIUS and low < 0.0:
                raise InputError(f"the radius of legs must not be negative; it starts at {low:g}")
            if name in MACHINE:
                MACHINE[name].check(name, low)
            least = problems.longest_minimum(self.base)
            if name == problems.REACH and not low > least:
                end, start = format_apart((least, low))
                raise InputError(
                    f"the reach must stay above every minimum length, so above {end}; it starts "
                    f"at {start}"
                )

    def _check_sampling(self) -> None:
        count = self.sampling.count
        if isinstance(count, dict) and set(count) != set(self.variables):
            raise InputError(
                f"sampling.count must name the variables {', '.join(self.variables)}; it names "
                f"{', '.join(count) or 'none'}"
            )
        if self.sampling.method == "latin-hypercube" and self.count > MOST_IN_HYPERCUBE:
            raise InputError(
                f"sampling.count must be at most {MOST_IN_HYPERCUBE:,} for a latin-hypercube; "
                "take sobol for more designs"
            )
        if self.count > MOST_DESIGNS:
            count, most = format_apart((self.count, MOST_DESIGNS), 3)
            raise InputError(f"the grid has {count} designs; at most {most} are made")

    def _check_measures(self) -> None:
        known = measures_in("studies")
        if not self.measures:
            raise InputError(f"measures must name at least one of {', '.join(known)}")
        _check_unique("measures", self.measures)
        for name in self.measures:
            if name not in known:
                raise InputError(f"no measure {name!r}; there are {', '.join(known)}")
            if name in self.variables:
                raise InputError(f"{name} is a variable of the study: leave it out of the measures")


def decode_study(data: bytes, source: str) -> Study:
    """Return the study in a JSON text, UTF-8 or UTF-16; errors name its source.

    Raises:
        InputError: Not JSON, of another schema, with unknown fields, fields given twice or
            unusable values.
    """
    return decode_strictly(data, Study, source)


def encode_study(study: Study) -> bytes:
    """Return a study as indented JSON, which `decode_study` reads back unchanged."""
    return msgspec.json.format(msgspec.json.encode(study), indent=2) + b"\n"


def load_study(path: str | Path) -> Study:
    """Return the study in a file, or a packaged one by its name.

    Raises:
        InputError: The file holds no study.
        StorageError: The file cannot be read.
    """
    known = STUDIES.get(str(path))
    if known is not None:
        return known
    if not os.path.lexists(path):
        raise InputError(
            f"no study and no file named {str(path)!r}; the studies that come along are "
            f"{', '.join(STUDIES)}"
        )
    return decode_study(read_at_most(Path(path)), str(path))


def study_hash(study: Study) -> str:
    """Return the SHA-256 of the encoded study, in hexadecimal; it differs between studies."""
    return hashlib.sha256(encode_study(study)).hexdigest()


def _complete(design: Any) -> Design:
    """Return the design itself, with a home pose that stays the same in all designs."""
    if isinstance(design, str):
        if design not in PRESETS:
            raise InputError(
                f"no preset {design!r}; there are {', '.join(PRESETS)}, or give a design"
            )
        design = PRESETS[design]
    instance("design", design, Design)
    return msgspec.structs.replace(design, home=design.home_pose)


def _ranges(given: Mapping[str, Pair]) -> dict[str, tuple[float, float]]:
    if not given:
        raise InputError(f"variables must name at least one of {', '.join(NAMES)}")
    ranges: dict[str, tuple[float, float]] = {}
    for name, ends in given.items():
        if name not in NAMES:
            raise InputError(f"variables: no variable {name!r}; there are {', '.join(NAMES)}")
        first, last = two(f"the range of {name}", ends)
        low, high = number(f"the low end of {name}", first), number(f"the high end of {name}", last)
        if not low < high:
            start, end = format_apart((low, high))
            raise InputError(
                f"the range of {name} is empty: {start} to {end}; the low end must lie below "
                "the high one"
            )
        ranges[str(name)] = (low, high)
    return ranges


def _check_unique(field: str, names: Sequence[str]) -> None:
    if len(set(names)) < len(names):
        raise InputError(f"{field} may name each once; got {', '.join(names)}")


def _load_studies() -> Mapping[str, Study]:
    files = packaged_files("studies", ".json")
    studies = [decode_study(file.read_bytes(), file.name) for file in files]
    return MappingProxyType({study.name: study for study in studies})


STUDIES: Mapping[str, Study] = _load_studies()
"""Packaged studies by name."""
