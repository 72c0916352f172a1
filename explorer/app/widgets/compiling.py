"""The notice that kernels are still being compiled, in every browser until all are ready."""

from __future__ import annotations

import viser

from explorer.numerics.number_text import format_decimals

TITLE = "Compiling for this processor"
BODY = (
    "{percent} % done, once on this machine. All that you ask for is computed meanwhile, "
    "only more slowly."
)


class CompilingNotice:
    """One notification in each browser, with the progress of compiling.

    Args:
        server: The server whose browsers show the page.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._shown: dict[int, viser.NotificationHandle] = {}

    def show(self, share: float) -> None:
        """Show the share that is compiled, 0 to 1; take the notice away at 1."""
        clients = self._server.get_clients()
        if share >= 1.0:
            for client_id, notice in self._shown.items():
                if client_id in clients:
                    notice.remove()
            self._shown.clear()
            return
        body = BODY.format(percent=format_decimals(100.0 * share, 0))
        for client_id, client in clients.items():
            notice = self._shown.get(client_id)
            if notice is None:
                self._shown[client_id] = client.add_notification(TITLE, body, loading=True)
            else:
                notice.body = body
