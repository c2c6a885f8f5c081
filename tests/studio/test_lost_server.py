"""A tab whose server has ended says what to do."""

from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Browser, Locator, Page, expect
from studio_process import Studio, sign_in


def test_tabs_say_what_to_do_when_the_studio_has_ended(
    browser: Browser, start_studio: Callable[..., Studio], tmp_path: Path
) -> None:
    """One that was connected, and one whose socket never came about."""
    studio = start_studio(tmp_path)
    window = browser.new_context()
    window.add_cookies([sign_in(studio)])  # type: ignore[list-item]
    connected, alone = window.new_page(), window.new_page()
    alone.route_web_socket("**/_nicegui_ws/**", lambda socket: socket.close())
    alone.route("**/_nicegui_ws/**", lambda route: route.abort())
    for tab in (connected, alone):
        tab.clock.install()
        tab.goto(studio.url)
        expect(tab.get_by_role("button", name="New project")).to_be_visible(timeout=30_000)
    connected.wait_for_function("() => window.socket?.connected")
    assert not told(connected).is_visible()
    studio.process.kill()
    studio.process.wait()

    for tab in (connected, alone):
        tab.wait_for_function("() => !window.socket?.connected")
        tab.clock.run_for(3_500)  # they ask every three seconds
        expect(told(tab)).to_be_visible(timeout=60_000)
    window.close()


def told(tab: Page) -> Locator:
    return tab.get_by_text("Start 'misfit studio' again and open the link that it prints")
