"""Who may ask the page, and how much: every request passes here before anything else sees it.

Another site that a person has open can send requests to this machine too. It knows no token, its requests
bear its own origin, and a name of its own that it lets point here (DNS rebinding) is not this page's name.
"""

from __future__ import annotations

import ipaddress
import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import parse_qs

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

#: Bytes of a request's body. A rig of 64 cables takes 20 kB.
LARGEST_BODY = 1 << 18
LOCAL = frozenset({"127.0.0.1", "localhost", "::1"})
#: The page loads its own files alone, runs no script from within a text, and stands in no other site's frame.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "frame-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
}


class Guard:
    """Refuses what does not come from the page itself; puts the headers that browsers obey on every answer.

    Parameters
    ----------
    app : ASGI application
    token : str
        Stands in the link that the command prints; from then on in a cookie.
    address : str
        What the server listens on. Beside it any address in figures is a name of the page where it is not a
        local one: a name that an attacker lets point here is never in figures.
    port : int
        Cookies know no ports, so its name has it.
    """

    def __init__(self, app: App, token: str, address: str, port: int) -> None:
        self._app = app
        self._token = token.encode()
        self._address = address
        self._port = port
        self._cookie = f"rig_identification_{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request, or pass it on."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":
            return  # the page has no other kind of connection
        headers = _headers(scope)
        if refusal := self._refusal(scope, headers):
            await _answer(send, *refusal)
        elif self._token_in_link(scope):
            kept = f"{self._cookie}={self._token.decode()}; HttpOnly; SameSite=Strict; Path=/"
            await _answer(send, 303, "", {"location": "/", "set-cookie": kept})
        elif not self._known(headers):
            await _answer(send, 403, "This page needs the link that rig-identification ui prints.")
        else:
            body = await _body(receive, headers)
            if body is None:
                await _answer(send, 413, f"A request holds at most {LARGEST_BODY} bytes.")
            else:
                await self._app(scope, _replayed(body, receive), _with_headers(send))

    def _refusal(self, scope: Scope, headers: dict[str, list[str]]) -> tuple[int, str] | None:
        """Status and reason for what comes under another name or from another site."""
        hosts, origins = headers.get("host", []), headers.get("origin", [])
        if len(hosts) != 1 or not self._is_ours(hosts[0]):
            return 421, "This server has no page of that name."
        if any(origin != f"http://{hosts[0]}" for origin in origins):
            return 403, "Requests of other sites are refused."
        if scope["method"] not in ("GET", "HEAD") and "cross-site" in headers.get("sec-fetch-site", []):
            return 403, "Requests of other sites are refused."
        return None

    def _is_ours(self, host: str) -> bool:
        name, colon, port = host.rpartition(":")
        if not colon or port != str(self._port):
            return False
        name = name.removeprefix("[").removesuffix("]").lower()
        if name in LOCAL or name == self._address.lower():
            return True
        return self._address not in LOCAL and _in_figures(name)

    def _token_in_link(self, scope: Scope) -> bool:
        if scope["path"] != "/" or scope["method"] != "GET":
            return False
        given = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [""])
        return self._is_token(given[0])

    def _known(self, headers: dict[str, list[str]]) -> bool:
        cookies = [part.strip() for line in headers.get("cookie", []) for part in line.split(";")]
        mine = f"{self._cookie}="
        return any(self._is_token(c.removeprefix(mine)) for c in cookies if c.startswith(mine))

    def _is_token(self, given: str) -> bool:
        return secrets.compare_digest(given.encode("utf-8", "replace"), self._token)


def _in_figures(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _headers(scope: Scope) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for name, value in scope["headers"]:
        found.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
    return found


async def _body(receive: Receive, headers: dict[str, list[str]]) -> bytes | None:
    """The whole body; None where it is larger than it may be, which is told as soon as it is."""
    said = headers.get("content-length", ["0"])[0]
    if not said.isdecimal() or len(said) > len(str(LARGEST_BODY)) or int(said) > LARGEST_BODY:
        return None
    body = b""
    while True:
        message = await receive()
        piece: bytes = message.get("body", b"")
        body += piece
        if len(body) > LARGEST_BODY:
            return None
        if message["type"] == "http.disconnect" or not message.get("more_body"):
            return body


def _replayed(body: bytes, receive: Receive) -> Receive:
    """What the application receives: the body at once, then what else comes."""
    waiting = [{"type": "http.request", "body": body, "more_body": False}]

    async def receive_again() -> Message:
        return waiting.pop() if waiting else await receive()

    return receive_again


def _with_headers(send: Send) -> Send:
    async def send_with(message: Message) -> None:
        if message["type"] == "http.response.start":
            given = {name.lower() for name, _ in message["headers"]}
            added = {"content-security-policy": POLICY, **HEADERS}
            message["headers"] = [
                *message["headers"],
                *((n.encode(), v.encode()) for n, v in added.items() if n.encode() not in given),
            ]
        await send(message)

    return send_with


async def _answer(send: Send, status: int, text: str, headers: dict[str, str] | None = None) -> None:
    body = text.encode()
    told = {
        "content-type": "text/plain; charset=utf-8",
        "content-length": str(len(body)),
        "content-security-policy": POLICY,
        **HEADERS,
        **(headers or {}),
    }
    raw = [(name.encode(), value.encode("latin-1")) for name, value in told.items()]
    await send({"type": "http.response.start", "status": status, "headers": raw})
    await send({"type": "http.response.body", "body": body})
