"""`explorer serve`: the explorer's page, served to the browser of this machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from explorer.cli.options import DesignOptions
from explorer.cli.values import whole_number


@dataclass(frozen=True, kw_only=True)
class Serve(DesignOptions):
    """Serve the explorer's page and open it in the browser (the default)."""

    host: str = "127.0.0.1"
    """Address to listen on; the default is for this machine alone."""

    port: Annotated[int, whole_number("--port", 0, 65535)] = 8080
    """Port to listen on; 0 takes any free one, a taken one is an error."""

    open: bool = True
    """Whether to open the browser."""

    def run(self) -> None:
        """Serve the page until interrupted.

        Raises:
            DesignError: a design that cannot be used.
            ServerError: the server cannot start, for instance because the port is taken.
        """
        design = self.load()
        from explorer.app.server import serve

        serve(design, host=self.host, port=self.port, open_browser=self.open)
