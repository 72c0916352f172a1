"""The load on the platform, what holds it, and the shares of the limits."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from explorer.app.features.feature import Feature, Feed, InBar, Services, Tab
from explorer.app.features.forces.load_figure import LoadFigure
from explorer.app.features.forces.loads import NearestFeed, WeightsFeed
from explorer.app.features.forces.panel import ForcesPanel
from explorer.app.features.forces.scene import ForcesScene, LoadHandle
from explorer.app.features.forces.tasks import nearest_position, weights_of_parts


def _of_kind(kind: Callable[[Services], Feed], services: Services) -> Feed:
    """Return the one feed of a kind."""
    return services.get(kind)


FORCES = Feature(
    "forces",
    tabs=(Tab("analyse", "Forces", ForcesPanel, viser.Icon.ARROW_DOWN_CIRCLE),),
    bar=(InBar("middle", LoadFigure),),
    scene=(ForcesScene, LoadHandle),
    later_feeds=tuple(partial(_of_kind, kind) for kind in (WeightsFeed, NearestFeed)),
    tasks=(weights_of_parts, nearest_position),
    lists=("Weights",),
)
