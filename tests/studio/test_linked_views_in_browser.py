"""Linked views in a real browser: what is brushed in one shows in the others, with the numbers that numpy gives."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.parse import parse_qs, urlparse
from urllib.request import urlopen

import numpy as np
import pytest
from accessibility import grave_violations
from playwright.sync_api import Browser, Page, Response, ViewportSize

from orchestrator.compare.result import Comparison, SetErrors, TrialCurves
from orchestrator.report.numbers import digits, quantity
from orchestrator.studio.views.store import write

ONE_PAGE = Path(__file__).parents[1] / "studio_views" / "one_page.py"
UNITS, FLOOR, STEP, SAMPLES = {"q1": "rad", "q2": "rad"}, {"q1": 0.01, "q2": 0.01}, 0.002, 30_000
TIME = STEP * np.arange(SAMPLES)
# Like the standard measure (CLS) without what follows an input or a new size of the window: a busy machine may show the
# tab some pixels wide before the browser hears of its size.
SHIFTS = """
new PerformanceObserver((list) => {
  for (const e of list.getEntries().filter((e) => !e.hadRecentInput)) {
    window.shifts = (window.shifts ?? 0) + e.value;
    (window.shifted ??= []).push(
      ...e.sources.map((s) => [s.node?.nodeName + '.' + s.node?.className, s.previousRect.y, s.currentRect.y]));
  }
}).observe({ type: 'layout-shift', buffered: true })
"""


def trial(place: int) -> TrialCurves:
    """The residual of q1 grows with time and with the angle."""
    random = np.random.default_rng(place)
    modelled = {"q1": np.sin(0.5 * TIME + place), "q2": np.cos(0.3 * TIME)}
    error = 0.002 * TIME * (1.5 + modelled["q1"])
    measured = {name: values + error + 0.01 * random.standard_normal(SAMPLES) for name, values in modelled.items()}
    return TrialCurves(f"trial_{place}.csv", "learning", TIME, measured, modelled, {})


CURVES = (trial(0), trial(1))


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A server of one page with the views of these curves."""
    folder = tmp_path_factory.mktemp("one_page") / "views"
    nothing = SetErrors(dict.fromkeys(UNITS, 1.0), 1.0)
    write(folder, Comparison("m", "d", tuple(UNITS), UNITS, FLOOR, (), nothing, None, {}, curves=CURVES))
    command = [sys.executable, str(ONE_PAGE), str(folder)]
    server = subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, start_new_session=True, cwd=Path(__file__).parents[2]
    )
    assert server.stdout is not None
    yield server.stdout.readline().strip()
    server.kill()
    server.wait(timeout=10)
    server.stdout.close()


@pytest.fixture
def size(request: pytest.FixtureRequest) -> ViewportSize:
    """That of a small screen, unless a test asks for another."""
    return getattr(request, "param", {"width": 1280, "height": 720})


@pytest.fixture
def views(browser: Browser, address: str, size: ViewportSize) -> Iterator[Page]:
    """The page, once curves and map are drawn."""
    window = browser.new_context(viewport=size)
    window.set_default_timeout(15_000)
    page = window.new_page()
    page.add_init_script(SHIFTS)
    with page.expect_response("**/views/curves/**"):
        page.goto(address)
    page.locator("section[aria-label='State map'] p", has_text="largest").wait_for()
    yield page
    window.close()


def brush(page: Page, plot: str, one: tuple[float, float], other: tuple[float, float]) -> None:
    """Drag with the shift key over a plot, from one to another share of its width and height."""
    target = page.locator(plot).first
    target.evaluate("(element) => element.scrollIntoView({ block: 'center' })")
    box = target.bounding_box()
    assert box is not None
    ends = [(box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in (one, other)]
    page.keyboard.down("Shift")
    page.mouse.move(*ends[0])
    page.mouse.down()
    page.mouse.move(*ends[1], steps=4)
    page.mouse.up()
    page.keyboard.up("Shift")


def cells(page: Page, title: str) -> list[str]:
    """The first row of a table, which may be folded away."""
    row = page.locator(f"[aria-label='Table: {title}'] tbody tr").first
    return row.locator("th, td").all_text_contents()


def entered(page: Page, label: str) -> float:
    return float(page.get_by_label(label, exact=True).input_value())


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def residual(curves: TrialCurves) -> np.ndarray:
    return curves.measured["q1"] - curves.modelled["q1"]


def test_brushing_a_time_changes_numbers_and_map_as_numpy_says(views: Page) -> None:
    brush(views, ".view-plot", (0.3, 0.3), (0.6, 0.4))
    views.locator("section[aria-label='State map'] p", has_text="where selected").wait_for()
    low, high = entered(views, "from, s"), entered(views, "to, s")
    time = CURVES[0].time
    inside = (time >= low) & (time <= high)
    parts = np.concatenate([residual(c)[inside] for c in CURVES])
    row = cells(views, "Errors of the selection")

    assert 10 < low < 20 < 30 < high < 45
    assert row[3:5] == [quantity(rms(parts), "rad"), digits(rms(parts) / 0.01)]
    assert row[1] == quantity(rms(np.concatenate([residual(c) for c in CURVES])), "rad")
    worst = _worst_box(views, inside)
    assert cells(views, "Boxes with the largest errors")[1] == quantity(worst, "rad")


def _worst_box(page: Page, inside: np.ndarray) -> float:
    """The largest rms among boxes of the map's two coordinates, by a histogram of numpy."""
    assert page.get_by_label("Across", exact=True).input_value() == "q1"
    page.get_by_label("Upwards", exact=True).click()
    page.get_by_role("option", name="q2", exact=True).click()
    page.locator("section[aria-label='State map'] p", has_text="q1 and q2").wait_for()
    x, y, e = (
        np.concatenate(part)
        for part in (
            [c.measured["q1"] for c in CURVES],
            [c.measured["q2"] for c in CURVES],
            [residual(c) for c in CURVES],
        )
    )
    edges = [np.linspace(x.min(), x.max(), 25), np.linspace(y.min(), y.max(), 17)]
    keep = np.tile(inside, 2)
    count, total = (np.histogram2d(x[keep], y[keep], edges, weights=weights)[0] for weights in (None, e[keep] ** 2))
    return float(np.sqrt(np.nanmax(np.where(count > 0, total / np.maximum(count, 1), np.nan))))


def test_a_region_brushed_or_entered_changes_the_numbers_as_numpy_says(views: Page) -> None:
    brush(views, ".view-map .view-plot", (0.5, 0.1), (0.8, 0.8))
    views.locator("section[aria-label='Selection'] p", has_text="where selected").wait_for()
    brushed = [entered(views, f"across, {end}") for end in ("from", "to")]
    # The speed is an estimate that depends on smoothing, so the region is made to hold every speed.
    for label, value in (
        ("across, from", "0.1"),
        ("across, to", "0.5"),
        ("upwards, from", "-99"),
        ("upwards, to", "99"),
    ):
        views.get_by_label(label, exact=True).fill(value)
    views.get_by_label("upwards, to", exact=True).press("Enter")
    inside = np.concatenate([residual(c)[(c.measured["q1"] >= 0.1) & (c.measured["q1"] <= 0.5)] for c in CURVES])
    count = views.locator(
        "[aria-label='Table: Errors of the selection'] td", has_text=f"{len(inside)} of {2 * SAMPLES}"
    )
    count.first.wait_for(state="attached")

    assert -1 < brushed[0] < 0.2 < brushed[1] < 1.1
    assert cells(views, "Errors of the selection")[3] == quantity(rms(inside), "rad")


def test_a_time_is_selected_and_cleared_by_keyboard_alone(views: Page) -> None:
    views.get_by_label("from, s", exact=True).fill("20")
    views.get_by_label("to, s", exact=True).fill("25")
    views.get_by_label("to, s", exact=True).press("Enter")
    expected = np.concatenate([residual(c)[(TIME >= 20) & (TIME <= 25)] for c in CURVES])
    views.locator("section[aria-label='Selection'] p", has_text=f"q1: {quantity(rms(expected), 'rad')} rms").wait_for()
    views.locator(".view-plot").first.press("Escape")
    views.locator("section[aria-label='Selection'] p", has_text="Nothing is selected").wait_for()

    assert views.get_by_label("from, s", exact=True).input_value() == ""


def test_a_range_that_cannot_be_is_refused_in_words(views: Page) -> None:
    views.get_by_label("from, s", exact=True).fill("5")
    views.get_by_label("to, s", exact=True).fill("2")
    views.get_by_role("button", name="Select this time").click()

    views.get_by_text("time from 5 to 2 s is empty").wait_for()


def test_after_a_zoom_only_what_is_in_sight_is_fetched(views: Page) -> None:
    plot = views.locator(".view-plot").first
    plot.focus()
    for _ in range(6):
        with views.expect_response("**/views/curves/**") as answer:
            plot.press("+")
        views.wait_for_timeout(50)
    with views.expect_response(_asks_for_all_columns) as answer:
        plot.press("ArrowLeft")
    low, high, columns = (float(value) for value in _asked(answer.value))
    head, content = _head(answer.value.body())
    for entry in head["trials"]:
        time = head["from"] + np.frombuffer(content, "<f4", entry["count"])
        content = content[16 * entry["count"] + -(-entry["count"] // 4) * 4 :]
        block = STEP * 2 ** max(0, np.ceil(np.log2((high - low) / STEP / columns)))

        assert time.min() >= low - 2 * block and time.max() <= high + 2 * block
        assert entry["count"] <= 2 * (columns + 1)
    assert high - low < 10


def _asks_for_all_columns(response: Response) -> bool:
    return "/views/curves/" in response.url and _asked(response)[2] > 1000


def _asked(response: Response) -> list[float]:
    query = parse_qs(urlparse(response.url).query)
    return [float(query[name][0]) for name in ("low", "high", "columns")]


def _head(content: bytes) -> tuple[dict[str, Any], bytes]:
    length = int.from_bytes(content[:4], "little")
    return json.loads(content[4 : 4 + length]), content[4 + length :]


@pytest.mark.parametrize(
    ("source", "status"),
    [
        ("nobodys-key?low=0&high=1&columns=500", 404),
        ("any?low=nan&high=1&columns=500", 422),
        ("any?low=0&high=1&columns=9999999", 422),
    ],
)
def test_curves_are_had_by_their_key_and_within_limits_only(address: str, source: str, status: int) -> None:
    with pytest.raises(HTTPError) as refused:
        urlopen(f"{address}views/curves/{source}", timeout=10)

    assert refused.value.code == status
    refused.value.close()


@pytest.mark.parametrize("size", [{"width": 1280, "height": 720}, {"width": 820, "height": 1180}], indirect=True)
def test_the_page_is_accessible_fits_and_does_not_jump(
    views: Page, size: ViewportSize, screenshot: Callable[[Page, str], Path]
) -> None:
    screenshot(views, f"linked-views-{size['width']}")

    assert views.evaluate("window.shifts ?? 0") < 0.1, views.evaluate("window.shifted")
    assert views.evaluate("document.documentElement.scrollWidth") <= size["width"]
    assert grave_violations(views) == []
