"""Undo and redo of any step, from the request to the last message of the frame.

The history is a long one of all kinds of steps; every step of it is undone, one by one, and
redone. What the worker draws anew follows, as after any change.
"""

from __future__ import annotations

import random
import time
from collections.abc import Iterator
from dataclasses import replace

from benchmarks.ready_page import ready_page
from benchmarks.table import Row, seconds
from benchmarks.timing import Spread
from explorer import PRESETS
from explorer.app.session.session import REDO, UNDO
from explorer.app.state.action import Action
from explorer.app.state.actions import (
    Open,
    Set,
    SetAngle,
    SetJoint,
    SetMode,
    SetPosition,
    SetVariable,
)
from explorer.app.state.state import State
from explorer.mechanism.design import VARIABLES

STEPS = 300


def run() -> Iterator[Row]:
    """Yield a row for undoing and one for redoing."""
    choose = random.Random(1)
    with ready_page() as running:
        session = running.page.session
        for _ in range(STEPS):
            session.do(_action(choose, session.state))
            session.wait_until_idle()
        running.page.wait_until_drawn()
        count = len(session.history.steps) - 1
        for name, way in (("undo", UNDO), ("redo", REDO)):
            durations: list[float] = []
            for _ in range(count):
                began = time.perf_counter()
                session.travel(way)
                session.wait_until_idle()
                durations.append(time.perf_counter() - began)
            spread = Spread.of(durations)
            yield Row(
                f"{name} of each of {count} steps of all kinds, the slowest",
                f"{seconds(spread.longest)} (p50 {seconds(spread.p50)}, p95 {seconds(spread.p95)})",
                "20 ms",
            )


def _action(choose: random.Random, state: State) -> Action:
    near = choose.gauss(0.0, 0.5)
    x, index = state.pose.position, choose.randrange(3)
    variable = choose.randrange(len(VARIABLES))
    return choose.choice(
        (
            SetPosition(index, x[index] + near),
            SetAngle(index, state.yaw_pitch_roll[index] + 10.0 * near),
            SetJoint(choose.randrange(6), state.joints[0] + near),
            SetMode(choose.randrange(8)),
            SetVariable(VARIABLES[variable], state.design.variables[variable] * (1.0 + 0.1 * near)),
            Set("design.unit_mm", choose.uniform(1.0, 20.0)),
            Set("view", replace(state.view, labels=not state.view.labels)),
            Set("view", replace(state.view, ghosts=not state.view.ghosts)),
            Open(choose.choice(list(PRESETS.values()))),
        )
    )
