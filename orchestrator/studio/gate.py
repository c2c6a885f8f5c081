"""The gate before every route: right host, right origin, and a session that the one-time token opened."""

import hmac
import html
import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

HOSTS = ("127.0.0.1", "localhost")
READING = ("GET", "HEAD")
# What a browser shows in place of a page that it may not have; it needs nothing else of this server.
REFUSED = (
    '<!doctype html><html lang="en"><meta name="viewport" content="width=device-width"><meta name="color-scheme" content="light dark">'
    "<title>misfit studio</title><style>body {{ font: 1.1rem/1.5 system-ui, sans-serif; max-width: 40rem; margin: 4rem auto; padding: 0 1rem }}"
    "</style><h1>misfit studio</h1><p>{}</p><p>Nothing is lost: projects are kept on the disk, and their addresses stay the same.</p>"
)


@dataclass
class Keys:
    """The one-time token, until it is used, and the sessions that it opened.

    A token opens one session; whoever comes second with the same link is refused and so learns that somebody else
    was first. Sessions end with the server.
    """

    token: str | None = field(default_factory=secrets.token_urlsafe)
    sessions: set[str] = field(default_factory=set)

    def exchange(self, token: str) -> str | None:
        """A new session for the token, once; None for a wrong or used one."""
        if self.token is None or not hmac.compare_digest(token.encode(), self.token.encode()):
            return None
        self.token = None
        session = secrets.token_urlsafe()
        self.sessions.add(session)
        return session


class Gate:
    """An application around another one that lets only the user's own browser through.

    Requests are refused with 403 if their Host is not this server's (a foreign name that points to 127.0.0.1: DNS
    rebinding), if they come from another origin, or if they carry no session; bodies of more than `most_bytes` are not
    read to their end. Every answer gets the headers below.
    """

    def __init__(self, app: Application, port: int, keys: Keys, most_bytes: int) -> None:
        self.app, self.port, self.keys, self._most_bytes = app, port, keys, most_bytes
        self._hosts = {f"{host}:{port}" for host in HOSTS}
        self._origins = {f"http://{host}" for host in self._hosts}
        # Cookies are shared by all ports of a host, so each studio names its own.
        self._cookie = f"misfit-studio-{port}"
        self._headers = _headers(self._hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        if (token := _token(scope)) is not None and headers.get("host") in self._hosts:
            await self._enter(scope, headers, token, send)
        elif refusal := self._refusal(scope, headers):
            await _refuse(scope, receive, send, refusal, "text/html" in headers.get("accept", ""))
        elif int(headers.get("content-length", "0") or 0) > self._most_bytes:
            await _answer(send, 413, f"Requests of more than {self._most_bytes / 2**20:g} MiB are refused.")
        else:
            await self._let_through(scope, _counted(receive, self._most_bytes), send)

    async def _let_through(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Hand on a request; one whose browser has left ends without an answer, which the layers behind call an error."""
        from starlette.requests import ClientDisconnect

        left = False

        async def noticed() -> Message:
            nonlocal left
            message = await receive()
            left = left or message["type"] == "http.disconnect"
            return message

        try:
            await self.app(scope, noticed, self._guarded(scope, send))
        except (RuntimeError, ClientDisconnect):
            if not left:
                raise

    def _refusal(self, scope: Scope, headers: dict[str, str]) -> str | None:
        """Why a request is refused, or None."""
        if headers.get("host") not in self._hosts:
            return f"This studio answers at http://{HOSTS[0]}:{self.port} only."
        origin = headers.get("origin")
        writes = scope["type"] == "websocket" or scope["method"] not in READING
        if (origin is None and writes) or (origin is not None and origin not in self._origins):
            return "Requests from other origins are refused."
        if headers.get("sec-fetch-site", "none") not in ("none", "same-origin"):
            return "Requests from other sites are refused; open the address in a tab of its own."
        if not self._has_session(headers):
            return (
                "Open the link that 'misfit studio' printed first. It works once; start the studio again for a new one."
            )
        return None

    def _has_session(self, headers: dict[str, str]) -> bool:
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(self._cookie)
        except CookieError:
            return False
        return cookie is not None and cookie.value in self.keys.sessions

    async def _enter(self, scope: Scope, headers: dict[str, str], token: str, send: Send) -> None:
        """Exchange the token for a session cookie.

        The answer is a page that opens `/`, not a redirect: after one, a browser that came from another program would
        count the request for `/` as coming from there, and leave out the cookie.
        """
        session = self.keys.exchange(token) if scope["method"] == "GET" else None
        if session is None and not self._has_session(headers):
            await _answer(send, 403, "This link has been used or is not of this studio. Start 'misfit studio' again.")
            return
        cookie = f"{self._cookie}={session}; HttpOnly; SameSite=Strict; Path=/"
        extra = [(b"set-cookie", cookie.encode())] if session else []
        page = (
            '<!doctype html><html lang="en"><title>misfit studio</title><meta http-equiv="refresh" content="0; url=/">'
        )
        await _answer(send, 200, page, "text/html", [*extra, *self._headers.items()])

    def _guarded(self, scope: Scope, send: Send) -> Send:
        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                given = {name.lower() for name, _ in message["headers"]}
                missing = [(name, value) for name, value in self._headers.items() if name not in given]
                message = {**message, "headers": [*message["headers"], *missing]}
            await send(message)

        return with_headers if scope["type"] == "http" else send


def _counted(receive: Receive, most_bytes: int) -> Receive:
    """A request whose length was not announced ends where it grows too long."""
    seen = 0

    async def counted() -> Message:
        nonlocal seen
        message = await receive()
        seen += len(message.get("body", b"")) if message["type"] == "http.request" else 0
        return {"type": "http.disconnect"} if seen > most_bytes else message

    return counted


def _headers(hosts: set[str]) -> dict[bytes, bytes]:
    # NiceGUI writes inline scripts and Vue compiles templates in the browser, so both must be allowed for scripts;
    # that nothing comes from or goes to elsewhere holds all the same.
    policy = (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' data: blob:; font-src 'self' data:; worker-src 'self' blob:; "
        f"connect-src 'self' {' '.join(f'ws://{host}' for host in sorted(hosts))}; "
        # The bench view's stop button is a server of its own on this machine, so that it outlives the studio.
        "frame-src http://localhost:* http://127.0.0.1:*; "
        "object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
    )
    return {
        b"content-security-policy": policy.encode(),
        b"cross-origin-opener-policy": b"same-origin",
        b"cross-origin-resource-policy": b"same-origin",
        b"referrer-policy": b"no-referrer",
        b"x-content-type-options": b"nosniff",
        b"x-frame-options": b"DENY",
    }


def _token(scope: Scope) -> str | None:
    if scope["type"] != "http" or scope["path"] != "/":
        return None
    return parse_qs(scope["query_string"].decode("latin-1")).get("token", [None])[0]


async def _refuse(scope: Scope, receive: Receive, send: Send, why: str, as_page: bool) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": why[:120]})
    elif as_page:
        await _answer(send, 403, REFUSED.format(html.escape(why, quote=False)), "text/html")
    else:
        await _answer(send, 403, why)


async def _answer(
    send: Send, status: int, text: str, kind: str = "text/plain", headers: list[tuple[bytes, bytes]] | None = None
) -> None:
    body = text.encode()
    fixed = [(b"content-type", f"{kind}; charset=utf-8".encode()), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": [*fixed, *(headers or [])]})
    await send({"type": "http.response.body", "body": body})
