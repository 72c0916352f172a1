"""The panels and the bar on top, and what each new browser needs: its room and camera."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import get_args

import viser

from explorer.app.features.feature import Feature, Place, Services, Side, Tab
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import MANUAL, press_button
from explorer.page.browser.viser_gaps import (
    dock_above_in,
    keep_arrangement,
    make_with_id,
    panel_in,
    run_script,
    run_script_in,
)
from explorer.page.look import read_script
from explorer.page.session.clock import Timer
from explorer.page.widgets.assigning import Update

# Seconds until the panels of a new page are laid out.
SETTLE_SECONDS = 0.7
# Most attempts to place a new browser's camera, and the longest pause between two in seconds.
MOST_ATTEMPTS, LONGEST_PAUSE_SECONDS = 12, 5.0
# Width and height of a window in pixels: in a narrower one the left panel goes above the right
# one, which leaves the scene room, if the window is high enough for both.
NARROW, HIGH_ENOUGH = 1100, 700
ROOM = "room"
# Widths of the panels on the left and on the right, and height of the open drawer, in pixels.
LEFT_WIDTH, RIGHT_WIDTH, DRAWER_HEIGHT = 300, 360, 300
# Width, and place from the left and from the top, of a window before the stylesheet places it.
ANY_WIDTH, ANY_PLACE = 640, 80


class Panels:
    """The panels of the page, which hold the tabs."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._gui = gui
        keep_arrangement(gui)
        places = "build", "analyse", "work"
        self.build, self.analyse, self.work = (make_with_id(gui.add_panel, at) for at in places)
        self._tabs: dict[tuple[Place, str], viser.GuiTabHandle] = {}

    def tab(self, tab: Tab, manual: str) -> viser.GuiTabHandle:
        """Return the tab of a place with a title, made at the first call with its button "?"."""
        key = (tab.place, tab.title)
        if key not in self._tabs:
            if tab.place == "dialog":
                panel = make_with_id(self._gui.add_panel, f"dialog {tab.title}")
                panel.float(x=ANY_PLACE, y=ANY_PLACE, width=ANY_WIDTH)
            else:
                panel: viser.PanelHandle = getattr(self, tab.place)
            add_tab = partial(panel.add_tab, tab.title, tab.icon)
            self._tabs[key] = make_with_id(add_tab, f"tab {tab.title}")
            if manual:
                hint = f"Read about {tab.title} in the manual."
                button = press_button(MANUAL, manual, "?", label=hint, class_name="ex-asks")
                with self._tabs[key]:
                    self._gui.add_html(button)
        return self._tabs[key]

    def titles(self, place: Place) -> list[str]:
        """Return the titles of the tabs in a place."""
        return [title for each, title in self._tabs if each == place]

    def lay_out(self, client: viser.ClientHandle | None = None) -> None:
        """Put the panels of a browser, or of all also to come, where they are at first."""

        def of(panel: viser.PanelHandle) -> viser.PanelHandle:
            return panel if client is None else panel_in(client, panel)

        of(self.build).dock_left()
        of(self.build).set_width(LEFT_WIDTH)
        of(self.analyse).dock_right()
        of(self.analyse).set_width(RIGHT_WIDTH)
        of(self.work).float(x=0, y=-1, width=ANY_WIDTH, height=DRAWER_HEIGHT)
        of(self.work).minimize()


class Layout:
    """Lays out the panels, if the scene is not alone, and adapts the page to each new browser."""

    def __init__(self, services: Services, panels: Panels | None) -> None:
        self._cameras, self._panels = services.cameras, panels
        if panels is not None:
            panels.lay_out()
            titles = {"drawer": panels.titles("work"), "dialogs": panels.titles("dialog")}
            run_script(services.server, read_script("places", titles))
        services.buttons.on(ROOM, self._settle, values=("narrow", "wide"))
        services.server.on_client_connect(ask_for_room)

    def reset(self, client: viser.ClientHandle) -> None:
        """Put the panels of a browser into the places that they have at first."""
        if self._panels is not None:
            self._panels.lay_out(client)
            ask_for_room(client)

    def _settle(self, room: str, client: viser.ClientHandle) -> None:
        if self._panels is not None and room == "narrow":
            dock_above_in(client, self._panels.build, self._panels.analyse)
        Timer(SETTLE_SECONDS, self._place_camera, client, 0)

    def _place_camera(self, client: viser.ClientHandle, attempt: int) -> None:
        """Put the camera of a new browser where it belongs, again and again until it is there.

        Some browsers report the size of the scene before its panels are laid out, and not again
        before the camera moves; slow ones miss where it is put. Each attempt makes them report.
        """
        # The camera of a browser that has disconnected counts as placed too.
        if attempt > 0 and self._cameras.stands(client):
            return
        self._cameras.look_again(client)
        if attempt + 1 < MOST_ATTEMPTS:
            pause = min((1.0 + attempt) * SETTLE_SECONDS, LONGEST_PAUSE_SECONDS)
            Timer(pause, self._place_camera, client, attempt + 1)


def ask_for_room(client: viser.ClientHandle) -> None:
    """Ask a browser whether panels on both sides would leave the scene too little room."""
    run_script_in(client, read_script("room", NARROW, HIGH_ENOUGH))


TITLE = "Flagged 4-4 explorer"
SIDES: tuple[Side, ...] = get_args(Side)
PRODUCT = (
    f'<div class="ex-product"><h1>{TITLE}</h1>'
    '<small class="ex-dim ex-small">six actuators, four legs</small></div>'
)


class Bar:
    """The bar on top of the page, with the parts of the features side by side."""

    def __init__(self, services: Services, features: Sequence[Feature]) -> None:
        declared = [each for feature in features for each in feature.bar]
        self._parts = [(side, make(services)) for side, make in declared]
        self._html = services.gui.add_html("")

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the bar show the frame."""
        parts = [(side, part(frame)) for side, part in self._parts]
        sides = ("".join(html for each, html in parts if each == side) for side in SIDES)
        bar = '<div>{}</div><div role="toolbar" aria-label="Figures">{}</div><div>{}</div>'.format(
            *sides
        )
        # With this scripts read lengths that are typed in another unit.
        unit = f'data-unit-mm="{frame.state.design.unit_mm!r}"'
        yield self._html, "content", f'<header class="ex-bar" {unit}>{PRODUCT}{bar}</header>'
