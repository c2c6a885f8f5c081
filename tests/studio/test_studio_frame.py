"""The frame that every page stands in."""

from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Page, expect
from studio_process import Studio


def test_start_page_has_header_navigation_main_part_and_footer(
    tab: Page, studio: Studio, screenshot: Callable[[Page, str], Path]
) -> None:
    tab.goto(f"{studio.url}/")

    expect(tab.get_by_role("banner")).to_have_count(1)
    expect(tab.get_by_role("navigation")).to_have_count(1)
    expect(tab.get_by_role("main")).to_have_count(1)
    expect(tab.get_by_role("contentinfo")).to_have_count(1)
    expect(tab.get_by_role("link", name="Projects")).to_have_attribute("aria-current", "page")
    screenshot(tab, "start_empty")


def test_no_bar_without_a_name_is_drawn_while_a_request_is_under_way(tab: Page, studio: Studio) -> None:
    tab.goto(f"{studio.url}/")
    tab.wait_for_load_state("networkidle")
    tab.route("**/slow", lambda route: None)  # never answered
    tab.evaluate("() => { const r = new XMLHttpRequest(); r.open('GET', '/slow'); r.send(); }")
    tab.wait_for_timeout(300)  # the bar would come with the request, and be there until it is answered
    expect(tab.locator(".q-loading-bar:not([aria-hidden=true])")).to_have_count(0)


def test_an_address_without_a_page_leads_to_the_start_page(tab: Page, studio: Studio) -> None:
    answer = tab.goto(f"{studio.url}/nowhere")

    assert answer is not None and answer.status == 404
    tab.get_by_role("link", name="Go to the start page").click()
    expect(tab.get_by_role("link", name="Projects")).to_have_attribute("aria-current", "page")
