"""The bench view in a browser: it shows what happens at the bench, and its stop button outlives everything around it."""

import os
import re
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from bench_session import RATE_HZ, STALLED, STANDSTILL_S, Session, hold, wait_until
from playwright.sync_api import Browser, Page, expect
from studio_process import Studio, sign_in, start

from hil.session.recorded import replay_session
from hil.stop.server import stop_button

pytestmark = pytest.mark.skipif(not Path("/dev/shm").is_dir(), reason="no /dev/shm")
# From the click to the cycle that stops, in s, on a machine that does other things as well; 0.03 s on a calm one.
SOON_S = 2.0


@pytest.fixture(scope="module")
def out_of_sight() -> Iterator[None]:
    """Sessions of other tests, which run at the same time, are not seen here, nor these there."""
    with (
        tempfile.TemporaryDirectory(prefix="misfit-tests-", dir="/dev/shm") as folder,
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setenv("MISFIT_SHARED", folder)
        yield


@pytest.fixture(scope="module")
def studio(out_of_sight: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Studio]:
    running = start(tmp_path_factory.mktemp("workspace"))
    yield running
    running.stop()


@pytest.fixture(scope="module")
def session_cookie(studio: Studio) -> dict[str, Any]:
    return sign_in(studio)


@pytest.fixture
def session(tmp_path: Path, studio: Studio) -> Iterator[Session]:
    running = hold(tmp_path / "session")
    yield running
    running.kill()


def open_bench(tab: Page, studio: Studio) -> tuple[float, float]:
    """Open the page; returns the middle of its stop button."""
    tab.goto(f"{studio.url}/bench")
    return middle_of_the_button(tab)


def middle_of_the_button(tab: Page) -> tuple[float, float]:
    """Where it is on the screen, once there is one and the arm is armed."""
    button = tab.frame_locator("iframe").get_by_role("button", name="STOP")
    expect(button).to_be_visible()
    expect(tab.locator(".bench-state")).to_contain_text("Armed, all is well.")
    box = button.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def let_down(session: Session, pressed_ns: int) -> None:
    """The robot was stopped by the button, soon, and by the documented way: torque fades within a second."""
    code, faults = session.end()
    stalled = {fault.partition(":")[0] for fault in faults} & STALLED
    if stalled and (still := session.standstill_s()) > STANDSTILL_S:
        pytest.skip(f"loop or robot stood still for {1e3 * still:.0f} ms on this machine, which ended the session")
    assert (code, faults) == (1, ["not_aborted: stopped by the operator"])
    seconds, cycles = session.stopped_after(pressed_ns)
    print(f"\nstopped {1e3 * seconds:.0f} ms after the click, torque off {cycles} cycles of {1e3 / RATE_HZ:g} ms later")
    assert 0 < seconds < SOON_S
    assert RATE_HZ <= cycles <= RATE_HZ + 3
    assert replay_session(session.folder).first_different is None


def says_that_numbers_are_old(tab: Page) -> None:
    """The button's frame notices that the page around it has stopped, without any help of that page."""
    [frame] = tab.frames[1:]
    wait_until(lambda: "OLD numbers" in frame.evaluate("document.getElementById('told').textContent"))


def serious(tab: Page) -> list[str]:
    found = Axe().run(tab).response["violations"]
    return [f"{each['id']}: {each['help']}" for each in found if each["impact"] in ("serious", "critical")]


def test_a_fault_is_told_in_plain_words_and_escape_ends_the_session_with_its_recording_intact(
    session: Session, tab: Page, studio: Studio, screenshot: Callable[[Page, str], Path]
) -> None:
    open_bench(tab, studio)
    arm = tab.get_by_role("img", name="The robot from above and from the side")
    expect(arm).to_be_visible()
    box = arm.bounding_box()
    assert box is not None and box["y"] + box["height"] < 720, "the arm is not on the first screen"
    session.tell("lose 1")
    # A busy machine adds faults of its own, late answers among them: it says when the first and the last one came.
    fault = tab.locator(".bench-faults li").filter(has_text="A motor did not say in time where it is.")
    expect(fault).to_contain_text(re.compile(r"\d\d:\d\d:\d\d, (at|from \d+\.\d\d to) \d+\.\d\d s, \d+ cycle"))
    expect(fault).to_contain_text("Half torque while it lasted.")
    expect(fault).to_contain_text("What to do: Look at plugs")
    screenshot(tab, "bench_fault_1280")
    assert serious(tab) == []
    tab.set_viewport_size({"width": 390, "height": 844})
    clipped = "() => [...document.querySelectorAll('.bench-part')].filter((part) => part.scrollWidth > part.clientWidth + 1).length"
    tab.wait_for_function(f"({clipped})() === 0")
    frame = tab.frame_locator("#bench-stop iframe").locator("#told")
    assert frame.evaluate("(told) => told.getBoundingClientRect().top") >= 0, "its words are cut off"
    tab.set_viewport_size({"width": 820, "height": 1180})
    assert tab.evaluate("document.documentElement.scrollWidth") <= 820
    screenshot(tab, "bench_fault_820")

    pressed_ns = time.monotonic_ns()
    tab.keyboard.press("Escape")
    let_down(session, pressed_ns)
    expect(tab.locator(".bench-state")).to_contain_text("Somebody stopped the session")
    expect(tab.locator(".bench-state")).to_contain_text(f"misfit hil replay {session.folder}")
    screenshot(tab, "bench_ended_820")


def test_the_first_tab_reaches_the_stop_button_and_a_click_stops_its_own_session_while_the_page_runs_an_endless_script(
    session: Session, tab: Page, studio: Studio, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    x, y = open_bench(tab, studio)
    other = hold(tmp_path / "other")  # newer, and not the one that this page stops
    request.addfinalizer(other.kill)
    expect(tab.get_by_role("navigation", name="Sessions")).to_contain_text(f"session {other.process.pid} with the")
    named = f"session {session.process.pid} with the Proficio"
    expect(tab.locator("#bench-stop")).to_contain_text(f"Stops {named}")
    tab.keyboard.press("Tab")
    # The frame is a process of its own: the page gives its focus away at once, and is told later where it went.
    expect(tab.locator("iframe")).to_be_focused()
    expect(tab.frame_locator("iframe").locator("#stop")).to_be_focused()
    expect(tab.frame_locator("iframe").locator("#told")).to_contain_text(f"Stops {named}")

    tab.mouse.wheel(0, 300)  # it stays in sight
    tab.evaluate("setTimeout(() => { for (;;); }, 0)")
    time.sleep(0.5)
    pressed_ns = time.monotonic_ns()
    tab.mouse.click(x, y)
    let_down(session, pressed_ns)
    assert other.process.poll() is None


def test_the_page_says_how_to_begin_finds_the_session_and_its_button_works_while_the_studio_stands_still(
    browser: Browser,
    out_of_sight: None,
    start_studio: Callable[..., Studio],
    tmp_path: Path,
    screenshot: Callable[[Page, str], Path],
) -> None:
    studio = start_studio(tmp_path / "workspace")
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    context.add_cookies([sign_in(studio)])  # type: ignore[list-item]
    tab = context.new_page()
    tab.goto(f"{studio.url}/bench")
    expect(tab.get_by_text("No session runs on this machine")).to_be_visible()
    expect(tab.get_by_text("misfit hil hold --virtual")).to_be_visible()
    screenshot(tab, "bench_empty_1280")
    assert serious(tab) == []

    session = hold(tmp_path / "session")
    try:
        x, y = middle_of_the_button(tab)
        studio.process.send_signal(signal.SIGSTOP)
        says_that_numbers_are_old(tab)
        pressed_ns = time.monotonic_ns()
        tab.mouse.click(x, y)
        let_down(session, pressed_ns)
    finally:
        studio.process.send_signal(signal.SIGCONT)
        session.kill()
        context.close()


def test_a_dead_button_a_stuck_session_and_a_killed_one_are_each_said(
    session: Session, tab: Page, studio: Studio
) -> None:
    open_bench(tab, studio)
    os.kill(stop_server_of(session), signal.SIGKILL)
    told = tab.frame_locator("iframe").get_by_role("status")
    began = time.monotonic()
    expect(told).to_contain_text("This button is DEAD", timeout=10_000)
    print(f"\na dead button is said after {time.monotonic() - began:.2f} s")
    expect(tab.get_by_role("alert")).to_contain_text("The stop button on this page is dead.")
    expect(tab.locator(".bench-state").first).to_contain_text("Armed, all is well.")  # the session goes on

    session.process.send_signal(signal.SIGSTOP)
    expect(tab.locator(".bench-state").first).to_contain_text("The session is stuck: no new cycle")
    session.kill()
    expect(tab.locator(".bench-state").first).to_contain_text("The session was killed.")
    expect(tab.locator(".bench-state").first).to_contain_text(str(session.folder))


def test_the_button_works_in_a_window_of_its_own_without_scripts(browser: Browser) -> None:
    with stop_button() as flag:
        wait_until(lambda: flag.port != 0)
        context = browser.new_context(java_script_enabled=False)
        tab = context.new_page()
        tab.goto(flag.address("localhost"))
        assert not flag.is_pressed
        tab.keyboard.press("Tab")
        tab.keyboard.press("Enter")
        expect(tab.get_by_role("status")).to_contain_text("Pressed")
        assert flag.is_pressed
        context.close()


def stop_server_of(session: Session) -> int:
    found: list[int] = []

    def there() -> bool:
        for entry in Path("/proc").glob("[0-9]*"):
            try:
                mine = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1]) == session.process.pid
                if mine and b"hil.stop.server" in (entry / "cmdline").read_bytes().split(b"\0"):
                    found.append(int(entry.name))
            except OSError:
                continue
        return bool(found)

    wait_until(there)
    return found[0]
