"""The keys of the page: all of them on one card, and a line that tells where to find them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from html import escape

import viser

from explorer.app.browser.viser_gaps import element_id
from explorer.app.widgets.commands import KEYS, PAGE, PALETTE_KEY, STEP
from explorer.app.widgets.labels import labelled, out_of_sight
from explorer.app.widgets.markup import DIM, GREY, by_theme
from explorer.app.widgets.palette import Command, group_of

# What viser does with keys and pointers.
CAMERA = (
    ("drag, arrows", "Turn"),
    ("right drag", "Move"),
    ("wheel", "Zoom"),
    ("W A S D Q E", "Fly"),
)
# viser opens its palette at this key, which nothing on the server can press.
OPEN_PALETTE = (
    "document.documentElement.dispatchEvent(new KeyboardEvent('keydown',"
    "{key:'k',code:'KeyK',ctrlKey:true,bubbles:true}))"
)

# viser leaves it to the server to close a card, whatever is pressed in the browser. A part of the
# card therefore names the button that does.
CLOSED_BY = "data-closed-by"
CLOSING = """
(() => {
  if (window.explorerClosing) return;
  window.explorerClosing = true;
  const CARD = ".mantine-Modal-content", AROUND = ".mantine-Modal-inner, .mantine-Modal-overlay";
  const isBeside = (it) => !!it.closest?.(AROUND) && !it.closest(CARD);
  const close = () => {
    const card = [...document.querySelectorAll(`${CARD} [data-closed-by]`)].at(-1);
    if (card) document.getElementById(card.getAttribute("data-closed-by"))?.click();
  };
  addEventListener("keydown", (event) => {
    // The palette may lie over a card, and is closed first.
    if (event.key === "Escape" && !event.target.closest?.(".mantine-Spotlight-content")) close();
  }, true);
  // What was pressed on a card and let go beside it, such as a marked text, closes nothing.
  let isPressedBeside = false;
  addEventListener("pointerdown", ({ target }) => { isPressedBeside = isBeside(target); }, true);
  addEventListener("click", ({ target }) => {
    if (isPressedBeside && isBeside(target)) close();
  }, true);
})();
"""
"""Closes the card on top in a browser by Escape, and by a click beside it."""

# viser's own grey is too pale to be read easily, on white and on black.
LEGIBLE = f"<style>:root:root:root{{--mantine-color-dimmed:{by_theme(*GREY)}}}</style>"

Press = Callable[[viser.ClientHandle], None]


class KeysCard:
    """The card with all keys, over the page of the browser that asked for it."""

    def __init__(self) -> None:
        # What closes the card, by browser; hands come on threads of their own.
        self._open: dict[int, Callable[[], None]] = {}
        self._lock = threading.RLock()

    def toggle(self, client: viser.ClientHandle, commands: Sequence[Command]) -> None:
        """Show the keys of these commands, or put them away."""
        with self._lock:
            if client.client_id in self._open:
                self.close(client)
                return
            modal = client.gui.add_modal("Keys")
            self._open[client.client_id] = modal.close
            with modal:
                table = client.gui.add_html("")
                button = client.gui.add_button("Close", hint="Put the card away; Keys: K, Escape.")
                table.content = closed_by(element_id(button), keys_table(commands))
            button.on_click(lambda _: self.close(client))

    def close(self, client: viser.ClientHandle) -> None:
        """Put the card away."""
        with self._lock:
            close = self._open.pop(client.client_id, None)
            if close is not None:
                close()

    def disconnected(self, client: viser.ClientHandle) -> None:
        """Forget a browser."""
        self._open.pop(client.client_id, None)


class Toolbar:
    """One line on top of the page: where commands and keys are found, the theme, the tour.

    Args:
        gui: Where it is added.
        presses: What the words of the line do, but for the palette's.
    """

    def __init__(self, gui: viser.GuiApi, presses: dict[str, tuple[str, Press]]) -> None:
        line = gui.add_html("")
        buttons: dict[str, viser.GuiButtonHandle] = {}
        for name, (hint, press) in presses.items():
            button = gui.add_button(name, hint=hint)
            button.on_click(lambda event, press=press: _pressed(event, press))
            buttons[name] = button
        ids = {name: element_id(button) for name, button in buttons.items()}
        gui.add_html(out_of_sight(tuple(ids.values())))
        told = {name: (ids[name], hint) for name, (hint, _) in presses.items()}
        line.content = LEGIBLE + toolbar_line(told)


def _pressed(event: viser.GuiEvent[viser.GuiButtonHandle], press: Press) -> None:
    if event.client is not None:
        press(event.client)


def toolbar_line(entries: dict[str, tuple[str, str]]) -> str:
    """Return the line as HTML: the palette first, then each entry by its button's id and hint."""
    look = "cursor:pointer;white-space:nowrap;padding:2px 0"
    palette = (
        f'<span role="button" tabindex="0" style="{look}" onclick="{escape(OPEN_PALETTE)}" '
        "onkeydown=\"if(event.key==='Enter')this.click()\" "
        'title="Search for anything that can be done, and do it.">Commands '
        f"{keycap(str(PALETTE_KEY))}</span>"
    )
    others = "".join(
        labelled(identity, hint, _worded(name), style=look)
        for name, (identity, hint) in entries.items()
    )
    return (
        '<div style="display:flex;justify-content:space-between;gap:8px;padding:0 14px 7px 10px;'
        f'font-size:12.5px;line-height:1.5">{palette}{others}</div>'
    )


def _worded(name: str) -> str:
    keys = KEYS.get(f"{PAGE}{STEP}{name}", ())
    return " ".join([escape(name), *(keycap(str(key)) for key in keys)])


def keycap(key: str) -> str:
    """Return a key as it looks, as HTML."""
    return (
        '<kbd style="font:inherit;font-size:10.5px;padding:0 4px;border-radius:3px;'
        "white-space:nowrap;border:1px solid color-mix(in srgb,currentColor 35%,transparent);"
        f'background:color-mix(in srgb,currentColor 7%,transparent)">{escape(key)}</kbd>'
    )


def closed_by(button: str, content: str) -> str:
    """Return what is on a card, HTML, so that the card is closed by the button with this id."""
    return f'<div {CLOSED_BY}="{escape(button)}">{content}</div>'


def keys_table(commands: Iterable[Command]) -> str:
    """Return all keys as HTML, in the groups of their commands and in two columns."""
    groups: dict[str, list[str]] = {}
    for command in commands:
        if command.keys:
            caps = " ".join(keycap(str(key)) for key in command.keys)
            words = command.label.partition(STEP)[2].replace(STEP, ", ")
            groups.setdefault(group_of(command), []).append(_row(words, caps))
    camera = [_row(words, keycap(keys)) for keys, words in CAMERA]
    palette = _row("Search all commands", keycap(str(PALETTE_KEY)))
    groups["Page"] = [palette, *groups.get("Page", [])]
    blocks = "".join(
        f'<div style="margin-bottom:7px"><div style="{DIM};font-weight:600;break-after:avoid">'
        f"{escape(name)}</div>{''.join(rows)}</div>"
        for name, rows in {**groups, "Camera": camera}.items()
    )
    return (
        f'<div style="columns:2;column-gap:22px;padding:0 12px;font-size:12px;line-height:1.45">'
        f"{blocks}</div>"
    )


def _row(words: str, caps: str) -> str:
    return (
        '<div style="display:flex;justify-content:space-between;gap:8px;break-inside:avoid">'
        f"<span>{escape(words)}</span><span>{caps}</span></div>"
    )
