"""The gate lets nothing through without a session, from elsewhere, or under another name."""

from typing import Any

import pytest
from coroutines import finished
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.studio.gate import Gate, Keys

PORT = 8765
LIMIT = 1000
HERE = f"127.0.0.1:{PORT}"
Headers = dict[str, str]


class Reached(Exception):
    """The application behind the gate was called."""


async def behind(scope: Any, receive: Any, send: Any) -> None:
    raise Reached


def ask(keys: Keys, headers: Headers, path: str = "/", query: str = "", method: str = "GET", kind: str = "http") -> Any:
    """Status of the answer, its headers and its body; `Reached` if the application was called."""
    sent: list[Any] = []

    async def receive() -> Any:
        return {"type": "websocket.connect" if kind == "websocket" else "http.request"}

    async def send(message: Any) -> None:
        sent.append(message)

    raw = [(name.encode(), value.encode("latin-1")) for name, value in headers.items()]
    scope = {"type": kind, "path": path, "query_string": query.encode(), "headers": raw, "method": method}
    finished(Gate(behind, PORT, keys, LIMIT)(scope, receive, send))
    return sent


def signed_in(keys: Keys) -> Headers:
    assert keys.token is not None
    return {"host": HERE, "cookie": f"misfit-studio-{PORT}={keys.exchange(keys.token)}"}


def test_with_session_and_same_origin_the_application_is_reached() -> None:
    keys = Keys()
    headers = signed_in(keys)

    for kind, origin in (("http", {}), ("websocket", {"origin": f"http://{HERE}"})):
        with pytest.raises(Reached):
            ask(keys, headers | origin, kind=kind)


@given(path=st.text(), cookie=st.text(st.characters(max_codepoint=255)), kind=st.sampled_from(["http", "websocket"]))
def test_without_session_nothing_is_reached_whatever_path_and_cookie(path: str, cookie: str, kind: str) -> None:
    keys = Keys()
    signed_in(keys)

    headers = {"host": HERE, "cookie": cookie, "origin": f"http://{HERE}"}
    sent = ask(keys, headers, path=path, kind=kind)

    assert sent[0].get("status") == 403 or sent[0]["type"] == "websocket.close"


@pytest.mark.parametrize(
    "host", ["evil.example", f"evil.example:{PORT}", "127.0.0.1", "127.0.0.1:80", f"[::1]:{PORT}", ""]
)
def test_foreign_host_names_are_refused_even_with_a_session(host: str) -> None:
    keys = Keys()
    headers = signed_in(keys) | {"host": host}

    assert ask(keys, headers)[0]["status"] == 403


@pytest.mark.parametrize("method", ["GET", "POST", "PUT", "DELETE"])
@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", f"https://{HERE}"])
def test_foreign_origins_are_refused_even_with_a_session(method: str, origin: str) -> None:
    keys = Keys()
    headers = signed_in(keys) | {"origin": origin}

    assert ask(keys, headers, method=method)[0]["status"] == 403
    assert ask(keys, headers, kind="websocket")[0]["type"] == "websocket.close"


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_requests_that_other_sites_make_the_browser_send_are_refused(site: str) -> None:
    keys = Keys()

    assert ask(keys, signed_in(keys) | {"sec-fetch-site": site})[0]["status"] == 403


def test_writing_without_an_origin_is_refused() -> None:
    keys = Keys()
    headers = signed_in(keys)

    assert ask(keys, headers, method="POST")[0]["status"] == 403
    assert ask(keys, headers, kind="websocket")[0]["type"] == "websocket.close"


def test_token_opens_one_session_and_no_second() -> None:
    keys = Keys()
    query = f"token={keys.token}"

    first = ask(keys, {"host": HERE}, query=query)[0]
    second = ask(keys, {"host": HERE}, query=query)[0]

    cookie = dict(first["headers"])[b"set-cookie"].decode()
    assert first["status"] == 200 and second["status"] == 403
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
    with pytest.raises(Reached):
        ask(keys, {"host": HERE, "cookie": cookie.partition(";")[0]})


def test_used_link_still_leads_its_own_user_in() -> None:
    keys = Keys()
    query = f"token={keys.token}"
    headers = signed_in(keys)

    assert ask(keys, headers, query=query)[0]["status"] == 200
    assert ask(keys, {"host": HERE}, query=query)[0]["status"] == 403


def test_looking_at_the_link_with_head_does_not_use_it_up() -> None:
    keys = Keys()
    query = f"token={keys.token}"

    assert ask(keys, {"host": HERE}, query=query, method="HEAD")[0]["status"] == 403
    assert ask(keys, {"host": HERE}, query=query)[0]["status"] == 200


@given(st.text())
def test_wrong_tokens_open_nothing_and_leave_the_right_one(token: str) -> None:
    keys = Keys()

    assert keys.exchange(token) is None
    assert keys.token is not None and keys.exchange(keys.token) is not None


def test_longer_requests_than_the_limit_are_refused_before_they_are_read() -> None:
    keys = Keys()
    headers = signed_in(keys) | {"origin": f"http://{HERE}", "content-length": str(LIMIT + 1)}

    assert ask(keys, headers, method="POST")[0]["status"] == 413


def upload_through_the_gate(application: Any, messages: list[dict[str, Any]]) -> None:
    """A PUT whose messages end with those given; the application behind is another one."""
    keys = Keys()
    headers = signed_in(keys) | {"origin": f"http://{HERE}"}
    raw = [(name.encode(), value.encode("latin-1")) for name, value in headers.items()]
    scope = {
        **{"type": "http", "path": "/", "raw_path": b"/", "root_path": "", "query_string": b"", "headers": raw},
        **{"method": "PUT", "asgi": {"version": "3.0", "spec_version": "2.3"}, "http_version": "1.1", "scheme": "http"},
    }
    waiting = list(messages)

    async def receive() -> Any:
        return waiting.pop(0) if len(waiting) > 1 else waiting[0]

    async def send(message: Any) -> None:
        pass

    finished(Gate(application, PORT, keys, LIMIT)(scope, receive, send))


PART, GONE = {"type": "http.request", "body": b"x", "more_body": True}, {"type": "http.disconnect"}
WHOLE = {"type": "http.request", "body": b"x", "more_body": False}


def test_a_browser_that_leaves_in_the_middle_of_an_upload_is_no_error_of_the_server() -> None:
    from fastapi import FastAPI, Request
    from starlette.middleware.base import BaseHTTPMiddleware
    from starlette.responses import PlainTextResponse, Response

    class Layer(BaseHTTPMiddleware):
        async def dispatch(self, request: Request, call_next: Any) -> Any:
            return await call_next(request)

    application = FastAPI()
    application.add_middleware(Layer)

    @application.put("/")
    async def upload(request: Request) -> Response:
        return PlainTextResponse(str(len(await request.body())))

    upload_through_the_gate(application, [PART, GONE])


@pytest.mark.parametrize("messages", [[PART, GONE], [WHOLE]])
def test_an_error_counts_as_long_as_the_browser_is_there(messages: list[dict[str, Any]]) -> None:
    async def silent(scope: Any, receive: Any, send: Any) -> None:
        for _ in messages:
            await receive()
        raise RuntimeError("No response returned.")

    if messages[-1] is GONE:
        upload_through_the_gate(silent, messages)
    else:
        with pytest.raises(RuntimeError, match="No response returned"):
            upload_through_the_gate(silent, messages)
