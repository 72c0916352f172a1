"""The check of the design and the search for machines, each in a process of its own."""

from __future__ import annotations

from explorer.app.features.requirement.state import Required
from explorer.app.session.feed import FeedOf
from explorer.app.state.frame import Frame
from explorer.find.answers import FoundDesigns, RequirementCheck
from explorer.find.check import check_requirement
from explorer.find.nearest import find_or_relax
from explorer.find.requirement import Requirement
from explorer.jobs.process import Channel
from explorer.mechanism.design import Design


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
