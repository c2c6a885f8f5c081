"""A wheel carries all that is needed, and takes no name from its users; the checkout is not there when it runs."""

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

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


def run(python: Path, program: str, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    environment = {**kept, "MISFIT_CACHE": str(folder / "cache")}
    command = [str(python), "-c", program, *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


COMMAND = "from misfit_start import command; command()"


def test_the_wheel_builds_an_fmu_without_the_checkout(python: Path, tmp_path: Path) -> None:
    done = run(python, COMMAND, tmp_path, "build", "arm", "--out", str(tmp_path))

    assert done.returncode == 0, done.stderr
    assert (tmp_path / "arm.fmu").exists()
    (ours,) = python.parents[1].rglob("_misfit")
    needed = [
        "orchestrator/models/simulator.c",
        "orchestrator/report/templates",
        "orchestrator/library/cards",
        "orchestrator/studio/static/upload.js",
        "orchestrator/studio/examples/arm/case.toml",
    ]
    assert all((ours / name).exists() for name in needed)


def test_the_wheel_has_one_parent_for_its_packages(python: Path) -> None:
    (ours,) = python.parents[1].rglob("_misfit")

    assert {path.name for path in ours.iterdir()} == {"fmus", "orchestrator", "hil"}
    assert not [name for name in ("fmus", "orchestrator", "hil", "tests") if (ours.parent / name).exists()]


OWN = "import orchestrator, hil, fmus; assert (orchestrator.X, hil.X, fmus.X) == (1, 2, 3)\n"
RUN = "import misfit; print(misfit.MisfitError, misfit.Component.__name__)\n"


def with_own_modules(folder: Path) -> Path:
    (folder / "orchestrator.py").write_text("X = 1")
    (folder / "hil.py").write_text("X = 2")
    (folder / "fmus").mkdir()
    (folder / "fmus" / "__init__.py").write_text("X = 3")
    return folder


def test_a_user_with_modules_of_these_names_gets_both(python: Path, tmp_path: Path) -> None:
    folder = with_own_modules(tmp_path)

    assert run(python, OWN, folder).returncode == 0
    assert "Component" in run(python, RUN, folder).stdout
    both = run(python, OWN + RUN, folder)
    assert both.returncode == 1 and "rename that one" in both.stderr.splitlines()[-1]


def test_pytest_with_the_plugin_imports_a_users_own_modules(python: Path, tmp_path: Path) -> None:
    (with_own_modules(tmp_path) / "test_own.py").write_text(f"def test_own():\n    {OWN}")

    done = run(python, "import pytest; raise SystemExit(pytest.main([]))", tmp_path)

    assert done.returncode == 0, done.stdout


def test_without_such_modules_users_import_the_packages_by_name(python: Path, tmp_path: Path) -> None:
    done = run(python, "import fmus, hil, orchestrator; print(orchestrator.__file__)", tmp_path)

    assert "_misfit" in done.stdout, done.stderr


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
