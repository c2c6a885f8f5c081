"""Files as people have them, and Modelica models, are dropped into the studio; menus say what each column is."""

import sys
import tomllib
from pathlib import Path

from accessibility import grave_violations
from playwright.sync_api import Page, expect
from studio_process import ROOT, Studio

from orchestrator.studio.workspace import Workspace

sys.path.insert(0, str(ROOT))
from tests.measurements.dirty_files import dirty_files  # noqa: E402
from tests.shaft import SHAFT  # noqa: E402

PATIENCE_MS = 90_000


def case_of(project_folder: Path) -> dict[str, object]:
    return tomllib.loads((project_folder / "measurements" / "case.toml").read_text())


def test_a_dirty_file_and_a_modelica_model_are_dropped_and_matched_by_menus(
    tab: Page, studio: Studio, tmp_path: Path
) -> None:
    project = Workspace(studio.workspace).create("Wizard")
    (tmp_path / "Shaft.mo").write_text(SHAFT)
    content = dirty_files()["UTF-8 with a byte order mark, spreadsheet"].content
    (tmp_path / "run.csv").write_bytes(content.replace(b"phi", b"Drehwinkel"))
    tab.set_viewport_size({"width": 1280, "height": 800})
    tab.goto(f"{studio.url}/project/{project.id}")
    tab.locator("#choose-model").set_input_files(tmp_path / "Shaft.mo")
    expect(tab.get_by_text("Model: Shaft (Shaft.mo)")).to_be_visible(timeout=PATIENCE_MS)
    tab.locator("#choose-measurements").set_input_files(tmp_path / "run.csv")

    # Nothing is called phi, but one column is an angle, and so is one variable.
    angle = tab.get_by_label("Model variable of Drehwinkel (°)")
    expect(angle).to_have_value("phi", timeout=PATIENCE_MS)
    expect(tab.get_by_label("Unit of Drehwinkel (°)")).to_have_value("deg")
    expect(tab.get_by_text("2 of 2 columns are variables of the model.")).to_be_visible(timeout=PATIENCE_MS)
    assert tab.locator(".studio-spark polyline").count() == 2
    expect(
        tab.get_by_text("Where the model fails")
    ).not_to_be_visible()  # nothing was compared, so nothing stands behind it
    tab.screenshot(path=ROOT / "build" / "screenshots" / "import_wizard.png")
    assert grave_violations(tab) == []

    tab.get_by_label("Between samples of torque (mNm)").select_option("hold")
    expect(tab.get_by_label("Between samples of torque (mNm)")).to_have_value("hold", timeout=PATIENCE_MS)
    for _ in range(300):  # until the job has written it
        if case_of(project.folder).get("interpolation") == {"torque (mNm)": "hold"}:
            break
        tab.wait_for_timeout(200)
    assert case_of(project.folder).get("interpolation") == {"torque (mNm)": "hold"}
    expect(tab.get_by_text("2 of 2 columns are variables of the model.")).to_be_visible(timeout=PATIENCE_MS)

    angle.select_option("")
    expect(tab.get_by_text("1 of 2 columns are variables of the model; they cannot be used yet.")).to_be_visible(
        timeout=PATIENCE_MS
    )
    expect(tab.get_by_text("no column is an output of the model").first).to_be_visible()
    expect(tab.get_by_role("heading", name="These data cannot be used yet.")).to_be_visible()
    expect(tab.get_by_text("Next: Choose variables and units in the table below.")).to_be_visible()
    assert "case.toml" not in tab.locator(".studio-problem", has_text="no column is an output").first.inner_text()


def test_a_file_that_is_no_table_is_called_by_the_name_it_was_dropped_under(
    tab: Page, studio: Studio, tmp_path: Path
) -> None:
    project = Workspace(studio.workspace).create("A letter")
    (tmp_path / "letter.csv").write_text("Dear colleague,\nthe data follow.\n")
    tab.goto(f"{studio.url}/project/{project.id}")
    tab.locator("#choose-measurements").set_input_files(tmp_path / "letter.csv")

    expect(tab.get_by_text("Looking at the columns failed: letter.csv: no table of numbers")).to_be_visible()
    assert str(studio.workspace) not in tab.locator("body").inner_text()


def test_an_fmu_without_a_program_for_this_machine_is_told_as_such(tab: Page, studio: Studio, tmp_path: Path) -> None:
    import zipfile

    project = Workspace(studio.workspace).create("Windows only")
    with zipfile.ZipFile(tmp_path / "plant.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", '<fmiModelDescription fmiVersion="2.0"/>')
        archive.writestr("binaries/win64/plant.dll", b"MZ")
    tab.goto(f"{studio.url}/project/{project.id}")
    tab.locator("#choose-model").set_input_files(tmp_path / "plant.fmu")

    expect(tab.get_by_text("holds no program for this machine (binaries: only for win64)")).to_be_visible()
