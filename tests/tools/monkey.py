"""Random hands on a running explorer: through websockets, as many tabs, with no mercy.

From the checkout, for as long as one likes: python tests/tools/monkey.py [actions] [seed]
"""

from __future__ import annotations

import io
import math
import os
import random
import re
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator
from concurrent.futures import Future, wait
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import psutil
import server_clock
import viser
from client import press_update, presses_in, wait_for, wait_until_heard
from page_props import differences, shown_by
from server_clock import wait_until_drawn
from socket_tab import SocketTab

from explorer.app.features.designs.feature import SavedDesigns
from explorer.app.features.help.search import RUN
from explorer.app.features.paths.state import Paths, journey_of
from explorer.app.page import REFUSAL
from explorer.app.server import Running, start
from explorer.app.session.session import UNDONE
from explorer.app.state.actions import open_design
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile
from explorer.app.storage.user_data import UserData
from explorer.jobs.jobs import RESTARTED
from explorer.mechanism.design_file import PRESETS, encode_design

TABS = 3
# Between two looks at whether the page shows its state.
BETWEEN_LOOKS = 1000
PATIENCE_SECONDS = 120.0
# Between two kills of the worker.
KILL_SECONDS = 5.0
# Notices of what these hands do themselves: they kill the worker, and undo in one tab what
# another one has done.
EXPECTED = re.compile(
    "|".join((re.escape(RESTARTED), ".*".join(map(re.escape, UNDONE.split("{}")))))
)
# Seconds that pass in a second of the machine's while a slider is dragged, lest a drag on a busy
# machine becomes two, and those after which the next gesture is another one.
SLOW_PACE, REST_SECONDS = 0.001, 2.0

BROKEN = (
    b"",
    b"{",
    b"null",
    b"[" * 5000,
    b"\xff\xfe\x00",
    b'{"a3": [1, 2]}',
    b'{"schema": 99}',
    b'{"schema": 2, "a3": [1e999, 0], "b1": [1, 1], "b2": 1, "b3": 2}',
    b'{"schema": 2, "a3": [4, 0], "b1": [1, 1], "b2": 1, "b3": 2}',
    b"PK\x03\x04" + bytes(200),
)
NUMBERS = (0.0, -1.0, 1e-12, 1e9, math.nan, math.inf, -math.inf, 1e308)


@dataclass
class Report:
    """What came of it.

    Attributes:
        actions: That were done.
        faults: What the page said had gone wrong in the explorer itself.
        drift: What the page showed beside what a new page of the same state shows.
        threads, processes: At each look.
    """

    actions: int = 0
    faults: list[str] = field(default_factory=list[str])
    drift: list[str] = field(default_factory=list[str])
    threads: list[int] = field(default_factory=list[int])
    processes: list[int] = field(default_factory=list[int])


class Monkey:
    """Does random things to an explorer.

    Args:
        running: The explorer.
        seed: For what it does.
        in_turn: Whether each event waits until the explorer has handled the one before, and each
            gesture until it is at rest. Then a seed does the same in every run; else how the
            events fall between frames is not repeatable.
    """

    def __init__(self, running: Running, seed: int, *, in_turn: bool = False) -> None:
        self.running = running
        self.report = Report()
        self._random = random.Random(seed)
        self._tabs = [SocketTab(running.url) for _ in range(TABS)]
        self._does: tuple[tuple[float, Callable[[], None]], ...] = (
            (50, self._use),
            (20, self._drag),
            (12, self._push),
            (12, self._press),
            (8, self._trigger),
            (4, self._pull_handle),
            (2, self._click_scene),
            (2, self._upload),
            (2, self._reload),
            (1, self._vanish),
            (1, self._preset),
            (0.3, self._kill),
        )
        gui: Any = running.viser.gui
        self._gui = gui
        self._killed = 0.0
        page: Any = running.page
        page._notify = self._listen(page._notify)
        page.session._report = self._keep_fault
        self._in_turn = in_turn
        self._calls: list[Future[Any]] = []
        pool = gui._thread_executor
        pool.submit = self._keep_call(pool.submit)

    def run(self, actions: int) -> Report:
        """Do so many things, look now and then, and say what came of it."""
        said = io.StringIO()
        with redirect_stderr(said), redirect_stdout(said):
            self._run(actions)
        # Nothing is printed where nothing is wrong.
        if said.getvalue().strip():
            self.report.faults.append(said.getvalue())
        return self.report

    def _run(self, actions: int) -> None:
        weights = [weight for weight, _ in self._does]
        since = 0
        while self.report.actions < actions:
            _, act = self._random.choices(self._does, weights)[0]
            before = self.report.actions
            self._do(act)
            since += self.report.actions - before
            if since >= BETWEEN_LOOKS:
                since = 0
                self.look()
        self.look()
        for tab in self._tabs:
            tab.close()

    def _do(self, act: Callable[[], None]) -> None:
        if not self._in_turn:
            act()
            return
        server_clock.set_pace(SLOW_PACE)
        try:
            act()
        finally:
            server_clock.set_pace(1.0)
        server_clock.advance(REST_SECONDS)
        self._settle()
        assert server_clock.settle(self.running.page, PATIENCE_SECONDS)

    def _keep_call(self, submit: Callable[..., Future[Any]]) -> Callable[..., Future[Any]]:
        """Return how to call on a thread of viser's, so that it can be waited for."""

        def submit_and_keep(*arguments: Any) -> Future[Any]:
            call = submit(*arguments)
            self._calls.append(call)
            return call

        return submit_and_keep

    def _hear(self) -> None:
        """Wait until all that the tabs have sent is handled."""
        wait_until_heard(self.running, *self._tabs)
        calls, self._calls = self._calls, []
        assert not wait(calls, PATIENCE_SECONDS).not_done
        assert self.running.page.session.wait_until_idle(PATIENCE_SECONDS)

    def look(self) -> None:
        """Wait for quiet, and compare the page with a new one of the same state."""
        self._hear()
        self._settle()
        self.report.threads.append(threading.active_count())
        self.report.processes.append(len(psutil.Process().children(recursive=True)))
        page = self.running.page
        state, history = page.session.state, page.session.history
        with explorer_with_data() as fresh:
            session: Any = fresh.page.session
            wait_until_drawn(fresh.page, PATIENCE_SECONDS)
            session._state, session._history = state, history
            shelves = [each.services.get(SavedDesigns) for each in (fresh.page, page)]
            for saved in shelves:
                saved.wait_until_idle()
            shelves[0].entries = shelves[1].entries
            shelves[0].last_deleted = shelves[1].last_deleted
            session.redraw()
            assert wait_until_drawn(fresh.page, PATIENCE_SECONDS)
            found = differences(shown_by(self.running), shown_by(fresh))
            # What is typed for a button to read is no part of the state.
            self.report.drift += [each for each in found if "GuiTextHandle value" not in each]

    def _settle(self) -> None:
        page = self.running.page
        deadline = time.monotonic() + PATIENCE_SECONDS
        while time.monotonic() < deadline:
            assert wait_until_drawn(page, PATIENCE_SECONDS), "the page does not come to rest"
            journey = journey_of(page.session.state)
            is_on = journey is not None and journey.is_playing
            if not is_on and not Paths.of(page.session.state).is_planning:
                time.sleep(0.1)
                if page.session.wait_until_idle(0.0):
                    return
            time.sleep(0.05)
        raise AssertionError("the page does not come to rest")

    def _keep_fault(self, error: Exception) -> None:
        self.report.faults.append(repr(error))

    def _listen(self, notify: Callable[..., None]) -> Callable[..., None]:
        """Return how to notify people, so that what is no fault of theirs is kept."""

        def notify_and_keep(title: str, message: str, *others: object) -> None:
            if title != REFUSAL and not EXPECTED.fullmatch(message):
                self.report.faults.append(message)
            notify(title, message, *others)

        return notify_and_keep

    @property
    def _tab(self) -> SocketTab:
        return self._random.choice(self._tabs)

    def _inputs(self, *, buttons: bool) -> list[Any]:
        handles = list(self._gui._gui_input_handle_from_uuid.values())
        return [h for h in handles if h._impl.is_button is buttons]

    def _use(self) -> None:
        """Give a control a value, once in a while an impossible one."""
        handle = self._random.choice(self._inputs(buttons=False))
        self._tab.update(handle._impl.uuid, self._value_for(handle))
        self._did()

    def _drag(self) -> None:
        """Move a slider in many small steps, sometimes by two hands in two tabs."""
        sliders = [h for h in self._inputs(buttons=False) if _is(h, viser.GuiSliderHandle)]
        handle = self._random.choice(sliders)
        tabs = [self._tab] if self._random.random() < 0.8 else [self._tab, self._tab]
        low, high = handle.min, handle.max
        at = self._random.uniform(low, high)
        for _ in range(self._random.randint(3, 20)):
            at = min(max(at + self._random.gauss(0.0, 0.03) * (high - low), low), high)
            self._random.choice(tabs).update(handle._impl.uuid, at)
            self._did()
            if self._random.random() < 0.3:
                time.sleep(self._random.uniform(0.0, 0.01))

    def _push(self) -> None:
        handle = self._random.choice(self._inputs(buttons=True))
        value: object = True
        if _is(handle, viser.GuiButtonGroupHandle):
            value = self._random.choice(handle.options)
        elif _is(handle, viser.GuiUploadButtonHandle):
            return
        self._tab.update(handle._impl.uuid, value)
        self._did()

    def _press(self) -> None:
        """Press a button in markup, or what is none."""
        found = presses_in(self.running)
        press = self._random.choice(found)
        if self._random.random() < 0.1:
            press = (press[0], "gone")
        self._tab.update(*press_update(self.running, *press))
        self._did()

    def _trigger(self) -> None:
        """Choose a command from the search, or press the keys of one."""
        commands = list(self._gui._command_handle_from_uuid)
        label = self._random.choice(self.running.page.services.commands.all).label
        if self._random.random() < 0.5:
            self._tab.update(*press_update(self.running, RUN, label))
        else:
            self._tab.send({"type": "CommandTriggerMessage", "uuid": self._random.choice(commands)})
        self._did()

    def _pull_handle(self) -> None:
        scene: Any = self.running.viser.scene
        nodes = scene._handle_from_node_name.items()
        names = [n for n, handle in nodes if _is(handle, viser.TransformControlsHandle)]
        name = self._random.choice(names)
        tab = self._tab
        for _ in range(self._random.randint(1, 12)):
            quaternion = [self._random.gauss(0.0, 1.0) for _ in range(4)]
            norm = math.hypot(*quaternion)
            tab.send(
                {
                    "type": "TransformControlsUpdateMessage",
                    "name": name,
                    "position": [self._random.uniform(-5.0, 5.0) for _ in range(3)],
                    "wxyz": [each / norm for each in quaternion],
                }
            )
            self._did()

    def _click_scene(self) -> None:
        scene: Any = self.running.viser.scene
        self._tab.send(
            {
                "type": "SceneNodeClickMessage",
                "name": self._random.choice(list(scene._handle_from_node_name)),
                "instance_index": None,
                "ray_origin": (0.0, -30.0, 20.0),
                "ray_direction": (0.0, 0.8, -0.6),
                "screen_pos": (0.5, 0.5),
                "modifier": None,
            }
        )
        self._did()

    def _upload(self) -> None:
        """Upload what is no design, or half of one, or a whole one."""
        buttons = [h for h in self._inputs(buttons=True) if _is(h, viser.GuiUploadButtonHandle)]
        if not buttons:
            return
        whole = encode_design(self._random.choice(list(PRESETS.values())))
        content = self._random.choice([*BROKEN, whole, whole[: len(whole) // 2]])
        self._tab.upload(self._random.choice(buttons)._impl.uuid, "../x.json", content)
        self._did()

    def _reload(self) -> None:
        """Close a tab and open it again."""
        index = self._random.randrange(TABS)
        self._tabs[index].close()
        self._open(index)
        self._did()

    def _open(self, index: int) -> None:
        """Open a tab in the place of one that has gone."""
        clients = self.running.viser.get_clients
        if self._in_turn:
            wait_for(lambda: len(clients()) == TABS - 1)
        self._tabs[index] = SocketTab(self.running.url)
        if self._in_turn:
            wait_for(lambda: len(clients()) == TABS)

    def _vanish(self) -> None:
        """Lose a tab in mid-drag, without a word."""
        index = self._random.randrange(TABS)
        tab = self._tabs[index]
        sliders = [h for h in self._inputs(buttons=False) if _is(h, viser.GuiSliderHandle)]
        handle = self._random.choice(sliders)
        for _ in range(5):
            tab.update(handle._impl.uuid, self._random.uniform(handle.min, handle.max))
            self._did()
        tab.drop()
        self._open(index)

    def _kill(self) -> None:
        """Kill the worker that draws the workspace, whatever it is doing."""
        numbers = self.running.page.jobs.process_ids()
        # Twice over the same work it is given up; at rest it has none.
        is_time = self._in_turn or time.monotonic() - self._killed > KILL_SECONDS
        if numbers and is_time:
            self._killed = time.monotonic()
            with suppress(ProcessLookupError):
                os.kill(numbers[0], getattr(signal, "SIGKILL", signal.SIGTERM))
        self._did()

    def _preset(self) -> None:
        """Return to a sane design, lest all that follows happens to a monster."""
        page = self.running.page
        page.session.do(open_design(self._random.choice(list(PRESETS.values()))))
        self._did()

    def _value_for(self, handle: Any) -> Any:
        value: Any = handle._impl.value
        if _is(handle, viser.GuiDropdownHandle):
            return self._random.choice(handle.options)
        if isinstance(value, bool):
            return self._random.random() < 0.5
        if isinstance(value, tuple):
            return [self._number(float(each)) for each in handle.value]
        if isinstance(value, str):
            return self._random.choice(["", "mine", "../../etc", "<b>x</b>", "δ" * 200, "\x00"])
        if _is(handle, viser.GuiSliderHandle) and self._random.random() < 0.95:
            return self._random.uniform(handle.min, handle.max)
        return self._number(float(value))

    def _number(self, present: float) -> float:
        if self._random.random() < 0.1:
            return self._random.choice(NUMBERS)
        return present + self._random.gauss(0.0, 0.2) * max(1.0, abs(present))

    def _did(self) -> None:
        self.report.actions += 1
        if self._in_turn:
            self._hear()


def _is(handle: Any, kind: type) -> bool:
    """Whether a handle is of a kind; what it is made of remains viser's affair."""
    return isinstance(handle, kind)


@contextmanager
def explorer_with_data() -> Generator[Running]:
    """Start an explorer with a data folder of its own, to be let loose on."""
    with tempfile.TemporaryDirectory() as folder:
        library, store = Library(Path(folder) / "designs"), SessionFile(Path(folder) / "sessions")
        running = start(PRESETS["paper-optimal"], port=0, user_data=UserData(library, store))
        try:
            yield running
        finally:
            running.stop()


def main(actions: int = 20000, seed: int = 1) -> None:
    """Let a monkey loose and print what came of it."""
    with explorer_with_data() as running:
        report = Monkey(running, seed).run(actions)
    print(f"{report.actions} actions")
    print("threads:", report.threads)
    print("processes:", report.processes)
    print("\n".join(["faults:", *report.faults, "drift:", *report.drift]))
    sys.exit(bool(report.faults or report.drift))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
