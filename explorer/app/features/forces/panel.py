"""The load, the verdict on it, and tables of what holds it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from html import escape
from typing import get_args

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.forces.actions import SetForce, rounded
from explorer.app.features.forces.loads import Loads, NearestFeed
from explorer.app.features.forces.words import (
    Share,
    larger,
    newtons,
    share_colour,
    share_look,
    share_words,
    shares_of,
)
from explorer.app.inputs.bindings import Bound
from explorer.app.inputs.controls import Controls
from explorer.app.state.actions import SetPose
from explorer.app.state.frame import Frame
from explorer.app.state.view import Weighed
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.markup import (
    box,
    caption,
    dim,
    format_number,
    meter,
    note,
    row,
    status,
    table,
)
from explorer.app.widgets.under_way import problem
from explorer.mechanism.design import JOINTS
from explorer.mechanism.tool_point import position_of
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import drop_rounding, format_column, format_decimals
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import PART_NAMES, has_limits

WEIGHED: tuple[Weighed, ...] = get_args(Weighed)
GO, WORST = "forces.go", "forces.worst"
GO_HINT = "Move the platform to the nearest position that holds the load, turned as it is."
WORST_HINT = "Turn the force into the direction that uses the largest share of a limit here."
SENSES = {True: "pushes", False: "pulls"}
# Digits of forces and moments.
DIGITS = 4


class ForcesPanel:
    """The verdict on the load, its controls, and tables of what holds it."""

    def __init__(self, services: Services) -> None:
        gui, self._session = services.gui, services.session
        self._loads, self._nearest = services.get(Loads), services.get(NearestFeed)
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
                WEIGHED,
                "view.forces.weighed",
            )
            controls.checkbox(
                "Forces in the scene",
                "Draw the load, the forces of the legs on the platform, the forces along the "
                "guide, and the bending of the struts, in colours of their shares.",
                "view.forces.shown",
            )
            self._besides = gui.add_html("", visible=False)
        self._tables = gui.add_html("")
        self._most = gui.add_html("")
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
        yield self._top, "content", box(*self._summary(frame, loaded))
        force = frame.state.design.payload.force_n
        yield self._besides, "visible", force > 0.0
        yield (
            self._besides,
            "content",
            note(f"Besides, the payload's force of {newtons(force)} in any direction acts."),
        )
        yield self._tables, "content", box(*tables(loaded))
        yield self._most, "content", box(*largest(frame, loaded))
        yield from self._controls.updates(frame)

    def _summary(self, frame: Frame, loaded: LoadedPose) -> Iterator[str]:
        yield from verdict(loaded)
        if frame.state.view.is_twin:
            yield note("These are the forces of the 4-4, not of the 6-4 twin that is drawn.")
        if self._nearest.request is not None:
            yield f'<div class="ex-line"><span>{self._nearest_words(frame)}</span></div>'
        weights = self._loads.weights
        if weights.problem is not None:
            yield problem(weights, "The legs have no weights", "")
        elif weights.request is not None and weights.weights is None:
            yield note("computing the weights of the parts …")

    def _nearest_words(self, frame: Frame) -> str:
        """Return where the nearest position is that holds the load, as HTML."""
        feed = self._nearest
        if feed.problem is not None:
            return escape(feed.problem)
        if feed.drawing is None or (not feed.is_current and feed.drawing.pose is None):
            return dim("searching the nearest position that holds it …")
        pose = feed.drawing.pose
        if pose is None:
            return "None found in this orientation and mode that holds it."
        design, at = frame.state.design, frame.state.view.at
        there = position_of(design, pose, at)
        apart = design.unit_mm * math.dist(pose.position, frame.state.pose.position)
        size = design.reach
        numbers = ", ".join(format_number(value, DIGITS, size=size) for value in there)
        go = press_button(GO, "", "Go", hint=GO_HINT, class_name="ex-link")
        far = format_number(apart, 3, size=design.unit_mm * size)
        return f"Held {far} mm from here, with {at} at {numbers} {go}"

    def _go(self, _: str, client: viser.ClientHandle) -> None:
        drawing = self._nearest.drawing
        if drawing is not None and drawing.pose is not None:
            self._session.do(SetPose(drawing.pose), who=client.client_id)

    def _turn(self, _: str, client: viser.ClientHandle) -> None:
        frame = Frame(self._session.settled())
        size = math.hypot(*frame.state.view.forces.force)
        direction = without_force(self._loads.of(frame)).worst_force(size).direction
        if size > 0.0 and np.isfinite(direction).all():
            force = rounded(size * direction, size)
            action = SetForce(force, title="Force in its worst direction")
            self._session.do(action, who=client.client_id)


def verdict(loaded: LoadedPose) -> Iterator[str]:
    """Yield whether the load is held, and which part is nearest to its limit, as HTML."""
    if not loaded.is_regular:
        yield status("Not every load is held here", "beyond")
        yield '<div class="ex-beyond">The pose is singular: the forces are infinite.</div>'
        return
    if not has_limits(loaded.design):
        yield '<div class="ex-status">No limits are given</div>'
        yield dim(
            "Give actuators, struts or the guide limits in the tab Machine to see their shares."
        )
        return
    share, part = loaded.share, PART_NAMES[loaded.worst]
    look = share_look(share)
    titles = {"within": "Holds the load", "close": "Holds the load, close to a limit"}
    yield status(titles.get(look, "Does not hold the load"), look)
    verb = "gives way: it needs" if share > 1.0 else "needs most:"
    yield f"<div>{escape(part.capitalize())} {verb} {share_words(share)} of its limit</div>"


def tables(loaded: LoadedPose) -> Iterator[str]:
    """Yield the forces of the actuators, the struts and the guide beside their limits, as HTML."""
    held, shares = loaded.held, shares_of(loaded)
    spread = np.where(np.isfinite(held.spread), held.spread, 0.0)
    values = held.actuators.tolist()
    forces = _column(held.actuators, spread[:6])
    size = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    rows = [
        row(dim(name), f"{force} N", dim(_sense(drop_rounding(value, size))), *_share_cells(share))
        for name, force, value, share in zip(JOINTS, forces, values, shares[:6], strict=True)
    ]
    yield caption("Forces of the actuators", "A positive force pushes the value of its joint up.")
    yield f'<div class="ex-shares">{table(rows)}</div>'
    metres = 1e-3 * loaded.design.unit_mm
    moments = _column(metres * held.bending, metres * spread[6:8])
    across = _column(held.guide_force, spread[8:10])
    parts: list[str] = []
    for index, leg in enumerate((2, 3)):
        bending = larger(shares[6 + index], shares[10 + index])
        parts += [
            row(dim(f"strut {leg}"), f"{moments[index]} N m", dim("bends"), *_share_cells(bending)),
            row(dim(f"carriage {leg}"), f"{across[index]} N", dim("on guide"),
                *_share_cells(shares[8 + index])),
        ]  # fmt: skip
    yield caption(
        "Struts and guide",
        "The bending moment of a strut at its carriage, which the guide takes, and the force of "
        "the carriage across the guide. A share of a moment is that of the smaller limit.",
    )
    yield f'<div class="ex-shares">{table(parts)}</div>'


def _column(values: FloatArray, spread: FloatArray) -> list[str]:
    """Return forces or moments as text, each with what the payload's force may add, if any."""
    size = float(np.abs(values[np.isfinite(values)]).max(initial=0.0)) + float(spread.max())
    texts = format_column(values.tolist(), DIGITS, infinite="∞", size=size)
    if not spread.any():
        return texts
    more = format_column(spread.tolist(), 3, size=size)
    return [f"{text} ± {each}" for text, each in zip(texts, more, strict=True)]


def _sense(force: float) -> str:
    if not math.isfinite(force) or force == 0.0:
        return ""
    return SENSES[force > 0.0]


def _share_cells(share: Share) -> tuple[str, str]:
    if share is None:
        return "", dim(share_words(share))
    bar = meter(min(100.0, 100.0 * share), share_colour(share))
    return bar, f'<span class="ex-{share_look(share)}">{share_words(share)}</span>'


def largest(frame: Frame, loaded: LoadedPose) -> Iterator[str]:
    """Yield the largest payload and force, and the worst direction of the force, as HTML."""
    yield caption("Most that is held here")
    payload, newton = loaded.largest_payload, loaded.newton
    rows = [
        row(
            dim("payload"),
            f"{format_number(payload, DIGITS)} kg" if math.isfinite(payload) else "no limit",
            hint="Largest mass at the centre of the payload, besides the load above, that keeps "
            "all limits",
        ),
        row(
            dim("force in every direction"),
            f"{newtons(1.0 / newton.share)}, limited by {dim(PART_NAMES[newton.part])}"
            if newton.share
            else "no limit",
            hint="Largest force at the tool, alone, that all parts hold in every direction, and "
            "the part that gives way first",
        ),
    ]
    yield table(rows)
    size = math.hypot(*frame.state.view.forces.force)
    worst = without_force(loaded).worst_force(size)
    if not (size > 0.0 and np.isfinite(worst.direction).all()):
        return
    numbers = ", ".join(format_decimals(value, 2) for value in worst.direction.tolist())
    turn = press_button(WORST, "", "Turn", hint=WORST_HINT, class_name="ex-link")
    yield (
        f'<div class="ex-after">{dim("worst direction of this force")} {numbers}: '
        f"{escape(PART_NAMES[worst.part])} at {share_words(worst.share)} {turn}</div>"
    )


def without_force(loaded: LoadedPose) -> LoadedPose:
    """Return the pose under its moment and weights, without the force at the tool."""
    return replace(loaded, load=(0.0, 0.0, 0.0, *loaded.load[3:]))
