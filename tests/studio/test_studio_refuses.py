"""A running studio refuses whoever is not its user, on every kind of route."""

import http.client
import socket
import urllib.parse
from typing import Any

import pytest
from studio_process import Studio

from orchestrator.studio.gate import HOSTS
from orchestrator.studio.workspace import Workspace

ROUTES = [
    ("GET", "/"),
    ("GET", "/project/abcdefghjk"),
    ("GET", "/project/abcdefghjk/download/report.html"),
    ("PUT", "/project/abcdefghjk/upload/model?name=a.fmu"),
    ("GET", "/studio/upload.js"),
    ("GET", "/_nicegui/3.18.0/static/nicegui.js"),
    ("GET", "/_nicegui_ws/socket.io/?EIO=4&transport=polling"),
    ("POST", "/_nicegui_ws/socket.io/?EIO=4&transport=polling"),
    ("GET", "/favicon.ico"),
    ("GET", "/docs"),
    ("GET", "/openapi.json"),
    ("GET", "/nowhere"),
]
WEBSOCKET = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}
SOCKET_PATH = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"


def ask(
    studio: Studio, method: str, path: str, headers: dict[str, str], body: bytes | None = None
) -> tuple[int, dict[str, str], bytes]:
    address = urllib.parse.urlsplit(studio.url).netloc
    connection = http.client.HTTPConnection(address, timeout=20)
    try:
        connection.request(method, path, body=body, headers=headers)
        answer = connection.getresponse()
        content = answer.read() if answer.status != 101 else b""
        return answer.status, {name.lower(): value for name, value in answer.getheaders()}, content
    finally:
        connection.close()


@pytest.fixture
def signed_in(studio: Studio, session_cookie: dict[str, Any]) -> dict[str, str]:
    return {"Cookie": f"{session_cookie['name']}={session_cookie['value']}", "Origin": studio.url}


@pytest.mark.parametrize(("method", "path"), ROUTES)
def test_every_route_is_closed_without_the_cookie(studio: Studio, method: str, path: str) -> None:
    status, _, body = ask(studio, method, path, {"Origin": studio.url})

    assert status == 403 and b"misfit studio" in body


@pytest.mark.parametrize("change", [{"Cookie": ""}, {"Origin": "http://evil.example"}, {"Host": "evil.example"}])
def test_websocket_needs_cookie_origin_and_host(
    studio: Studio, signed_in: dict[str, str], change: dict[str, str]
) -> None:
    good, *_ = ask(studio, "GET", SOCKET_PATH, WEBSOCKET | signed_in)
    bad, *_ = ask(studio, "GET", SOCKET_PATH, WEBSOCKET | signed_in | change)

    assert (good, bad) == (101, 403)


def test_pages_carry_a_policy_that_keeps_everything_here(studio: Studio, signed_in: dict[str, str]) -> None:
    status, headers, _ = ask(studio, "GET", "/", signed_in)
    rules = dict(rule.strip().split(" ", 1) for rule in headers["content-security-policy"].split(";"))

    assert status == 200
    assert rules["default-src"] == "'self'" and rules["frame-ancestors"] == "'none'" and rules["object-src"] == "'none'"
    sources = {source for rule in rules.values() for source in rule.split() if ":" in source and "//" in source}
    assert all(urllib.parse.urlsplit(source).netloc.partition(":")[0] in HOSTS for source in sources)
    assert headers["x-content-type-options"] == "nosniff"


def test_server_listens_on_127_0_0_1_only(studio: Studio) -> None:
    port = urllib.parse.urlsplit(studio.url).port
    assert port is not None

    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.2", port), timeout=5)


@pytest.mark.parametrize(
    "name",
    [
        "project.json",
        "..%2fproject.json",
        "%2e%2e%2fproject.json",
        "%2fetc%2fpasswd",
        "..%5cproject.json",
        "%00",
        "diagnosis.pickle",
    ],
)
def test_downloads_offer_results_of_the_project_and_nothing_else(
    studio: Studio, signed_in: dict[str, str], name: str
) -> None:
    project = Workspace(studio.workspace).create("a project")
    (project.results / "report.html").write_text("<p>a report</p>")

    offered = ask(studio, "GET", f"/project/{project.id}/download/report.html", signed_in)
    status, _, body = ask(studio, "GET", f"/project/{project.id}/download/{name}", signed_in)

    assert offered[0] == 200 and "sandbox" in offered[1]["content-security-policy"]
    assert status == 404 and b"schema" not in body and b"root:" not in body


def test_refused_upload_is_one_line(studio: Studio, signed_in: dict[str, str]) -> None:
    project = Workspace(studio.workspace).create("a project")

    status, _, body = ask(studio, "PUT", f"/project/{project.id}/upload/model?name=x.fmu", signed_in, b"no archive")

    assert status == 400 and body.decode().count("\n") == 0 and b"x.fmu is not an FMU" in body


def test_link_that_was_used_tells_what_to_do(studio: Studio, session_cookie: dict[str, Any]) -> None:
    status, _, body = ask(studio, "GET", studio.link.removeprefix(studio.url), {})

    assert status == 403 and b"Start 'misfit studio' again" in body
