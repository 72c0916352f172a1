"""What a person reads where a request is refused: a page, or words on a page that may not connect.

A browser tells a page nothing about a websocket that is refused. So the page comes with a script
that asks for the reason by a plain request, and shows it.
"""

from __future__ import annotations

import gzip
from functools import lru_cache
from html import escape
from http import HTTPStatus
from string import Template
from urllib.parse import unquote

from websockets.datastructures import Headers
from websockets.http11 import Response

from explorer.app.look import read_file
from explorer.app.security.access import Refusal

# Start of the request by which the page asks why its websocket is refused; its origin follows.
QUESTION = "/connection?origin="
# The page shows this once several attempts have failed that the explorer does not refuse.
UNREFUSED = (
    "The explorer answers, but no websocket reaches it. A proxy in between must pass on "
    "websockets, with the headers Upgrade and Connection."
)
HEAD = b"<head>"


def asked_origin(target: str) -> str | None:
    """Return the origin in a page's question about its websocket; None for another request.

    Args:
        target: Path and query of the request.
    """
    if not target.startswith(QUESTION):
        return None
    return unquote(target.removeprefix(QUESTION))


def explain(refusal: Refusal | None) -> Response:
    """Return the answer to a page's question about its websocket."""
    return refuse(refusal or Refusal(HTTPStatus.OK, UNREFUSED), as_page=False)


def refuse(refusal: Refusal, *, as_page: bool) -> Response:
    """Return the response of a refusal.

    Args:
        refusal: The refusal.
        as_page: Whether it is a page, for a browser, rather than one line of text.
    """
    kind, text, more = "plain", f"{refusal.reason}\n", dict[str, str]()
    if as_page:
        page = Template(read_file("refused.html"))
        text = page.substitute(style=read_file("refused.css"), reason=escape(refusal.reason))
        kind = "html"
        more = {"Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'"}
    body = text.encode()
    headers = {
        "Content-Type": f"text/{kind}; charset=utf-8",
        "Content-Length": str(len(body)),
        "X-Content-Type-Options": "nosniff",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Cache-Control": "no-store",
    }
    return Response(refusal.status.value, refusal.status.phrase, Headers(headers | more), body)


def add_explanations(response: Response) -> None:
    """Add the script that shows why the page may not connect, if a response is the page."""
    if response.headers.get("Content-Type", "").startswith("text/html"):
        is_packed = response.headers.get("Content-Encoding") == "gzip"
        response.body = _with_script(bytes(response.body or b""), is_packed)
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))


# The page as it is, and packed.
@lru_cache(maxsize=2)
def _with_script(body: bytes, is_packed: bool) -> bytes:
    page = gzip.decompress(body) if is_packed else body
    style, script = read_file("refused.css"), read_file("refused.js")
    added = f"<style>{style}</style><script>{script}</script>".encode()
    page = page.replace(HEAD, HEAD + added, 1)
    return gzip.compress(page) if is_packed else page
