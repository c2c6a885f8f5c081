"""A studio in a child process, as tests start it."""

import http.cookiejar
import os
import subprocess
import sys
import threading
import urllib.request
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PATIENCE_S = 180.0
ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Studio:
    """A running studio: `link` is its first printed line, `url` its address without the token (no slash at the end)."""

    link: str
    workspace: Path
    process: "subprocess.Popen[str]"

    @property
    def url(self) -> str:
        return self.link.partition("/?")[0]

    def stop(self) -> None:
        self.process.terminate()
        try:
            self.process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait(timeout=10)
        assert self.process.stdout is not None
        self.process.stdout.close()


def start(workspace: Path, **environment: str) -> Studio:
    """Start `misfit studio` on a free port; one that says nothing for so long is ended, and its link is empty."""
    command = [sys.executable, "-m", "orchestrator.cli", "studio", "--no-browser", "--port", "0"]
    process = subprocess.Popen(
        [*command, "--workspace", str(workspace)],
        cwd=ROOT,
        env={**os.environ, "PYTHONUNBUFFERED": "1", **environment},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    impatience = threading.Timer(PATIENCE_S, process.kill)
    impatience.start()
    link = process.stdout.readline().strip()
    impatience.cancel()
    return Studio(link, workspace, process)


def sign_in(studio: Studio) -> dict[str, Any]:
    """Use the one-time link as a browser does; the session cookie in Playwright's form."""
    jar = http.cookiejar.CookieJar()
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(jar))
    with opener.open(studio.link, timeout=PATIENCE_S):
        pass
    [cookie] = jar
    return {"name": cookie.name, "value": cookie.value, "url": studio.url}
