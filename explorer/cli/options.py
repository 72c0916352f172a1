"""Base classes of the commands, with the options that they share: design, pose, output."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar

import msgspec
import numpy as np
import tyro

from explorer.cli import values
from explorer.cli.output import write_json
from explorer.cli.streams import write
from explorer.errors import DesignError, ExplorerError, InputError, StorageError
from explorer.files.writing import check_writable, write_whole
from explorer.mechanism.configuration import Point, offset_of, tool_offset, tool_position
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import load_design, typical_machine
from explorer.mechanism.folds import pose_of_folds
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Pose, Quadruple, Triple
from explorer.mechanism.tilt_torsion import pose_of_tilt_torsion
from explorer.numerics.arrays import FloatArray
from explorer.statics.reactions import has_limits
from explorer.workspace.workspace import Workspace

if TYPE_CHECKING:
    from explorer.mechanism.built_machine import BuiltMachine
    from explorer.workspace.carried_region import CarriedRegion

_Struct = TypeVar("_Struct", bound=msgspec.Struct)


@dataclass(frozen=True, kw_only=True)
class DesignOptions:
    """The option for the design."""

    design: Annotated[str, tyro.conf.arg(metavar=values.DESIGN_NAME)] = "paper-optimal"
    """A preset (buildable, paper-initial, paper-optimal), a design file (JSON), or the name of
    a design saved on the page."""

    def read_design(self) -> Design:
        """Return the design, as `load` does."""
        return load(self.design)


def replace_given(struct: _Struct, **changes: object) -> _Struct:
    """Return a struct with the changes that are not None."""
    given = {name: value for name, value in changes.items() if value is not None}
    return msgspec.structs.replace(struct, **given)


def with_payload(design: Design, mass_kg: float | None) -> Design:
    """Return a design with the mass of its payload that is given; itself for None."""
    if mass_kg is None:
        return design
    return msgspec.structs.replace(design, payload=design.payload.with_mass(mass_kg))


def load(name: str) -> Design:
    """Return a preset, the design in a file, or a design saved on the page."""
    try:
        return load_design(name)
    except DesignError:
        # The name means a file that exists; its error says what is wrong with it.
        if os.path.exists(name):  # noqa: PTH110 - that of a Path raises for names too long
            raise
        from explorer.app.storage.library import Library

        with contextlib.suppress(ExplorerError):
            return Library().open(name)
        raise


class PartialAnswerError(ExplorerError):
    """An answer that has been printed, without a file, or without what was searched for."""

    exit_status: ClassVar[int] = 1


def write_files(files: Mapping[Path, bytes]) -> tuple[list[Path], list[StorageError]]:
    """Write the files of an answer; return those written, and the errors of the others.

    The command prints its answer before it raises the errors, so that a full disk does not lose
    the work of hours.
    """
    written: list[Path] = []
    errors: list[StorageError] = []
    for path, data in files.items():
        try:
            write_whole(path, data)
            written.append(path)
        except StorageError as error:
            errors.append(error)
    return written, errors


@dataclass(frozen=True, kw_only=True)
class JsonOptions:
    """The option for JSON."""

    json: values.Flag = False
    """Write one JSON object to standard output, and nothing else."""

    def write(
        self,
        as_json: Callable[[], Mapping[str, object]],
        lines: Iterable[str],
        errors: Sequence[ExplorerError] = (),
    ) -> None:
        """Write the answer as JSON with `--json`, otherwise as text, then raise its errors.

        Lines of a generator are computed only if they are written.
        """
        if self.json:
            write_json(as_json())
        else:
            write("\n".join(lines) + "\n")
        if errors:
            raise PartialAnswerError("; ".join(map(str, errors)))


@dataclass(frozen=True, kw_only=True)
class TypicalOptions:
    """The option for typical values of precision and stiffness."""

    typical: values.Flag = False
    """Assume typical errors, stiffness, struts and tolerances where the design states none, and say
    so."""

    def with_typical(self, design: Design) -> tuple[Design, tuple[str, ...]]:
        """Return the design with what is assumed of it, and in words what that is."""
        return typical_machine(design) if self.typical else (design, ())


@dataclass(frozen=True, kw_only=True)
class MachineOptions:
    """The option for the machine that was built."""

    machine: Annotated[Path | None, values.hint("default: the design itself", "FILE.json")] = None
    """Machine that was built of the design, as `explorer calibrate` writes it."""

    def read_machine(self, design: Design) -> BuiltMachine | None:
        """Return the machine that was built of a design, None for the design itself."""
        from explorer.calibration.machine_file import load_machine

        return None if self.machine is None else load_machine(self.machine, design)


@dataclass(frozen=True, kw_only=True)
class RadiiOptions:
    """The option for the radii of the legs."""

    radii: Annotated[
        Quadruple | None, values.numbers("r1 r2 r3 r4", or_one=True), values.OF_DESIGN
    ] = None
    """Radii of the four legs in design units, or one for all."""

    def with_radii(self, design: Design) -> Design:
        """Return the design with the given radii."""
        return design if self.radii is None else design.with_limits(leg_radii=self.radii)


@dataclass(frozen=True, kw_only=True)
class PointOptions(DesignOptions):
    """The options for the design, and for the point of the platform that is meant."""

    at: Point = "b4"
    """Point whose positions are meant, and at which loads act and results hold: b4 or the tool of
    the design."""

    def tool(self, design: Design) -> Triple | None:
        """Return the tool point in the platform frame, in design units; None for b4."""
        return design.tool.position if self.at == "tool" else None

    def shift(self, design: Design, pose: Pose) -> FloatArray:
        """Return the vector from b4 to the point in the base frame, shape (3,)."""
        return offset_of(design, pose.rotation, self.at)


def make_pose(
    command: object,
    prefix: str,
    default: Pose,
    position: values.Numbers | None = None,
    tool: Triple | None = None,
) -> Pose:
    """Return the pose that options give, completed from a default pose.

    The command has the options for orientation and folds, in fields whose names start with a prefix
    such as ``to_``. The position of b4 or the tool in the base frame may go on with yaw, pitch and
    roll in degrees or with a quaternion; without one the tool stays in place. The tool is a point
    in the platform frame, None if positions are those of b4. Lengths are in design units.
    """
    option = f"--{prefix.replace('_', '-')}"
    # Values of options have the types of the fields below.
    given: dict[str, Any] = {
        name: value
        for name in ("quaternion", "yaw_pitch_roll", "tilt_torsion", "folds")
        if (value := getattr(command, prefix + name, None)) is not None
    }
    named = [option + name.replace("_", "-") for name in given]
    if position is not None and len(position) > 3:
        if given:
            raise InputError(f"{option[:-1]} has an orientation already; leave {named[0]} out")
        given["quaternion" if len(position) > 6 else "yaw_pitch_roll"] = position[3:]
    folds = given.pop("folds", None)
    if len(given) > 1:
        raise InputError(f"give one of {named[0]} and {named[1]}, not both")
    if folds is not None:
        others = [*["the position"] * (position is not None), *named[:-1]]
        if others:
            raise InputError(f"{option}folds is a whole pose; leave {' and '.join(others)} out")
        return pose_of_folds(folds)
    place: Any = default.position if position is None else position[:3]
    if "tilt_torsion" in given:
        pose = pose_of_tilt_torsion(place, given["tilt_torsion"])
    elif "yaw_pitch_roll" in given:
        pose = Pose.of_yaw_pitch_roll(place, given["yaw_pitch_roll"])
    else:
        pose = Pose(place, given.get("quaternion", default.quaternion))
    if tool is None or (position is None and not given):
        return pose
    here = tool_position(default, tool) if position is None else place
    x, y, z = (np.array(here) - tool_offset(pose.rotation, tool)).tolist()
    return Pose((x, y, z), pose.quaternion)


END_OPTIONS = "with --to, --to-quaternion, --to-yaw-pitch-roll, --to-tilt-torsion or --to-folds"
_INSTEAD, _INSTEAD_AT_END = (values.hint(f"instead of --{at}quaternion") for at in ("", "to-"))


@dataclass(frozen=True, kw_only=True)
class EndOptions:
    """The options for the orientation or the folds at the end of a move."""

    to_quaternion: Annotated[values.Quaternion, values.hint("default: that of the start")] = None
    """Orientation of the platform at the end."""

    to_yaw_pitch_roll: Annotated[values.YawPitchRoll, _INSTEAD_AT_END] = None
    """Orientation of the platform at the end, in degrees."""

    to_tilt_torsion: Annotated[values.TiltTorsion, _INSTEAD_AT_END] = None
    """Azimuth, tilt and torsion of the platform at the end, in degrees."""

    to_folds: Annotated[values.Folds, values.hint("instead of --to")] = None
    """Folds of the pose at the end; r in design units, angles in degrees."""

    def end(self, start: Pose, to: values.Numbers | None, tool: Triple | None) -> Pose | None:
        """Return the given pose completed from the start, as `make_pose` does; None without one."""
        given = to, self.to_quaternion, self.to_yaw_pitch_roll, self.to_tilt_torsion, self.to_folds
        return make_pose(self, "to_", start, to, tool) if any(given) else None


@dataclass(frozen=True, kw_only=True)
class OrientationOptions:
    """The options for the orientation; that of the home pose by default."""

    quaternion: Annotated[values.Quaternion, values.OF_HOME] = None
    """Orientation of the platform; of any length but zero."""

    yaw_pitch_roll: Annotated[values.YawPitchRoll, _INSTEAD] = None
    """Orientation of the platform: angles in degrees about its own z, then y, then x axis."""

    tilt_torsion: Annotated[values.TiltTorsion, _INSTEAD] = None
    """Orientation of the platform in T&T angles: azimuth and angle of its tilt, and its torsion, in
    degrees."""

    @property
    def has_orientation(self) -> bool:
        """Whether one of the options is given."""
        return any((self.quaternion, self.yaw_pitch_roll, self.tilt_torsion))

    def oriented_home(self, design: Design) -> Pose:
        """Return the home pose of the design with the given orientation, as `make_pose` does."""
        return make_pose(self, "", design.home_pose)


@dataclass(frozen=True, kw_only=True)
class PoseOptions(OrientationOptions, PointOptions):
    """The options for the design and the pose, which is the home pose by default."""

    position: Annotated[values.Position, values.OF_HOME] = None
    """Position of b4, or of the tool, in the base frame, in design units."""

    folds: Annotated[values.Folds, values.hint("instead of position and orientation")] = None
    """Folds of the pose: the distance r of a1 and b4 in design units, then angles in degrees, beta
    and epsilon from 0 to 180, phi1, phi2 and phi3 from -180 to 180."""

    def pose(self, design: Design) -> Pose:
        """Return the given pose completed from the home pose, as `make_pose` does."""
        return make_pose(self, "", design.home_pose, self.position, self.tool(design))


def check_has_limits(design: Design) -> None:
    """Check that a part of a design has a limit."""
    if not has_limits(design):
        raise InputError(
            "the design limits neither its actuators nor its struts nor its guide, so that it "
            "holds any load: give its file a limit, such as actuators.push_n"
        )


def carrying_part(workspace: Workspace, load: Six, tolerance: float | None) -> CarriedRegion:
    """Return the part of a workspace that holds a load (F; M) at the tool, in N and N × unit."""
    from explorer.workspace.carried_region import carried_region

    check_has_limits(workspace.design)
    return carried_region(workspace, load, tolerance=tolerance)


def check_out(out: Path, table: Path | None) -> None:
    """Check that a file can be written, and is not the table that is read.

    Raises:
        InputError: The file is the table.
        StorageError: The file cannot be written.
    """
    if table is not None and table.exists() and out.exists() and out.samefile(table):
        raise InputError(f"--out {out} is the table to read; name another file")
    check_writable(out)
