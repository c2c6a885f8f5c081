"""The swap view by clicks: two FMUs dropped in, their difference seen, and the parting time checked against the formula."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from accessibility import grave_violations
from playwright.sync_api import Page, expect
from studio_process import Studio

from orchestrator.cosim.built import built_fmu

PATIENCE_MS = 120_000
STOP, STEPS, TOLERANCE = 10.0, 1000, 1e-3
RATES = (1.0, 1.1)
MODELS = """
model Old "Falls from 1 m"
  parameter Real k(unit="1/s") = 1.0;
  input Real u(unit="m/s", start=0);
  output Real x(unit="m", start=1, fixed=true);
equation
  der(x) = u - k*x;
end Old;
model New "Falls a little faster"
  parameter Real k(unit="1/s") = 1.1;
  input Real u(unit="mm/s", start=0);
  output Real x(unit="m", start=1, fixed=true);
  output Real doubled(unit="m");
equation
  der(x) = 0.001*u - k*x;
  doubled = 2*x;
end New;
"""


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("fmus")
    found = []
    for name in ("Old", "New"):
        # A file of models holds one class at its top.
        file = folder / f"{name}.mo"
        file.write_text(f"model {name}" + MODELS.split(f"model {name}")[1].split(f"end {name};")[0] + f"end {name};\n")
        found.append(shutil.copy(built_fmu(f"{file}:{name}"), folder / f"{name}.fmu"))
    return found


def parting_time() -> float:
    """First point of the run at which exp(-k t) of both rates are farther apart than the tolerance."""
    time = np.linspace(0.0, STOP, STEPS + 1)
    old, new = (np.exp(-rate * time) for rate in RATES)
    return float(time[np.abs(old - new) > TOLERANCE * np.ptp(old)][0])


def drop(tab: Page, fmus: list[Path]) -> None:
    for side, file in zip(("old", "new"), fmus, strict=True):
        tab.locator(f"#choose-{side}").set_input_files(file)
        expect(tab.locator(f"#sent-{side}")).to_have_text(f"{file.name} was taken.", timeout=PATIENCE_MS)


def test_two_fmus_show_their_difference_and_when_they_part(
    tab: Page, studio: Studio, screenshot: Callable[[Page, str], Path], fmus: list[Path]
) -> None:
    tab.goto(f"{studio.url}/swap")
    expect(tab.get_by_text("Next: drop in both FMUs.")).to_be_visible()
    drop(tab, [Path(each) for each in fmus])
    # What drives the inputs is chosen here, since the formula below is that of inputs at rest.
    expect(tab.get_by_text("part first at")).to_be_visible(timeout=PATIENCE_MS)
    tab.get_by_label("Inputs").click()
    tab.get_by_role("option", name="at their start values").click()
    tab.get_by_role("button", name="Compare", exact=True).click()

    expect(tab.get_by_text(f"part first at {parting_time():.4g} s, in x")).to_be_visible(timeout=PATIENCE_MS)
    rows = {cells[0].strip(): cells[1:] for cells in _rows(tab, "Differences of the interfaces", 3)}
    assert rows["u"] == ["unit", "m/s", "mm/s", "breaking"]
    assert rows["k"] == ["start", "1", "1.1", "compatible"]
    assert rows["doubled"] == ["variable", "missing", "output", "compatible"]
    speeds = _rows(tab, "Clock time on this machine", 2)
    assert [row[0] for row in speeds] == ["Old.fmu", "New.fmu"]
    assert all(row[3].endswith("times real time") for row in speeds)
    assert tab.locator("svg.curves").count() == 1
    screenshot(tab, "swap_view")
    assert grave_violations(tab) == []

    tab.reload()  # the address is that of this comparison
    expect(tab.get_by_text("part first at")).to_be_visible()
    expect(tab.get_by_text("Old.fmu", exact=True).first).to_be_visible()


def _rows(tab: Page, caption: str, count: int) -> list[list[str]]:
    rows = tab.locator("table", has_text=caption).locator("tbody tr")
    expect(rows).to_have_count(count)
    return [[cell.inner_text() for cell in row.locator("th, td").all()] for row in rows.all()]


def test_same_fmu_twice_does_not_part(tab: Page, studio: Studio, fmus: list[Path], tmp_path: Path) -> None:
    tab.goto(f"{studio.url}/swap")
    drop(tab, [Path(fmus[0]), Path(fmus[0])])

    expect(tab.get_by_text(re.compile("The interface of the new one fits where the old one is"))).to_be_visible(
        timeout=PATIENCE_MS
    )
    expect(tab.get_by_text(re.compile(r"that moved agrees? within 0.1\s% of"))).to_be_visible()
    expect(tab.get_by_text("They do not differ")).to_be_visible()
    assert tab.locator("table", has_text="Signals that both have").locator("td").first.inner_text() == "never"

    recording = tmp_path / "drive.csv"
    recording.write_text("time,u\n0,0\n1,2\n3,1\n")
    expect(tab.get_by_text(re.compile("^Compared in"))).to_be_visible(timeout=PATIENCE_MS)
    tab.locator("#choose-recording").set_input_files(recording)
    expect(tab.get_by_text('drive.csv was taken. Choose "as recorded in the file" under Inputs')).to_be_visible()
    tab.get_by_label("Inputs").click()
    tab.get_by_role("option", name="as recorded in the file").click()
    tab.get_by_role("button", name="Compare", exact=True).click()
    expect(tab.get_by_text("run to 3 s")).to_be_visible(timeout=PATIENCE_MS)


def test_a_file_that_is_no_fmu_is_refused_in_one_line(tab: Page, studio: Studio, tmp_path: Path) -> None:
    broken = tmp_path / "broken.fmu"
    broken.write_bytes(b"PK\x03\x04 this is no archive")
    tab.goto(f"{studio.url}/swap")
    tab.locator("#choose-old").set_input_files(broken)

    told = tab.locator("#sent-old")
    expect(told).to_contain_text("broken.fmu")
    assert "Traceback" not in told.inner_text()
    expect(tab.get_by_text("Next: drop in both FMUs.")).to_be_visible()


@pytest.mark.parametrize("address", ["/swap/..%2F..%2Fetc/upload/old", "/swap/abcdefghij/upload/elsewhere"])
def test_an_upload_to_elsewhere_is_refused(tab: Page, studio: Studio, address: str) -> None:
    tab.goto(f"{studio.url}/swap")
    answer = tab.request.put(f"{studio.url}{address}?name=a.fmu", data=b"x", headers={"Origin": studio.url})

    assert answer.status in (400, 404)
    assert not (studio.workspace / "swaps" / "abcdefghij" / "elsewhere").exists()


MUSCLE = """model Muscle "A force in proportion to activation, strength and length"
  parameter Real strength(unit="N") = {strength};
  input Real alpha(unit="1", start=0, min=0, max=1);
  input Real L(unit="m", start=0.18);
  output Real F(unit="N");
equation
  F = strength*alpha*L/0.18;
end Muscle;
"""


def test_a_muscle_of_four_fifths_the_strength_never_passes_as_the_same(
    tab: Page, studio: Studio, tmp_path: Path
) -> None:
    pair = []
    for name, strength in (("Whole", 100.0), ("Weak", 80.0)):
        file = tmp_path / name / "Muscle.mo"
        file.parent.mkdir()
        file.write_text(MUSCLE.format(strength=strength))
        pair.append(Path(shutil.copy(built_fmu(f"{file}:Muscle"), tmp_path / f"{name}.fmu")))
    tab.goto(f"{studio.url}/swap")
    drop(tab, pair)

    expect(tab.get_by_text("They do not do the same: outputs part first")).to_be_visible(timeout=PATIENCE_MS)
    address = tab.url
    tab.get_by_label("Inputs").click()
    tab.get_by_role("option", name="at their start values").click()
    tab.get_by_role("button", name="Compare", exact=True).click()
    expect(tab.get_by_text("Nothing was exercised: 1 output stayed constant in both")).to_be_visible(
        timeout=PATIENCE_MS
    )

    tab.goto(f"{studio.url}/swap")  # it is found again
    tab.get_by_role("link", name="Whole.fmu and Weak.fmu").click()
    expect(tab.get_by_text("Nothing was exercised")).to_be_visible()
    assert tab.url == address
