"""Base classes of the commands, with the options that they share: design, pose, output."""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass
from typing import Annotated

import msgspec
import tyro

from explorer.cli.values import numbers
from explorer.errors import DesignError, ExplorerError, InputError
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import load_design
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import Pose, Quadruple, Triple


@dataclass(frozen=True, kw_only=True)
class DesignOptions:
    """The option for the design."""

    design: Annotated[str, tyro.conf.arg(metavar="PRESET_OR_FILE")] = "paper-optimal"
    """A preset (paper-initial, paper-optimal), a design file (JSON), or the name of a design
    saved on the page."""

    def load(self) -> Design:
        """Return the design.

        Raises:
            DesignError: no such preset, file or saved design, or a file without a design.
        """
        return load(self.design)


def load(name: str) -> Design:
    """Return a preset, the design in a file, or a design saved on the page.

    Raises:
        DesignError: no such preset, file or saved design, or a file without a design.
    """
    try:
        return load_design(name)
    except DesignError:
        # A file of this name exists, so it was meant, and is invalid.
        if os.path.exists(name):  # noqa: PTH110 - that of a Path raises for names too long
            raise
        from explorer.app.storage.library import Library

        with contextlib.suppress(ExplorerError):
            return Library().open(name)
        raise


@dataclass(frozen=True, kw_only=True)
class JsonOptions:
    """The option for JSON."""

    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Write one JSON object to standard output, and nothing else."""


@dataclass(frozen=True, kw_only=True)
class RadiiOptions:
    """The option for the radii of the legs."""

    radii: Annotated[
        Quadruple | None,
        numbers("--radii", "r1 r2 r3 r4", or_one=True),
        tyro.conf.arg(help_behavior_hint="(default: those of the design)"),
    ] = None
    """Radii of the four legs in design units, or one for all."""

    def with_radii(self, design: Design) -> Design:
        """Return the design with the given radii.

        Raises:
            DesignError: a radius is negative.
        """
        if self.radii is None:
            return design
        limits = msgspec.structs.replace(design.limits, leg_radii=self.radii)
        return msgspec.structs.replace(design, limits=limits)


_THE_HOME = tyro.conf.arg(help_behavior_hint="(default: that of the home pose)")


@dataclass(frozen=True, kw_only=True)
class OrientationOptions:
    """The options for the orientation; that of the home pose by default."""

    quaternion: Annotated[Quadruple | None, numbers("--quaternion", "w x y z"), _THE_HOME] = None
    """Orientation of the platform; of any length but zero."""

    yaw_pitch_roll: Annotated[
        Triple | None,
        numbers("--yaw-pitch-roll", "yaw pitch roll"),
        tyro.conf.arg(help_behavior_hint="(instead of --quaternion)"),
    ] = None
    """Orientation of the platform: angles in degrees about its own z, then y, then x axis."""

    def oriented_home(self, design: Design) -> Pose:
        """Return the home pose of the design, with the given orientation.

        Raises:
            InputError: two orientations, or a quaternion of length zero.
        """
        if self.quaternion is not None and self.yaw_pitch_roll is not None:
            raise InputError("give one of --quaternion and --yaw-pitch-roll, not both")
        home = home_pose(design)
        if self.yaw_pitch_roll is not None:
            return Pose.of_yaw_pitch_roll(home.position, self.yaw_pitch_roll)
        return Pose(home.position, self.quaternion or home.quaternion)


@dataclass(frozen=True, kw_only=True)
class PoseOptions(OrientationOptions):
    """The options for the pose; position and orientation are those of the home pose by default."""

    position: Annotated[Triple | None, numbers("--position", "x y z"), _THE_HOME] = None
    """Position of b4 in the base frame, in design units."""

    def pose(self, design: Design) -> Pose:
        """Return the pose, completed from the home pose.

        Raises:
            InputError: two orientations, or a quaternion of length zero.
        """
        oriented = self.oriented_home(design)
        return oriented if self.position is None else Pose(self.position, oriented.quaternion)
