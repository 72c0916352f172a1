"""`explorer serve`: the explorer's page, served to the browser of this machine."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from explorer.cli.options import load
from explorer.cli.values import DESIGN_NAME, hint, whole_number


@dataclass(frozen=True, kw_only=True)
class Serve:
    """Serve the explorer's page and open it in the browser (the default)."""

    design: Annotated[str | None, tyro.conf.arg(metavar=DESIGN_NAME)] = None
    """A preset, a design file (JSON), or the name of a design saved on the page; by default the
    last session."""

    host: str = "127.0.0.1"
    """Address to listen on; the default is for this machine alone."""

    port: Annotated[int, whole_number("--port", 0, 65535)] = 8080
    """Port to listen on; 0 takes any free port, a port in use is an error."""

    token: str | None = None
    """Access token of 16 to 128 letters, digits, - and _; by default that of the environment
    variable EXPLORER_TOKEN, else a random one if other machines can connect."""

    allow_host: Annotated[tuple[str, ...], hint("none", "NAME …")] = ()
    """Names of hosts by which a proxy passes requests on, such as lab.example.org; a token is
    then needed."""

    study: Annotated[tuple[Path, ...], hint("optional", "FOLDER …")] = ()
    """Results of explorer sweep to list on the page, beside the studies run there."""

    open: bool = True
    """Open the browser."""

    def run(self) -> None:
        """Serve the page until interrupted."""
        design = None if self.design is None else load(self.design)
        from explorer.app.server import serve
        from explorer.app.storage.study_folders import check_given

        check_given(self.study)

        # Other users of this machine see arguments, but not the environment.
        token = os.environ.get("EXPLORER_TOKEN") if self.token is None else self.token
        serve(
            design,
            host=self.host,
            port=self.port,
            token=token,
            allow_hosts=self.allow_host,
            open_browser=self.open,
            studies=self.study,
        )
