"""Access by host, origin and token, over a socket too."""

from __future__ import annotations

import socket
import zlib
from collections.abc import Iterator
from http import HTTPStatus
from http.client import HTTPConnection, HTTPResponse

import pytest
from client import websocket_status
from hypothesis import given, strategies as st
from websockets.datastructures import Headers
from websockets.http11 import Request

from explorer.app.server import Running, start
from explorer.errors import ServerError
from explorer.mechanism.design_file import PRESETS
from explorer.page.security import Access, Refusal, is_loopback

PORT = 8080
TOKEN = "a-token_of-16-or-more"
OPEN = Access("127.0.0.1")
CLOSED = Access("0.0.0.0", TOKEN)
COOKIE = f"explorer-token-{PORT}={TOKEN}"
HERE = f"127.0.0.1:{PORT}"

EVIL_HOSTS = (
    "evil.example", f"evil.example:{PORT}", f"127.0.0.1.evil.example:{PORT}", "127.0.0.1",
    "127.0.0.1:80", "127.0.0.1:8081", f"localhost.evil.example:{PORT}", "", ":8080",
    f"user@127.0.0.1:{PORT}", f"127.0.0.1:{PORT}/", f"127.0.0.1:{PORT} ", f"[::2]:{PORT}",
    f"0x7f.1:{PORT}", f"2130706433:{PORT}", "[::1", f"127.1:{PORT}",
)  # fmt: skip
EVIL_ORIGINS = (
    "null", "http://evil.example", f"http://evil.example:{PORT}", "http://127.0.0.1:8081",
    "http://127.0.0.1", f"http://localhost:{PORT}", f"file://127.0.0.1:{PORT}", "file://", "",
    f"http://127.0.0.1:{PORT}.evil.example", f"http://127.0.0.1:{PORT}/", f"//127.0.0.1:{PORT}",
    f"chrome-extension://127.0.0.1:{PORT}", f"127.0.0.1:{PORT}", f"http:// 127.0.0.1:{PORT}",
)  # fmt: skip

NAMES = HERE, f"localhost:{PORT}", f"[::1]:{PORT}"
WORDS = st.text(st.characters(codec="latin-1", exclude_categories=["Cc"]), max_size=30) | (
    st.from_regex(r"(https?://)?[a-z0-9.:\[\]-]{1,30}", fullmatch=True)
)


def request(target: str, **headers: list[str]) -> Request:
    return Request(target, Headers((name, each) for name in headers for each in headers[name]))


def page(host: str = HERE, target: str = "/", cookie: str | None = None) -> Request:
    return request(target, host=[host], cookie=[] if cookie is None else [cookie])


def websocket(
    host: str = HERE,
    origin: str | None = f"http://{HERE}",
    target: str = "/",
    cookie: str | None = None,
) -> Request:
    origins, cookies = [] if origin is None else [origin], [] if cookie is None else [cookie]
    return request(target, host=[host], origin=origins, cookie=cookies, upgrade=["websocket"])


def is_forbidden(refusal: Refusal | None) -> bool:
    return refusal is not None and refusal[0] == HTTPStatus.FORBIDDEN


def check_on_loopback(host: str, origin: str) -> None:
    """Check that only a name of this machine and its own origin pass, others with a line."""
    is_here = host.lower() in NAMES
    is_own = origin.lower() in (f"http://{host}".lower(), f"https://{host}".lower())
    for head, passes in (
        (page(host), is_here),
        # Even with the cookie, which a browser may send along.
        (websocket(host, origin, cookie=COOKIE), is_here and is_own),
    ):
        refusal = OPEN.judge(head, PORT)
        assert passes if refusal is None else is_forbidden(refusal) and not passes
        assert refusal is None or refusal[1].isprintable()


def test_only_names_of_this_machine_and_their_own_origins_pass_on_loopback() -> None:
    assert OPEN.token is None
    for host in (*NAMES, f"LOCALHOST:{PORT}", *EVIL_HOSTS):
        for origin in (f"http://{host}", f"https://{host}", *EVIL_ORIGINS):
            check_on_loopback(host, origin)
            if host == HERE and origin in EVIL_ORIGINS:
                head = websocket(origin=origin, cookie=COOKIE)
                assert is_forbidden(CLOSED.judge(head, PORT))
    for host in ("127.0.0.1", "localhost", "[::1]"):
        assert OPEN.judge(websocket(host, f"http://{host}"), 80) is None


@given(WORDS, WORDS)
def test_no_other_host_and_no_other_origin_passes_on_loopback(host: str, origin: str) -> None:
    check_on_loopback(host, origin)
    check_on_loopback(HERE, origin)


@pytest.mark.parametrize("hosts", [[], [HERE, HERE], [HERE, "evil.example"]])
def test_request_without_exactly_one_host_and_origin_is_refused(hosts: list[str]) -> None:
    origins = [f"http://{host}" for host in hosts]
    for access in (OPEN, CLOSED):
        for headers in ({"host": hosts}, {"host": [HERE], "origin": origins, "upgrade": ["x"]}):
            assert is_forbidden(access.judge(request("/", cookie=[COOKIE], **headers), PORT))


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.7", "lab.example", "fe80::1"])
def test_server_beyond_loopback_has_a_random_token(host: str) -> None:
    first, second = Access(host), Access(host)
    assert first.token is not None
    assert len(first.token) >= 32
    assert first.token != second.token
    assert f"?token={first.token}" in first.url(PORT)


@pytest.mark.parametrize(
    "token",
    ["", "x" * 15, "x" * 129, "ein Wort mit Leerzeichen", "ä" * 20, "x" * 16 + "\n", "x" * 16 + ";",
     "&token=" + "x" * 16],
)  # fmt: skip
def test_token_that_no_address_can_hold_is_refused_in_one_line(token: str) -> None:
    for host in ("127.0.0.1", "0.0.0.0"):
        with pytest.raises(ServerError, match=r"^[^\n]*16 to 128[^\n]*$"):
            Access(host, token)


@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])
def test_token_passes_in_the_address_and_in_the_cookie(host: str) -> None:
    access = Access(host, TOKEN)
    for head in (
        page(target=f"/?token={TOKEN}"),
        page(target=f"/?darkMode&token={TOKEN}"),
        page(cookie=f"a=b; {COOKIE}; c=d"),
        websocket(cookie=COOKIE),
        websocket(target=f"/?token={TOKEN}"),
    ):
        assert access.judge(head, PORT) is None


@pytest.mark.parametrize("wrong", ["", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), "x" * 16])
def test_wrong_token_is_refused_without_naming_the_right_one(wrong: str) -> None:
    for head in (
        page(),
        page(target=f"/?token={wrong}"),
        page(target=f"/?tokens={TOKEN}"),
        page(cookie=f"explorer-token-{PORT}={wrong}"),
        # Another explorer's, on another port of the same machine.
        page(cookie=f"explorer-token-{PORT + 1}={TOKEN}"),
        page(cookie=f'explorer-token-{PORT}; "{TOKEN}'),
        page(cookie=f"explorer-token-{PORT}=ü\xff"),
        websocket(),
        websocket(cookie=f"explorer-token-{PORT}={wrong}"),
        websocket(target=f"/?token={wrong}"),
    ):
        refusal = CLOSED.judge(head, PORT)
        assert refusal is not None
        assert refusal[0] == HTTPStatus.UNAUTHORIZED
        assert TOKEN not in refusal[1]


def test_host_beyond_loopback_is_an_address_or_the_machines_name() -> None:
    access, name = Access("lab.example", TOKEN), socket.gethostname()
    for host in ("lab.example:1", f"{name}:1", f"{name}.local", "10.1.2.3:99", "[fe80::1]:80"):
        assert access.judge(page(host, cookie=COOKIE), PORT) is None
    for host in ("evil.example", "evil.lab.example", "lab.example.evil.example:8080"):
        assert is_forbidden(access.judge(page(host, cookie=COOKIE), PORT))


PROXY = "lab.example.org"


@pytest.mark.parametrize("listening", ["127.0.0.1", "0.0.0.0"])
@pytest.mark.parametrize("scheme", ["http", "https"])
@pytest.mark.parametrize("host", [PROXY, f"{PROXY}:8443", PROXY.upper()])
def test_host_of_a_proxy_passes_with_its_own_origin_and_the_token(
    listening: str, scheme: str, host: str
) -> None:
    access = Access(listening, TOKEN, [PROXY])
    origin = f"{scheme}://{host}"
    assert access.judge(page(host, cookie=COOKIE), PORT) is None
    assert access.judge(websocket(host, origin, cookie=COOKIE), PORT) is None
    # The origin is still that of the host, to the port.
    for other in (f"x.{host}", f"{PROXY}.", "evil.example"):
        assert is_forbidden(access.judge(page(other, cookie=COOKIE), PORT))
    for wrong in (None, f"{scheme}://evil.example", f"{origin}:1", f"{scheme}://{HERE}", "null"):
        assert is_forbidden(access.judge(websocket(host, wrong, cookie=COOKIE), PORT))
    refusal = access.judge(websocket(host, origin), PORT)
    assert refusal is not None
    assert refusal[0] == HTTPStatus.UNAUTHORIZED


def test_proxy_needs_a_token_on_loopback_too() -> None:
    access = Access("127.0.0.1", names=[PROXY])
    assert access.token is not None
    assert access.judge(page(), PORT) is not None


@pytest.mark.parametrize(
    "name", ["", "*", "*.example.org", "https://lab.example.org", "lab/x", "a b", "lab:x", "ä.de"]
)
def test_name_that_no_host_has_is_refused_in_one_line(name: str) -> None:
    with pytest.raises(ServerError, match=r"^[^\n]*such as lab.example.org[^\n]*$"):
        Access("127.0.0.1", TOKEN, [name])


@pytest.mark.parametrize(
    "query",
    ["websocket=ws://evil.example", "playbackPath=//evil.example/x",
     "websocket=ws%3A%2F%2Fevil.example", "a=b;c", "a=%00", "ü", "a?b"],
)  # fmt: skip
def test_query_with_another_address_is_refused(query: str) -> None:
    assert is_forbidden(OPEN.judge(page(target=f"/?{query}"), PORT))
    assert is_forbidden(CLOSED.judge(page(target=f"/?token={TOKEN}&{query}"), PORT))


def test_policy_lets_the_page_connect_only_to_its_server() -> None:
    headers = OPEN.headers(page(), PORT)
    policy = {
        words[0]: words[1:]
        for words in map(str.split, headers["Content-Security-Policy"].split(";"))
    }
    remote = [source for source in policy["default-src"] if "://" in source]
    assert remote == [f"ws://{HERE}", f"wss://{HERE}"]
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert "Set-Cookie" not in headers


def test_cookie_is_bound_to_the_port_and_hidden_from_scripts_and_other_sites() -> None:
    cookie = CLOSED.headers(page(), PORT)["Set-Cookie"]
    given_cookie, *flags = cookie.split("; ")
    assert given_cookie == COOKIE
    assert set(flags) == {"Path=/", "HttpOnly", "SameSite=Strict"}


@pytest.mark.parametrize(
    ("host", "url"),
    [("127.0.0.1", "http://127.0.0.1:8080"), ("::1", "http://[::1]:8080"),
     ("localhost", "http://localhost:8080"), ("0.0.0.0", "http://127.0.0.1:8080/?token=" + TOKEN),
     ("::", "http://[::1]:8080/?token=" + TOKEN)],
)  # fmt: skip
def test_url_is_one_that_a_browser_on_this_machine_opens(host: str, url: str) -> None:
    assert Access(host, None if is_loopback(host) else TOKEN).url(PORT) == url


@pytest.mark.parametrize(
    ("allowed", "host", "origin", "passes"),
    [
        # Browsers leave the usual port of their scheme out; proxies may add it.
        ("lab.example:443", "lab.example", "https://lab.example", True),
        ("lab.example:80", "lab.example", "http://lab.example", True),
        ("lab.example", "lab.example:443", "https://lab.example", True),
        ("lab.example:443", "lab.example:443", "https://lab.example", True),
        ("lab.example", "lab.example:80", "http://lab.example", True),
        ("lab.example:8443", "lab.example", "https://lab.example", False),
        ("lab.example:443", "lab.example:8443", "https://lab.example:8443", False),
        ("lab.example", "lab.example:443", "http://lab.example", False),
        ("lab.example", "lab.example", "https://lab.example:8443", False),
        ("lab.example", "lab.example:443", "https://evil.example", False),
        ("lab.example", "lab.example.evil", "https://lab.example.evil", False),
        ("[2001:db8::80]", "[2001:db8::80]", "http://[2001:db8::80]", True),
    ],
)
def test_allowed_name_passes_with_usual_ports(
    allowed: str, host: str, origin: str, *, passes: bool
) -> None:
    access = Access("127.0.0.1", TOKEN, [allowed])
    assert (access.judge(websocket(host, origin, cookie=COOKIE), PORT) is None) == passes


# The same over a socket.
BROWSER = {"Accept": "text/html,application/xhtml+xml", "Accept-Encoding": "gzip"}


@pytest.fixture(scope="module")
def behind() -> Iterator[Running]:
    """An explorer behind a proxy."""
    running = start(PRESETS["paper-optimal"], port=0, token=TOKEN, allow_hosts=[PROXY])
    yield running
    running.stop()


def get(running: Running, target: str, **headers: str) -> tuple[HTTPResponse, str]:
    """Return the response to a request and its body, unpacked."""
    connection = HTTPConnection("127.0.0.1", running.viser.get_port(), timeout=60)
    connection.request("GET", target, headers=headers)
    response = connection.getresponse()
    body = response.read()
    connection.close()
    assert int(response.headers["Content-Length"]) == len(body)
    if response.headers.get("Content-Encoding") == "gzip":
        body = zlib.decompress(body, 16 + zlib.MAX_WBITS)
    return response, body.decode()


def test_page_through_a_proxy_lets_itself_connect_there(behind: Running) -> None:
    response, page = get(behind, f"/?token={TOKEN}", Host=PROXY, **BROWSER)
    assert response.status == 200
    assert f"wss://{PROXY}" in response.headers["Content-Security-Policy"]
    # The same with and without packing.
    assert get(behind, f"/?token={TOKEN}", Host=PROXY)[1] == page
    response, page = get(behind, "/", **BROWSER)
    assert response.status == 401
    assert "?token=" in page
    bare = behind.url.partition("/?")[0]
    assert [websocket_status(url) for url in (bare, f"{behind.url}x", behind.url)] == [
        401,
        401,
        101,
    ]
    assert "<script" not in get(behind, "/", Host="<script>alert(1)</script>", **BROWSER)[1]


@pytest.mark.parametrize("host", ["evil.example:9", f"{PROXY}.evil.example"])
def test_wrong_host_is_answered_with_a_line_that_names_it_and_the_option(
    behind: Running, running: Running, host: str
) -> None:
    for each in (behind, running):
        response, line = get(each, "/", Host=host, **BROWSER)
        assert response.status == 403
        assert response.headers["Content-Type"].startswith("text/plain")
        assert TOKEN not in line
        assert line.count("\n") == 1
        assert f"--allow-host {host.partition(':')[0]}" in line
