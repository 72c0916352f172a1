"""The user's designs by name: save, open, duplicate, rename, delete, upload and download."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from html import escape

import viser

from explorer.app.browser.viser_gaps import element_id
from explorer.app.features.designs.shelf import Shelf
from explorer.app.session.session import Session
from explorer.app.state.actions import Open, SetName
from explorer.app.state.frame import Frame
from explorer.app.storage.library import Entry
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Controls
from explorer.app.widgets.labels import labelled, out_of_sight
from explorer.app.widgets.markup import BEYOND, DIM, format_number
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import LARGEST_FILE, PRESETS

# Rows of a page of the list.
ROWS = 24
Who = int | None


@dataclass(frozen=True)
class Row:
    """A line of the list.

    Attributes:
        name: Of the design.
        design: None where the file is of no use.
        problem: Why it is not.
        is_preset: Whether it came along, and stays as it is.
    """

    name: str
    design: Design | None
    problem: str | None = None
    is_preset: bool = False


class DesignsPanel:
    """The live design's name, what can be done with it, and the list of all others.

    Args:
        gui: Where it is added.
        session: Whose design it is.
        shelf: The saved designs.
        download: Sends the live design to a browser.
    """

    def __init__(
        self, gui: viser.GuiApi, session: Session, shelf: Shelf, download: Callable[[Who], None]
    ) -> None:
        self._session = session
        self._shelf = shelf
        self._controls = Controls(gui, session)
        self._controls.text(
            "Name",
            "What the live design is called, and saved as.",
            lambda frame: frame.state.design.name,
            lambda _, name: SetName(name),
            disabled=lambda state: state.optimisation.is_on,
        )
        does: dict[str, Callable[[Who], None]] = {
            "Save": lambda who: shelf.save(session.state.design, who),
            "Save a copy": lambda who: shelf.save_copy(session.state.design, who),
            "Rename": self._rename,
            "Download": download,
        }
        self._does = gui.add_button_group(
            "Design",
            tuple(does),
            hint="Save under its name, or as a copy; give the saved one the name above; take it "
            "away as a file. What is replaced goes to the trash.",
        )
        self._does.on_click(lambda event: does[self._does.value](event.client_id))
        self.status = gui.add_html("")
        upload = gui.add_upload_button(
            "Open a file …",
            color="gray",
            icon=viser.Icon.UPLOAD,
            mime_type="application/json",
            hint=f"A design file (JSON) of at most {LARGEST_FILE // 1000} kB from this computer.",
        )
        upload.on_upload(
            lambda event: shelf.take(upload.value.content, upload.value.name, event.client_id)
        )
        self.list = gui.add_html("")
        self.restore = gui.add_button(
            "Bring back",
            color="gray",
            icon=viser.Icon.ARROW_BACK_UP,
            hint="Bring back the design that was deleted or replaced last.",
            visible=False,
        )
        self.restore.on_click(lambda event: shelf.restore(event.client_id))
        # The list is made of labels of these.
        self.open = self._buttons(gui, "Open design", self._open)
        self.duplicate = self._buttons(gui, "Duplicate design", self._duplicate)
        self.delete = self._buttons(gui, "Delete design", self._delete)
        self.newer = self._turner(gui, "Newer designs", -ROWS, "Turn the list to those before.")
        self.older = self._turner(gui, "Older designs", ROWS, "Turn the list to those after.")
        hidden = (*self.open, *self.duplicate, *self.delete, self.newer, self.older)
        gui.add_html(out_of_sight([element_id(button) for button in hidden]))
        # Those of the page to which the list is turned, and which of all is the first.
        self.rows: tuple[Row, ...] = ()
        self._first = 0

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the panel show the frame and the saved designs."""
        self._shelf.look()
        yield from self._controls.updates(frame)
        live, base = frame.state.design, frame.state.base
        saved = {entry.name: entry.design for entry in self._shelf.entries}
        yield self.status, "content", status(live, saved.get(live.name))
        rows = rows_of(self._shelf.entries)
        first = min(self._first, (len(rows) - 1) // ROWS * ROWS)
        self._first, self.rows = first, rows[first : first + ROWS]
        ids = [
            tuple(element_id(buttons[row]) for buttons in (self.open, self.duplicate, self.delete))
            for row in range(len(self.rows))
        ]
        turns = (
            element_id(self.newer) if first > 0 else None,
            element_id(self.older) if first + ROWS < len(rows) else None,
        )
        foot = _foot(first, len(self.rows), len(rows), turns) if len(rows) > ROWS else ""
        yield self.list, "content", listed(self.rows, base.name, ids, foot)
        for button, identity in zip((self.newer, self.older), turns, strict=True):
            yield button, "visible", identity is not None
        for index in range(ROWS):
            row = self.rows[index] if index < len(self.rows) else None
            yield self.open[index], "visible", row is not None and row.design is not None
            yield self.duplicate[index], "visible", row is not None and row.design is not None
            yield self.delete[index], "visible", row is not None and not row.is_preset
        deleted = self._shelf.deleted
        yield self.restore, "visible", bool(deleted)
        if deleted:
            yield self.restore, "label", f"Bring back {deleted[0].name}"

    def _rename(self, who: Who) -> None:
        state = self._session.state
        self._shelf.rename(state.base.name, state.design.name, who)

    def _open(self, row: Row, who: Who) -> None:
        if row.is_preset and row.design is not None:
            self._session.do(Open(row.design), who=who)
        else:
            self._shelf.open(row.name, who)

    def _duplicate(self, row: Row, who: Who) -> None:
        if row.is_preset and row.design is not None:
            self._shelf.copy(row.design, who)
        else:
            self._shelf.duplicate(row.name, who)

    def _delete(self, row: Row, who: Who) -> None:
        if not row.is_preset:
            self._shelf.delete(row.name, who)

    def _turner(self, gui: viser.GuiApi, label: str, by: int, hint: str) -> viser.GuiButtonHandle:
        button = gui.add_button(label, visible=False, hint=hint)

        @button.on_click
        def _(_: object) -> None:
            self._first = max(0, self._first + by)
            self._session.redraw()

        return button

    def _buttons(
        self, gui: viser.GuiApi, label: str, does: Callable[[Row, Who], None]
    ) -> list[viser.GuiButtonHandle]:
        def pushed(row: int, who: Who) -> None:
            if row < len(self.rows):
                does(self.rows[row], who)

        buttons = [
            gui.add_button(
                f"{label} {row + 1}",
                visible=False,
                hint=f"{label.split(maxsplit=1)[0]} the design in row {row + 1} of the list.",
            )
            for row in range(ROWS)
        ]
        for row, button in enumerate(buttons):
            button.on_click(lambda event, row=row: pushed(row, event.client_id))
        return buttons


def rows_of(entries: Sequence[Entry]) -> tuple[Row, ...]:
    """Return the lines of the list: the designs of the user, then those that came along."""
    presets = [Row(design.name, design, is_preset=True) for design in PRESETS.values()]
    own = [Row(entry.name, entry.design, entry.problem) for entry in entries]
    return (*own, *presets)


def status(live: Design, saved: Design | None) -> str:
    """Return in words whether the live design is saved, as HTML."""
    if saved == live:
        words = "Saved."
    elif live.name in PRESETS and live == PRESETS[live.name]:
        words = "A preset, as it came."
    elif saved is None:
        words = "Not saved under a name yet; it comes back with the session."
    else:
        words = "Changed since it was saved."
    return f'<div style="padding:0 12px 2px;font-size:12px;{DIM}">{escape(words)}</div>'


def listed(
    rows: Sequence[Row], current: str, ids: Sequence[tuple[str, ...]], foot: str = ""
) -> str:
    """Return the list in HTML, each row made of labels of its three buttons."""
    head = (
        f'<div style="display:flex;gap:8px;padding:2px 8px;{DIM};font-size:11.5px">'
        '<span style="flex:1">Designs, the last saved on top</span>'
        '<span style="width:170px;text-align:right">reach |a3|</span>'
        '<span style="width:132px"></span></div>'
    )
    lines = "".join(
        _line(row, each, row.name == current) for row, each in zip(rows, ids, strict=True)
    )
    return (
        '<div style="padding:2px 6px 8px;font-size:12.5px;line-height:1.3;'
        f'font-variant-numeric:tabular-nums">{head}{lines}{foot}</div>'
    )


def _foot(first: int, count: int, total: int, turns: tuple[str | None, str | None]) -> str:
    """Return the line that tells which part of the list is shown, and turns to the others."""
    newer, older = (
        "" if identity is None else _deed(identity, name, name)
        for identity, name in zip(turns, ("Newer designs", "Older designs"), strict=True)
    )
    return (
        '<div style="display:flex;gap:12px;padding:6px 8px 0">'
        f'<span style="flex:1;{DIM}">{first + 1} to {first + count} of {total}</span>'
        f"{newer}{older}</div>"
    )


def _line(row: Row, ids: tuple[str, ...], is_current: bool) -> str:
    look = "display:flex;gap:8px;align-items:center;padding:3px 8px;border-radius:4px;"
    if is_current:
        look += "background:rgba(34,104,212,0.14);"
    if row.design is None:
        name = (
            f'<span style="flex:1;color:{BEYOND}" title="{escape(row.problem or "", quote=True)}">'
            f"{escape(row.name)}: cannot be used</span>"
        )
        reach = doubled = ""
    else:
        tag = f' <span style="{DIM}">preset</span>' if row.is_preset else ""
        name = labelled(
            ids[0],
            f"Open {row.name}",
            f"{escape(row.name)}{tag}",
            style="flex:1;cursor:pointer;overflow:hidden;text-overflow:ellipsis;white-space:nowrap;"
            + ("font-weight:600;" if is_current else ""),
        )
        length = row.design.reach
        reach = (
            f'{format_number(length)} units <span style="{DIM}">= '
            f"{format_number(length * row.design.unit_mm)} mm</span>"
        )
        doubled = _deed(ids[1], f"Duplicate {row.name}", "Duplicate")
    gone = "" if row.is_preset else _deed(ids[2], f"Delete {row.name}", "Delete")
    return (
        f'<div style="{look}">{name}'
        f'<span style="width:170px;text-align:right">{reach}</span>'
        f'<span style="width:132px;display:flex;gap:12px;justify-content:flex-end">'
        f"{doubled}{gone}</span></div>"
    )


def _deed(identity: str, name: str, content: str) -> str:
    style = "cursor:pointer;color:var(--mantine-primary-color-filled)"
    return labelled(identity, name, content, style=style)
