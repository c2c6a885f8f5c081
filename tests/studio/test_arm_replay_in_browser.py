"""The replay's script in a real browser: it draws what Python draws, and can be operated by mouse and keyboard."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from orchestrator.report.arm_drawing import (
    Instant,
    Line,
    Panel,
    Replay,
    Scales,
    arm_svg,
    replay_html,
    replay_script,
    replay_style,
)
from orchestrator.report.palette import css_variables

COUNT = 101


def swing() -> Replay:
    """A motion with everything in it, through a straight elbow, so that strings change sides."""
    time = np.linspace(2.0, 4.0, COUNT)
    part = time - 2.0
    q = np.column_stack([0.9 * part - 0.2, 1.4 * np.sin(1.4 * part) - 0.05])
    torque = np.column_stack([np.sin(3 * part), -0.7 * np.cos(2 * part)])
    activation = np.column_stack([0.5 + 0.5 * np.sin(part + k) for k in range(6)])
    force = np.column_stack([5 * np.cos(part), -3 * part])
    panel = Panel("elbow angle", "rad", (Line("measured", "#000000", q[:, 1]),))
    return Replay(time, q, torque, 0.1 * np.abs(torque), force, activation, q + 0.1, (panel,))


@pytest.fixture
def page(browser: Browser, tmp_path: Path) -> Iterator[Page]:
    file = tmp_path / "replay.html"
    body = f"<style>{css_variables()}{replay_style()}</style>{replay_html(swing(), 'Swing')}"
    file.write_text(f"<!doctype html><meta charset=utf-8>{body}<script>{replay_script()}</script>")
    tab = browser.new_page(viewport={"width": 1000, "height": 700}, reduced_motion="reduce")
    errors: list[str] = []
    tab.on("pageerror", lambda error: errors.append(str(error)))
    tab.goto(file.as_uri())
    yield tab
    tab.close()
    assert errors == []


def numbers(text: str) -> np.ndarray:
    return np.array([float(x) for x in re.findall(r"-?\d+(?:\.\d+)?", text)])


def parts(svg: str) -> dict[str, list[str]]:
    names = ("link", "muscle", "ghost", "torque", "spread", "force")
    return {name: re.findall(rf'class="{name}" d="([^"]*)"', svg) for name in names}


@pytest.mark.parametrize("sample", [0, 3, 30, 77, 100])
def test_script_draws_what_python_draws(page: Page, sample: int) -> None:
    motion = swing()
    instants: list[Instant] = [motion.instant(k) for k in motion.frames()]
    expected = parts(arm_svg(motion.instant(sample), motion.shape, Scales.of(motion.shape, instants)))

    page.evaluate("t => document.querySelector('.arm-replay').misfitShow(t)", float(motion.time[sample]))
    drawn = parts(page.locator("svg.arm").evaluate("svg => svg.outerHTML"))

    for name, paths in expected.items():
        assert len(paths) == len(drawn[name])
        for mine, theirs in zip(paths, drawn[name], strict=True):
            assert re.sub(r"[-\d.]+", "", mine) == re.sub(r"[-\d.]+", "", theirs), name
            # Angles travel to 1e-4 rad, over at most 0.65 m, and coordinates to 0.1 mm.
            np.testing.assert_allclose(numbers(theirs), numbers(mine), atol=0.35)


def clock(page: Page) -> float:
    return float((page.locator("output").text_content() or "").removesuffix(" s"))


def test_slider_obeys_the_keyboard_and_moves_the_mark_in_the_curves(page: Page) -> None:
    slider = page.get_by_role("slider", name="Time")
    slider.focus()
    page.evaluate("document.querySelector('.arm-replay').misfitShow(2)")
    left = float(page.locator(".now").get_attribute("x1") or "nan")
    for _ in range(10):
        slider.press("ArrowRight")

    assert clock(page) == pytest.approx(2.2, abs=0.006)
    assert slider.get_attribute("aria-valuetext") == "2.20 seconds"
    svg = page.locator("svg.curves")
    width = float(svg.get_attribute("data-right") or "nan") - left
    assert float(page.locator(".now").get_attribute("x1") or "nan") == pytest.approx(left + 0.1 * width, abs=0.5)


def test_it_does_not_play_by_itself_and_plays_to_the_end_when_asked(page: Page) -> None:
    begun = clock(page)
    page.wait_for_timeout(150)
    assert clock(page) == begun

    page.evaluate("document.querySelector('.arm-replay').misfitShow(3.6)")
    page.get_by_role("button", name="Play").click()
    page.get_by_role("button", name="Pause").wait_for()
    page.get_by_role("button", name="Play").wait_for(timeout=5000)

    assert clock(page) == 4.0


def test_who_wants_less_motion_sees_few_pictures(page: Page) -> None:
    count = """() => new Promise(done => {
        const seen = new Set(), link = document.querySelector('.link');
        new MutationObserver(() => seen.add(link.getAttribute('d'))).observe(link, {attributes: true});
        document.querySelector('.arm-replay').misfitShow(2);
        document.querySelector('.arm-replay button').click();
        setTimeout(() => done(seen.size), 1200);
    })"""

    assert 1 <= page.evaluate(count) <= 5


def test_click_on_a_curve_shows_that_moment(page: Page) -> None:
    svg = page.locator("svg.curves")
    box = svg.bounding_box()
    assert box is not None
    left, right = (float(svg.get_attribute(f"data-{side}") or "nan") for side in ("left", "right"))
    middle = 0.5 * (left + right) / 620 * box["width"]
    page.mouse.click(box["x"] + middle, box["y"] + 40)

    assert clock(page) == pytest.approx(3.0, abs=0.02)


def test_replay_looks_right(page: Page, screenshot: Callable[[Page, str], Path]) -> None:
    page.evaluate("document.querySelector('.arm-replay').misfitShow(2.9)")
    screenshot(page, "arm_replay")

    drawing, curves = (page.locator(f"svg.{name}").bounding_box() for name in ("arm", "curves"))
    assert drawing is not None and curves is not None
    assert drawing["x"] + drawing["width"] <= curves["x"] + 1
    assert curves["x"] + curves["width"] <= 1000
