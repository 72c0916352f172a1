"""Up to three pinned designs beside the live one: buttons that pin them, measures, drawing."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from html import escape

import viser

from explorer.app.features.compare.scene import SCENES
from explorer.app.features.compare.table import ComparedDesign, columns_of, notes, table
from explorer.app.features.compare.work import FEEDS, SLOTS, Comparable, Compared
from explorer.app.features.designs.feature import SavedDesigns
from explorer.app.features.feature import Feature, Services, Tab
from explorer.app.session.session import Change
from explorer.app.state.actions import Action, action, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import without_name
from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.chips import Chips, StateCommand, turn
from explorer.app.widgets.markup import box
from explorer.errors import InputError
from explorer.mechanism.design_file import PRESETS
from explorer.page.widgets.assigning import Update
from explorer.six_legged.files import FIELD, TABLES, decode_table
from explorer.six_legged.table import SixLegged

# Largest number of designs that have a button of their own: the presets, then the last saved.
MOST_BUTTONS = 12
DIVIDER = '<span class="ex-divider"></span>'


def _pin_words(_: State, design: Comparable) -> str:
    return f"Pin {design.name}"


@action(_pin_words)
def pin(state: State, design: Comparable) -> State:
    """Pin a copy of a design or a table on six legs beside the live one, in the first free place.

    Raises:
        InputError: The design is pinned already, or there is no free place.
    """
    compared, slot = Compared.of(state), Compared.of(state).slot_of(design)
    if slot is not None:
        raise InputError(
            f"{design.name} is pinned already, as {SLOTS[slot]}; change it, or pin another one"
        )
    if None not in compared.places:
        places = ", ".join(SLOTS)
        raise InputError(
            f"{design.name} cannot be pinned: {places} are taken; unpin one of them first"
        )
    kind = "tables" if isinstance(design, SixLegged) else "pinned"
    return with_value(state, f"compared.{kind}.{compared.places.index(None)}", design)


def _unpin_words(_: State, slot: int) -> str:
    return f"Unpin {SLOTS[slot]}"


@action(_unpin_words)
def unpin(state: State, slot: int) -> State:
    """Remove the pinned design from a place, 0 to 2; do nothing if the place is free."""
    cleared = with_value(state, f"compared.pinned.{slot}", None)
    return with_value(cleared, f"compared.tables.{slot}", None)


def open_table(_: Services, data: bytes, name: str) -> tuple[Action, str]:
    """Return the action that pins the table in a file, and what it is; see `Opener`."""
    table = decode_table(data, name)
    return pin(table), f"The table on six legs {table.name}, pinned in Compare."


LOOKS = {
    label: StateCommand(
        f"Compare › {label}",
        does,
        *turn(f"compared.look.{name}", label),
        lambda state, among=among: any(getattr(Compared.of(state), among)),
    )
    for label, name, among, does in (
        (
            "Overlay workspaces",
            "overlay",
            "places",
            "Draw the workspaces at home over one another, in the designs' colours, to true size.",
        ),
        (
            "Outlines",
            "outlines",
            "places",
            "Outline base, legs and platform of the pinned designs in their home poses.",
        ),
        (
            "Equal strokes and cones",
            "equal",
            "tables",
            "Give the pinned tables the longest stroke of the live design's legs, and its cones.",
        ),
    )
}


def _open(slot: int, state: State) -> Action:
    design = Compared.of(state).pinned[slot]
    if design is None:
        raise InputError(f"nothing is pinned as {SLOTS[slot]}; pin a design first")
    return open_design(design)


PLACE_BUTTONS: tuple[tuple[str, Callable[[int, State], Action], str, str, str], ...] = (
    (
        "open",
        _open,
        "Open pinned",
        "Make it the live design; undo brings back the present one.",
        "pinned",
    ),
    (
        "unpin",
        lambda slot, _: unpin(slot),
        "Unpin",
        "Remove it from the comparison; undo brings it back.",
        "places",
    ),
)
"""Name, action, words, hint and places of the buttons of each pinned design."""


class ComparePanel:
    """The table of the compared designs, and buttons that pin and unpin them."""

    def __init__(self, services: Services) -> None:
        self._session = services.session
        self._feeds = [services.get(feed) for feed in FEEDS]
        self._library = None if services.user_data is None else services.get(SavedDesigns)
        self.html = services.gui.add_html("")
        self._add_buttons(services)
        self._looks = Chips(services.buttons, services.session, "compare.turn", "", LOOKS)
        self._key: tuple[object, ...] = ()
        self._content = ""

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        compared = Compared.of(frame.state)
        choices = self._choices()
        columns = columns_of(frame.state, self._feeds)
        key = (columns, compared, tuple(choices), frame.state.design.name)
        if key != self._key:
            self._key, self._content = key, self._page(frame.state, columns, choices)
        yield self.html, "content", self._content

    def _add_buttons(self, services: Services) -> None:
        services.do_on_press("compare.pin", self._pin)
        services.buttons.offer(
            "Compare › Pin this design",
            "Keep a copy of the live design as it is now, to compare it with what it becomes.",
            "compare.pin",
            is_ready=lambda: None in Compared.of(self._session.state).places,
        )
        for verb, change, words, hint, among in PLACE_BUTTONS:
            commands = {
                place: StateCommand(
                    f"Compare › {words} design {place}",
                    hint,
                    partial(change, slot),
                    is_ready=lambda state, slot=slot, among=among: (
                        getattr(Compared.of(state), among)[slot] is not None
                    ),
                )
                for slot, place in enumerate(SLOTS)
            }
            Chips(services.buttons, services.session, f"compare.{verb}", "", commands)

    def _page(
        self, state: State, columns: tuple[ComparedDesign, ...], choices: Mapping[str, Comparable]
    ) -> str:
        compared, pins = Compared.of(state), _pin_buttons(state, choices)
        if compared.is_empty:
            return box(
                '<div class="ex-before">Pin this design, then change it: the copy stays beside it. '
                "Or pin another one, or a hexapod: a table on six legs below, or drop the file of "
                "yours (JSON, or LinuxCNC's HAL) on the page. Up to three can be pinned; the "
                "workspaces of designs can be drawn over one another.</div>",
                f'<div class="ex-flow">{pins}</div>',
            )
        remarks = "".join(
            f'<div class="ex-dim ex-after">{note}</div>' for note in notes(state, columns)
        )
        return box(
            f'<div class="ex-flow ex-before">{pins}{DIVIDER}{self._looks.buttons(state)}</div>',
            table(columns),
            remarks,
        )

    def _choices(self) -> dict[str, Comparable]:
        """Return designs and tables with a button, by name; a design comes before its namesake."""
        entries = () if self._library is None else self._library.entries
        own = (entry.design for entry in entries if entry.design is not None)
        named = {**PRESETS, **{design.name: design for design in own}}
        designs = dict(itertools.islice(named.items(), MOST_BUTTONS))
        return designs | {name: table for name, table in TABLES.items() if name not in designs}

    def _pin(self, name: str) -> Change | None:
        """Return the action that pins the named design, or the live one for ""."""
        chosen = self._choices().get(name)
        return None if name and chosen is None else lambda state: pin(chosen or state.design)


def _pin_buttons(state: State, choices: Mapping[str, Comparable]) -> str:
    """Return the buttons that pin the live design and others, as HTML."""
    compared = Compared.of(state)
    is_full = None not in compared.places
    hint = "All three places are taken: unpin one first" if is_full else "Keep a copy as it is now"
    look, words = "ex-chip is-main", "Pin this design"
    live = press_button("compare.pin", "", words, hint=hint, class_name=look, is_disabled=is_full)
    if is_full:
        return live
    groups = {"": [live], "hexapod ": list[str]()}
    for name, design in choices.items():
        kind = "hexapod " if isinstance(design, SixLegged) else ""
        if compared.slot_of(design) is None and without_name(design) != without_name(state.design):
            groups[kind].append(
                press_button(
                    "compare.pin",
                    name,
                    f"+ {escape(name)}",
                    hint=f"Pin {kind}{name} beside the live design",
                    label=f"Pin {kind}{name}",
                    class_name="ex-chip ex-cut",
                )
            )
    return DIVIDER.join("".join(group) for group in groups.values() if group)


COMPARE = Feature(
    "compare",
    manual="page.md#Compare",
    tabs=(Tab("work", "Compare", ComparePanel, viser.Icon.COLUMNS_3),),
    scene=SCENES,
    feeds=FEEDS,
    openers=dict.fromkeys((FIELD, ".hal"), open_table),
)
