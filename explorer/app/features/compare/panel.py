"""Two to four designs side by side: which they are, their figures, and what is drawn of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from html import escape

import viser

from explorer.app.browser.viser_gaps import element_id
from explorer.app.features.compare.actions import Pin, SetLook, Unpin
from explorer.app.features.compare.bars import bars
from explorer.app.features.compare.columns import Column, columns_of, notes
from explorer.app.features.compare.feed import CompareFeed
from explorer.app.features.compare.table import table
from explorer.app.session.session import Change, Session
from explorer.app.state.actions import Open
from explorer.app.state.compared import SLOTS, Look
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.labels import labelled, out_of_sight
from explorer.app.widgets.markup import DIM
from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS

NOTHING = "—"
HEAD = "Pin another design"


@dataclass(frozen=True)
class _Switch:
    """A way to look at the comparison, that is on or off.

    Attributes:
        name: Of the button.
        words: On the page.
        hint: What it does, a sentence.
        is_on: Whether it is.
        turned: The look with it on, or off if it was on.
    """

    name: str
    words: str
    hint: str
    is_on: Callable[[Look], bool]
    turned: Callable[[Look], Look]


SWITCHES = (
    _Switch(
        "Table",
        "Table",
        "Show every figure of the designs side by side.",
        lambda look: look.shows == "table",
        lambda look: replace(look, shows="table"),
    ),
    _Switch(
        "Bars",
        "Bars",
        "Draw the figures of the designs as bars.",
        lambda look: look.shows == "bars",
        lambda look: replace(look, shows="bars"),
    ),
    _Switch(
        "Millimetres",
        "mm",
        "Tell lengths in millimetres, rather than in units of the live design.",
        lambda look: look.millimetres,
        lambda look: replace(look, millimetres=not look.millimetres),
    ),
    _Switch(
        "Overlay workspaces",
        "Overlay workspaces",
        "Draw the workspaces over one another in the colours of the designs, to true size, each "
        "at the orientation of its home.",
        lambda look: look.overlay,
        lambda look: replace(look, overlay=not look.overlay),
    ),
    _Switch(
        "Live one as it is turned",
        "live as turned",
        "Draw the workspace of the live design at its present orientation, rather than at home.",
        lambda look: look.at_pose,
        lambda look: replace(look, at_pose=not look.at_pose),
    ),
    _Switch(
        "Outlines",
        "Outlines",
        "Outline base, legs and platform of the pinned designs in their home poses.",
        lambda look: look.outlines,
        lambda look: replace(look, outlines=not look.outlines),
    ),
)


class ComparePanel:
    """The comparison.

    Args:
        gui: Where it is added.
        session: Whose design is compared.
        saved: Returns the user's own designs, to pin one of them.
    """

    def __init__(
        self, gui: viser.GuiApi, session: Session, saved: Callable[[], Sequence[Design]]
    ) -> None:
        self._session = session
        self._saved = saved
        self.another = gui.add_dropdown(
            HEAD,
            (NOTHING, *PRESETS),
            hint="Keep a copy of a preset or of a design of yours beside the live one.",
        )
        self.another.on_update(self._chosen)
        self.html = gui.add_html("")
        # All that is pressed on it are labels of these.
        self.pin = self._button(
            gui,
            "Pin this design",
            "Keep a copy of the live design as it is now, to compare it with what it becomes.",
            lambda state: Pin(state.design),
        )
        self.switches = [
            self._button(gui, each.name, each.hint, _switching(each)) for each in SWITCHES
        ]
        self.open = [
            self._button(
                gui,
                f"Open pinned design {letter}",
                "Make it the live design; undo brings back what was there.",
                _opening(slot),
            )
            for slot, letter in enumerate(SLOTS)
        ]
        self.unpin = [
            self._button(
                gui,
                f"Unpin design {letter}",
                "Let go of it; undo brings it back.",
                _unpinning(slot),
            )
            for slot, letter in enumerate(SLOTS)
        ]
        hidden = [self.pin, *self.switches, *self.open, *self.unpin]
        gui.add_html(out_of_sight([element_id(button) for button in hidden]))
        self._deeds = [
            (element_id(opens), element_id(unpins))
            for opens, unpins in zip(self.open, self.unpin, strict=True)
        ]
        self._shown: tuple[object, ...] = ()
        self._content = ""

    def updates(self, frame: Frame, feed: CompareFeed) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        compared = frame.state.compared
        options = (NOTHING, *self._choices())
        yield self.another, "options", options
        if not self._session.is_waiting(self):
            yield self.another, "value", NOTHING
        yield self.pin, "disabled", None not in compared.pinned
        for slot, design in enumerate(compared.pinned):
            yield self.open[slot], "visible", design is not None
            yield self.unpin[slot], "visible", design is not None
        for button in self.switches:
            yield button, "visible", not compared.is_empty
        columns = columns_of(frame.state, feed)
        shown = (columns, compared)
        if shown != self._shown:
            self._shown, self._content = shown, self._page(frame.state, columns)
        yield self.html, "content", self._content

    def _page(self, state: State, columns: tuple[Column, ...]) -> str:
        look = state.compared.look
        box = (
            '<div style="padding:2px 12px 10px;font-size:12.5px;line-height:1.4;'
            'font-variant-numeric:tabular-nums">'
        )
        if state.compared.is_empty:
            return (
                f"{box}{self._pins()}"
                f'<p style="{DIM};margin:10px 0 0">Pin this design, then change it: the live '
                "one stands beside its copy. Up to three can be pinned, presets and designs of "
                "yours too; their workspaces can be drawn over one another.</p></div>"
            )
        if look.shows == "table":
            body = table(columns, self._deeds, millimetres=look.millimetres)
        else:
            legend = "".join(
                f'<span style="margin-right:14px;white-space:nowrap">{each.swatch()}'
                f"<b>{each.letter}</b> {escape(each.design.name)}</span>"
                for each in columns
            )
            body = (
                f'<div style="margin-bottom:6px">{legend}</div>'
                f"{bars(columns, millimetres=look.millimetres)}"
            )
        said = "".join(
            f'<div style="{DIM};margin-top:6px">{note}</div>' for note in notes(state, columns)
        )
        # Of the two ways to see the figures one is on, the other switches are for themselves.
        ids = [element_id(button) for button in self.switches]
        chips = "".join(
            _chip(identity, each, is_on=each.is_on(look))
            for identity, each in zip(ids, SWITCHES, strict=True)
            if look.overlay or each.words != "live as turned"
        )
        return (
            f'{box}<div style="display:flex;flex-wrap:wrap;gap:6px;margin-bottom:9px">'
            f"{self._pins(is_full=None not in state.compared.pinned)}{chips}</div>"
            f"{body}{said}</div>"
        )

    def _pins(self, *, is_full: bool = False) -> str:
        look = _CHIP + (
            "opacity:0.45;background:var(--mantine-color-default);"
            if is_full
            else "background:var(--mantine-primary-color-filled);color:white;cursor:pointer;"
        )
        return labelled(
            element_id(self.pin),
            "All three places are taken: unpin one first" if is_full else "Pin this design",
            "Pin this design",
            style=look,
        )

    def _choices(self) -> dict[str, Design]:
        """Return what can be pinned by name; a design of one's own never has that of a preset."""
        return {**{each.name: each for each in self._saved()}, **PRESETS}

    def _chosen(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        design = self._choices().get(self.another.value)
        if event.client_id is not None and design is not None:
            self._session.post(self, lambda _: Pin(design), who=event.client_id)

    def _button(
        self, gui: viser.GuiApi, label: str, hint: str, change: Change
    ) -> viser.GuiButtonHandle:
        button = gui.add_button(label, hint=hint)
        # Each press counts, so none is merged with another.
        button.on_click(lambda event: self._session.post(object(), change, who=event.client_id))
        return button


def _switching(switch: _Switch) -> Change:
    return lambda state: SetLook(switch.turned(state.compared.look))


def _opening(slot: int) -> Change:
    def change(state: State) -> Open:
        design = state.compared.pinned[slot]
        if design is None:
            raise InputError(f"nothing is pinned as {SLOTS[slot]}; pin a design first")
        return Open(design)

    return change


def _unpinning(slot: int) -> Change:
    return lambda _: Unpin(slot)


_CHIP = (
    "display:inline-block;padding:2px 9px;border-radius:11px;font-size:12px;white-space:nowrap;"
    "border:1px solid var(--mantine-color-default-border);"
)


def _chip(identity: str, switch: _Switch, *, is_on: bool) -> str:
    look = _CHIP + "cursor:pointer;"
    if is_on:
        look += (
            "background:var(--mantine-primary-color-light);"
            "border-color:var(--mantine-primary-color-filled);"
        )
    state = "on" if is_on else "off"
    return labelled(identity, f"{switch.hint} Now {state}.", switch.words, style=look)
