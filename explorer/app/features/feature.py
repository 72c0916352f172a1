"""The declaration of a feature, and the services that the page offers to features.

A feature is a folder beside this module. It declares all that it adds to the page in one
`Feature`, which stands in the list of `explorer.app.page`.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, Protocol, TypeVar

import viser

from explorer.app.scene.camera import Cameras
from explorer.app.scene.placing import ScenePart
from explorer.app.session.feed import Feed
from explorer.app.session.session import Change, HistoryMove, Session, Who
from explorer.app.state.actions import Action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.storage.user_data import Autosaver, UserData
from explorer.app.widgets.buttons import Buttons, press_button
from explorer.app.widgets.chips import Chips, StateCommand
from explorer.app.widgets.downloads import Downloads
from explorer.app.widgets.markup import alert, dim
from explorer.app.widgets.theme import Theme
from explorer.jobs.jobs import Jobs
from explorer.numerics.number_text import format_decimals
from explorer.page.browser.viser_gaps import element_id, run_script, run_script_in
from explorer.page.look import call_script, read_script
from explorer.page.widgets.assigning import Updates
from explorer.page.widgets.palette import STEP, Command, Commands

Place = Literal["build", "analyse", "work", "dialog"]
Side = Literal["left", "middle", "right"]
Shared = TypeVar("Shared")
AnyFeed = Feed[Any, Any]
COPY_HINT = "Copy the command line of this answer; it reads design.json unless this is a preset."
# Two sheets.
COPY_ICON = (
    '<svg viewBox="0 0 16 16" aria-hidden="true"><path d="M5.5 5.5v-3h8v8h-3m-8-5h8v8h-8z"/></svg>'
)

Opener = Callable[["Services", bytes, str], tuple[Action, str]]
"""Returns the action that opens a file by its content and name, and a sentence on what it is."""


@dataclass(frozen=True)
class Services:
    """The services that the page offers to its features.

    Attributes:
        complain: Function that shows a problem to one client, or to all for None.
        tell: Function that shows a message to a client, or to all if none is given.
        cameras: Cameras of the browsers; they frame all that the features draw.
        user_data: The user's designs and session; None to save nothing.
        offers_tour: Whether the tour begins by itself in browsers that have not seen it.
        autosaver: Saver of the session; None to save nothing.
        declared: The features, of which the page may lack some.
        shared: The objects that the features share, by the functions that make them, see `get`.
    """

    server: viser.ViserServer
    session: Session
    jobs: Jobs
    buttons: Buttons
    downloads: Downloads
    complain: Callable[[str, Who], None]
    tell: Callable[..., None]
    theme: Theme
    cameras: Cameras
    user_data: UserData | None
    offers_tour: bool
    autosaver: Autosaver | None = None
    declared: tuple[Feature, ...] = ()
    shared: dict[object, Any] = field(default_factory=dict[object, Any])
    _ends: list[Callable[[], None]] = field(default_factory=list[Callable[[], None]])

    @property
    def gui(self) -> viser.GuiApi:
        """The API that adds controls."""
        return self.server.gui

    @property
    def scene(self) -> viser.SceneApi:
        """The API that adds parts of the scene."""
        return self.server.scene

    @property
    def commands(self) -> Commands:
        """The commands of the page."""
        return self.buttons.commands

    @cached_property
    def features(self) -> tuple[Feature, ...]:
        """The features that the page has."""
        return tuple(each for each in self.declared if each.is_offered(self))

    def get(self, kind: Callable[[Services], Shared]) -> Shared:
        """Return the one object of a class that the features share, made at the first call."""
        if kind not in self.shared:
            self.shared[kind] = kind(self)
        return self.shared[kind]

    def has(self, kind: Callable[[Services], object]) -> bool:
        """Whether the one object of a class has been made."""
        return kind in self.shared

    def at_end(self, stop: Callable[[], None]) -> None:
        """Register a function that is called when the page ends."""
        self._ends.append(stop)

    def stop(self) -> None:
        """Call the functions registered with `at_end`, the last one first."""
        while self._ends:
            self._ends.pop()()

    def do_on_press(
        self,
        name: str,
        change_of: Callable[[str], Action | Change | HistoryMove | None],
        values: Container[str] | None = None,
    ) -> None:
        """Register what presses on a name do by their value, None for nothing; see `Buttons.on`."""

        def press(value: str, client: viser.ClientHandle) -> None:
            change = change_of(value)
            if change is not None:
                self.session.do(change, who=client.client_id)

        self.buttons.on(name, press, values=values)

    def link(
        self,
        name: str,
        label: str,
        does: str,
        change: Callable[[State], Action | None],
        *,
        is_ready: Callable[[State], bool] | None = None,
        words: str = "",
    ) -> str:
        """Add a button that does a `StateCommand`, and offer it; return the button as HTML."""
        command = StateCommand(label, does, change, is_ready=is_ready, words=words)
        Chips(self.buttons, self.session, name, "", {"": command})
        return command.html(name, "", "ex-link")

    def add_upload(
        self,
        label: str,
        hint: str,
        kinds: str,
        take: Callable[[bytes, str, viser.ClientHandle | None], None],
        *,
        takes_drops: bool = False,
    ) -> None:
        """Add a button that chooses files of some MIME types; `take` gets content and name of each.

        One button of the page also takes the files that are dropped on it.
        """
        button = self.gui.add_upload_button(
            label, color="gray", icon=viser.Icon.UPLOAD, mime_type=kinds, hint=hint
        )
        run_script(self.server, read_script("files", element_id(button), takes_drops))

        @button.on_upload
        def _(event: viser.GuiEvent[viser.GuiUploadButtonHandle]) -> None:
            take(button.value.content, button.value.name, event.client)
            # The button holds one file; the next one of several comes now.
            if event.client is not None:
                run_script_in(event.client, call_script("sendFile"))

    def copy_button(self, answer: str, command_of: Callable[[State], str]) -> str:
        """Add the button that copies the command of an answer in a state; return it as HTML.

        The answer is named from the tab on, such as "Loads › Forces".
        """
        words, name = "Copy the command line", f"{answer.rpartition(STEP)[2].lower()}.copy"

        def copy(_: str, client: viser.ClientHandle) -> None:
            command = command_of(self.session.latest_state())
            run_script_in(client, read_script("copies", command))

        self.buttons.on(name, copy)
        self.buttons.offer(f"{answer}{STEP}{words}", COPY_HINT, name)
        return press_button(name, "", COPY_ICON, hint=COPY_HINT, label=words, class_name="ex-copy")


def show(visible: bool, *parts: Any) -> Updates:
    """Yield the updates that show or hide handles, and parts of the scene with a `show`."""
    for part in parts:
        # To look for `show` at a handle would take viser 25 µs.
        if isinstance(part, viser.SceneNodeHandle):
            yield part, "visible", visible
        else:
            yield from part.show(visible)


def follow_drags(
    services: Services,
    gizmo: viser.TransformControlsHandle,
    key: str,
    action_of: Callable[[State], Action],
) -> None:
    """Post the action of each movement of a gizmo by a user; of one key the newest counts."""

    @gizmo.on_update
    async def _(event: viser.TransformControlsEvent) -> None:
        if event.client_id is not None:
            stamp = gizmo.update_timestamp
            services.session.post(key, action_of, stamp=stamp, who=event.client_id)


def progress(feed: AnyFeed) -> str:
    """Return the progress of a drawing that is being computed, in words."""
    stage = feed.stage
    if stage is None:
        return "computing …"
    return f"computing the {stage.words}, {format_decimals(100.0 * stage.share, 0)} % done …"


def problem(feed: AnyFeed, title: str, button: str) -> str:
    """Return why there is no newer drawing of a feed, as HTML.

    The title is that of a failure; the label is of the button that repeats what was cancelled.
    """
    if feed.is_cancelled:
        return alert("Stopped", f"Press “{button}”, or change something, to compute it.")
    return alert(title, feed.problem or "")


def look_of(feed: AnyFeed) -> str:
    """Return the class of what belongs to the drawing of a feed: pale while a newer one is made."""
    return "" if feed.drawing is None or feed.is_current else "is-outdated"


def html_of(feed: AnyFeed, html: Callable[[Any], str], title: str, button: str = "") -> str:
    """Return the drawing of a feed as HTML, pale while it is outdated, or why there is none.

    The title is that of a failure; the button repeats a cancelled computation.
    """
    if feed.problem is not None:
        return problem(feed, title, button)
    if feed.drawing is None:
        return dim(progress(feed).capitalize())
    return f'<div class="{look_of(feed)}">{html(feed.drawing)}</div>'


class Panel(Protocol):
    """The content of a tab, or a part of it."""

    def updates(self, frame: Frame, /) -> Updates:
        """Yield the updates that make the panel show the frame."""
        ...


class Follower(Protocol):
    """Requests drawings from the process of the page, before the frame is drawn."""

    def follow(self, frame: Frame, /) -> None:
        """Request what a frame needs, or begin or end the work that it requests, once."""
        ...


class Runner(Follower, Protocol):
    """Does long work that the state requests, after the frame is drawn."""

    def prepare(self) -> None:
        """Start the process that the work will need, in the background."""
        return

    def finish(self) -> None:
        """End work whose result so far is kept, before the session ends."""
        return


@dataclass(frozen=True)
class Tab:
    """A panel in a tab of the page.

    Attributes:
        place: Place of the tab: the panel on the left, where the mechanism is built; that on the
            right, where it is analysed; the drawer at the foot of the scene, for work that needs
            width; or a dialog of its own over the scene.
        title: Title of the tab; several panels may share one, in their order.
        panel: Function that makes the panel.
        icon: Icon above the title, for the first panel of a title.
    """

    place: Place
    title: str
    panel: Callable[[Services], Panel]
    icon: viser.IconName | None = None


BarPart = Callable[[Frame], str]
"""A part of the bar on top of the page: its HTML for a frame."""

InBar = tuple[Side, Callable[["Services"], BarPart]]
"""The side of the bar on which a part stands, in the order of the features, and what makes it."""


@dataclass(frozen=True)
class FileExport:
    """Files of one thing in several formats, as the dialog Export offers them.

    Attributes:
        hint: Sentence on what the files hold.
        formats: Names of the formats, each that of a button.
        send: Function that sends a client a file in a format.
    """

    title: str
    hint: str
    formats: tuple[str, ...]
    send: Callable[[Services, str, Who], None]
    is_ready: Callable[[Services], bool] = lambda _: True


@dataclass(frozen=True)
class Feature:
    """All that a feature adds to the page.

    Its actions and its part of the state need no entry: actions bring their own words, and its part
    of the state is saved, undone and compared with the rest.

    Attributes:
        name: Name of its folder.
        manual: What the button "?" of its tabs opens in the manual, the file of a page with "#" and
            a heading of it; "" for no button. Tabs that features share have that of the first.
        openers: Functions that open files, by a field that no other kind of file has, or of tables
            by a column, by all columns, or by the suffix; any other file is a design.
        verdicts: The verdicts that its first tab gives, each with a sentence on what it means.
        feeds: Feeds, which request drawings from the process of the page; `FeedOf` declares one.
        later_feeds: Feeds whose requests come after those of all features' `feeds`, since nobody
            waits for their results while the scene changes.
        passing: Function that returns the commands that come and go, such as those that open a
            saved design; the same object while they stay.
        floor: Function that returns the lowest height, in design units, of what is drawn in place
            of the schematic mechanism; None while that is drawn itself.
    """

    name: str
    manual: str = ""
    tabs: tuple[Tab, ...] = ()
    bar: tuple[InBar, ...] = ()
    verdicts: Mapping[str, str] = field(default_factory=dict[str, str])
    exports: tuple[FileExport, ...] = ()
    openers: Mapping[str, Opener] = field(default_factory=dict[str, Opener])
    scene: tuple[Callable[[Services], ScenePart], ...] = ()
    feeds: tuple[Callable[[Services], Follower], ...] = ()
    later_feeds: tuple[Callable[[Services], Follower], ...] = ()
    runners: tuple[Callable[[Services], Runner], ...] = ()
    commands: tuple[StateCommand, ...] = ()
    passing: Callable[[Services], tuple[Command, ...]] | None = None
    floor: Callable[[Services], float | None] | None = None
    is_offered: Callable[[Services], bool] = lambda _: True
