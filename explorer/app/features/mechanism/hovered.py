"""Rows of tables that the scene shows while a pointer rests on them."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Services


class HoveredRow:
    """The row of a table on which a pointer rests.

    It is no part of the state: it is neither saved nor undone.

    Args:
        services: What the page offers.
        name: Name under which buttons and rows report the pointer, see `press_button`.
        rows: Numbers of the rows.

    Attributes:
        row: Number of the row; None if there is none.
    """

    def __init__(self, services: Services, name: str, rows: range) -> None:
        self.row: int | None = None
        self._session = services.session
        self._client: int | None = None
        services.buttons.on(name, self._hover, values={"", *map(str, rows)})
        services.server.on_client_disconnect(self._forget)

    def _hover(self, value: str, client: viser.ClientHandle) -> None:
        self._client = client.client_id
        self._show(int(value) if value else None)

    def _forget(self, client: viser.ClientHandle) -> None:
        # A browser that is closed does not report that the pointer has left.
        if client.client_id == self._client:
            self._show(None)

    def _show(self, row: int | None) -> None:
        if row != self.row:
            self.row = row
            self._session.redraw()
