"""The optimiser: its declaration, the search in the bar, and the required box in the scene."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import numpy as np
import viser

from explorer.app.features.feature import Feature, InBar, Services, Tab
from explorer.app.features.optimise.buttons import ACCEPT, BUTTONS, PAPER, button
from explorer.app.features.optimise.panel import OptimisePanel
from explorer.app.features.optimise.runner import Optimiser
from explorer.app.features.optimise.words import search_notice
from explorer.app.features.optimise.work import requested_box
from explorer.app.scene.placing import Placed, ScenePart
from explorer.app.scene.shapes import add_lines
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import open_button, running
from explorer.app.widgets.colours import JOINT
from explorer.measures.size import corners_of
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.arrays import FloatArray
from explorer.optimise.demands import Box

TAB = "Optimise"
# The twelve edges of a cube by its corners, whose bits are the axes.
EDGES = tuple((a, a | 1 << axis) for a in range(8) for axis in range(3) if not a >> axis & 1)


def search_chip(frame: Frame) -> str:
    """Return the search that runs or waits for an answer, or where to begin, as HTML."""
    state = frame.state
    notice = search_notice(state)
    if notice is not None:
        buttons = "".join(button(name, state, is_main=name == ACCEPT) for name in notice.buttons)
        return running(TAB, notice.title, notice.text, notice.share, buttons)
    if state.optimisation.run is None and state.design in PRESETS.values():
        paper = BUTTONS[PAPER]
        words = escape(paper.label)
        return open_button(
            TAB, words, press=PAPER, hint=paper.hint, class_name="ex-tool ex-outlined"
        )
    return ""


class RequiredBox(ScenePart):
    """The edges of the required box, if there is one."""

    def __init__(self, services: Services) -> None:
        self._edges = add_lines(services.scene, "/required_box", len(EDGES), JOINT, 2.0)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the box of a frame."""
        box = visible_box(placed.frame.state)
        yield self._edges, "visible", box is not None
        if box is not None:
            edges = placed.scale * edges_of(box)
            yield self._edges, "points", edges.astype(np.float32)


def visible_box(state: State) -> Box | None:
    """Return the box of the present run, else that of the problem, if any."""
    run = state.optimisation.run
    if run is not None and run.iterates and not run.accepted:
        if run.problem.demands.required_box is None:
            return None
        return run.problem.required_box_at((run.best or run.iterates[-1]).values)
    return requested_box(state) if state.optimisation.request.needs_box else None


def edges_of(box: Box) -> FloatArray:
    """Return the edges of a box, shape (12, 2, 3)."""
    return corners_of(box)[np.array(EDGES)]


OPTIMISE = Feature(
    "optimise",
    tabs=(Tab("work", "Optimise", OptimisePanel, viser.Icon.SPARKLES),),
    bar=(InBar("right", lambda _: search_chip),),
    scene=(RequiredBox,),
    runners=(Optimiser,),
    lists=("Objective",),
)
