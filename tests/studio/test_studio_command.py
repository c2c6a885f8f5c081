"""`misfit studio` as a user starts it."""

import socket
import stat
import subprocess
import sys
import urllib.parse
from collections.abc import Callable
from pathlib import Path

import pytest
from studio_process import Studio

from orchestrator.studio import browser


def test_first_line_is_the_link_with_a_token_and_ctrl_c_ends_it_well(
    start_studio: Callable[..., Studio], tmp_path: Path
) -> None:
    studio = start_studio(tmp_path)
    address = urllib.parse.urlsplit(studio.link)

    assert address.hostname == "127.0.0.1" and len(urllib.parse.parse_qs(address.query)["token"][0]) >= 43
    studio.process.send_signal(2)
    assert studio.process.wait(timeout=30) in (0, 130)


def test_port_that_is_taken_is_told_in_one_line(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = str(other.getsockname()[1])
        command = [sys.executable, "-m", "orchestrator.cli", "studio", "--no-browser", "--port", port]
        done = subprocess.run(
            [*command, "--workspace", str(tmp_path)], capture_output=True, text=True, check=False, timeout=60
        )

    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.count("\n") == 1 and f"port {port} cannot be used" in done.stderr


def test_browser_gets_the_token_by_a_private_file_that_is_gone_afterwards(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    monkeypatch.setattr(browser.webbrowser, "open", opened.append)

    with browser.browser_opened("http://127.0.0.1:1/?token=secret", tmp_path):
        [file] = tmp_path.iterdir()
        assert stat.S_IMODE(file.stat().st_mode) == 0o600 and "token=secret" in file.read_text()

    assert opened == [file.as_uri()] and "secret" not in opened[0]
    assert list(tmp_path.iterdir()) == []
