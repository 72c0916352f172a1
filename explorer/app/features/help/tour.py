"""The tour for first-time users: five steps, each done by the user, shown or skipped."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from explorer.app.features.optimise.actions import StartRun
from explorer.app.state.action import Action
from explorer.app.state.actions import GoHome, Set, SetPosition, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.state.state import State

# What "Show me" does: the stride of the platform in reaches, the height over the base plane in
# warning lengths, and the factor on a variable.
STRIDE, NEAR, GROWTH = 0.1, 0.5, 1.1


@dataclass(frozen=True)
class Step:
    """A step of the tour.

    Attributes:
        title: Task of the user.
        text: Instructions, and what to look at; plain text.
        tab: Tab of the controls.
        is_done: Whether the user did it, from the frame in which it began and the present one.
        show: Action that does it for the user.
        after: Action when the user goes on; None for none.
    """

    title: str
    text: str
    tab: str
    is_done: Callable[[Frame, Frame], bool]
    show: Callable[[Frame], Action]
    after: Action | None = None


def _is_moved(before: Frame, now: Frame) -> bool:
    return before.state.pose != now.state.pose


def _move(frame: Frame) -> Action:
    return SetPosition(1, frame.state.position[1] + STRIDE * frame.state.design.reach)


def _is_near(_: Frame, now: Frame) -> bool:
    return now.verdict.kind != "clear"


def _approach(frame: Frame) -> Action:
    """Lower b4 towards the base plane: δ3 is its height."""
    state = frame.state
    height = math.copysign(NEAR * state.warn_below, state.pose.position[2])
    return SetPosition(2, height + float(state.offset(state.pose.rotation)[2]))


def _is_changed(before: Frame, now: Frame) -> bool:
    return before.state.design.variables != now.state.design.variables


def _change(frame: Frame) -> Action:
    return SetVariable("a3x", GROWTH * frame.state.design.variables[0])


def _is_solid(_: Frame, now: Frame) -> bool:
    return now.state.view.workspace.solid


def _show_solid(_: Frame) -> Action:
    return Set("view.workspace.solid", True, "Solid")


def _is_optimised(before: Frame, now: Frame) -> bool:
    return now.state.optimisation.count > before.state.optimisation.count


STEPS = (
    Step(
        "Move the platform",
        "Drag an arrow or an arc at b4, or a slider of Pose. The legs and the pose stay in step.",
        "Pose",
        _is_moved,
        _move,
    ),
    Step(
        "Come close to a singularity",
        "Lower z. The two flags turn from blue to orange as they come close: where they meet, the "
        "mechanism is singular. Singularity, on the right, tells how far it is.",
        "Pose",
        _is_near,
        _approach,
        GoHome(),
    ),
    Step(
        "Change the design",
        "Move a slider of Design, such as a3x. The pose is held, or the lengths of the legs.",
        "Design",
        _is_changed,
        _change,
    ),
    Step(
        "See the workspace",
        "Press Solid in Workspace: all positions of b4 within the limits. Cut it open, or colour "
        "it by the smallest margin.",
        "Workspace",
        _is_solid,
        _show_solid,
    ),
    Step(
        "Optimise, and take it with you",
        "Press Optimise, and accept what it finds; what you do not accept is put back. Export, on "
        "top of the page, has files for CAD, simulation and print. Ctrl-Z undoes what you "
        "changed.",
        "Optimise",
        _is_optimised,
        lambda _: StartRun(),
    ),
)


@dataclass(frozen=True)
class Tour:
    """The progress of one user's tour.

    Attributes:
        at: Index of the step.
        began: Frame in which the step began.
        searches: Number of searches before the tour began.
        is_done: Whether the user has done the step.
    """

    at: int
    began: Frame
    searches: int
    is_done: bool = False

    @property
    def step(self) -> Step:
        """The present step."""
        return STEPS[self.at]

    @property
    def is_last(self) -> bool:
        """Whether no step follows."""
        return self.at == len(STEPS) - 1

    def after_frame(self, frame: Frame) -> Tour:
        """Return the tour after a frame, in which the step may be done."""
        if self.is_done or not self.step.is_done(self.began, frame):
            return self
        return replace(self, is_done=True)

    def left_search(self, state: State) -> int | None:
        """Return the number of a search that the tour led to and whose result is not accepted."""
        run = state.optimisation.run
        if run is None or run.accepted or run.number <= self.searches:
            return None
        return run.number

    def step_by(self, steps: int, frame: Frame) -> Tour:
        """Return the tour some steps on or back, within its first and last."""
        at = min(max(self.at + steps, 0), len(STEPS) - 1)
        return Tour(at, frame, self.searches)


def start_tour(frame: Frame) -> Tour:
    """Return the tour at its first step."""
    return Tour(0, frame, frame.state.optimisation.count)
