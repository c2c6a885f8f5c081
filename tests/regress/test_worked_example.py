"""The example of docs/regress.md: three FMUs, a bad change, the red report, the fix."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from cases_of_balls import MISFIT, misfit

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "regress.md").read_text()
MODELS = [f"Plant.mo:Plant.{name}" for name in ("Motor", "Tank", "Room")]


@pytest.fixture
def team(tmp_path: Path) -> Path:
    folder = Path(shutil.copytree(ROOT / "docs/examples/regress_team", tmp_path / "team"))
    _build(folder, *MODELS)
    return folder


def _build(folder: Path, *models: str) -> None:
    subprocess.run([MISFIT, "build", *models, "--out", ".", "--quiet"], cwd=folder, check=True)
    for path in folder.glob("*.fmi3.fmu"):
        path.unlink()


def test_a_bad_change_is_red_where_the_page_says_and_its_fix_is_green(team: Path) -> None:
    updated = misfit("--update", folder=team)
    green = misfit(folder=team)
    _change(team, "R*i - k*w", "R*i - 2*k*w")
    red = misfit("--html", "report.html", "--junit", "results.xml", folder=team)
    _change(team, "R*i - 2*k*w", "R*i - k*w")
    fixed = misfit(folder=team)

    assert "updated motor/start: motor_start_ref.csv" in updated.stdout and "4 passed" in updated.stdout
    assert (green.returncode, red.returncode, fixed.returncode) == (0, 1, 0)
    told = re.search(r"```text\n(FAILED.*?)```", PAGE, re.DOTALL)
    assert told is not None
    for line in told[1].splitlines():
        # The page cuts long lines with "...".
        assert line.removesuffix(" ...").rstrip(";,") in red.stdout
    assert "<img" in (team / "report.html").read_text()


def test_the_steady_speed_of_the_example_is_that_of_algebra() -> None:
    """In rest u = R i + k w and k i = d w, so w = k u / (R d + k^2)."""
    speed = 0.05 * 12.0 / (2.0 * 1e-4 + 0.05**2)

    assert f"{speed:.2f}" in (ROOT / "docs/examples/regress_team/motor.regress.toml").read_text()


def _change(folder: Path, old: str, new: str) -> None:
    text = (folder / "Plant.mo").read_text()
    assert old in text
    (folder / "Plant.mo").write_text(text.replace(old, new))
    _build(folder, MODELS[0])
