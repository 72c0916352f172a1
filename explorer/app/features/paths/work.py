"""The actuators' speeds, forces and powers along the page's path, in the worker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from explorer.app.features.paths.state import journey_of
from explorer.app.session.feed import FeedOf
from explorer.app.state.state import State
from explorer.errors import ExplorerError
from explorer.export.drawings.drives import force_speed_chart, time_charts
from explorer.export.drawings.markup import as_html
from explorer.measures.blocks.block import Block
from explorer.mechanism.design import Design
from explorer.paths.drives import TimedPath, drive_blocks, drives_along

DrivesRequest: TypeAlias = tuple[Design, TimedPath]
"""A path of a design."""


@dataclass(frozen=True, eq=False)
class DrivesDrawing:
    """The actuators' speeds, forces and powers along a path, and the charts as SVG."""

    blocks: tuple[Block, ...]
    charts: str


def request_for(state: State) -> DrivesRequest | None:
    """Return the path of a state in its time; None without a path."""
    journey = journey_of(state)
    return None if journey is None else (journey.design, journey.path)


def draw_drives(request: DrivesRequest) -> DrivesDrawing | ExplorerError:
    """Return the actuators' speeds, forces and powers along a path, or why there are none."""
    try:
        found = drives_along(*request)
    except ExplorerError as error:
        return error
    charts = "".join(as_html(chart) for chart in (time_charts(found), force_speed_chart(found)))
    return DrivesDrawing(tuple(drive_blocks(found)), charts)


DRIVES_FEED = FeedOf(draw_drives, lambda frame: request_for(frame.state))
