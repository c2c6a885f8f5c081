"""An FMU from the browser never runs in the studio's own process, whatever it does."""

import sys
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect
from studio_process import ROOT, Studio

sys.path.insert(0, str(ROOT / "tests" / "cosim"))

from faulty import faulty_fmu  # noqa: E402

PATIENCE_MS = 120_000
ROWS = "".join(f"{k / 50},{k % 5},{k / 50}\n" for k in range(60))


def processes_with(library: str, among: set[int]) -> set[int]:
    """Those processes that have loaded a library and still live."""
    found = set()
    for process in among:
        try:
            if library in Path(f"/proc/{process}/maps").read_text():
                found.add(process)
        except OSError:
            continue
    return found


def family(process: int) -> set[int]:
    """A process and its descendants: tests that run at the same time load such libraries too."""
    try:
        tasks = list(Path(f"/proc/{process}/task").iterdir())
        children = {int(child) for task in tasks for child in (task / "children").read_text().split()}
    except OSError:
        return {process}
    return {process}.union(*map(family, children))


def open_with(tab: Page, studio: Studio, fmu: Path) -> None:
    tab.goto(studio.url)
    tab.get_by_role("button", name="New project", exact=True).click()
    tab.locator("#choose-model").set_input_files(fmu)
    expect(tab.locator("#sent-model")).to_have_text(f"{fmu.name} is the model now.")
    data = {"name": "trial.csv", "mimeType": "text/csv", "buffer": f"time,u,y\n{ROWS}".encode()}
    tab.locator("#choose-measurements").set_input_files(data)  # type: ignore[arg-type]


def test_fmu_that_hangs_does_so_elsewhere_and_is_gone_after_cancel(tab: Page, studio: Studio, tmp_path: Path) -> None:
    open_with(tab, studio, faulty_fmu(tmp_path, "hang"))
    compare = tab.get_by_role("button", name="Compare", exact=True)
    expect(compare).to_be_enabled(timeout=PATIENCE_MS)
    compare.click()
    expect(tab.get_by_text("running the model along every trial")).to_be_visible(timeout=PATIENCE_MS)

    for _ in range(200):
        if holders := processes_with("faulty.so", family(studio.process.pid)):
            break
        tab.wait_for_timeout(50)
    tab.get_by_role("button", name="Cancel").click()

    expect(tab.get_by_text("Comparing: cancelled after")).to_be_visible(timeout=PATIENCE_MS)
    assert holders and studio.process.pid not in holders
    # A killed process gives its memory back a moment after the signal.
    for _ in range(100):
        if not processes_with("faulty.so", holders):
            break
        tab.wait_for_timeout(50)
    assert processes_with("faulty.so", holders) == set()


@pytest.mark.parametrize("fault", ["segfault", "exit"])
def test_fmu_that_dies_is_told_in_one_line_and_the_studio_lives(
    tab: Page, studio: Studio, tmp_path: Path, fault: str
) -> None:
    open_with(tab, studio, faulty_fmu(tmp_path, fault))
    compare = tab.get_by_role("button", name="Compare", exact=True)
    expect(compare).to_be_enabled(timeout=PATIENCE_MS)
    compare.click()

    status = tab.get_by_role("region", name="Work").get_by_role("status")
    expect(status).to_contain_text("failed: FMU", timeout=PATIENCE_MS)
    expect(status).to_contain_text("crashed its process")
    assert studio.process.poll() is None
    tab.reload()
    expect(status).to_contain_text("crashed its process")
