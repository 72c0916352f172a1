"""The state of the application, a frozen value, and the frame that is drawn from it.

There is one state for the whole server, shared by every tab. It changes through one
door, `explorer.app.session.session`, by the actions of `explorer.app.state.actions`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from explorer.app.state.compared import Compared
from explorer.app.state.jog import Jog
from explorer.app.state.optimisation import Comparison, SearchResult, Wish
from explorer.app.state.paths import Journey, Paths
from explorer.app.state.presses import Press
from explorer.app.state.studies import Studies
from explorer.app.state.view import View
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import TETRAHEDRA, margins, mode_of
from explorer.mechanism.pose import Pose, Triple, yaw_pitch_roll_from_rotation
from explorer.optimise.outcome import Iterate
from explorer.optimise.problem import (
    Problem,
)
from explorer.optimise.record import Record
from explorer.singularity.colours import WARN_SHARE

Joints = tuple[float, float, float, float, float, float]
Hold = Literal["pose", "legs"]


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
class Run:
    """A run of the optimiser.

    Attributes:
        number: Of the run, from 1.
        problem: That is solved.
        starts: From how many designs.
        own: The state before it, to which to return.
        phase: Whether it goes on, has been asked to end, or has ended.
        iterates: Those that have been shown; the last one is what is drawn.
        verdict: How it ended, once it has.
        comparison: Of own and found design, once it is there.
        accepted: Whether the result was accepted.
    """

    number: int
    problem: Problem
    starts: int
    own: State
    phase: Literal["running", "cancelling", "ended"] = "running"
    iterates: tuple[Iterate, ...] = ()
    verdict: SearchResult | None = None
    comparison: Comparison | None = None
    accepted: bool = False

    @property
    def is_undecided(self) -> bool:
        """Whether there is a result that was neither accepted nor given up."""
        return self.best is not None and not self.accepted

    @property
    def best(self) -> Iterate | None:
        """What was found, once it has ended."""
        return None if self.verdict is None else self.verdict.best


@dataclass(frozen=True)
class Optimisation:
    """All that the state knows of it.

    Attributes:
        wish: What is asked for.
        run: The last run, or the one that goes on; None if there is none of this design.
        count: Of all runs so far.
        refusal: Why the last one was not begun, if it was not.
    """

    wish: Wish = field(default_factory=Wish)
    run: Run | None = None
    count: int = 0
    refusal: str | None = None

    @property
    def is_on(self) -> bool:
        """Whether a run goes on."""
        return self.run is not None and self.run.phase != "ended"

    @property
    def record(self) -> Record | None:
        """Of the search that ended last; None where there is none to repeat."""
        verdict = None if self.run is None else self.run.verdict
        return None if verdict is None else verdict.record


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
