"""The stop button's server, a process of its own: `python -m hil.stop.server FLAG`.

It answers on this machine only, and only to those who know the token in its address. Of everything that can be asked of it
one thing changes anything: a POST to `stop`, which stops the robot. It ends with its session.
"""

import errno
import hmac
import json
import os
import secrets
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, ClassVar

from fmus.children import child_environment, parent_process, python_command
from hil.stop.flag import StopFlag
from hil.stop.page import READY, page

PULSE_S = 0.1
# A loop that has not seen the button for so long is not going to.
UNSEEN_S = 0.5
_TRIES = 20


class Handler(BaseHTTPRequestHandler):
    """One request."""

    flag: ClassVar[StopFlag]
    timeout = 5.0  # s, for those who connect and say nothing
    server_version, sys_version = "misfit-stop", ""

    def do_GET(self) -> None:
        """The page, or what has become of the press."""
        wanted = self._allowed()
        if wanted == "":
            nonce = secrets.token_urlsafe(16)
            self._answer(200, "text/html; charset=utf-8", page(nonce, words_of(self.flag)[0]), nonce)
        elif wanted == "state":
            words, bad = words_of(self.flag)
            document = {"words": words, "bad": bad, "over": self.flag.is_over, "ready": words.startswith(READY)}
            self._answer(200, "application/json", json.dumps(document).encode())
        elif wanted is not None:
            self._refuse(404, "there is no such page")

    def do_POST(self) -> None:
        """Stop the robot."""
        wanted = self._allowed()
        if wanted is None:
            return
        if wanted != "stop":
            self._refuse(404, "nothing else can be asked for than to stop")
        elif self.headers.get("Origin", self._own) != self._own:
            self._refuse(403, "another site may not press this button")
        else:
            self.flag.press()
            self.send_response(303)
            self.send_header("Location", "./")
            self.send_header("Content-Length", "0")
            self.end_headers()

    @property
    def _own(self) -> str:
        return f"http://{self.headers.get('Host', '')}"

    def _allowed(self) -> str | None:
        """What is asked for behind the token; None, after a refusal, if the token or the host's name is wrong."""
        port = self.flag.port
        if self.headers.get("Host") not in (f"localhost:{port}", f"127.0.0.1:{port}"):
            self._refuse(403, "this machine is called localhost")  # another name may be a foreign site's
            return None
        token, _, wanted = self.path.removeprefix("/").partition("/")
        if not hmac.compare_digest(token.encode(), self.flag.token.encode()):
            self._refuse(403, "the address lacks its token; open the button from the bench view")
            return None
        return wanted

    def _refuse(self, status: int, words: str) -> None:
        self._answer(status, "text/plain; charset=utf-8", f"refused: {words}\n".encode())

    def _answer(self, status: int, kind: str, body: bytes, nonce: str = "") -> None:
        local = "http://localhost:* http://127.0.0.1:*"
        allowed = f"'nonce-{nonce}'" if nonce else "'none'"
        policy = (
            f"default-src 'none'; script-src {allowed}; style-src {allowed}; connect-src 'self'; form-action 'self';"
            f" base-uri 'none'; frame-ancestors {local}"
        )
        self.send_response(status)
        for name, value in (
            ("Content-Type", kind),
            ("Content-Length", str(len(body))),
            ("Cache-Control", "no-store"),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "same-origin"),
            ("Content-Security-Policy", policy),
        ):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing is said in the session's terminal."""


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    # With those five that are usual, a press among many connections may be sent again only after a second.
    request_queue_size = 128

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that hangs up is no news."""


class _Server6(_Server):
    address_family = socket.AF_INET6


def words_of(flag: StopFlag) -> tuple[str, bool]:
    """What the button says of itself, and whether that is bad news."""
    if flag.is_over:
        return "The session has ended, the arm has been let go.", False
    if not flag.is_pressed:
        return (f"{READY} Stops {flag.words}." if flag.words else READY), False
    if (after := flag.seen_after_ms) is not None:
        return f"Stopping: the loop saw it after {after:.1f} ms, the arm is let down over a second.", False
    if flag.unseen_s > UNSEEN_S:
        return "Pressed, but the loop does not answer. Use the pendant on the robot.", True
    return "Pressed.", False


def servers(flag: StopFlag) -> list[ThreadingHTTPServer]:
    """Listen on a free port of 127.0.0.1, and of ::1 where there is one: nobody else may answer for localhost there."""
    handler = type("Bound", (Handler,), {"flag": flag})
    for _ in range(_TRIES):
        first = _Server(("127.0.0.1", 0), handler)
        if not socket.has_ipv6:
            return [first]
        try:
            return [first, _Server6(("::1", first.server_port), handler)]
        except OSError as error:
            if error.errno != errno.EADDRINUSE:  # the port is not taken: this machine has no ::1
                return [first]
            first.server_close()
    raise OSError("no port is free on both 127.0.0.1 and ::1")


def serve(flag: StopFlag) -> None:
    """Serve until told to end, or until the session is gone."""
    parent, ended = parent_process(), threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: ended.set())
    found = servers(flag)
    flag.listen(found[0].server_port)
    for server in found:
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 60.0}, daemon=True).start()
    while not ended.is_set() and os.getppid() == parent:
        flag.live()
        ended.wait(PULSE_S)
    if os.getppid() != parent:  # nobody else is left to do it
        flag.path.unlink(missing_ok=True)


@contextmanager
def stop_button() -> Iterator[StopFlag]:
    """Run one beside a session; it is up a moment later, and the session does not wait for that."""
    flag = StopFlag.create()
    process = subprocess.Popen(
        python_command("hil.stop.server", str(flag.path)),
        env=child_environment(),
        stdin=subprocess.DEVNULL,
        start_new_session=True,  # a closed terminal must not stop it
    )
    try:
        yield flag
    finally:
        flag.finish()
        process.terminate()
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=10)
        flag.remove()


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the session first
    serve(StopFlag(Path(sys.argv[1])))
