"""A wheel carries all that the commands need; the checkout is not there when it runs."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_installed_wheel_builds_an_fmu_without_the_checkout(tmp_path: Path) -> None:
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--quiet"]
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", str(tmp_path), str(ROOT)]
    subprocess.run([*pip, *options], check=True, capture_output=True)
    with zipfile.ZipFile(next(tmp_path.glob("misfit_fmu-*.whl"))) as wheel:
        wheel.extractall(tmp_path / "site")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site"), "MISFIT_CACHE": str(tmp_path / "cache")}

    command = [sys.executable, "-m", "orchestrator.cli", "build", "arm", "--out", str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    assert (tmp_path / "arm.fmu").exists()
    site = tmp_path / "site"
    needed = [
        "orchestrator/models/simulator.c",
        "orchestrator/report/templates",
        "orchestrator/library/cards",
        "orchestrator/studio/static/upload.js",
        "orchestrator/studio/examples/arm/case.toml",
    ]
    assert all((site / name).exists() for name in needed)
    used = subprocess.run(
        [sys.executable, "-c", "import fmus, fmus.library as l; print(fmus.__file__, l.library_root())"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert all(path.startswith(str(site)) for path in used.stdout.split())
