"""Reports in a real browser: nothing is fetched, nothing is refused, axe finds nothing serious, and they print."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from accessibility import grave_violations
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page
from studio_process import ROOT, Studio

from orchestrator.report.arm_drawing import Line, Panel, Replay, replay_html
from orchestrator.report.html import discovery_report, render
from orchestrator.report.page import Page as Report
from orchestrator.report.page import Picture
from orchestrator.studio.workspace import Workspace

sys.path.insert(0, str(Path(__file__).parents[1] / "report"))
from builders import diagnosis, entries  # noqa: E402


def moving() -> Replay:
    time = np.linspace(0, 4, 200)
    q = np.column_stack([0.8 + 0.4 * np.sin(time), 1.2 + 0.5 * np.cos(time)])
    torque = np.column_stack([np.sin(time), -0.7 * np.cos(2 * time)])
    panel = Panel("elbow angle", "rad", (Line("measured", "#000000", q[:, 1]),))
    return Replay(time, q, torque, 0.1 + 0.0 * torque, modelled=q + 0.1, panels=(panel,))


@pytest.fixture(scope="module")
def report(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Page, list[str]]]:
    """A discovery's report in a tab, and what the browser complained of or asked the network for."""
    found = diagnosis(n=200)
    file = tmp_path_factory.mktemp("report") / "report.html"
    file.write_text(discovery_report(found, entries(found), moving()))
    tab, seen = browser.new_page(viewport={"width": 1280, "height": 720}), []
    tab.on("console", lambda message: seen.append(message.text))
    tab.on("pageerror", lambda error: seen.append(str(error)))
    tab.on("request", lambda request: seen.append(request.url))
    tab.goto(file.as_uri())
    yield tab, [line for line in seen if line != file.as_uri() and not line.startswith("data:")]
    tab.close()


def test_a_report_asks_nothing_of_the_network_and_its_replay_works(report: tuple[Page, list[str]]) -> None:
    page, seen = report
    page.locator(".why > summary").click()
    page.get_by_role("slider", name="Time").press("ArrowRight")

    assert seen == []
    assert page.get_by_role("slider", name="Time").get_attribute("aria-valuetext") is not None
    page.locator(".why > summary").click()


def test_on_a_phone_no_table_of_a_report_is_cut_and_its_figures_keep_their_size(report: tuple[Page, list[str]]) -> None:
    """Figures of 900 pixels were shrunk to 360, and tables ended at the edge of the screen."""
    page, _ = report
    page.set_viewport_size({"width": 390, "height": 844})
    page.evaluate("document.querySelectorAll('details').forEach((part) => { part.open = true; })")

    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    cut = "[...document.querySelectorAll('.scroll')].filter((box) => box.scrollWidth > box.clientWidth + 1).length"
    assert page.evaluate(cut) == 0
    assert page.locator(".scroll td:visible").count() == page.locator(".scroll td:visible[data-label]").count() > 0
    assert min(image.bounding_box()["width"] for image in page.locator("figure img").all()) > 650  # type: ignore[index]
    assert [entry for entry in grave_violations(page) if "scrollable" in str(entry)] == []
    page.set_viewport_size({"width": 1280, "height": 720})
    page.evaluate("document.querySelectorAll('details').forEach((part) => { part.open = false; })")


@pytest.mark.parametrize(("scheme", "paper"), [("light", "rgb(255, 255, 255)"), ("dark", "rgb(21, 25, 30)")])
def test_axe_finds_nothing_serious_in_a_report(
    report: tuple[Page, list[str]], scheme: Literal["light", "dark"], paper: str
) -> None:
    page, _ = report
    page.emulate_media(color_scheme=scheme)
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == paper
    if scheme == "dark":
        page.screenshot(path=ROOT / "build" / "screenshots" / "dark_report.png", full_page=True)
    # The report's own policy forbids scripts, as it should; axe comes in through the developer's door.
    answer = Axe().run(page).response
    found = [v for v in answer["violations"] if v["impact"] in ("serious", "critical")]

    assert len(answer["passes"]) > 10
    assert [(v["id"], [node["html"][:120] for node in v["nodes"]]) for v in found] == []


@pytest.mark.parametrize("width", [1280, 768])
def test_a_report_never_scrolls_sideways(report: tuple[Page, list[str]], width: int) -> None:
    page, _ = report
    page.set_viewport_size({"width": width, "height": 720})

    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_behind_the_answer_of_a_report_parts_show_their_heading_until_they_are_opened_or_printed(
    report: tuple[Page, list[str]],
) -> None:
    page, _ = report
    page.set_viewport_size({"width": 1280, "height": 800})
    closed = page.evaluate("document.documentElement.scrollHeight")
    page.locator(".why > summary").click()
    replay = page.locator(".arm-replay").bounding_box()
    picture = page.locator(".why > div figure").first.bounding_box()
    parts = page.locator("details.part:not([open])")

    assert replay is not None and picture is not None and parts.count() >= 4
    assert page.evaluate("document.documentElement.scrollHeight") < closed + replay["height"] + picture["height"] + 1600
    page.emulate_media(media="print")
    assert (parts.last.locator("> div").bounding_box() or {"height": 0})["height"] > 20
    page.emulate_media(media="null")
    page.locator(".why > summary").click()


def test_a_report_prints_with_the_summary_on_a_page_of_its_own(
    report: tuple[Page, list[str]], tmp_path: Path, screenshot: Callable[[Page, str], Path]
) -> None:
    page, _ = report
    page.set_viewport_size({"width": 1280, "height": 720})
    screenshot(page, "report_discovery")
    whole, summary = tmp_path / "whole.pdf", tmp_path / "summary.pdf"
    page.pdf(path=whole, format="A4")
    page.pdf(path=summary, format="A4", page_ranges="1")
    (Path(__file__).parents[2] / "build" / "screenshots" / "report_discovery.pdf").write_bytes(whole.read_bytes())

    page.emulate_media(media="print")
    page.set_viewport_size({"width": 680, "height": 1010})
    height = page.locator(".summary").bounding_box()
    assert height is not None and height["height"] < 1010
    assert page.evaluate("getComputedStyle(document.querySelector('.summary')).breakAfter") == "page"
    assert page.locator("nav").is_hidden() and page.locator(".controls").is_hidden()
    assert whole.stat().st_size > summary.stat().st_size


def test_a_replay_runs_in_a_report_that_the_studio_shows_and_no_other_script_does(tab: Page, studio: Studio) -> None:
    project = Workspace(studio.workspace).create("replay")
    page = render(Report("Arm", "It moves.", None, (), replay=Picture(replay_html(moving(), "Swing"), "")))
    foreign = "<script>document.title = 'taken over'</script></main>"
    (project.results / "report.html").write_text(page.replace("</main>", foreign))
    tab.goto(f"{studio.url}/project/{project.id}/download/report.html")
    tab.get_by_role("slider", name="Time").press("ArrowRight")

    assert tab.get_by_role("slider", name="Time").get_attribute("aria-valuetext") is not None
    assert tab.title() == "Arm"
    assert tab.evaluate("window.origin") == "null"
