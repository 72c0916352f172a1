"""The state of the application, a frozen value, and the frame that is drawn from it.

There is one state for the whole server, shared by every tab. It changes through one
door, `explorer.app.session`, by the actions of `explorer.app.actions`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from explorer.app.compared import Compared
from explorer.app.jog import Jog
from explorer.app.optimisation import Optimisation
from explorer.app.paths import Journey, Paths
from explorer.app.presses import Press
from explorer.app.prototype_view import PrototypeView
from explorer.app.singular_view import SingularView
from explorer.app.studies import Studies
from explorer.colours import WARN_SHARE
from explorer.design import JOINTS, Design
from explorer.errors import InputError
from explorer.home import home_pose
from explorer.kinematics import inverse
from explorer.moves import MoveClearance, move_clearance
from explorer.performance import (
    Performance,
    SingularityFreeBall,
    performance,
    singularity_free_ball,
)
from explorer.pose import Pose, Triple, yaw_pitch_roll_from_rotation
from explorer.singularity import TETRAHEDRA, margins, mode_of
from explorer.snapshot import Snapshot, evaluate
from explorer.uncoupled import Travel, travels
from explorer.verdict import Verdict, verdict

Joints = tuple[float, float, float, float, float, float]
Hold = Literal["pose", "legs"]


@dataclass(frozen=True)
class WorkspaceView:
    """How the constant-orientation workspace is shown.

    Attributes:
        solid: Whether the solid is drawn.
        region: Whether it is all that is within the limits, or what of it can be reached
            without a collision of legs.
        start: Whether it is to be reached from the home position, or from the present one.
        hull: Whether its convex hull is drawn.
        planes: Whether the three singularity planes are drawn.
        orientation: Whether it is that of the present pose, or of the home pose.
        colour: By what its surface is coloured.
        cut: The axis along which it is cut open, or None.
        level: The coordinate at which it is cut, in design units; None for the middle of its
            extent, which also counts where this is beyond it.
        tolerance: Largest distance of a facet from the true surface, in design units; None
            for a share of the reach.
    """

    solid: bool = False
    region: Literal["limits", "reachable"] = "limits"
    start: Literal["home", "pose"] = "home"
    hull: bool = False
    planes: bool = False
    orientation: Literal["pose", "home"] = "pose"
    colour: Literal["plain", "margin", "condition"] = "plain"
    cut: Literal["x", "y", "z"] | None = None
    level: float | None = None
    tolerance: float | None = None


@dataclass(frozen=True)
class View:
    """What is shown, and how.

    Attributes:
        flags, bodies, legs, labels, grid, handle: Whether each is drawn.
        tetrahedra: Whether each of the three is drawn.
        clearance: Whether the closest pair of legs is marked.
        swept: Whether the tetrahedra are drawn that the legs swept in the last move.
        radius_curve: Whether the reachable volume is drawn against the radius of the legs.
        ghosts: Whether the seven other assembly modes are drawn.
        twin: Whether the 6-4 twin's six legs replace the four.
        warn_below: The length below which margins are warned of, in design units; distances
            are warned of below a share of it, see `explorer.verdict`. None for a share of the
            reach.
        prototype: How the prototype is shown.
        workspace: How the workspace is shown.
        singular: How singularities are shown.
    """

    flags: bool = True
    bodies: bool = True
    legs: bool = True
    labels: bool = True
    grid: bool = True
    handle: bool = True
    tetrahedra: tuple[bool, bool, bool] = (True, True, True)
    clearance: bool = False
    swept: bool = False
    radius_curve: bool = False
    ghosts: bool = False
    twin: bool = False
    warn_below: float | None = None
    prototype: PrototypeView = field(default_factory=PrototypeView)
    workspace: WorkspaceView = field(default_factory=WorkspaceView)
    singular: SingularView = field(default_factory=SingularView)


@dataclass(frozen=True)
class Unclosed:
    """Joints that were asked for and cannot close; the mechanism keeps its last pose.

    Attributes:
        joint: Index of the joint that was moved.
        asked: The value it was moved to.
        nearest: The nearest value that closes, the others as they are; None if none is.
        failing: Which of the three trilaterations have no solution, 0 to 2.
    """

    joint: int
    asked: float
    nearest: float | None
    failing: tuple[int, ...]

    def __str__(self) -> str:
        which = " and ".join(" ".join(TETRAHEDRA[i]) for i in self.failing)
        kind = "tetrahedron" if len(self.failing) == 1 else "tetrahedra"
        advice = (
            f"the nearest value that closes is {self.nearest:.6g}, where the pose is singular; "
            "“Use the nearest length” stops short of it"
            if self.nearest is not None
            else "with the other legs as they are, no value works"
        )
        name = JOINTS[self.joint]
        return f"{name} = {self.asked:.6g} cannot close the {kind} {which}; {advice}."


@dataclass(frozen=True)
class Taken:
    """A length that was taken in the place of the one asked for.

    Attributes:
        joints: The joints that it led to; the words hold while they are the present ones.
        words: Why it was taken, a sentence.
    """

    joints: Joints
    words: str


@dataclass(frozen=True)
class Gesture:
    """A move of the platform by one hand, however many events it came in.

    Attributes:
        start: The pose in which it began.
        source: What was moved by it, for instance a slider.
        last: When its last event happened, in seconds.
        press: The last press of a browser that it was part of; None if it is not known.
    """

    start: Pose
    source: object
    last: float
    press: Press | None = None


@dataclass(frozen=True)
class State:
    """Everything that the page shows follows from this.

    Attributes:
        design: The manipulator.
        base: The design as it was opened, to which reset returns.
        pose: The last pose that closes.
        yaw_pitch_roll: Its angles in degrees, kept as they were given.
        joints: As asked for; those of the pose unless `unclosed` says otherwise.
        mode: The assembly mode; at a singular pose the one it came from.
        hold: What stays when the design changes.
        unclosed: Why the joints asked for do not close, if they do not.
        view: What is shown.
        taken: The length that was last taken in the place of one that does not close.
        gesture: What brought the platform to its pose; None where nothing moved it there,
            as after a change of the design.
        jog: The uncoupled motion that was last used.
        paths: The path that is played, and what is stored to plan one.
        optimisation: What is to be optimised, and how far that has got.
        compared: What the design is compared with.
        studies: Which study of designs is looked at, and how.
    """

    design: Design
    base: Design
    pose: Pose
    yaw_pitch_roll: Triple
    joints: Joints
    mode: int
    hold: Hold = "pose"
    unclosed: Unclosed | None = None
    view: View = field(default_factory=View)
    taken: Taken | None = field(default=None, compare=False)
    gesture: Gesture | None = None
    jog: Jog | None = None
    paths: Paths = field(default_factory=Paths)
    optimisation: Optimisation = field(default_factory=Optimisation)
    compared: Compared = field(default_factory=Compared)
    studies: Studies = field(default_factory=Studies)

    @property
    def jog_in_use(self) -> Jog | None:
        """The uncoupled motion that brought the platform here; None once it is elsewhere."""
        return self.jog if self.jog is not None and self.jog.pose == self.pose else None

    @property
    def remark(self) -> str | None:
        """Why the present length is not the one that was asked for; None where it is."""
        taken = self.taken
        return taken.words if taken is not None and taken.joints == self.joints else None

    @property
    def journey(self) -> Journey | None:
        """The path at hand; None where it was made for another design."""
        journey = self.paths.journey
        return journey if journey is not None and journey.design == self.design else None

    @property
    def warn_below(self) -> float:
        """The length below which margins are warned of, in design units."""
        given = self.view.warn_below
        return WARN_SHARE * self.design.reach if given is None else given


def opened(design: Design, pose: Pose | None = None, view: View | None = None) -> State:
    """Return the state in which a design opens: in its home pose unless told otherwise."""
    at = home_pose(design) if pose is None else pose
    return State(
        design=design,
        base=design,
        pose=at,
        yaw_pitch_roll=angles_of(at),
        joints=joints_of(design, at),
        mode=mode_at(at, previous=0),
        view=view or View(),
    )


def joints_of(design: Design, pose: Pose) -> Joints:
    """Return the joints of a pose as plain numbers."""
    l1, d1, d2, d3, d4, l4 = inverse(design, pose.position, pose.rotation).tolist()
    return (l1, d1, d2, d3, d4, l4)


def angles_of(pose: Pose) -> Triple:
    """Return yaw, pitch and roll of a pose in degrees as plain numbers."""
    yaw, pitch, roll = yaw_pitch_roll_from_rotation(pose.rotation).tolist()
    return (yaw, pitch, roll)


def mode_at(pose: Pose, previous: int) -> int:
    """Return the mode of a pose; a margin that is exactly zero keeps its previous sign."""
    margin = margins(pose.position, pose.rotation)
    bits = np.where(margin == 0.0, previous & np.array([4, 2, 1]), 0).sum()
    return int(mode_of(margin)) | int(bits)


@dataclass(frozen=True)
class Frame:
    """A state and what follows from it: all that scene and panels need to draw."""

    state: State

    @cached_property
    def snapshot(self) -> Snapshot:
        """The design in its pose."""
        return evaluate(self.state.design, self.state.pose)

    @cached_property
    def verdict(self) -> Verdict:
        """How near the pose is to a singularity; the colours of the flags follow it."""
        return verdict(self.snapshot, self.state.warn_below)

    @cached_property
    def performance(self) -> Performance:
        """How fast and how strong the platform is in its pose."""
        return performance(self.state.design, self.state.pose)

    @cached_property
    def travels(self) -> tuple[Travel, ...]:
        """How far each of the six uncoupled motions may go from here to the singularity."""
        return travels(self.state.pose)

    @cached_property
    def free_ball(self) -> SingularityFreeBall:
        """The largest ball of positions about the pose without a singular one."""
        return singularity_free_ball(self.state.pose)

    @cached_property
    def last_move(self) -> MoveClearance | None:
        """The straight move from where the last gesture began, in one step; None without one."""
        gesture = self.state.gesture
        if gesture is None:
            return None
        try:
            return move_clearance(self.state.design, gesture.start, self.state.pose)
        except InputError:
            # There and back again: a move of no length, the one thing that is refused.
            return None
