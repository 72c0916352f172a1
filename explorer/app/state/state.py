"""The state of the application, a frozen value from which the page is drawn.

There is one state for the whole server, shared by every tab. It changes only through
`explorer.app.session.session`, by actions, see `explorer.app.state.actions`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer.app.state.parts import (
    LENGTHS,
    STAYS,
    TRANSIENT,
    Parts,
    in_unit,
    keep_on_open,
    new_parts,
)
from explorer.app.state.view import View
from explorer.errors import InputError
from explorer.mechanism import pose as poses, tilt_torsion as tilts
from explorer.mechanism.configuration import Point, offset_of, point_of, position_of
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.machine import Six
from explorer.mechanism.margins import TETRAHEDRA, margins, mode_of
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics import arrays
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import Unit
from explorer.page.state.presses import Press
from explorer.singularity.colours import WARN_SHARE

Mode = Annotated[int, msgspec.Meta(ge=0, le=7)]
"""Index of an assembly mode."""
Joints = tuple[float, float, float, float, float, float]
Folds = tuple[float, float, float, float, float, float]
Hold = Literal["pose", "legs"]
# Difference of the entries of rotation matrices up to which they are the same but for rounding.
SAME_ROTATION = 1e-12
POINTS: dict[Point, str] = {"b4": "b4", "tool": "the tool"}
"""Words for the point whose position is meant."""


@dataclass(frozen=True)
class Unclosed:
    """Joints that were asked for and cannot close; the mechanism keeps its last pose.

    The joint that was moved is given by its index, and the nearest value that closes is None if
    none is. Failing are those of the three trilaterations, 0 to 2, that have no solution.
    """

    joint: Annotated[int, msgspec.Meta(ge=0, le=5)]
    asked: float
    nearest: float | None
    failing: tuple[int, ...]

    def words(self, unit: Unit) -> str:
        """Return why they do not close, and what would, with a unit of lengths."""
        tetrahedra = " and ".join(" ".join(TETRAHEDRA[i]) for i in self.failing)
        kind = "tetrahedron" if len(self.failing) == 1 else "tetrahedra"
        advice = (
            f"the nearest value that closes is {unit.text(self.nearest, 6)}, at a singular pose"
            if self.nearest is not None
            else "with the other legs as they are, no value works"
        )
        name = JOINTS[self.joint]
        asked = unit.text(self.asked, 6)
        return f"{name} = {asked} cannot close the {kind} {tetrahedra}; {advice}."


@dataclass(frozen=True)
class GivenFolds:
    """The folds of a pose as the user set them: r in design units, the angles in degrees.

    They count while the pose that they led to is the present one.
    """

    folds: Folds
    pose: Pose


@dataclass(frozen=True)
class Gesture:
    """A move of the platform by one control, from press to release, in however many events.

    It has the pose in which it began, the time of its last event in seconds, and the last press
    of a browser that it was part of; None if that is not known.
    """

    start: Pose
    source: object
    last: float
    press: Press | None = None


@dataclass(frozen=True)
class State:
    """The state, from which everything on the page follows.

    Attributes:
        base: The design as it was opened, to which reset returns.
        pose: The last pose that closes.
        yaw_pitch_roll: The angles of the pose in degrees, as the user gave them.
        joints: The joints as last set; those of the pose unless `unclosed` is given.
        mode: The assembly mode; at a singular pose the one before it.
        hold: Whether the pose or the legs stay when the design changes.
        unclosed: Why the joints do not close; None if they do.
        taken: The joints that a length led to that was taken in the place of one that does not
            close, and why it was taken, a sentence; None if none was.
        gesture: The gesture that led to the pose; None if none did, as after a change of the
            design.
        parts: The parts of the features by their names; `FeaturePart.of` returns one.
        set_tilt_torsion: Azimuth, tilt and torsion in degrees as the user last set them, which
            count while they give the rotation of the pose; None if none were set.
        set_tool_angles: Yaw, pitch and roll of the tool in degrees as the user last set them, which
            count while they give the tool's orientation; None if none were set.
        set_folds: The folds as the user last set them; None if none were set.
    """

    design: Design
    base: Design
    pose: Pose
    yaw_pitch_roll: Triple
    joints: Joints
    mode: Mode
    hold: Hold = field(default="pose", metadata=STAYS)
    unclosed: Unclosed | None = None
    view: View = field(default_factory=View, metadata={**STAYS, **LENGTHS})
    taken: tuple[Joints, str] | None = field(default=None, compare=False, metadata=TRANSIENT)
    gesture: Gesture | None = field(default=None, metadata=TRANSIENT)
    parts: Parts = field(default_factory=new_parts, metadata={"on_open": keep_on_open, **LENGTHS})
    set_tilt_torsion: tilts.TiltTorsion | None = None
    set_tool_angles: Triple | None = None
    set_folds: GivenFolds | None = None

    def in_unit_of(self, design: Design) -> State:
        """Return the state with its `LENGTHS` in the unit of a design, as the page shows them."""
        return in_unit(self, self.unit, self.view.unit_for(design))

    def for_step(self) -> State:
        """Return what a step of the history keeps: without gesture and what else goes on."""
        parts = {name: part.for_step() for name, part in self.parts.items()}
        return replace(self, gesture=None, parts=parts)

    def with_view_of(self, other: State) -> State:
        """Return the state with the view of another one, but for the point that is shown and set.

        Its lengths stay as the page shows them.
        """
        view = in_unit(other.view, other.unit, other.view.unit_for(self.design))
        return replace(self, view=replace(view, at=self.view.at))

    def restore_over(self, present: State) -> State:
        """Return the state, of a step, with what stays of the present one: the view and counts.

        Raises:
            InputError: The design cannot be changed now.
        """
        if present.busy:
            raise InputError(f"{present.busy}: cancel that first, then undo what led to it")
        parts = {name: part.continue_from(present.parts[name]) for name, part in self.parts.items()}
        return replace(self.with_view_of(present), parts=parts)

    def check_free(self) -> None:
        """Check that the design may be changed.

        Raises:
            InputError: It may not, for instance while it is being optimised.
        """
        if self.busy:
            raise InputError(f"{self.busy}: wait until that is done, or cancel it")

    @property
    def busy(self) -> str:
        """Why the design cannot be changed now, as a clause; "" if it can."""
        return next((part.busy for part in self.parts.values() if part.busy), "")

    @property
    def tilt_torsion(self) -> tilts.TiltTorsion:
        """Azimuth, tilt and torsion of the pose in degrees, as the user set them if known.

        At tilt 0 and 180° the rotation does not determine all three.
        """
        given, rotation = self.set_tilt_torsion, self.pose.rotation
        if given is not None and _are_same(tilts.rotation_from_tilt_torsion(given), rotation):
            return given
        return tilts.tilt_torsion_of(rotation)

    @property
    def tool_angles(self) -> Triple:
        """Yaw, pitch and roll of the tool on the platform, in degrees, as set if known.

        At a pitch of ±90° the orientation does not determine all three.
        """
        given, tool = self.set_tool_angles, Pose((0.0, 0.0, 0.0), self.design.tool.quaternion)
        if given is not None and _are_same(
            poses.rotation_from_yaw_pitch_roll(given), tool.rotation
        ):
            return given
        return tool.yaw_pitch_roll

    @property
    def unit(self) -> Unit:
        """The unit in which lengths are shown and typed."""
        return self.view.unit_for(self.design)

    def unit_of(self, power: int) -> Unit:
        """Return the unit of quantities with a power of length, such as 3 for volumes."""
        return self.unit.to_power(power, self.design.reach**3)

    @property
    def point(self) -> str:
        """The words for the point whose position is shown and set."""
        return POINTS[self.view.at]

    @property
    def position(self) -> Triple:
        """The position of that point in the base frame, in design units."""
        return position_of(self.design, self.pose, self.view.at)

    @property
    def tool(self) -> Triple | None:
        """The shown point in the platform frame, in design units; None if it is b4."""
        point = point_of(self.design, self.view.at)
        return point if any(point) else None

    def offset(self, rotation: ArrayLike) -> FloatArray:
        """Return the vector (..., 3) from b4 to that point, along base axes, of rotations."""
        return offset_of(self.design, np.asarray(rotation), self.view.at)

    def pose_at(self, position: Triple, orientation: Pose) -> Pose:
        """Return the pose with the orientation of a pose, and that point at a position.

        Raises:
            InputError: The position is not finite, or too far away.
        """
        b4 = arrays.triple(np.array(position) - self.offset(orientation.rotation))
        return Pose(b4, orientation.quaternion)

    @property
    def load(self) -> Six:
        """The load at the tool as (F; M), base axes, in N and N × unit."""
        forces, units = self.view.forces, 1e3 / self.design.unit_mm
        fx, fy, fz = forces.force
        mx, my, mz = (units * each for each in forces.moment)
        return fx, fy, fz, mx, my, mz

    @property
    def remark(self) -> str | None:
        """Why the present length is not the one that the user set; None where it is."""
        joints, words = self.taken or (None, "")
        return words if joints == self.joints else None

    @property
    def warn_below(self) -> float:
        """The length below which margins are warned of, in design units."""
        given = self.view.warn_below
        return WARN_SHARE * self.design.reach if given is None else given


def _are_same(one: FloatArray, other: FloatArray) -> bool:
    """Whether two rotation matrices are the same but for rounding."""
    return bool(np.allclose(one, other, rtol=0.0, atol=SAME_ROTATION))


def open_state(design: Design, pose: Pose | None = None, view: View | None = None) -> State:
    """Return the state in which a design opens: in its home pose unless another is given."""
    at = design.home_pose if pose is None else pose
    return State(
        design=design,
        base=design,
        pose=at,
        yaw_pitch_roll=at.yaw_pitch_roll,
        joints=joints_of(design, at),
        mode=mode_at(at, previous=0),
        view=view or View(),
    )


def joints_of(design: Design, pose: Pose) -> Joints:
    """Return the joints of a pose as plain numbers."""
    l1, d1, d2, d3, d4, l4 = inverse(design, pose.position, pose.rotation).tolist()
    return (l1, d1, d2, d3, d4, l4)


def mode_at(pose: Pose, previous: int) -> int:
    """Return the mode of a pose; a margin that is exactly zero keeps its previous sign."""
    margin = margins(pose.position, pose.rotation)
    bits = np.where(margin == 0.0, previous & np.array([4, 2, 1]), 0).sum()
    return int(mode_of(margin)) | int(bits)
