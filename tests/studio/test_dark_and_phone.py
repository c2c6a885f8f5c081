"""Pages follow a system that asks for dark ones, and fit a phone with all that their tables hold."""

import json

import pytest
from accessibility import grave_violations
from playwright.sync_api import Browser, Page, expect
from studio_process import ROOT, Studio
from test_first_screen import document_of, project_of

PHONE = {"width": 390, "height": 844}
CLIPPED = """() => [...document.querySelectorAll('.view-scroll, pre')]
  .filter((box) => box.scrollWidth > box.clientWidth + 1).map((box) => box.ariaLabel || box.className)"""


# Letters of drawings, in pixels of the screen, that are smaller than a reader of a phone can make out.
SMALL = """(least) => [...document.querySelectorAll('svg text')].filter((text) => text.getClientRects().length)
  .map((text) => [text.textContent, parseFloat(getComputedStyle(text).fontSize) * text.getScreenCTM().a])
  .filter(([, size]) => size < least)"""


def open_why(tab: Page, studio: Studio) -> None:
    tab.goto(f"{studio.url}/project/{project_of(studio, document_of('arm')).id}")
    tab.get_by_role("button", name="Why do you think so?").click()
    expect(tab.locator(".steps-drawing")).to_be_visible()


@pytest.mark.parametrize("page", ["/", "/swap", "/bench", "/recordings"])
def test_pages_fit_a_phone(page: str, tab: Page, studio: Studio) -> None:
    tab.set_viewport_size(PHONE)
    tab.goto(f"{studio.url}{page}")
    expect(tab.locator("h1")).to_be_visible()

    # Outlasts a page that loads itself again, as it does after a lost connection on a busy machine.
    tab.wait_for_function(f"document.documentElement.scrollWidth <= {PHONE['width']}")


def test_no_table_of_a_result_is_clipped_on_a_phone_and_each_cell_says_its_column(tab: Page, studio: Studio) -> None:
    tab.set_viewport_size(PHONE)
    open_why(tab, studio)
    for summary in tab.locator("#why details > summary").all():
        summary.click()
    tab.screenshot(path=ROOT / "build" / "screenshots" / "phone_why.png", full_page=True)

    assert tab.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    assert tab.evaluate(CLIPPED) == []
    cell = tab.locator("td[data-label='90 % interval']").first
    before = cell.evaluate("(cell) => getComputedStyle(cell, '::before').content")
    assert json.loads(before) == "90 % interval: "


@pytest.mark.parametrize("width", [360, 390, 820, 1280])
def test_letters_of_drawings_are_large_enough_on_every_screen(width: int, tab: Page, studio: Studio) -> None:
    """On a phone those of the wide pictures had 5 pixels, those of the versions too."""
    tab.set_viewport_size({"width": width, "height": 800})
    open_why(tab, studio)
    tab.screenshot(path=ROOT / "build" / "screenshots" / f"letters_{width}.png", full_page=True)

    assert tab.locator(".answer svg:visible").count() >= 3
    assert tab.evaluate(SMALL, 9) == []
    assert tab.evaluate("document.documentElement.scrollWidth") <= width


def test_what_was_drawn_on_white_is_dark_on_a_dark_page(tab: Page, studio: Studio) -> None:
    tab.emulate_media(color_scheme="dark")
    open_why(tab, studio)

    expect(tab.locator(".steps-drawing")).to_have_css("filter", "invert(0.91) hue-rotate(180deg)")
    assert grave_violations(tab) == []


def test_a_page_without_a_session_says_in_a_page_what_to_do(browser: Browser, studio: Studio) -> None:
    window = browser.new_context(viewport={"width": 1280, "height": 800})
    tab = window.new_page()
    answer = tab.goto(f"{studio.url}/project/abcdefghij")
    assert answer is not None and answer.status == 403
    expect(tab.get_by_role("heading", name="misfit studio")).to_be_visible()
    expect(tab.get_by_text("Open the link that 'misfit studio' printed first.")).to_be_visible()
    assert grave_violations(tab) == []
    window.close()
