"""A tab whose server has ended says what to do."""

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect
from studio_process import Studio, sign_in


@pytest.mark.parametrize("connected", [True, False])
def test_a_tab_says_what_to_do_when_the_studio_has_ended(
    browser: Browser, start_studio: Callable[..., Studio], tmp_path: Path, connected: bool
) -> None:
    studio = start_studio(tmp_path)
    window = browser.new_context()
    window.add_cookies([sign_in(studio)])  # type: ignore[list-item]
    tab = window.new_page()
    if not connected:
        tab.route_web_socket("**/_nicegui_ws/**", lambda socket: socket.close())
        tab.route("**/_nicegui_ws/**", lambda route: route.abort())
    tab.goto(studio.url)
    expect(tab.get_by_role("button", name="New project")).to_be_visible(timeout=30_000)
    if connected:
        tab.wait_for_function("() => window.socket?.connected")
    studio.process.kill()

    told = tab.get_by_text("Start 'misfit studio' again and open the link that it prints")
    expect(told).to_be_visible(timeout=60_000)
    window.close()
