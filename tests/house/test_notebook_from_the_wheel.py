"""The notebook of the front door runs from the wheel, in an environment that holds nothing else of the checkout."""

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

NOTEBOOK = """
import misfit
data  = misfit.Data.read("tests/cases/pendulum")
model = misfit.Model("pendulum")
model.compare(data).plot()
found  = model.diagnose(data)
better = model.add(found.effects)
after = better.compare(data); better.missing(data).plot(); better.to_fmu("p.fmu"); better.to_modelica("P.mo")

assert found.verdict == "named" and found.effects, found.verdict
assert after.held_out.over_floor < 0.2 * model.compare(data).held_out.over_floor
print(misfit.__file__)
"""


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of a fresh environment: the wheel is installed there, other packages are borrowed from this one."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--quiet"]
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", str(folder), str(ROOT)]
    subprocess.run([*pip, *options], check=True, capture_output=True)
    venv.create(folder / "env", with_pip=False)
    python = folder / "env" / "bin" / "python"
    where = [str(python), "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    site = Path(subprocess.run(where, check=True, capture_output=True, text=True).stdout.strip())
    with zipfile.ZipFile(next(folder.glob("misfit_fmu-*.whl"))) as wheel:
        wheel.extractall(site)
    # A path in a .pth file is searched, its own .pth files are not: the checkout's editable install stays out.
    (site / "borrowed.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return python


def run(python: Path, program: str, folder: Path) -> subprocess.CompletedProcess[str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    environment = {**kept, "MISFIT_CACHE": str(folder / "cache")}
    command = [str(python), "-c", program]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def test_the_wheel_has_the_front_door(python: Path, tmp_path: Path) -> None:
    done = run(python, "import misfit; [getattr(misfit, n) for n in misfit.__all__]; print(misfit.__file__)", tmp_path)

    assert done.returncode == 0, done.stderr
    assert str(ROOT) not in done.stdout and str(python.parent.parent) in done.stdout


@pytest.mark.slow
def test_the_notebook_runs_from_the_wheel(python: Path, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "tests" / "cases" / "pendulum", tmp_path / "tests" / "cases" / "pendulum")

    done = run(python, NOTEBOOK, tmp_path)

    assert done.returncode == 0, done.stderr
    assert str(ROOT) not in done.stdout
    assert (tmp_path / "p.fmu").is_file() and "model P " in (tmp_path / "P.mo").read_text()
