"""The main job by clicks, from an empty page to an error that has fallen, in a real browser."""

import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path

from accessibility import grave_violations
from playwright.sync_api import Page, expect
from studio_process import ROOT, Studio

CASES = ROOT / "tests" / "cases"
# The machine may be busy with other tests; how long the work takes is not what is tested here.
PATIENCE_MS = 500_000
Screenshot = Callable[[Page, str], Path]


def press(tab: Page, button: str) -> None:
    tab.get_by_role("button", name=button, exact=True).click()


def open_why(tab: Page) -> None:
    """Open the evidence; a page that lost its connection on a busy machine comes back with it folded."""
    if not tab.locator("#why").evaluate("(why) => why.open"):
        press(tab, "Why do you think so?")


def times_floor(studio: Studio, tab: Page) -> list[float]:
    """Held-out errors of the versions shown, as multiples of the noise floor, from the table behind the picture."""
    open_why(tab)
    tab.get_by_text("Error by version as a table").click()
    cells = tab.locator("table", has_text="held-out trials, times the floor").locator("tbody tr").all()
    return [float(row.locator("td").nth(3).inner_text()) for row in cells]


# Canvases of plots on which nothing but a frame is drawn: less than a thousandth of their pixels is coloured.
EMPTY_PLOTS: str = """() => [...document.querySelectorAll(".view-plot canvas")].filter((canvas) => {
  const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  let coloured = 0;
  for (let i = 0; i < pixels.length; i += 4) {
    const [red, green, blue, opaque] = pixels.subarray(i, i + 4);
    coloured += opaque > 0 && Math.max(red, green, blue) - Math.min(red, green, blue) > 40;
  }
  return coloured < pixels.length / 4000;
}).length"""


def three_trials(folder: Path) -> list[Path]:
    """An arm case of two learning trials and a held-out one: the whole of six takes longer and shows the same."""
    case = CASES / "arm" / "case_009"
    names = ["trial_01.csv", "trial_02.csv", "trial_05.csv"]
    text = re.sub(r"^files = .*$", f"files = {json.dumps(names)}", (case / "case.toml").read_text(), flags=re.M)
    text = text.replace("learning = [1, 2, 3, 4]", "learning = [1, 2]").replace("held_out = [5, 6]", "held_out = [3]")
    (folder / "case.toml").write_text(text)
    return [folder / "case.toml", *(case / name for name in names)]


def test_arm_from_empty_page_to_fallen_error(tab: Page, studio: Studio, screenshot: Screenshot, tmp_path: Path) -> None:
    tab.goto(studio.url)
    press(tab, "New project")
    tab.get_by_label("Built-in model").select_option("arm")
    expect(tab.get_by_text("Next: drop in measurements.")).to_be_visible()
    tab.locator("#choose-measurements").set_input_files(three_trials(tmp_path))

    columns = tab.get_by_role("region", name="Columns of the measurements")
    expect(columns.get_by_role("row", name=re.compile("q1 .*rad q1 rad compared"))).to_be_visible(timeout=PATIENCE_MS)
    screenshot(tab, "arm_1_columns")

    press(tab, "Compare")
    expect(tab.get_by_text("The model does not explain the held-out trials")).to_be_visible(timeout=PATIENCE_MS)
    tab.wait_for_function(f"document.querySelectorAll('.view-plot canvas').length > 3 && ({EMPTY_PLOTS})() === 0")
    screenshot(tab, "arm_2_compared")

    press(tab, "Diagnose")
    expect(tab.get_by_text("screening")).to_be_visible(timeout=PATIENCE_MS)
    tab.reload()  # the work goes on, and the page shows it again
    expect(tab.get_by_text("Diagnosing")).to_be_visible()
    answer = tab.get_by_role("heading", name="Coulomb friction at joint1 and joint2 is missing.")
    expect(answer).to_be_visible(timeout=PATIENCE_MS)
    expect(tab.locator(".a-named th")).to_have_text("Coulomb friction at joint1 and joint2")
    pictures = tab.locator(".a-grid-of-four").inner_html()
    screenshot(tab, "arm_3_diagnosed")

    press(tab, "Add it to the model")
    expect(tab.locator(".a-detail", has_text="the error on held-out trials fell from")).to_be_visible(
        timeout=PATIENCE_MS
    )
    assert tab.locator(".a-grid-of-four").inner_html() == pictures  # axes and colours stay
    before, after = times_floor(studio, tab)
    assert before > 10 and after < 2
    tab.wait_for_timeout(1500)  # until the bar has fallen
    screenshot(tab, "arm_4_added")
    assert grave_violations(tab) == []

    press(tab, "Undo")
    open_why(tab)
    expect(tab.get_by_text("The model as given has an error on held-out trials")).to_be_visible()
    press(tab, "Add it to the model")  # what was built is there at once
    expect(tab.locator(".a-detail", has_text="the error on held-out trials fell from")).to_be_visible()

    with tab.expect_download() as waiting:
        tab.get_by_role("link", name="Arm_1.fmu").click()
    waiting.value.save_as(tmp_path / "Arm_1.fmu")
    with zipfile.ZipFile(tmp_path / "Arm_1.fmu") as fmu:
        assert "modelDescription.xml" in fmu.namelist()
    with tab.context.expect_page() as opened:
        tab.get_by_role("link", name="report.html").click()
    expect(opened.value.get_by_text("Coulomb friction").first).to_be_visible()
    screenshot(opened.value, "arm_5_report")
    with tab.expect_download() as waiting:
        tab.get_by_role("link", name="All of them in a zip").click()
    waiting.value.save_as(tmp_path / "all.zip")
    with zipfile.ZipFile(tmp_path / "all.zip") as archive:
        assert {"Arm_1.mo", "Arm_1.fmu", "report.html", "diagnosis.json", "ledger.jsonl"} <= set(archive.namelist())
        assert json.loads(archive.read("diagnosis.json"))["verdict"] == "named"


def test_rat_muscle_from_the_example_to_an_error_that_falls_in_two_steps(
    tab: Page, studio: Studio, screenshot: Screenshot
) -> None:
    tab.goto(studio.url)
    press(tab, "Open: A real rat muscle")
    columns = tab.get_by_role("region", name="Columns of the measurements")
    expect(columns.get_by_role("row", name=re.compile(r"STIM \[ \] .*1 stimulation"))).to_be_visible(
        timeout=PATIENCE_MS
    )

    press(tab, "Diagnose")
    for effect in ("activation dynamics", "stimulation delay"):
        add = tab.get_by_role("button", name=f"Add {effect}")
        expect(add).to_be_enabled(timeout=PATIENCE_MS)
        add.click()
    expect(tab.get_by_text("in 2 steps")).to_be_attached(timeout=PATIENCE_MS)

    errors = times_floor(studio, tab)
    assert errors[0] > 2 * errors[1] > 2 * errors[2]
    tab.wait_for_timeout(1500)
    screenshot(tab, "rat_muscle_added")
