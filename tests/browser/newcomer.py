"""A newcomer at the page, who finds everything by its role and its words and counts presses."""

from __future__ import annotations

import colorsys
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from playwright.sync_api import Locator, Page, expect
from tab import Tab

Words = str | re.Pattern[str]
Role = Literal["button", "checkbox", "tab"]

# Words of those buttons that are lighter than what they are filled with, in one look: the page
# draws buttons anew.
FILLED = """() => [...document.querySelectorAll("button:enabled")].filter((button) => {
    const { color, backgroundColor } = getComputedStyle(button);
    const parts = (each) => each.match(/[\\d.]+/g).map(Number);
    const [words, fill] = [parts(color), parts(backgroundColor)];
    const light = ([r, g, b]) => 0.3 * r + 0.6 * g + 0.1 * b;
    return button.checkVisibility() && (fill[3] ?? 1) === 1 && light(words) > light(fill);
}).map((button) => button.innerText.trim())"""
# Scroll to something; return whether it is then within the window.
SCROLL = """it => {
    it.scrollIntoView({ block: "nearest" });
    const { top, bottom } = it.getBoundingClientRect();
    // A part of a pixel may stay outside, since scrolling goes by whole ones.
    return it.isConnected && top > -1 && bottom < innerHeight + 1;
}"""
COLOUR = "it => getComputedStyle(it).color.match(/[\\d.]+/g)?.slice(0, 3).map(Number)"


DROPPED = """([name, text]) => {
  const transfer = new DataTransfer();
  transfer.items.add(new File([text], name));
  return transfer;
}"""


class Newcomer:
    """Somebody who uses the page for the first time.

    Args:
        tab: The tab at which they sit.

    Attributes:
        page: Its page.
        presses: Number of clicks, drags and keys so far, without those that type a value.
    """

    def __init__(self, tab: Tab) -> None:
        self._tab = tab
        self.page: Page = tab.page
        self.presses = 0

    def button(self, words: Words) -> Locator:
        """Return the first button with these words; what runs has its buttons in the bar too."""
        return self.page.get_by_role("button", name=words, exact=True).first

    def wait(self) -> None:
        """Wait until the page shows all that follows from what was done."""
        self._tab.settle()

    def press(self, words: Words, role: Role = "button") -> None:
        """Press a button, a checkbox or a tab, once the page has drawn all that was sent."""
        self.presses += 1
        self._tab.settle()
        self.page.get_by_role(role, name=words, exact=True).first.click()

    def press_running(self, words: str) -> None:
        """Press a button of what runs, while which the page is never at rest."""
        self.presses += 1
        self._tab.push(words)

    def open(self, title: str) -> None:
        """Press a tab of the panels."""
        self.press(title, "tab")
        tab = self.page.get_by_role("tab", name=title, exact=True)
        expect(tab).to_have_attribute("aria-selected", "true")

    def key(self, key: str) -> None:
        """Press a key that types no value."""
        self.presses += 1
        self.page.keyboard.press(key)

    def field(self, words: str) -> Locator:
        """Return the field with these words beside it."""
        return self.page.get_by_role("textbox", name=words, exact=True).first

    def type(self, words: str, text: str) -> None:
        """Press a field, replace what is in it, and press Enter, without a pause between keys."""
        self.presses += 2
        self.field(words).click()
        with self._tab.slow_time():
            self.page.keyboard.press("ControlOrMeta+a")
            self.page.keyboard.type(text)
            self.page.keyboard.press("Enter")

    def type_all(self, first: str, *texts: str) -> None:
        """Press a field, and type into it and those after it, each left by the key Tab."""
        self.presses += 1
        self.field(first).click()
        self.page.keyboard.press("ControlOrMeta+a")
        for text in texts:
            with self._tab.slow_time():
                self.page.keyboard.type(text)
                self.key("Tab")

    def choose(self, words: str, option: str) -> None:
        """Open a list and press an option."""
        self.presses += 2
        self.page.get_by_role("combobox", name=words, exact=True).click()
        self.page.get_by_role("option", name=option, exact=True).click()

    def export(self, what: str, file_format: str) -> bytes:
        """Return the file that the dialog Export gives."""
        self.press("Export")
        dialog = self.page.get_by_role("dialog", name="Export")
        with self.page.expect_download() as download:
            self.press(f"Export {what} as {file_format}")
        self.page.keyboard.press("Escape")
        expect(dialog).to_have_count(0)
        return Path(download.value.path()).read_bytes()

    def upload(self, file: Path) -> None:
        """Open a design file in the dialog of designs, which the design's name opens."""
        self.press(re.compile("^paper-optimal"))
        with self.page.expect_file_chooser() as chooser:
            self.press("Open a file …")
        chooser.value.set_files(file)

    def drop(self, file: Path) -> None:
        """Drop a file on the scene."""
        self.presses += 1
        transfer = self.page.evaluate_handle(DROPPED, [file.name, file.read_text()])
        self.page.dispatch_event("canvas", "drop", {"dataTransfer": transfer})

    def notices(self, words: Words) -> Locator:
        """Return the notices in sight with some words."""
        return self.page.locator(".mantine-Notification-root").filter(has_text=words)

    def figure(self, name: str) -> Locator:
        """Return a figure of the bar, which begins with its name."""
        return self.button(re.compile(f"^{name} "))

    def sees(self, words: Words) -> Locator:
        """Wait until words are in sight, scrolling to them as a wheel does; return where."""
        text = self.page.get_by_text(words).filter(visible=True).first
        # Words that change are other ones each time.
        self._tab.wait_for(lambda: bool(text.evaluate(SCROLL)), f"{words} in sight")
        return text

    def filled(self) -> list[str]:
        """Return the words of the buttons in sight that are filled."""
        return sorted(set(self.page.evaluate(FILLED)))

    def wait_for_numbers(
        self, where: Locator, values: Sequence[float], tolerance: float = 0.006
    ) -> None:
        """Wait until numbers are among those in the words of something."""

        def are_there() -> bool:
            found = numbers(where.inner_text())
            return all(any(abs(each - value) <= tolerance for each in found) for value in values)

        self._tab.wait_for(are_there, f"{values} in sight")

    def presses_for(self) -> int:
        """Return how many presses there were since the last count, and begin to count anew."""
        presses, self.presses = self.presses, 0
        return presses


def hue(it: Locator) -> float:
    """Return the hue of words in degrees: red is 0, amber 40, green 120."""
    # What is drawn anew at this moment has none.
    while (colour := it.evaluate(COLOUR)) is None:
        pass
    red, green, blue = colour
    return 360.0 * colorsys.rgb_to_hls(red / 255.0, green / 255.0, blue / 255.0)[0]


def numbers(text: str) -> list[float]:
    """Return the numbers in words of the page."""
    plain = re.sub(r"(?<=\d)[,\u2009\u202f](?=\d{3})", "", text.replace("−", "-"))
    return [float(each) for each in re.findall(r"-?\d+(?:\.\d+)?", plain)]
