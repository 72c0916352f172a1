"""What helps hands and eyes on the whole page: commands and keys, the theme, the tour, the room.

The page makes it before its controls, whose top line it adds, and tells it when all of them
are there.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import viser

from explorer.app.browser.browser_facts import BrowserFacts, ask
from explorer.app.browser.fields import SCRIPT as FIELDS
from explorer.app.browser.room import SCRIPT as ROOM
from explorer.app.browser.viser_gaps import placed_for, run_script
from explorer.app.features.designs.shelf import Shelf
from explorer.app.features.help.keys_panel import CLOSING, KeysCard, Toolbar
from explorer.app.features.help.tour_panel import TourGuide
from explorer.app.features.history.commands import saved_commands, session_commands
from explorer.app.scene.camera import Cameras
from explorer.app.session.session import Session, Who
from explorer.app.state.frame import Frame
from explorer.app.storage.library import Entry
from explorer.app.storage.preferences import PreferenceFile
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.names import SCRIPT as NAMES
from explorer.app.widgets.palette import Command, Palette
from explorer.app.widgets.theme import Theme
from explorer.errors import StorageError

# Until the panels of a new page are laid out.
SETTLE_SECONDS = 0.7
# So often a new browser's camera is looked after, if it says nothing, and in the end so seldom.
MOST_LOOKS, LONGEST_PAUSE_SECONDS = 12, 5.0
# In pixels. In a narrower window the left panel goes below the right one, which leaves the
# scene room, if the window is high enough for both.
NARROW, HIGH_ENOUGH = 1100, 700
# Of the panels, and left free beside what lies over the scene.
RIGHT_WIDTH, LEFT_WIDTH, FREE = 350, 286, 16
# Of the drawer when it is open; the scene of a small laptop's screen is as wide.
DRAWER_WIDTH, DRAWER_HEIGHT, TALL_DRAWER = 620, 300, 540


class Hands:
    """Makes the page handy.

    Args:
        server: Of the page.
        session: That commands are given to.
        preferences: Where theme and tour are remembered; None to remember nothing, begin no
            tour by itself and be light.
        complain: Called with a message for people and the client it is for.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        session: Session,
        preferences: PreferenceFile | None,
        complain: Callable[[str, Who], None],
    ) -> None:
        self._server = server
        self._session = session
        self._preferences = preferences
        self._complain = complain
        chosen = None if preferences is None else preferences.chosen
        self._is_seen = chosen is None or chosen.tour_seen
        self._has_theme = chosen is None or chosen.dark is not None
        self.theme = Theme(
            server.gui,
            dark=chosen is not None and chosen.dark is True,
            changed=session.redraw,
        )
        self._keys = KeysCard()
        self.tour = TourGuide(session, self._tour_ended)
        self._palette: Palette | None = None
        # What was saved when it was last offered.
        self._offered: tuple[Entry, ...] = ()
        self._stacked: tuple[viser.PanelHandle, viser.PanelHandle] | None = None
        Toolbar(
            server.gui,
            {
                "Keys": ("Show all keys on a card.", self._show_keys),
                "Theme": ("Turn the page dark, or light again.", self._turn_theme),
                "Tour": ("Begin the tour of five steps.", self.tour.begin),
            },
        )

    @property
    def palette(self) -> Palette:
        """All commands; more can be added.

        Raises:
            RuntimeError: not all controls are there yet.
        """
        if self._palette is None:
            raise RuntimeError("the page is not complete yet")
        return self._palette

    def complete(
        self,
        cameras: Cameras,
        side: viser.PanelHandle,
        drawer: viser.PanelHandle,
        *,
        docked: bool,
    ) -> None:
        """Offer all that is on the page by now, and lay out its panels.

        Args:
            cameras: Of the browsers.
            side: The panel on the left.
            drawer: The panel over the foot of the scene.
            docked: Whether panels lie beside the scene.
        """
        fit = Command("View › Fit", "Show the whole mechanism from where you look.", cameras.fit)
        for script in (FIELDS, ROOM, NAMES, CLOSING):
            run_script(self._server, script)
        self._palette = Palette(self._server, (fit, *session_commands(self._session)))
        drawer.float(x=FREE // 2, y=-FREE // 2, width=DRAWER_WIDTH, height=DRAWER_HEIGHT)
        drawer.minimize()
        if docked:
            main = self._server.gui.main_panel
            main.dock_right()
            main.set_width(RIGHT_WIDTH)
            side.dock_left()
            side.set_width(LEFT_WIDTH)
            self._stacked = (side, drawer)
        self._server.on_client_connect(lambda client: self._connected(client, cameras))
        self._server.on_client_disconnect(self._disconnected)

    def updates(self, *, controls: bool) -> Iterator[Update]:
        """Yield what leaves those commands to be chosen that can be done.

        Args:
            controls: Whether any control has come into use or gone out of it.
        """
        yield from self.palette.updates(controls=controls)

    def offer_saved(self, shelf: Shelf) -> None:
        """Offer to open what is saved, by name."""
        if shelf.entries is not self._offered:
            self._offered = shelf.entries
            self.palette.offer(saved_commands(shelf))

    def set_drawer(
        self, client: viser.ClientHandle, drawer: viser.PanelHandle, *, tall: bool
    ) -> None:
        """Make the drawer tall in a browser, or as low as it is at first."""
        placed_for(client, drawer).set_height(TALL_DRAWER if tall else DRAWER_HEIGHT)

    def follow(self, frame: Frame) -> None:
        """See whether a user on the tour has done what its step asks for."""
        self.tour.follow(frame)

    def _connected(self, client: viser.ClientHandle, cameras: Cameras) -> None:
        if not self._is_seen:
            self.tour.begin(client)
        # It answers in its own time.
        threading.Thread(
            target=self._meet, args=(client, cameras), name="meet", daemon=True
        ).start()

    def _meet(self, client: viser.ClientHandle, cameras: Cameras) -> None:
        facts = ask(client)
        if facts is not None:
            self._suit(client, facts)
        # Some browsers tell the size of the scene before its panels are laid out, and not again
        # before the camera moves; slow ones miss where it is put. Each look makes them tell.
        pause = SETTLE_SECONDS
        for look in range(MOST_LOOKS):
            time.sleep(pause)
            # The camera of one that has gone stands too.
            if look > 0 and cameras.stands(client):
                return
            cameras.look_again(client)
            pause = min((1.0 + look) * SETTLE_SECONDS, LONGEST_PAUSE_SECONDS)

    def _suit(self, client: viser.ClientHandle, facts: BrowserFacts) -> None:
        if self._stacked is not None:
            _make_room(client, facts, *self._stacked)
        if not self._has_theme:
            self._has_theme = True
            self.theme.choose(dark=facts.dark)

    def _disconnected(self, client: viser.ClientHandle) -> None:
        self._keys.disconnected(client)
        self.tour.disconnected(client)

    def _show_keys(self, client: viser.ClientHandle) -> None:
        self._keys.toggle(client, self.palette.commands)

    def _turn_theme(self, client: viser.ClientHandle) -> None:
        self._has_theme = True
        self.theme.choose(dark=not self.theme.is_dark)
        self._remember(client.client_id, dark=self.theme.is_dark)

    def _tour_ended(self) -> None:
        self._is_seen = True
        self._remember(None, tour_seen=True)

    def _remember(
        self, who: Who, *, dark: bool | None = None, tour_seen: bool | None = None
    ) -> None:
        if self._preferences is None:
            return
        try:
            self._preferences.choose(dark=dark, tour_seen=tour_seen)
        except StorageError as error:
            self._complain(str(error), who)


def is_narrow(facts: BrowserFacts) -> bool:
    """Whether panels on both sides would leave the scene too little room."""
    return facts.width < NARROW and facts.height >= HIGH_ENOUGH


def _make_room(
    client: viser.ClientHandle,
    facts: BrowserFacts,
    side: viser.PanelHandle,
    drawer: viser.PanelHandle,
) -> None:
    if not is_narrow(facts):
        return
    placed_for(client, side).dock_below(client.gui.main_panel)
    room = facts.width - RIGHT_WIDTH - FREE
    placed_for(client, drawer).set_width(min(DRAWER_WIDTH, room))
