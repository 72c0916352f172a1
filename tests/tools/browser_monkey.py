"""Random hands in a real browser: clicks, drags, keys, files and reloads, wherever they land.

From the checkout, for as long as one likes: python tests/tools/browser_monkey.py [actions] [seed]
"""

from __future__ import annotations

import random
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

from graphics import quick_browser
from monkey import BROKEN, explorer_with_data
from playwright.sync_api import Browser
from tab import Tab

from explorer.app.server import Running
from explorer.mechanism.design_file import PRESETS, encode_design

# Between two looks at whether the browser shows what the server has.
BETWEEN_LOOKS = 50
# Within 50 ms viser's page tells of no more than the first and the last control that is changed:
# whatever is changed in between is lost. No hand is so quick.
PAUSE_MS = 60
KEYS = (
    "Control+z",
    "Control+Shift+z",
    "Control+y",
    "Control+k",
    "Escape",
    "Tab",
    "Enter",
    "ArrowRight",
    "ArrowDown",
    "Home",
    *"abcdefghijklmnopqrstuvwxyz0123456789?",
)
TEXTS = ("0", "12.5", "-3", "1e9", "abc", "", "-", "99999999999999999999", "δ")

# What can be clicked and lies open, as its middle and its kind; but for viser's own settings,
# by which the page can be sent to another server.
FIND = """() => [...document.querySelectorAll(
    'button, [role=tab], [role=slider], input, [role=combobox], [role=option]')]
  .map(each => {
    const box = each.getBoundingClientRect();
    const x = box.x + box.width / 2, y = box.y + box.height / 2;
    return {each, x, y, box};
  })
  .filter(({each, x, y, box}) => box.width > 2 && box.height > 2 && x > 0 && y > 0
    && x < innerWidth && y < innerHeight && !each.disabled
    && !each.querySelector('.tabler-icon-adjustments')
    && (h => h && (each.contains(h) || h.contains(each)))(document.elementFromPoint(x, y)))
  .map(({each, x, y}) => ({x, y, kind: each.getAttribute('role') || each.type || each.tagName}))"""

# The values of all sliders and checkboxes, by the ids that viser gives them.
READ = """() => Object.fromEntries([
  ...[...document.querySelectorAll('[id]:has([role=slider])')].filter(each =>
      each.querySelectorAll('[role=slider]').length === 1).map(each =>
      [each.id, Number(each.querySelector('[role=slider]').getAttribute('aria-valuenow'))]),
  ...[...document.querySelectorAll('input[type=checkbox][id]')].map(each =>
      [each.id, each.checked]),
])"""


@dataclass(frozen=True)
class Outcome:
    """What came of it.

    Attributes:
        actions: That were done.
        complaints: Of the browser's console, failed requests among them.
        drift: Controls whose value in the browser is not that of the server.
    """

    actions: int
    complaints: tuple[str, ...]
    drift: tuple[str, ...]


class BrowserMonkey:
    """Does random things in a tab.

    Args:
        browser: A real one.
        running: The explorer.
        seed: For what it does.
    """

    def __init__(self, browser: Browser, running: Running, seed: int) -> None:
        self._running = running
        self._random = random.Random(seed)
        self._tab = Tab(browser, running)
        self._page = self._tab.page
        self._drift: list[str] = []
        self._does: tuple[tuple[int, Callable[[], None]], ...] = (
            (60, self._click),
            (15, self._drag),
            (10, self._press),
            (8, self._write),
            (4, self._turn_scene),
            (2, self._upload),
            (1, self._tab.reload),
        )

    def run(self, actions: int) -> Outcome:
        """Do so many things, look now and then, and say what came of it."""
        weights = [weight for weight, _ in self._does]
        for count in range(1, actions + 1):
            _, act = self._random.choices(self._does, weights)[0]
            act()
            self._page.wait_for_timeout(PAUSE_MS)
            if count % BETWEEN_LOOKS == 0 or count == actions:
                self.look()
        complaints = tuple(self._tab.complaints())
        self._tab.close()
        return Outcome(actions, complaints, tuple(self._drift))

    def look(self) -> None:
        """Compare the controls in the browser with those of the server, once all is quiet."""
        gui: Any = self._running.viser.gui
        deadline = time.monotonic() + 20.0
        while True:
            self._running.page.session.wait_until_idle()
            shown: dict[str, Any] = self._page.evaluate(READ)
            handles = gui._gui_input_handle_from_uuid
            apart = [
                f"{getattr(handles[uuid], 'label', uuid)}: {value} in the browser, "
                f"{handles[uuid].value} in the server"
                for uuid, value in shown.items()
                if uuid in handles and abs(float(value) - float(handles[uuid].value)) > 1e-9
            ]
            if not apart:
                return
            if time.monotonic() > deadline:
                self._drift += apart
                return
            self._page.wait_for_timeout(100)

    def _find(self, kind: str | None = None) -> tuple[float, float] | None:
        found = [each for each in self._page.evaluate(FIND) if kind in (None, each["kind"])]
        if not found:
            return None
        chosen = self._random.choice(found)
        return chosen["x"], chosen["y"]

    def _click(self) -> None:
        at = self._find()
        if at is not None:
            self._page.mouse.click(*at)

    def _drag(self) -> None:
        at = self._find("slider")
        if at is None:
            return
        mouse = self._page.mouse
        mouse.move(*at)
        mouse.down()
        mouse.move(at[0] + self._random.uniform(-90.0, 90.0), at[1], steps=6)
        if self._random.random() < 0.05:
            # Gone in mid-drag.
            self._tab.reload()
        mouse.up()

    def _press(self) -> None:
        self._page.keyboard.press(self._random.choice(KEYS))

    def _write(self) -> None:
        at = self._find("text")
        if at is None:
            return
        self._page.mouse.click(*at)
        self._page.keyboard.press("Control+a")
        self._page.keyboard.type(self._random.choice(TEXTS))
        self._page.keyboard.press(self._random.choice(("Enter", "Tab", "Escape")))

    def _turn_scene(self) -> None:
        mouse = self._page.mouse
        mouse.move(self._random.uniform(320.0, 880.0), self._random.uniform(120.0, 600.0))
        if self._random.random() < 0.5:
            mouse.wheel(0.0, self._random.uniform(-300.0, 300.0))
            return
        mouse.down()
        mouse.move(self._random.uniform(320.0, 880.0), self._random.uniform(120.0, 600.0), steps=5)
        mouse.up()

    def _upload(self) -> None:
        inputs = self._page.locator("input[type=file]")
        if inputs.count() == 0:
            return
        good = encode_design(PRESETS["paper-initial"])
        content = self._random.choice([*BROKEN, good])
        inputs.nth(self._random.randrange(inputs.count())).set_input_files(
            {"name": "design.json", "mimeType": "application/json", "buffer": content}
        )


def main(actions: int = 2000, seed: int = 1) -> None:
    """Let a monkey loose and print what came of it."""
    with explorer_with_data() as running, quick_browser() as browser:
        outcome = BrowserMonkey(browser, running, seed).run(actions)
    print(f"{outcome.actions} actions")
    print("\n".join(["complaints:", *outcome.complaints, "drift:", *outcome.drift]))
    sys.exit(bool(outcome.complaints or outcome.drift))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
