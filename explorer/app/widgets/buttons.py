"""Buttons in the page's own markup: HTML, and functions that handle presses, by name.

viser's HTML reports no clicks. A script of the page sends each press on an element with
`data-press` to one hidden text control; of an element with `data-hover` it sends, as a press of
that name, that the pointer rests on it or has left it. Presses on names that are not registered are
dropped.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Container
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from html import escape

import msgspec
import viser

from explorer.app.widgets.markup import meter, note
from explorer.files.extras import EXTRAS, install_command, need_of
from explorer.page.browser.browser_facts import decode_text
from explorer.page.browser.viser_gaps import element_id, run_script, run_script_in
from explorer.page.look import read_script
from explorer.page.widgets.palette import Command, Commands, Key

MANUAL = "help.open"
"""The name of buttons that open the manual; the value is a page, with "#" and a heading or term."""

PressHandler = Callable[[str, viser.ClientHandle], None]
"""Handles a press with the value of its button, for the client that pressed."""


class _Press(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A press as the script sends it; another number for each makes the text differ."""

    name: str
    value: str
    count: int


_DECODER = msgspec.json.Decoder(_Press)


class Buttons:
    """The buttons in the markup of one page.

    Attributes:
        commands: The commands of the page; those that press a button are among them.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._registered: dict[str, tuple[PressHandler, Container[str] | None]] = {}
        self.commands = Commands()
        # Handles presses one after the other, in their order.
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="buttons")
        self.inbox = server.gui.add_text("Presses on markup", "", visible=False)

        # A coroutine runs on the thread that reads messages, while the text is that of this event.
        @self.inbox.on_update
        async def _(event: viser.GuiEvent[viser.GuiTextHandle]) -> None:
            if event.client is not None:
                self.receive(event.target.value, event.client)

        run_script(server, read_script("buttons", element_id(self.inbox)))
        self.on(COPY_INSTALL, _copy_install, values=EXTRAS)

    def on(self, name: str, does: PressHandler, *, values: Container[str] | None = None) -> None:
        """Register the function that handles presses on the buttons with a name.

        The name is unique in the page, such as "compare.open". A press may have any value
        if none are given.

        Raises:
            ValueError: The name is registered.
        """
        if name in self._registered:
            raise ValueError(f"two buttons are called {name!r}")
        self._registered[name] = does, values

    def offer(
        self,
        label: str,
        hint: str,
        name: str,
        value: str = "",
        is_ready: Callable[[], bool] = lambda: True,
        *,
        keys: tuple[Key, ...] = (),
    ) -> None:
        """Offer a press on the button with a name and a value in the search.

        The label names the command, from the tab to the option, and the hint is a sentence
        on it. It can be run while `is_ready` says so.
        """
        run = partial(self.press, name, value)
        self.commands.add(Command(label, hint, run, is_ready, keys=keys))

    def receive(self, text: str, client: viser.ClientHandle) -> None:
        """Queue a press that a page sent; drop a text that describes none."""
        press = decode_text(text, _DECODER)
        if press is not None:
            # A page that is being closed takes no more presses.
            with contextlib.suppress(RuntimeError):
                handled = self._thread.submit(self.press, press.name, press.value, client)
                # Raises what a press failed with, so that it is logged with its trace.
                handled.add_done_callback(lambda done: done.cancelled() or done.result())

    def press(self, name: str, value: str, client: viser.ClientHandle) -> None:
        """Handle a press on the button with a name and a value; do nothing if there is none."""
        does, values = self._registered.get(name, (None, None))
        if does is not None and (values is None or value in values):
            does(value, client)

    def stop(self) -> None:
        """End the thread on which presses are handled."""
        self._thread.shutdown(wait=False, cancel_futures=True)


def press_button(
    name: str,
    value: str | int,
    content: str,
    *,
    hint: str = "",
    label: str = "",
    class_name: str = "",
    hover: str = "",
    opens: str = "",
    is_on: bool | None = None,
    is_disabled: bool = False,
) -> str:
    """Return a button as HTML, whose presses go to the function registered under a name.

    Args:
        name: The name that was given to `Buttons.on`; none if "".
        value: The value that its function receives.
        content: The visible content, HTML.
        hint: Words on what a press does, shown when a pointer rests on the button.
        label: The name for screen readers; the content if "".
        class_name: The classes of the stylesheet.
        hover: The name under which a function is registered that receives the value while the
            pointer rests on the button, and "" once it has left; none if "".
        opens: Title of the tab or dialog that it opens.
        is_on: Whether a switch is on; None if the button is no switch.
        is_disabled: Whether the button cannot be pressed.
    """
    attributes = {
        "class": class_name,
        "data-opens": opens,
        "data-press": name,
        "data-value": str(value),
        "data-hover": hover,
        "title": hint,
        "aria-label": label,
        "aria-pressed": "" if is_on is None else str(is_on).lower(),
    }
    given = "".join(f' {key}="{escape(text)}"' for key, text in attributes.items() if text)
    disabled = " disabled" if is_disabled else ""
    return f'<button type="button"{given}{disabled}>{content}</button>'


COPY_INSTALL = "extra.copy"


def extra_button(extra: str) -> str:
    """Return a button as HTML that says which extra is missing for what, and copies the command.

    On a system that has no such library, it is a note.
    """
    words = need_of(extra)
    content = escape(words[:1].upper() + words[1:])
    if not install_command(extra):
        return note(content)
    hint = "Copy the command; run it in the checkout of the explorer, and start the explorer again."
    return press_button(COPY_INSTALL, extra, content, hint=hint, class_name="ex-button is-extra")


def _copy_install(extra: str, client: viser.ClientHandle) -> None:
    # The pip of the Python that runs the page, which may not be the first one of a shell.
    python = f'"{sys.executable}"' if " " in sys.executable else sys.executable
    run_script_in(client, read_script("copies", f"{python} -m {install_command(extra)}"))


def open_button(
    title: str,
    content: str,
    *,
    press: str = "",
    hint: str = "",
    class_name: str = "",
) -> str:
    """Return a button as HTML that opens the tab or the dialog with a title."""
    return press_button(press, "", content, hint=hint, class_name=class_name, opens=title)


def figure(opens: str, name: str, value: str, *, hint: str, look: str = "") -> str:
    """Return a figure of the bar as HTML, a button that opens the tab that explains it.

    The value with its unit is HTML; `look` is its class, such as "ex-close".
    """
    content = f'<span class="ex-dim ex-small">{escape(name)}</span><b class="{look}">{value}</b>'
    return open_button(opens, content, hint=hint, class_name="ex-figure")


def activity(opens: str, title: str, words: str, share: float | None, buttons: str) -> str:
    """Return running or waiting work as HTML for the bar, with a button that opens a tab.

    The share that is done, 0 to 1, is None if it is not known; the buttons that end or answer
    it are HTML.
    """
    bar = "" if share is None else meter(100.0 * share, look="ex-meter is-thin")
    content = (
        f'<b class="ex-cut">{escape(title)}</b>'
        f'<span class="ex-dim ex-small">{escape(words)}</span>{bar}'
    )
    title_button = open_button(opens, content, hint=f"Open the tab {opens}.", class_name="ex-name")
    return f'<span class="ex-running">{title_button}{buttons}</span>'
