"""The load on the platform as a tab: the verdict on it, its controls, and tables of reactions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import get_args

import numpy as np
import viser

from explorer.app.features.feature import Feature, InBar, Services, Tab
from explorer.app.features.forces.loads import (
    WEIGHTS_FEED,
    Loads,
    SetForce,
    nearest_feed,
    round_force,
)
from explorer.app.features.forces.scene import ForcesScene, LoadHandle
from explorer.app.features.forces.tasks import nearest_position, weights_of_parts
from explorer.app.inputs.controls import Bound, Controls
from explorer.app.state.actions import SetPose
from explorer.app.state.frame import Frame
from explorer.app.state.view import Weighed
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import CopyButton, figure, press_button
from explorer.app.widgets.markup import note
from explorer.app.widgets.under_way import problem
from explorer.measures.blocks import forces
from explorer.measures.blocks.block import Share, Statement
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import PART_NAMES, has_limits

GO, WORST = "forces.go", "forces.worst"
GO_HINT = "Move the platform to the nearest position that holds the load, turned as it is."
WORST_HINT = "Turn the force into the direction that uses the largest share of a limit here."


class ForcesPanel:
    """The verdict on the load, its controls, and tables of what holds it."""

    def __init__(self, services: Services) -> None:
        gui, self._session = services.gui, services.session
        self._loads, self._nearest = services.get(Loads), services.get(nearest_feed)
        self._controls = controls = Controls(gui, services.session)
        self._top = gui.add_html("")
        with gui.add_folder("Load at the tool (axes of the base)"):
            controls.triple(
                "Force (N)",
                "Force on the platform at the tool point, along x, y and z of the base; its arrow "
                "in the scene can be dragged.",
                Bound(
                    lambda frame: frame.state.view.forces.force, lambda _, force: SetForce(force)
                ),
                step=0.1,
                small=True,
            )
            controls.triple(
                "Moment (N m)",
                "Moment on the platform, about x, y and z of the base.",
                "view.forces.moment",
                step=0.01,
                small=True,
            )
            controls.dropdown(
                "Weights",
                "The bodies whose weights act besides: none, the payload of the tab Machine, or "
                "also the platform and the legs, as parts of the prototype.",
                get_args(Weighed),
                "view.forces.weighed",
            )
            controls.checkbox(
                "Forces in the scene",
                "Draw the load, the forces of the legs on the platform, the forces along the "
                "guide, and the bending of the struts, in colours of their shares.",
                "view.forces.shown",
            )
        self._tables = gui.add_html("")
        self._most = gui.add_html("")
        self._copy = CopyButton(services.buttons, "Forces", lambda: self._loads.source("forces"))
        services.buttons.on(GO, self._go)
        services.buttons.on(WORST, self._turn)
        services.buttons.offer(
            "Forces › Go to the nearest position that holds",
            GO_HINT,
            GO,
            is_ready=lambda: self._nearest.drawing is not None,
        )
        services.buttons.offer(
            "Forces › Turn the force to its worst direction",
            WORST_HINT,
            WORST,
            is_ready=lambda: any(self._session.state.view.forces.force),
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        loaded = self._loads.of(frame)
        summary = (forces.verdict(loaded), *self._nearest_position(frame, loaded))
        go = press_button(GO, "", "Go", hint=GO_HINT, class_name="ex-link")
        yield (
            self._top,
            "content",
            render(summary, {"go": go}, corner=self._copy.html) + "".join(self._notes(frame)),
        )
        yield self._tables, "content", render(forces.reaction_tables(loaded))
        yield self._most, "content", self._largest_loads(frame, loaded)
        yield from self._controls.updates(frame)

    def _largest_loads(self, frame: Frame, loaded: LoadedPose) -> str:
        most, size = forces.largest_loads(loaded), math.hypot(*frame.state.view.forces.force)
        if size > 0.0:
            facts = forces.worst_force(without_force(loaded).worst_force(size), "this force")
            most = most.add(*facts)
        turn = press_button(WORST, "", "Turn", hint=WORST_HINT, class_name="ex-link")
        return render((most,), {"turn": turn})

    def _notes(self, frame: Frame) -> Iterator[str]:
        if not has_limits(frame.state.design):
            yield note("Give limits in the tab Machine to see shares of them.")
        if frame.state.view.is_twin:
            yield note("These are the forces of the 4-4, not of the 6-4 twin that is drawn.")
        weights = self._loads.weights
        if weights.problem is not None:
            yield problem(weights, "The legs have no weights", "")
        elif weights.request is not None and weights.drawing is None:
            yield note("computing the weights of the parts …")

    def _nearest_position(self, frame: Frame, loaded: LoadedPose) -> Iterator[Statement]:
        """Yield where the nearest position is that holds the load, once one is searched for."""
        feed = self._nearest
        if feed.request is None:
            return
        if feed.problem is not None:
            yield Statement("", feed.problem)
        elif feed.drawing is None or (not feed.is_current and feed.drawing.pose is None):
            yield Statement("", "searching the nearest position that holds it …")
        else:
            yield forces.nearest_carrying(loaded, feed.drawing.pose, frame.state.tool)

    def _go(self, _: str, client: viser.ClientHandle) -> None:
        drawing = self._nearest.drawing
        if drawing is not None and drawing.pose is not None:
            self._session.do(SetPose(drawing.pose), who=client.client_id)

    def _turn(self, _: str, client: viser.ClientHandle) -> None:
        frame = Frame(self._session.latest_state())
        size = math.hypot(*frame.state.view.forces.force)
        direction = without_force(self._loads.of(frame)).worst_force(size).direction
        if size > 0.0 and np.isfinite(direction).all():
            force = round_force(size * direction, size)
            action = SetForce(force, title="Force in its worst direction")
            self._session.do(action, who=client.client_id)


def without_force(loaded: LoadedPose) -> LoadedPose:
    """Return the pose under its moment and weights, without the force at the tool."""
    return replace(loaded, load=(0.0, 0.0, 0.0, *loaded.load[3:]))


class LoadFigure:
    """The largest share of a limit; nothing for a design without limits."""

    def __init__(self, services: Services) -> None:
        self._loads = services.get(Loads)

    def __call__(self, frame: Frame) -> str:
        """Return the figure for a frame, as HTML."""
        loaded = self._loads.of(frame)
        if not has_limits(loaded.design):
            return ""
        hint = f"Largest share of a limit under the load of this tab: {PART_NAMES[loaded.worst]}."
        share = Share(loaded.share)
        return figure("Forces", "Load here", share.text(), hint=hint, look=f"ex-{share.look}")


FORCES = Feature(
    "forces",
    tabs=(Tab("analyse", "Forces", ForcesPanel, viser.Icon.ARROW_DOWN_CIRCLE),),
    bar=(InBar("middle", LoadFigure),),
    scene=(ForcesScene, LoadHandle),
    later_feeds=(WEIGHTS_FEED, nearest_feed),
    tasks=(weights_of_parts, nearest_position),
    lists=("Weights",),
)
