"""The user's designs by name: save, open, duplicate, rename, delete, upload and download."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape

import viser

from explorer.app.features.designs.files import DesignFile
from explorer.app.features.designs.name import saved_words
from explorer.app.features.designs.saved_designs import SavedDesigns
from explorer.app.features.feature import Services
from explorer.app.inputs.bindings import Bound
from explorer.app.inputs.controls import Controls
from explorer.app.session.session import Who
from explorer.app.state.actions import Open, SetName
from explorer.app.state.frame import Frame
from explorer.app.storage.library import Entry
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import Does, press_button
from explorer.app.widgets.markup import box, note
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import LARGEST_FILE, PRESETS
from explorer.numerics.number_text import format_number

# Number of rows on a page of the list.
ROWS = 24
TURNS = {
    "newer": ("Newer designs", "Show the previous page of the list."),
    "older": ("Older designs", "Show the next page of the list."),
}
"""Ways to turn the pages of the list, with the words and the hint of their buttons."""


@dataclass(frozen=True)
class Row:
    """A row of the list.

    Attributes:
        name: Name of the design.
        design: The design; None if its file cannot be used.
        problem: Why the file cannot be used; None if it can.
        is_preset: Whether the design is a preset, which nobody can change.
    """

    name: str
    design: Design | None
    problem: str | None = None
    is_preset: bool = False


class DesignsPanel:
    """The live design's name, buttons that save it, and the list of all designs."""

    def __init__(self, services: Services) -> None:
        gui, session, buttons = services.gui, services.session, services.buttons
        self._session = session
        self._saved = saved = services.get(SavedDesigns)
        self._controls = Controls(gui, session)
        self._controls.text(
            "Name",
            "Name of the live design, under which it is saved.",
            Bound(lambda frame: frame.state.design.name, lambda _, name: SetName(name)),
            disabled=lambda state: state.optimisation.is_on,
        )
        actions: dict[str, Callable[[Who], None]] = {
            "Save": lambda who: saved.save(session.settled().design, who),
            "Save a copy": lambda who: saved.save_copy(session.settled().design, who),
            "Rename": self._rename,
            "Download": services.get(DesignFile).send,
        }
        self._buttons = gui.add_button_group(
            "Design",
            tuple(actions),
            hint="Save the design under its name or as a copy, give the saved one the name above, "
            "or download it as a file. A design that is replaced can be brought back.",
        )
        self._buttons.on_click(lambda event: actions[self._buttons.value](event.client_id))
        self.status = gui.add_html("")
        upload = gui.add_upload_button(
            "Open a file …",
            color="gray",
            icon=viser.Icon.UPLOAD,
            mime_type="application/json",
            hint=f"A design file (JSON) of at most {LARGEST_FILE // 1000} kB from this computer.",
        )
        upload.on_upload(
            lambda event: saved.take(upload.value.content, upload.value.name, event.client_id)
        )
        self.list = gui.add_html("")
        self.restore = gui.add_button(
            "Bring back",
            color="gray",
            icon=viser.Icon.ARROW_BACK_UP,
            hint="Restore the design that was deleted or replaced last.",
            visible=False,
        )
        self.restore.on_click(lambda event: saved.restore(event.client_id))
        buttons.on("designs.open", self._for_row(self._open))
        buttons.on("designs.duplicate", self._for_row(self._duplicate))
        buttons.on("designs.delete", self._for_row(self._ask))
        buttons.on("designs.confirm", self._for_row(self._delete))
        buttons.on("designs.keep", self._for_row(lambda _, __: self._set_asked(None)))
        buttons.on("designs.turn", self._turn, values=TURNS)
        for way, (label, hint) in TURNS.items():
            buttons.offer(
                f"Designs › {label}",
                hint,
                "designs.turn",
                way,
                lambda way=way: self._can_turn(way),
            )
        # Rows of the present page, index of its first row, and number of all rows.
        self.rows: tuple[Row, ...] = ()
        self.first = self._total = 0
        # Name of the design that the page asks whether to delete.
        self.asked: str | None = None

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame and the saved designs."""
        self._saved.look()
        yield from self._controls.updates(frame)
        live, base = frame.state.design, frame.state.base
        _, words = saved_words(live, self._saved.find(live.name))
        yield self.status, "content", note(words)
        rows = rows_of(self._saved.entries)
        first = min(self.first, (len(rows) - 1) // ROWS * ROWS)
        self.first, self._total, self.rows = first, len(rows), rows[first : first + ROWS]
        ways = [way for way in TURNS if self._can_turn(way)]
        foot = _foot(first, len(self.rows), len(rows), ways) if len(rows) > ROWS else ""
        yield self.list, "content", list_designs(self.rows, base.name, self.asked, foot)
        deleted = self._saved.last_deleted
        yield self.restore, "visible", deleted is not None
        if deleted is not None:
            yield self.restore, "label", f"Bring back {deleted}"

    def _rename(self, who: Who) -> None:
        state = self._session.settled()
        self._saved.rename(state.base.name, state.design.name, who)

    def _open(self, row: Row, who: Who) -> None:
        if row.is_preset and row.design is not None:
            self._session.do(Open(row.design), who=who)
        else:
            self._saved.open(row.name, who)

    def _duplicate(self, row: Row, who: Who) -> None:
        if row.is_preset and row.design is not None:
            self._saved.copy(row.design, who)
        else:
            self._saved.duplicate(row.name, who)

    def _ask(self, row: Row, _: Who) -> None:
        if not row.is_preset:
            self._set_asked(row.name)

    def _delete(self, row: Row, who: Who) -> None:
        if row.name == self.asked:
            self._set_asked(None)
            self._saved.delete(row.name, who)

    def _set_asked(self, name: str | None) -> None:
        self.asked = name
        self._session.redraw()

    def _can_turn(self, way: str) -> bool:
        return self.first > 0 if way == "newer" else self.first + ROWS < self._total

    def _turn(self, way: str, _: viser.ClientHandle) -> None:
        if self._can_turn(way):
            self.first += -ROWS if way == "newer" else ROWS
            self._session.redraw()

    def _for_row(self, action: Callable[[Row, Who], None]) -> Does:
        def press(name: str, client: viser.ClientHandle) -> None:
            row = next((row for row in self.rows if row.name == name), None)
            if row is not None:
                action(row, client.client_id)

        return press


def rows_of(entries: Sequence[Entry]) -> tuple[Row, ...]:
    """Return the rows of the list: the designs of the user, then the presets."""
    presets = [Row(design.name, design, is_preset=True) for design in PRESETS.values()]
    own = [Row(entry.name, entry.design, entry.problem) for entry in entries]
    return (*own, *presets)


def list_designs(rows: Sequence[Row], current: str, asked: str | None, foot: str = "") -> str:
    """Return the list in HTML, with the buttons of each row.

    Args:
        rows: The rows.
        current: Name of the design that is open.
        asked: Name of the design whose row asks whether to delete it; None for no question.
        foot: Line below the list, HTML.
    """
    head = (
        '<div class="ex-row ex-dim ex-small"><span class="ex-fill">Designs, the last saved on top'
        '</span><span class="ex-reach">reach |a3|</span><span class="ex-acts"></span></div>'
    )
    lines = "".join(
        _line(row, is_current=row.name == current, is_asked=row.name == asked) for row in rows
    )
    return box(head, lines, foot)


def _foot(first: int, count: int, total: int, ways: Iterable[str]) -> str:
    """Return the line below the list: the rows that are shown, and links to other pages."""
    turns = "".join(
        press_button("designs.turn", way, TURNS[way][0], hint=TURNS[way][1], class_name="ex-link")
        for way in ways
    )
    return (
        f'<div class="ex-row"><span class="ex-fill ex-dim">{first + 1} to {first + count} '
        f"of {total}</span>{turns}</div>"
    )


def _line(row: Row, *, is_current: bool, is_asked: bool) -> str:
    if row.design is None:
        problem = escape(row.problem or "")
        name = (
            f'<span class="ex-fill ex-beyond" title="{problem}">'
            f"{escape(row.name)}: cannot be used</span>"
        )
        reach = copy = ""
    else:
        tag = ' <span class="ex-dim">preset</span>' if row.is_preset else ""
        name = press_button(
            "designs.open",
            row.name,
            f"{escape(row.name)}{tag}",
            hint=f"Open {row.name}",
            class_name="ex-fill ex-cut",
        )
        length = row.design.reach
        reach = (
            f'{format_number(length)} units <span class="ex-dim">= '
            f"{format_number(length * row.design.unit_mm)} mm</span>"
        )
        copy = _link("duplicate", row.name, "Duplicate")
    delete = "" if row.is_preset else _link("delete", row.name, "Delete")
    if is_asked:
        reach = "Delete it?"
        copy, delete = _link("confirm", row.name, "Delete"), _link("keep", row.name, "Keep")
    here = " is-here" if is_current else ""
    return (
        f'<div class="ex-row{here}">{name}<span class="ex-reach">{reach}</span>'
        f'<span class="ex-acts">{copy}{delete}</span></div>'
    )


def _link(act: str, name: str, words: str) -> str:
    hint = f"{words} {name}"
    return press_button(f"designs.{act}", name, words, hint=hint, label=hint, class_name="ex-link")
