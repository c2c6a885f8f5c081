"""A studio of its own for tests, in a child process, and windows of a browser that are signed in to it."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect
from studio_process import ROOT, Studio, sign_in, start

SCREENSHOTS = ROOT / "build" / "screenshots"
# How long a busy machine may take until a page shows what it should; windows have the same limit for what is done in them.
PATIENCE_MS = 60_000
expect.set_options(timeout=PATIENCE_MS)


@pytest.fixture
def start_studio() -> Iterator[Callable[..., Studio]]:
    """Starts studios that end with the test: `start_studio(folder, VARIABLE="value")`."""
    started: list[Studio] = []

    def begin(workspace: Path, **environment: str) -> Studio:
        started.append(start(workspace, **environment))
        return started[-1]

    yield begin
    for studio in started:
        studio.stop()


@pytest.fixture(scope="session")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Studio]:
    """One studio for all tests that need none of their own."""
    running = start(tmp_path_factory.mktemp("workspace"))
    yield running
    running.stop()


@pytest.fixture(scope="session")
def session_cookie(studio: Studio) -> dict[str, Any]:
    """The cookie of the shared studio: its link works once only."""
    return sign_in(studio)


@pytest.fixture
def context(browser: Browser, session_cookie: dict[str, Any]) -> Iterator[BrowserContext]:
    """A window at 1280x720 that is signed in to the shared studio."""
    window = browser.new_context(viewport={"width": 1280, "height": 720})
    window.set_default_timeout(PATIENCE_MS)
    window.add_cookies([session_cookie])
    yield window
    window.close()


@pytest.fixture
def tab(context: BrowserContext) -> Page:
    """An empty tab of that window."""
    return context.new_page()


@pytest.fixture
def screenshot() -> Callable[[Page, str], Path]:
    """Keeps a picture of a tab in build/screenshots."""

    def keep(tab: Page, name: str) -> Path:
        path = SCREENSHOTS / f"{name}.png"
        tab.evaluate("window.scrollTo(0, 0)")
        tab.screenshot(path=path, full_page=True)
        return path

    return keep
