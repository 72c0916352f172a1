"""The user's designs by name, in a list to save, open, copy and delete; the bar shows the name.

They are read and changed on a thread of their own, so that a slow or full disk does not hold up the
mechanism. Other explorers may change the same folder, so it is read again after each request.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from html import escape
from pathlib import Path

import viser

from explorer.app.features.feature import Feature, FileExport, Services, Tab
from explorer.app.inputs.bindings import ControlBinding
from explorer.app.inputs.controls import Controls
from explorer.app.session.history import HistoryStep
from explorer.app.session.session import Who
from explorer.app.state.actions import Action, mark_saved, open_design, set_name
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import open_geometry
from explorer.app.state.view import View
from explorer.app.storage.library import LibraryFile, copy_name
from explorer.app.widgets.buttons import open_button, press_button
from explorer.app.widgets.markup import box, note
from explorer.errors import ExplorerError, InputError
from explorer.export.pose_tables import parse_table
from explorer.files.json_text import field_names
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS, decode_design, encode_design
from explorer.page.session.latest import LatestWins
from explorer.page.widgets.assigning import Update
from explorer.page.widgets.palette import Command, Key

# Ctrl+S saves in the library what a browser would save as a page.
KEYS = {"Save": (Key("S", "cmd/ctrl"),)}
# Byte order marks, the zeros of UTF-16, and blanks.
BEFORE_JSON = b"\xef\xbb\xbf\xff\xfe\0 \t\r\n"

_Request = tuple[Callable[[], object], Who]


def send_design(services: Services, who: Who) -> None:
    """Send the live design to one browser, as a design file."""
    design = services.session.latest_state().design
    services.downloads.send(who, f"{design.name}.json", encode_design(design))


class SavedDesigns:
    """Carries out the page's requests to the library, one after the other.

    Attributes:
        entries: The saved designs, the last saved first.
        commands: Those that open them.
        last_deleted: Name of the design that can be brought back; None if there is none.
        deleted_at: Step of the session after which a design was deleted; None if none was.
    """

    def __init__(self, services: Services) -> None:
        if services.user_data is None:
            raise RuntimeError("a page that keeps nothing has no library")
        self._library = services.user_data.library
        self._session = services.session
        self._services = services
        self.entries: tuple[LibraryFile, ...] = ()
        self.commands: tuple[Command, ...] = ()
        self.last_deleted: str | None = None
        self.deleted_at: HistoryStep | None = None
        self._requests: LatestWins[_Request] = LatestWins(self._do_all, "designs")
        services.at_end(self._requests.stop)
        self.refresh()

    def words_on(self, live: Design) -> tuple[str, str]:
        """Return in a word and a sentence whether the saved design of its name is the live one."""
        saved = next((each.design for each in self.entries if each.name == live.name), None)
        if saved == live:
            return "saved", "Saved."
        if live == PRESETS.get(live.name):
            return "preset", "An unchanged preset."
        if saved is None:
            return "not saved", "Not saved under a name yet; it comes back with the session."
        return "changed", "Changed since it was saved."

    def refresh(self) -> None:
        """Request to read the folder again."""
        self._post(lambda: None, None)

    def save(self, design: Design, who: Who = None) -> None:
        """Save a design under its name; `restore` brings another one of that name back."""

        def work() -> None:
            if design.name in PRESETS:
                raise InputError(
                    f"{design.name!r} is a preset and stays as it is; give yours another name"
                )
            self._session.do(mark_saved(self._library.save(design.name, design)))

        self._post(work, who)

    def save_copy(self, design: Design, who: Who = None) -> None:
        """Save the live design under a new name, which it takes itself."""
        self._post(lambda: self._session.do(mark_saved(self._copy(design))), who)

    def rename(self, old: str, new: str, who: Who = None) -> None:
        """Give a saved design another name."""

        def work() -> None:
            if old not in {entry.name for entry in self._library.list()}:
                raise InputError("the design is not saved yet; save it before you rename it")
            self._session.do(mark_saved(self._library.rename(old, new)))

        self._post(work, who)

    def open(self, name: str, who: Who = None) -> None:
        """Open a saved design, or a preset with the present machine."""
        if name in PRESETS:
            self._session.do(partial(open_geometry, PRESETS[name]), who=who)
        else:
            self._post(lambda: self._session.do(open_design(self._library.open(name))), who)

    def copy(self, name: str, who: Who = None) -> None:
        """Save a copy of a design under a new name; the live one stays as it is."""
        self._post(lambda: self._copy(PRESETS.get(name) or self._library.open(name)), who)

    def delete(self, name: str, who: Who = None) -> None:
        """Delete a saved design; `restore` brings it back."""

        def work() -> None:
            self._library.delete(name)
            self.deleted_at = self._session.history.step

        self._post(work, who)

    def restore(self, who: Who = None) -> None:
        """Restore the design that was deleted or replaced last."""
        self.deleted_at = None
        self._post(self._library.restore, who)

    def take(self, data: bytes, name: str, client: viser.ClientHandle | None = None) -> None:
        """Open a file of a browser: a design, or what one of its fields says that it is."""
        who = None if client is None else client.client_id

        def work() -> None:
            openers = {k: v for one in self._services.features for k, v in one.openers.items()}
            suffix = Path(name).suffix.lower()
            if data.lstrip(BEFORE_JSON).startswith(b"{"):
                fields = field_names(data)
            elif suffix == ".csv":
                columns = parse_table(name, data, 1.0).columns
                fields = {*columns, ",".join(sorted(columns)), suffix}
            elif suffix in openers:
                fields = {suffix}
            else:
                raise InputError(f"{name} is no design, study or session; these are JSON files")
            opener = next((openers[each] for each in openers if each in fields), open_design_file)
            action, words = opener(self._services, data, name)
            before = self._session.latest_state()
            self._session.do(action, who=who)
            if client is not None and self._session.latest_state() is not before:
                client.add_notification(f"{name} is open", words, auto_close_seconds=6.0)

        self._post(work, who)

    def wait_until_idle(self, timeout: float = 10.0) -> bool:
        """Wait until all requests are done; return whether they are."""
        return self._requests.wait_until_idle(timeout)

    def _copy(self, design: Design) -> Design:
        taken = {entry.name for entry in self._library.list()} | set(PRESETS)
        return self._library.save(copy_name(design.name, taken), design)

    def _post(self, work: Callable[[], object], who: Who) -> None:
        self._requests.post(object(), time.monotonic(), (work, who))

    def _do_all(self, requests: Sequence[_Request]) -> None:
        for work, who in requests:
            try:
                work()
            except ExplorerError as error:
                self._services.complain(str(error), who)
        self.entries = self._library.list()
        self.commands = tuple(
            Command(
                f"Designs › Open {name}",
                "Open this saved design.",
                lambda client, name=name: self.open(name, client.client_id),
            )
            for name in (each.name for each in self.entries if each.design)
        )
        self.last_deleted = self._library.last_deleted
        self._session.redraw()


def open_design_file(_: Services, data: bytes, name: str) -> tuple[Action, str]:
    """Return the action that opens the design in a file, and what it is; see `Opener`."""
    design = decode_design(data, name)
    return open_design(design), f"The design {design.name}."


# Name of the button that shows why the session is not saved, and its label.
UNSAVED, UNSAVED_LABEL = "session.unsaved", "Session not saved"


class DesignName:
    """The name, a button that opens the dialog Designs, and a warning while saving fails."""

    def __init__(self, services: Services) -> None:
        self._saved = None if services.user_data is None else services.get(SavedDesigns)
        self._autosaver = services.autosaver
        services.buttons.on(UNSAVED, lambda _, client: self._show_problem(client))

    def __call__(self, frame: Frame) -> str:
        """Return the name for a frame, as HTML."""
        live = frame.state.design
        name = f'<b class="ex-cut" data-document>{escape(live.name)}</b>'
        if self._saved is None:
            return f'<span class="ex-name">{name}</span>'
        mark, words = self._saved.words_on(live)
        content = f'{name}<span class="ex-dim ex-small">{mark}</span>'
        hint = f"{words} Save, rename, open or upload designs."
        opens = open_button("Designs", content, hint=hint, class_name="ex-name")
        problem, look = self._problem, "ex-tool ex-outlined ex-beyond"
        if problem is None:
            return opens
        return opens + press_button(UNSAVED, "", UNSAVED_LABEL, hint=problem, class_name=look)

    @property
    def _problem(self) -> str | None:
        """Why the session is not saved; None while it is, or if nothing is."""
        return None if self._autosaver is None else self._autosaver.problem

    def _show_problem(self, client: viser.ClientHandle) -> None:
        if self._problem is not None:
            client.add_notification(UNSAVED_LABEL, self._problem, color="orange")


class DesignsPanel(Controls):
    """The live design's name, buttons that save it, and the list of all designs."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui, latest = services.gui, services.session.latest_state
        self._saved = saved = services.get(SavedDesigns)
        self.text(
            "Name",
            "Name of the live design, under which it is saved.",
            ControlBinding(lambda frame: frame.state.design.name, lambda _, name: set_name(name)),
            disabled=lambda state: bool(state.busy),
        )
        actions: dict[str, Callable[[Who], None]] = {
            "Save": lambda who: saved.save(latest().design, who),
            "Save a copy": lambda who: saved.save_copy(latest().design, who),
            "Rename": self._rename,
            "Download": partial(send_design, services),
        }
        self._buttons = gui.add_button_group(
            "Design",
            tuple(actions),
            hint="Save the design under its name or as a copy, give the saved one the name above, "
            "or download it as a file. A design that is replaced can be brought back.",
        )
        self._buttons.on_click(lambda event: actions[self._buttons.value](event.client_id))
        for option, act in actions.items():
            services.commands.offer(
                self._buttons,
                lambda client, act=act: act(client.client_id),
                option=option,
                keys=KEYS.get(option, ()),
            )
        self.markup(lambda frame: note(saved.words_on(frame.state.design)[1]))
        services.add_upload(
            "Open a file …",
            "A design, a table on six legs, a study or a session (JSON), what was measured of a "
            "machine or the poses of a path (CSV), a table of LinuxCNC (HAL), from this computer; "
            "or drop it anywhere on the page.",
            "application/json,text/csv,.hal",
            saved.take,
            takes_drops=True,
        )
        self.list = gui.add_html("")
        self.restore = self.press(
            "Bring back",
            "Restore the design that was deleted or replaced last.",
            saved.restore,
            icon=viser.Icon.ARROW_BACK_UP,
            color="gray",
        )
        self.follow(self.restore, "visible", lambda _: saved.last_deleted is not None)
        self.follow(
            self.restore, "label", lambda _: f"Bring back {saved.last_deleted or ''}".rstrip()
        )
        acts = {"open": saved.open, "duplicate": saved.copy, "delete": saved.delete}
        for name, act in acts.items():
            services.buttons.on(
                f"designs.{name}", lambda name, client, act=act: act(name, client.client_id)
            )
        self._listed: tuple[object, ...] = ()
        self._markup = ""

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame and the saved designs."""
        yield from super().updates(frame)
        base, view = frame.state.base, frame.state.view
        listed = self._saved.entries, base.name, view.lengths
        if listed != self._listed:
            self._listed = listed
            self._markup = list_designs(rows_of(self._saved.entries), base.name, view)
        yield self.list, "content", self._markup

    def _rename(self, who: Who) -> None:
        state = self._session.latest_state()
        self._saved.rename(state.base.name, state.design.name, who)


def rows_of(entries: Sequence[LibraryFile]) -> tuple[LibraryFile, ...]:
    """Return the rows of the list: the designs of the user, then the presets."""
    return (*entries, *(LibraryFile(name, "", design) for name, design in PRESETS.items()))


def list_designs(rows: Sequence[LibraryFile], current: str, view: View) -> str:
    """Return the list in HTML, with the buttons of each row; the open design is marked."""
    head = (
        '<div class="ex-row ex-dim ex-small"><span class="ex-fill">Designs, the last saved on top'
        '</span><span class="ex-reach">reach |a3|</span><span class="ex-acts"></span></div>'
    )
    lines = "".join(_line(row, view, is_current=row.name == current) for row in rows)
    return box(head, f'<div class="ex-designs">{lines}</div>')


def _line(row: LibraryFile, view: View, *, is_current: bool) -> str:
    if row.design is None:
        problem = escape(row.problem or "")
        name = (
            f'<span class="ex-fill ex-beyond" title="{problem}">'
            f"{escape(row.name)}: cannot be used</span>"
        )
        reach = copy = ""
    else:
        tag = ' <span class="ex-dim">preset</span>' if row.name in PRESETS else ""
        name = press_button(
            "designs.open",
            row.name,
            f"{escape(row.name)}{tag}",
            hint=f"Open {row.name}",
            class_name="ex-fill ex-cut",
        )
        reach = view.unit_for(row.design).text(row.design.reach)
        copy = _link("duplicate", row.name, "Duplicate")
    delete = "" if row.name in PRESETS else _link("delete", row.name, "Delete")
    here = " is-here" if is_current else ""
    return (
        f'<div class="ex-row{here}">{name}<span class="ex-reach">{reach}</span>'
        f'<span class="ex-acts">{copy}{delete}</span></div>'
    )


def _link(act: str, name: str, words: str) -> str:
    hint = f"{words} {name}"
    return press_button(f"designs.{act}", name, words, hint=hint, label=hint, class_name="ex-link")


DESIGNS = Feature(
    "designs",
    tabs=(Tab("dialog", "Designs", DesignsPanel),),
    exports=(
        FileExport(
            "Design",
            "A file to open again, here or with explorer --design.",
            ("JSON",),
            lambda services, _, who: send_design(services, who),
        ),
    ),
    passing=lambda services: services.get(SavedDesigns).commands,
    is_offered=lambda services: services.user_data is not None,
)
