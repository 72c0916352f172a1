"""A tab of the explorer as a person uses it: inputs are found by the words beside them."""

from __future__ import annotations

import itertools
import math
import re
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

import numpy as np
import server_clock
import viser
from playwright.sync_api import Browser, ConsoleMessage, Download, Locator, expect

from explorer.app.scene.camera import ViewName, framing, has_perspective
from explorer.app.screenshot import (
    AWAIT_FRAMES,
    HOLD,
    PATIENCE_SECONDS,
    SCENE_CANVAS,
    fixed_resolution_url,
    settle,
)
from explorer.app.server import Running
from explorer.app.session.history import start_history
from explorer.app.session.session import HistoryMove
from explorer.app.state.actions import Set
from explorer.app.state.state import State, open_state
from explorer.app.state.view import View
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.arrays import FloatArray
from explorer.page.browser.viser_gaps import element_id

# Small, since what the pictures look like is tested elsewhere; panels and scene side by side.
SIZE = (940, 540)

# All that a console may say: what it logs, and these complaints. The first is viser's three.js
# about itself, the second the software renderer about reading a frame back, the third about what
# lights the scene in a page that draws nothing while it loads. The last two are viser's page about
# what it leaves undone: of the messages that arrive within a frame it does the removals first, so
# that the last change of a card is too late for it; and a page that is loaded again is told of
# removals before its time if its server has not yet seen that the page before has gone.
TOLERATED = (
    re.compile(r"^warning: THREE\.Clock: This module has been deprecated"),
    re.compile(r"^warning: .*GL Driver Message .* GPU stall due to ReadPixels"),
    re.compile(r"^warning: .*This browser does not support reading pixels from 1016 RenderTargets"),
    re.compile(r"^error: Tried to update non-existent component '[\w-]+' \{content: "),
    re.compile(r"^warning: \(OK\) Tried to remove non-existent component [\w-]+$"),
)
TOLERATED_KINDS = ("log", "info", "debug")

# The slider as a whole is what its label is for; its thumb moves along it.
TRACK = "[id]:has([role=slider])"

# Take away focus, scrolling and messages, and turn to the first tab of each panel.
FORGET = """() => {
    document.activeElement?.blur();
    for (const box of document.querySelectorAll("*")) box.scrollTop = 0;
    const enter = { key: "Enter", code: "Enter", bubbles: true };
    for (const group of document.querySelectorAll("[role=tablist]")) {
        const first = group.querySelector("[role=tab]");
        if (first && first.ariaSelected !== "true") {
            first.dispatchEvent(new KeyboardEvent("keydown", enter));
        }
    }
}"""
NOTICE = ".mantine-Notification-root"
CLOSE_NOTICES = """() => {
    const closing = document.querySelectorAll(".mantine-Notification-closeButton");
    for (const button of closing) button.click();
}"""
# Whether nothing fades or glides any more.
STILL = "window.explorer.isStill()"
# What the pointer rests on may explain itself over the scene.
WITHOUT_TOOLTIP = "[role=tooltip] { visibility: hidden }"
# Has the page draw its scene, or hold it.
DRAW = """(draws) => {
    window.isReleased = draws;
    if (draws) window.__viserMutable?.requestRender();
}"""
# Seconds that pass in a second of the machine while time is slow.
SLOW_PACE = 0.01
# Messages by which one look at a page asks whether it has come to rest: two marks, and the number
# that it sends back.
OWN_MESSAGES = 3
_numbers = itertools.count(1)


# Fields then show what the state has.
IN_UNITS = View(lengths="design units")


class Tab:
    """One page of an explorer, which draws its scene only while it is told to.

    A page that draws nothing while it loads lacks the reflections of its surroundings later.

    Args:
        browser: In which it is opened.
        running: The explorer.
        size: Of its window, in pixels.
        dark: Whether its user prefers dark pages.
        draws: Whether it draws its scene all the time.
    """

    def __init__(
        self,
        browser: Browser,
        running: Running,
        *,
        size: tuple[int, int] = SIZE,
        dark: bool = False,
        draws: bool = False,
    ) -> None:
        self.running = running
        self._size, self._draws = size, draws
        self.requests: list[str] = []
        self._complaints: list[str] = []
        self._context = browser.new_context(
            viewport={"width": size[0], "height": size[1]},
            color_scheme="dark" if dark else "light",
        )
        self._context.add_cookies(
            [{"name": "explorer-software", "value": "seen", "url": running.url}]
        )
        self._context.set_default_timeout(1000 * PATIENCE_SECONDS)
        self._context.on("console", self._said)
        self._context.on("weberror", lambda error: self._complaints.append(str(error.error)))
        self._context.on("request", lambda request: self.requests.append(request.url))
        self._context.on("requestfailed", lambda request: self._complaints.append(request.url))
        self._context.add_init_script(HOLD)
        if draws:
            self._context.add_init_script("window.isReleased = true")
        self.page = self._context.new_page()
        known = set(running.viser.get_clients())
        self.page.goto(fixed_resolution_url(running))
        self._arrive(known)

    def close(self) -> None:
        """Close the tab."""
        self._context.close()

    def begin_anew(self) -> None:
        """Make explorer and page what they were when the page was opened.

        The state, its history and the camera start again; menus, pointer, focus, chosen tabs and
        scrolling go back.
        """
        page, session = self.running.page, self.running.page.session
        self.draw(False)
        self.page.keyboard.press("Escape")
        self.page.set_viewport_size({"width": self._size[0], "height": self._size[1]})
        self.page.mouse.move(0, 0)
        self.page.evaluate(FORGET)
        self.page.evaluate(CLOSE_NOTICES)
        # A field enters what was typed as it loses the focus.
        self._hear()
        # A move through the history leaves what is shown as it is.
        session.do(Set("view", IN_UNITS))
        session.do(HistoryMove(lambda _: start_history(open_state(PRESETS["paper-optimal"]))))
        page.panels.work.minimize()
        # Cameras follow what has changed, and the scene has its size, before this one is put.
        self._settle_server()
        settle(self.page, self.client)
        page.point_cameras("isometric")
        self.settle()

    def resize(self, size: tuple[int, int]) -> None:
        """Give the window another size, in pixels, and wait until all is laid out in it."""
        self.page.set_viewport_size({"width": size[0], "height": size[1]})
        self.settle()

    def draw(self, draws: bool) -> None:
        """Have the page draw its scene from now on, or not."""
        self._draws = draws
        self.page.evaluate(DRAW, draws)

    @contextmanager
    def drawing(self) -> Generator[None]:
        """Have the page draw its scene meanwhile."""
        before = self._draws
        self.draw(True)
        yield
        self.draw(before)

    def settle(self) -> None:
        """Wait until server and page have come to rest.

        Nothing waits, no pause is pending, and nothing fades or glides.
        """
        deadline = time.monotonic() + PATIENCE_SECONDS
        while True:
            self._settle_server()
            sent = self._sent_messages()
            settle(self.page, self.client)
            is_still = self.page.evaluate(STILL)
            self._hear()
            self._settle_server()
            # What the page had to say before may have changed something.
            if is_still and self._sent_messages() == sent + OWN_MESSAGES:
                return
            assert time.monotonic() < deadline, "the page is never at rest"

    def _settle_server(self) -> None:
        is_at_rest = server_clock.settle(self.running.page, PATIENCE_SECONDS)
        assert is_at_rest, "the explorer is never at rest"

    def advance(self, seconds: float) -> None:
        """Let time pass, for the explorer and for the page, without waiting for it."""
        self._hear()
        self.page.evaluate("pause => window.explorer.clock.advance(pause)", 1000.0 * seconds)
        self._hear()
        server_clock.advance(seconds)

    @contextmanager
    def slow_time(self) -> Generator[None]:
        """Let next to no time pass meanwhile, for the explorer and for the page.

        Within it pauses last, whatever the machine takes for what is done.
        """
        self._set_pace(SLOW_PACE)
        try:
            yield
        finally:
            # The clock is that of other explorers in this process too.
            server_clock.set_pace(1.0)
        self._set_pace(1.0)

    def _set_pace(self, pace: float) -> None:
        server_clock.set_pace(pace)
        self.page.evaluate("pace => window.explorer.clock.setPace(pace)", pace)

    def _hear(self) -> None:
        """Wait until the explorer has received all that the page has sent."""
        number = next(_numbers)
        self.page.evaluate("values => window.explorer.send(...values)", [self._echo_id, number])
        self.wait_for(lambda: self._echo.value == number, "an echo")

    def _sent_messages(self) -> int:
        """Return the number of messages to all pages and to this one so far."""
        guis: tuple[Any, ...] = (self.running.viser.gui, self.client.gui)
        return sum(each._websock_interface.get_message_buffer().message_counter for each in guis)

    def complaints(self) -> list[str]:
        """Return what the console said that is not tolerated, errors and failed requests."""
        return self._complaints

    def reload(self) -> None:
        """Load the page again."""
        known = set(self.running.viser.get_clients())
        self.page.reload()
        self._arrive(known)

    @property
    def client(self) -> viser.ClientHandle:
        """The tab as the server knows it."""
        return self.running.viser.get_clients()[self._client_id]

    @property
    def state(self) -> State:
        """The state of the explorer."""
        return self.running.page.session.state

    def label(self, words: str) -> Locator:
        """Return the words beside an input; any white space is one blank."""
        pattern = r"\s+".join(map(re.escape, words.split()))
        return self.page.locator("label").filter(has_text=re.compile(rf"^\s*{pattern}\s*$"))

    def row(self, words: str) -> Locator:
        """Return the input, or the inputs, with these words beside them."""
        return self.label(words).locator("xpath=ancestor::*[.//input][1]")

    def slider(self, words: str) -> Locator:
        """Return the thumb of a slider."""
        return self.row(words).get_by_role("slider")

    def field(self, words: str) -> Locator:
        """Return a number field, that of a slider or one of its own."""
        return self.row(words).locator("input[inputmode=decimal]")

    def shown(self, words: str) -> float:
        """Return the value at which a slider stands."""
        value = self.slider(words).get_attribute("aria-valuenow")
        assert value is not None
        return float(value)

    def type(self, words: str, text: str) -> None:
        """Type into a number field, key by key, without a pause that would enter it."""
        field = self.field(words)
        field.click()
        with self.slow_time():
            field.press("ControlOrMeta+a")
            field.press_sequentially(text)

    def grab(self, it: Locator) -> tuple[float, float]:
        """Press the middle of something, once it shows the state and rests; return the place."""
        # The worker may be at work.
        assert self.running.page.session.wait_until_idle(PATIENCE_SECONDS)
        settle(self.page, self.client)
        it.hover()
        place = middle(it)
        self.page.mouse.down()
        return place

    def drag(self, words: str, share: float, steps: int = 10) -> float:
        """Drag a slider to a share of its range by mouse; return the value that stands for."""
        thumb = self.slider(words)
        self.grab(thumb)
        # The track may be another one after the drag, since it follows the state.
        track = self.row(words).locator(TRACK).bounding_box()
        low, high = (float(thumb.get_attribute(f"aria-value{end}") or "") for end in ("min", "max"))
        assert track is not None
        x, y = track["x"] + share * track["width"], track["y"] + 0.5 * track["height"]
        self.page.mouse.move(x, y, steps=steps)
        self.page.mouse.up()
        return low + share * (high - low)

    def choose(self, words: str, option: str) -> None:
        """Choose from a list."""
        self.row(words).get_by_role("combobox").click()
        self.page.get_by_role("option", name=option, exact=True).click()

    def switch(self, words: str, *, on: bool) -> None:
        """Switch a checkbox."""
        self.row(words).locator("input[type=checkbox]").set_checked(on)

    def push(self, words: str) -> None:
        """Click a button."""
        # What runs stands in the bar too, with the buttons that it has in its tab.
        buttons = self.page.get_by_role("button", name=words, exact=True)
        buttons.locator("visible=true").first.click()

    def unfold(self, title: str) -> None:
        """Open a folder that is closed."""
        self.settle()
        head = self.page.get_by_role("button", name=title, exact=True)
        if head.get_attribute("aria-expanded") == "false":
            head.click()
        expect(head).to_have_attribute("aria-expanded", "true")

    def turn_to(self, name: str) -> None:
        """Turn to another tab of the panels."""
        tab = self.page.get_by_role("tab", name=name, exact=True)
        tab.click()
        expect(tab).to_have_attribute("aria-selected", "true")

    def open_dialog(self, name: str) -> None:
        """Open a dialog by its button in the bar."""
        self.page.locator(f"[data-opens='{name}']").first.click()
        self.page.get_by_role("dialog", name=name).wait_for()

    def close_notices(self) -> None:
        """Close the notices, which lie over the scene, and wait until they are gone."""
        self.page.evaluate(CLOSE_NOTICES)
        expect(self.page.locator(NOTICE)).to_have_count(0)

    def export(self, what: str, file_format: str) -> Download:
        """Download a file by the dialog Export."""
        self.open_dialog("Export")
        with self.page.expect_download() as download:
            self.push(f"Export {what} as {file_format}")
        self.page.keyboard.press("Escape")
        return download.value

    def wait_for(self, condition: Callable[[], bool], what: str) -> None:
        """Wait until a condition is met.

        Raises:
            AssertionError: it is not in time.
        """
        deadline = time.monotonic() + PATIENCE_SECONDS
        while not condition():
            if time.monotonic() > deadline:
                focused = self.page.evaluate("document.activeElement.outerHTML.slice(0, 300)")
                raise AssertionError(f"never came about: {what}; the focus is on {focused}")
            self.page.wait_for_timeout(20)

    def wait_until_shown(self, words: str, value: float, tolerance: float = 1e-9) -> None:
        """Wait until a slider and its field stand at a value."""
        self.wait_for(lambda: self.stands(words, value, tolerance), f"{words} at {value}")

    def stands(self, words: str, value: float, tolerance: float = 1e-9) -> bool:
        """Whether a slider and its field stand at a value."""
        text = self.field(words).input_value()
        digits = len(text.partition(".")[2])
        try:
            away = abs(float(text) - value)
        except ValueError:
            # What is being typed need not be a number.
            return False
        is_in_field = away <= tolerance + 0.5001 * 10.0**-digits
        return is_in_field and abs(self.shown(words) - value) <= tolerance

    def look_from(self, view: ViewName) -> None:
        """Push the button of a view and wait until the camera stands where it should."""
        self.settle()
        self.push(view.capitalize())

        def is_there() -> bool:
            camera = self.client.camera
            eye, _ = framing(self.running.page.corners(), view, camera.aspect)
            return bool(np.allclose(camera.position, eye, atol=1e-3))

        self.wait_for(is_there, f"the {view} view")
        self.settle()

    def picture(self) -> bytes:
        """Return a picture of the scene, drawn after all that has been asked for."""
        self.settle()
        with self.drawing():
            self.page.evaluate(AWAIT_FRAMES, 2)
            return self.page.locator(SCENE_CANVAS).screenshot(style=WITHOUT_TOOLTIP)

    def on_screen(self, point: FloatArray) -> tuple[float, float]:
        """Return where a point of the scene (3,) is in the page, once a pointer finds it there."""
        # What a pointer meets is where the last frame had it, also on a page on hold.
        self.page.evaluate(AWAIT_FRAMES, 2)
        camera = self.client.camera
        eye, target = np.array(camera.position), np.array(camera.look_at)
        forward = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        up = np.cross(right, forward)
        # Along an axis the page draws without perspective.
        along = point - eye if has_perspective(forward) else target - eye
        depth = along @ forward * math.tan(0.5 * camera.fov)
        box = self.page.locator(SCENE_CANVAS).bounding_box()
        assert box is not None
        across = float((point - eye) @ right / depth) * box["height"] / 2
        upward = float((point - eye) @ up / depth) * box["height"] / 2
        return box["x"] + box["width"] / 2 + across, box["y"] + box["height"] / 2 - upward

    def _arrive(self, known: set[int]) -> None:
        self.page.get_by_role("button", name="Home pose").wait_for()
        self.wait_for(lambda: bool(self._new(known)), "a connection")
        (self._client_id,) = self._new(known)
        self._echo = self.client.gui.add_number("Echo", 0, visible=False)
        self._echo_id = element_id(self._echo)
        self.draw(self._draws)
        # The scripts of the page are there, too, with what was sent before them.
        settle(self.page, self.client)
        # A browser that has shown it closes it.
        expect(self.page.locator("#webgl-software-rendering")).to_have_count(0)

    def _new(self, known: set[int]) -> set[int]:
        return set(self.running.viser.get_clients()) - known

    def _said(self, message: ConsoleMessage) -> None:
        complaint = f"{message.type}: {message.text}"
        if message.type not in TOLERATED_KINDS and not any(t.search(complaint) for t in TOLERATED):
            self._complaints.append(complaint)


def middle(it: Locator) -> tuple[float, float]:
    """Return the middle of something on the page."""
    # There is none of what is drawn anew at this moment.
    while (box := it.bounding_box()) is None:
        pass
    return box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
