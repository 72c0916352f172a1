"""The requirement's part of the state, with its action, and the check and search in processes."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.app.session.feed import FeedOf
from explorer.app.state.actions import action, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.parts import FeaturePart, with_value
from explorer.app.state.state import State
from explorer.find.answers import FoundDesigns, RequirementCheck
from explorer.find.check import check_requirement
from explorer.find.nearest import find_or_relax
from explorer.find.requirement import RequiredLegs, RequiredLoad, Requirement
from explorer.jobs.process import Channel
from explorer.mechanism.design import Design

FORM = "required.form"
"""The path of the requirement of the form."""

EXAMPLE = Requirement(
    name="need",
    box_mm=(200.0, 150.0, 100.0),
    tilt_deg=15.0,
    payload=RequiredLoad(2.0, (0.0, 0.0, 30.0), 5.0),
    legs=RequiredLegs(ratio=1.8, push_n=300.0, diameter_mm=16.0, apart_mm=5.0),
    swing_deg=45.0,
    buildable=True,
)


@dataclass(frozen=True)
class Required(FeaturePart, name="required"):
    """The requirement of the form, and whether the design is checked against it.

    It is in millimetres, degrees and newtons, and stays as it is in every design and unit.
    """

    form: Requirement = EXAMPLE
    is_checked: bool = False

    @property
    def requirement(self) -> Requirement | None:
        """The requirement that the design is checked against; None if there is none."""
        return self.form if self.is_checked else None


@action("Open {design}", is_jump=True)
def open_found(state: State, design: Design, requirement: Requirement) -> State:
    """Open a design that was found, with the requirement that it keeps beside it."""
    opened = open_design(design).apply(state)
    return with_value(opened, "required", Required(requirement, True))


def check_design(request: tuple[Design, Requirement]) -> RequirementCheck:
    """Return the check of a design against a requirement."""
    return check_requirement(*request)


def _request_for(frame: Frame) -> tuple[Design, Requirement] | None:
    required = Required.of(frame.state).requirement
    return None if required is None or frame.state.busy else (frame.state.design, required)


CHECK_FEED = FeedOf(check_design, _request_for, process="check", in_scene=False)


def find_machines(requirement: Requirement, channel: Channel) -> FoundDesigns:
    """Search for machines that keep a requirement, and send what is found so far to the parent."""
    return find_or_relax(requirement, watch=channel.send, stop=channel.is_cancelled)
