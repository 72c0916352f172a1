"""Base classes of the commands, with the options that they share: design, pose, output."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import msgspec
import numpy as np
import tyro

from explorer.cli.output import write_json, write_lines
from explorer.cli.values import DESIGN_NAME, OF_DESIGN, OF_HOME, Flag, fold_numbers, hint, numbers
from explorer.errors import DesignError, ExplorerError, InputError, StorageError
from explorer.mechanism.configuration import Point, offset_of, tool_offset, tool_position
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import load_design, typical_machine
from explorer.mechanism.folds import pose_of_folds
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Pose, Quadruple, Triple
from explorer.mechanism.tilt_torsion import pose_of_tilt_torsion
from explorer.numerics.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class DesignOptions:
    """The option for the design."""

    design: Annotated[str, tyro.conf.arg(metavar=DESIGN_NAME)] = "paper-optimal"
    """A preset (paper-initial, paper-optimal), a design file (JSON), or the name of a design
    saved on the page."""

    def read_design(self) -> Design:
        """Return the design, as `load` does."""
        return load(self.design)


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
    from explorer.files.writing import write_whole

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

    json: Flag = False
    """Write one JSON object to standard output, and nothing else."""

    def write(
        self,
        as_json: Callable[[], Mapping[str, object]],
        as_lines: Callable[[], Iterable[str]],
        errors: Sequence[ExplorerError] = (),
    ) -> None:
        """Write the answer to standard output: as JSON with `--json`, otherwise as text.

        Args:
            as_json: Returns the answer as plain values.
            as_lines: Returns the answer as lines of text.
            errors: Errors that keep the answer from being whole.
        """
        if self.json:
            write_json(as_json())
        else:
            write_lines(*as_lines())
        if errors:
            raise PartialAnswerError("; ".join(map(str, errors)))


@dataclass(frozen=True, kw_only=True)
class TypicalOptions:
    """The option for typical values of precision and stiffness."""

    typical: Flag = False
    """Assume typical errors, stiffness, struts and tolerances where the design states none, and say
    so."""

    def with_typical(self, design: Design) -> tuple[Design, tuple[str, ...]]:
        """Return the design with what is assumed of it, and in words what that is."""
        return typical_machine(design) if self.typical else (design, ())


@dataclass(frozen=True, kw_only=True)
class RadiiOptions:
    """The option for the radii of the legs."""

    radii: Annotated[
        Quadruple | None, numbers("--radii", "r1 r2 r3 r4", or_one=True), OF_DESIGN
    ] = None
    """Radii of the four legs in design units, or one for all."""

    def with_radii(self, design: Design) -> Design:
        """Return the design with the given radii."""
        if self.radii is None:
            return design
        limits = msgspec.structs.replace(design.limits, leg_radii=self.radii)
        return msgspec.structs.replace(design, limits=limits)


@dataclass(frozen=True, kw_only=True)
class PointOptions:
    """The option for the point of the platform that is meant."""

    at: Point = "b4"
    """Point whose positions are meant, and at which loads act and results hold: b4 or the tool of
    the design."""

    def tool(self, design: Design) -> Triple | None:
        """Return the tool point in the platform frame, in design units; None for b4."""
        return design.tool.position if self.at == "tool" else None

    def shift(self, design: Design, pose: Pose) -> FloatArray | None:
        """Return the vector from b4 to the tool in the base frame, shape (3,); None for b4."""
        return offset_of(design, pose.rotation, "tool") if self.at == "tool" else None


def make_pose(
    option: str,
    default: Pose,
    position: Triple | None,
    quaternion: Quadruple | None,
    yaw_pitch_roll: Triple | None,
    tilt_torsion: Triple | None,
    folds: Six | None = None,
    tool: Triple | None = None,
) -> Pose:
    """Return the pose that options give, completed from a default pose.

    Args:
        option: Start of the names of the options for orientation and folds, such as ``--to-``.
        default: Pose that completes what is not given; without a position the tool stays in place.
        position: Position of b4 or the tool in the base frame, in design units.
        quaternion: Orientation as (w, x, y, z), of any length but zero.
        yaw_pitch_roll: Orientation as angles in degrees.
        tilt_torsion: Orientation as azimuth, tilt and torsion in degrees.
        folds: The whole pose as r in design units and five angles in degrees.
        tool: Tool point in the platform frame, in design units; None if positions are those of b4.
    """
    orientations = {
        "quaternion": quaternion,
        "yaw-pitch-roll": yaw_pitch_roll,
        "tilt-torsion": tilt_torsion,
    }
    given = [f"{option}{name}" for name, value in orientations.items() if value is not None]
    if len(given) > 1:
        raise InputError(f"give one of {given[0]} and {given[1]}, not both")
    if folds is not None:
        if position is not None:
            given.insert(0, "the position")
        if given:
            raise InputError(f"{option}folds is a whole pose; leave {' and '.join(given)} out")
        return pose_of_folds(folds)
    at = default.position if position is None else position
    if tilt_torsion is not None:
        pose = pose_of_tilt_torsion(at, tilt_torsion)
    elif yaw_pitch_roll is not None:
        pose = Pose.of_yaw_pitch_roll(at, yaw_pitch_roll)
    else:
        pose = Pose(at, quaternion or default.quaternion)
    if tool is None or (position is None and not given):
        return pose
    here = tool_position(default, tool) if position is None else position
    x, y, z = (np.array(here) - tool_offset(pose.rotation, tool)).tolist()
    return Pose((x, y, z), pose.quaternion)


_INSTEAD = hint("instead of --quaternion")


@dataclass(frozen=True, kw_only=True)
class EndOptions:
    """The options for the orientation or the folds at the end of a move."""

    to_quaternion: Annotated[
        Quadruple | None,
        numbers("--to-quaternion", "w x y z"),
        hint("default: that of the start"),
    ] = None
    """Orientation of the platform at the end."""

    to_yaw_pitch_roll: Annotated[
        Triple | None,
        numbers("--to-yaw-pitch-roll", "yaw pitch roll"),
        hint("instead of --to-quaternion"),
    ] = None
    """Orientation of the platform at the end, in degrees."""

    to_tilt_torsion: Annotated[
        Triple | None,
        numbers("--to-tilt-torsion", "azimuth tilt torsion"),
        hint("instead of --to-quaternion"),
    ] = None
    """Azimuth, tilt and torsion of the platform at the end, in degrees."""

    to_folds: Annotated[Six | None, fold_numbers("--to-folds"), hint("instead of --to")] = None
    """Folds of the pose at the end; r in design units, angles in degrees."""

    @property
    def end(self) -> tuple[Quadruple | None, Triple | None, Triple | None, Six | None]:
        """The orientations and folds that may be given, in the order of `make_pose`."""
        return self.to_quaternion, self.to_yaw_pitch_roll, self.to_tilt_torsion, self.to_folds


@dataclass(frozen=True, kw_only=True)
class OrientationOptions:
    """The options for the orientation; that of the home pose by default."""

    quaternion: Annotated[Quadruple | None, numbers("--quaternion", "w x y z"), OF_HOME] = None
    """Orientation of the platform; of any length but zero."""

    yaw_pitch_roll: Annotated[
        Triple | None, numbers("--yaw-pitch-roll", "yaw pitch roll"), _INSTEAD
    ] = None
    """Orientation of the platform: angles in degrees about its own z, then y, then x axis."""

    tilt_torsion: Annotated[
        Triple | None, numbers("--tilt-torsion", "azimuth tilt torsion"), _INSTEAD
    ] = None
    """Orientation of the platform in T&T angles: azimuth and angle of its tilt, and its torsion, in
    degrees."""

    def oriented_home(self, design: Design) -> Pose:
        """Return the home pose of the design with the given orientation, as `make_pose` does."""
        return make_pose("--", design.home_pose, None, *self._orientation)

    @property
    def _orientation(self) -> tuple[Quadruple | None, Triple | None, Triple | None]:
        """The orientations that may be given, in the order of `make_pose`."""
        return self.quaternion, self.yaw_pitch_roll, self.tilt_torsion


@dataclass(frozen=True, kw_only=True)
class PoseOptions(OrientationOptions, PointOptions):
    """The options for the pose; position and orientation are those of the home pose by default."""

    position: Annotated[Triple | None, numbers("--position", "x y z"), OF_HOME] = None
    """Position of b4, or of the tool, in the base frame, in design units."""

    folds: Annotated[
        Six | None, fold_numbers("--folds"), hint("instead of position and orientation")
    ] = None
    """Folds of the pose: the distance r of a1 and b4 in design units, then angles in degrees, beta
    and epsilon from 0 to 180, phi1, phi2 and phi3 from -180 to 180."""

    def pose(self, design: Design) -> Pose:
        """Return the given pose completed from the home pose, as `make_pose` does."""
        given = (design.home_pose, self.position, *self._orientation, self.folds)
        return make_pose("--", *given, self.tool(design))
