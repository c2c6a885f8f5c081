"""Frame times of a plot while it is dragged and zoomed in a headless Chromium, and what each refetch costs."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from playwright.sync_api import Page, sync_playwright

from tests.chromium import FLAGS, program

RECORD = """() => {
  window.gaps = []; window.recording = true;
  let last = performance.now();
  const tick = (now) => { window.gaps.push(now - last); last = now; if (window.recording) requestAnimationFrame(tick); };
  requestAnimationFrame(tick);
}"""
STOP = "() => { window.recording = false; return window.gaps.slice(1); }"
FETCHES = """() => performance.getEntriesByType('resource').filter((e) => e.name.includes('/views/curves/')).map((e) => ({
  server: e.serverTiming.find((t) => t.name === 'view')?.duration ?? NaN, bytes: e.encodedBodySize, all: e.duration }))"""


@dataclass(frozen=True)
class Figures:
    """Gaps between frames, ms; CPU that the page spends on each, ms; of each refetch the server's own ms, bytes, and ms until they were here."""

    what: str
    gaps: np.ndarray
    work: float
    server: np.ndarray
    size: np.ndarray
    delay: np.ndarray

    def row(self) -> str:
        """One line of the table."""
        quantiles = "  ".join(
            f"{np.median(x):6.1f} {np.quantile(x, 0.95):6.1f}" for x in (self.gaps, self.server, self.delay)
        )
        return f"{self.what:22} {len(self.gaps):4d} {self.work:6.1f}  {quantiles}  {len(self.size):4d} {self.size.max() / 1e3:8.1f}"


HEADER = (
    f"{'':22} {'':4} {'CPU,':>6}  {'frame gap, ms':13}  {'server, ms':13}  {'refetch, ms':13}  {'':4} {'largest':>8}\n"
    f"{'':22} {'n':>4} {'ms':>6}  {'median':>6} {'p95':>6}  {'median':>6} {'p95':>6}  {'median':>6} {'p95':>6}  {'n':>4} {'kB':>8}"
)


@contextmanager
def opened(address: str) -> Iterator[Page]:
    """The page in a headless Chromium, its curves drawn."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program(), args=FLAGS)
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(address)
        page.wait_for_function(
            "performance.getEntriesByType('resource').some((e) => e.name.includes('/views/curves/'))"
        )
        page.locator(".view-plot").first.evaluate("(element) => element.scrollIntoView({ block: 'center' })")
        page.wait_for_timeout(2000)
        yield page
        browser.close()


def resting(page: Page) -> Figures:
    """Do nothing for a second: what frames cost on this machine now."""
    begun = _begin(page)
    page.wait_for_timeout(1000)
    return _end(page, "at rest", begun)


def dragging(page: Page, moves: int) -> Figures:
    """Drag to and fro."""
    x, y = _middle(page)
    page.mouse.move(x, y)
    page.mouse.down()
    begun = _begin(page)
    for k in range(moves):
        page.mouse.move(x - 300 * np.sin(2 * np.pi * k / moves), y)
        page.wait_for_timeout(8)
    found = _end(page, "drag to and fro", begun)
    page.mouse.up()
    return found


def zooming(page: Page, turns: int, inwards: bool) -> Figures:
    """Turn the wheel with the control key held."""
    page.mouse.move(*_middle(page))
    page.keyboard.down("Control")
    begun = _begin(page)
    for _ in range(turns):
        page.mouse.wheel(0, -100 if inwards else 100)
        page.wait_for_timeout(30)
    found = _end(page, f"zoom {'in' if inwards else 'out'}", begun)
    page.keyboard.up("Control")
    return found


def _middle(page: Page) -> tuple[float, float]:
    box = page.locator(".view-plot").first.bounding_box()
    assert box is not None
    return box["x"] + 0.5 * box["width"], box["y"] + 130


def _begin(page: Page) -> float:
    page.evaluate("() => { performance.clearResourceTimings(); performance.setResourceTimingBufferSize(5000); }")
    page.evaluate(RECORD)
    return _cpu(page)


def _cpu(page: Page) -> float:
    """Seconds of CPU that the processes which draw pages have spent, with all their threads."""
    browser = page.context.browser
    assert browser is not None
    processes = browser.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]
    return sum(float(process["cpuTime"]) for process in processes if process["type"] == "renderer")


def _end(page: Page, what: str, begun: float) -> Figures:
    gaps = np.array(page.evaluate(STOP))
    work = 1e3 * (_cpu(page) - begun) / len(gaps)
    page.wait_for_timeout(300)
    fetches = page.evaluate(FETCHES)
    server, size, delay = (np.array([f[key] for f in fetches] or [np.nan]) for key in ("server", "bytes", "all"))
    return Figures(what, gaps, work, server, size, delay)
