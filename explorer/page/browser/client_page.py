"""The page that a browser loads: the explorer's start screen, whose script loads viser's own page.

viser's page is one large file that shows nothing before all of it is there, and then an empty panel
until the first messages have come. The start screen is there at once, says how much has come, and
leaves once the whole page is there. Its scripts run before those of viser.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable
from dataclasses import replace
from http import HTTPStatus
from pathlib import Path
from string import Template

import viser
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from explorer.page.look import read_file, read_script

Answer = Callable[[ServerConnection, Request], Response | None]
"""Answers a request by HTTP; None where it opens a websocket."""

VISER_PAGE = Path(viser.__file__).parent / "client/build/index.html"
# Paths of the page of the explorer, of that of viser, and what viser calls its own.
PATHS, VISER_PATH, ITS_PATH = ("/", "/index.html"), "/viser.html", "/index.html"
# Scripts that run before those of viser, in their order.
SCRIPTS = ("socket", "graphics", "links")


class ClientPage:
    """Answers the requests for the page in the place of viser.

    Attributes:
        count_messages: Function that returns the number of messages that a new browser is sent.
    """

    def __init__(self) -> None:
        self.count_messages: Callable[[], int] = lambda: 1

    def answering(self, answer: Answer) -> Answer:
        """Return viser's function that answers requests, with the start screen before its page."""

        def answer_page(connection: ServerConnection, request: Request) -> Response | None:
            path, _, _ = request.path.partition("?")
            if path in PATHS and "Upgrade" not in request.headers:
                return _html(self.html(), request)
            if path != VISER_PATH:
                return answer(connection, request)
            response = answer(connection, replace(request, path=ITS_PATH))
            if response is not None:
                # Its address names its version.
                response.headers["Cache-Control"] = "private, max-age=31536000, immutable"
            return response

        return answer_page

    def html(self) -> str:
        """Return the page with the start screen."""
        address = f"{VISER_PATH[1:]}?v={viser.__version__}"
        start = read_script("start", address, VISER_PAGE.stat().st_size, self.count_messages())
        fields = {
            "style": read_file("start.css"),
            "script": "".join([*map(read_script, SCRIPTS), start]),
        }
        return Template(read_file("start.html")).substitute(fields)


def _html(text: str, request: Request) -> Response:
    packs = "gzip" in request.headers.get("Accept-Encoding", "")
    body = gzip.compress(text.encode()) if packs else text.encode()
    headers = {
        "Content-Type": "text/html; charset=utf-8",
        "Content-Encoding": "gzip" if packs else "identity",
        "Content-Length": str(len(body)),
        "Cache-Control": "no-cache",
    }
    return Response(HTTPStatus.OK.value, HTTPStatus.OK.phrase, Headers(headers), body)
