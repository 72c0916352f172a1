"""The shares of the limits along the present path, under the load of the page."""

from __future__ import annotations

import math
from html import escape
from typing import NamedTuple

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.features.forces.loads import Loads
from explorer.app.state.frame import Frame
from explorer.app.state.paths import Journey
from explorer.app.state.state import State
from explorer.app.widgets.markup import note
from explorer.measures.blocks.block import MOST_SHARE, Share
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_decimals, format_number
from explorer.paths.loads import DemandedLoad, PathLoads
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import PART_NAMES, has_limits


class JourneyLoads(NamedTuple):
    """The shares of the limits along a path over time.

    Attributes:
        time: Times of the samples, in seconds, shape (n,).
        path: The shares along the path.
    """

    time: FloatArray
    path: PathLoads

    @property
    def seconds(self) -> float:
        """Time at which the largest share occurs."""
        return float(np.interp(self.path.place, self.path.at, self.time))


class PathShares:
    """The shares along the path of the present frame, computed anew if path or load change."""

    def __init__(self, services: Services) -> None:
        self._loads = services.get(Loads)
        self._kept: tuple[tuple[object, ...], JourneyLoads] | None = None

    def of(self, frame: Frame) -> JourneyLoads | None:
        """Return the shares along the path of a frame; None without a path or without limits."""
        journey, loaded = frame.state.journey, self._loads.of(frame)
        if journey is None or not has_limits(loaded.design):
            return None
        of_path = journey.kind, journey.design, journey.poses, journey.tool
        key = *of_path, loaded.load, loaded.weights
        if self._kept is None or self._kept[0] != key:
            self._kept = key, _loads_of(journey, loaded)
        return self._kept[1]


def _loads_of(journey: Journey, loaded: LoadedPose) -> JourneyLoads:
    demanded = DemandedLoad.of(journey.design, loaded.load, loaded.weights)
    along, timed = demanded.over(journey.margins, journey.tool), journey.trajectory
    return JourneyLoads(np.interp(along.at, timed.at, timed.time), along)


def load_words(loads: JourneyLoads) -> str:
    """Return the largest share of a limit along a path, its bound and its place, as HTML."""
    share, bound, part = loads.path.share, loads.path.bound, loads.path.part
    at = f"at {format_decimals(loads.seconds, 2)} s"
    hint = ""
    if part is None:
        words = f"Nothing holds a load {at}: singular" if share else "No part bears a load"
    else:
        number = f"{format_number(100.0 * share, 3)} %" if share < MOST_SHARE else "∞"
        most = "no bound" if math.isinf(bound) else f"{format_number(100.0 * bound, 3)} % at most"
        words = f"Largest share {number} ({most}): {PART_NAMES[part]}, {at}"
        hint = f"That of {len(loads.time)} samples; in parentheses a bound of all between them"
    return f'<div class="ex-{Share(share).look}" title="{hint}">{escape(words)}</div>'


def demand_note(state: State) -> str:
    """Return what the demand for a load means if nothing has a limit, as HTML; "" otherwise."""
    paths = state.paths
    if has_limits(state.design) or not paths.holds_load or paths.kind != "planned":
        return ""
    return note("No part has a limit, so every load is held: see the tab Machine.")
