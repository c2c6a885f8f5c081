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
