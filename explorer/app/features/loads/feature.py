"""Loads as a tab: the verdict on the load, its controls, tables of reactions, and precision."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import get_args

import msgspec
import numpy as np
import viser

from explorer.app.features.feature import BarPart, Feature, Services, Tab, problem
from explorer.app.features.loads import load, precision
from explorer.app.features.loads.precision_scene import DeflectedScene, ErrorEllipsoidScene
from explorer.app.features.loads.scene import ForcesScene, LoadHandle
from explorer.app.features.machine.actuators import FORCE, FORCES
from explorer.app.features.machine.feature import MOMENT
from explorer.app.inputs.bindings import ControlBinding
from explorer.app.inputs.controls import Controls
from explorer.app.state.actions import Action, Set
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_pose
from explorer.app.state.state import State
from explorer.app.state.view import Weighed
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import figure
from explorer.app.widgets.markup import note
from explorer.measures.blocks import forces
from explorer.measures.blocks.block import Share, Statement
from explorer.mechanism.machine import Guide
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import PART_NAMES, has_limits

NO_LOAD = Statement(
    "No load acts", "Enter a force or a moment below, or a payload in the tab Machine."
)
LIMITS = (f"actuators {FORCE:g} N", f"struts {MOMENT:g} N m", f"guide {FORCE:g} N, {MOMENT:g} N m")
"""Words for the typical limits."""


class ForcesPanel(Controls):
    """The verdict on the load, its controls, and tables of what holds it."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        self._loads = services.get(load.Loads)
        self._nearest = services.get(load.nearest_feed)
        self.markup(self._summary)
        with services.gui.add_folder("Load at the tool (axes of the base)"):
            self.triple(
                "Force (N)",
                "Force on the platform at the tool point, along x, y and z of the base; its arrow "
                "in the scene can be dragged.",
                ControlBinding(
                    lambda frame: frame.state.view.forces.force,
                    lambda _, force: load.set_force(force),
                ),
                step=0.1,
            )
            self.triple(
                "Moment (N m)",
                "Moment on the platform, about x, y and z of the base.",
                "view.forces.moment",
                step=0.01,
            )
            self.dropdown(
                "Weights",
                "The bodies whose weights act besides: none, the payload of the tab Machine, or "
                "also the platform and the legs, as parts of the prototype.",
                get_args(Weighed),
                "view.forces.weighed",
                is_in_palette=True,
            )
            self.checkbox(
                "Forces in the scene",
                "Draw the load, the forces of the legs on the platform, the forces along the "
                "guide, and the bending of the struts, in colours of their shares.",
                "view.forces.shown",
            )
        self._assume = services.link(
            "forces.typical",
            "Loads › Assume typical limits",
            "Give actuators, struts and guide typical limits; the tab Machine shows and "
            "changes them.",
            assume_limits,
        )
        self.markup(self._tables)
        self.markup(self._largest_loads)
        self._copy = services.copy_button(
            "Loads › Forces", lambda state: self._loads.command("forces", state)
        )
        self._go = services.link(
            "forces.go",
            "Loads › Go to the nearest position that holds",
            "Move the platform to the nearest position that holds the load, turned as it is.",
            self._go_to_nearest,
            words="Go",
        )
        self._turn = services.link(
            "forces.worst",
            "Loads › Turn the force to its worst direction",
            "Turn the force into the direction that uses the largest share of a limit here.",
            self._turn_force,
            is_ready=lambda state: any(state.view.forces.force),
            words="Turn",
        )

    def _summary(self, frame: Frame) -> str:
        loaded = self._loads.of(frame)
        verdict = NO_LOAD if load.is_bare(loaded) else forces.verdict(loaded)
        summary = (verdict, *self._nearest_position(frame, loaded))
        return render(summary, {"go": self._go}, corner=self._copy) + self._notes(frame)

    def _tables(self, frame: Frame) -> str:
        loaded = self._loads.of(frame)
        return "" if load.is_bare(loaded) else render(forces.reaction_tables(loaded))

    def _largest_loads(self, frame: Frame) -> str:
        loaded = self._loads.of(frame)
        most, size = forces.largest_loads(loaded), math.hypot(*frame.state.view.forces.force)
        if size > 0.0:
            facts = forces.worst_force(without_force(loaded).worst_force(size), "this force")
            most = most.add(*facts)
        return render((most,), {"turn": self._turn})

    def _notes(self, frame: Frame) -> str:
        words = ""
        if not has_limits(frame.state.design):
            words += precision.offer("limits", LIMITS, self._assume)
        if frame.state.view.is_twin:
            words += note("These are the forces of the 4-4, not of the 6-4 twin that is drawn.")
        weights = self._loads.weights
        if weights.problem is not None:
            words += problem(weights, "The legs have no weights", "")
        elif weights.request is not None and weights.drawing is None:
            words += note("computing the weights of the parts …")
        return words

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

    def _go_to_nearest(self, _: State) -> Action | None:
        drawing = self._nearest.drawing
        return None if drawing is None or drawing.pose is None else set_pose(drawing.pose)

    def _turn_force(self, state: State) -> Action | None:
        size = math.hypot(*state.view.forces.force)
        direction = without_force(self._loads.of(Frame(state))).worst_force(size).direction
        if size == 0.0 or not np.isfinite(direction).all():
            return None
        force = load.round_force(size * direction, size)
        return Set("view.forces.force", force, "Force", "in its worst direction")


def assume_limits(state: State) -> Action | None:
    """Return the action that gives a design without limits typical ones; None if it has any."""
    design = state.design
    if has_limits(design):
        return None
    limited = msgspec.structs.replace(
        design,
        actuators=msgspec.structs.replace(design.actuators, push_n=FORCES),
        struts=msgspec.structs.replace(design.struts, moment_nm=MOMENT),
        guide=Guide(FORCE, MOMENT),
    )
    return Set("design", limited, "Machine", "typical limits")


def without_force(loaded: LoadedPose) -> LoadedPose:
    """Return the pose under its moment and weights, without the force at the tool."""
    return loaded.with_load((0.0, 0.0, 0.0, *loaded.load[3:]))


def load_figure(services: Services) -> BarPart:
    """Return the figure of the largest share of a limit, "" for a design without limits."""
    of = services.get(load.Loads).of

    def figure_of(frame: Frame) -> str:
        loaded = of(frame)
        if load.is_bare(loaded) or not has_limits(loaded.design):
            return ""
        hint = f"Largest share of a limit under the load of this tab: {PART_NAMES[loaded.worst]}."
        share = Share(loaded.share)
        return figure("Loads", "Load here", share.text(), hint=hint, look=f"ex-{share.look}")

    return figure_of


LOADS = Feature(
    "loads",
    manual="loads.md#The tab Loads",
    tabs=(
        Tab("analyse", "Loads", ForcesPanel, viser.Icon.ARROW_DOWN_CIRCLE),
        Tab("analyse", "Loads", precision.PrecisionPanel),
    ),
    bar=(("middle", load_figure),),
    verdicts={
        "Holds the load": "No part bears more than its limit.",
        "Does not hold the load": "A part would bear more than its limit.",
        "No limits are given": "The design states no largest force of an actuator or a part.",
        "The design states no errors": "No errors of actuators or dimensions are given.",
        "Errors are infinite here": "The pose is singular: the tool moves with all locked.",
    },
    exports=(precision.TOLERANCES,),
    scene=(ForcesScene, LoadHandle, ErrorEllipsoidScene, DeflectedScene),
    later_feeds=(load.WEIGHTS_FEED, load.nearest_feed, precision.BUDGET_FEED),
)
