"""The compiled decision: one source, found only where it was made from these very files, and the same decisions."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from fmus.errors import MisfitError
from hil import compiled
from hil.cli import hil
from tests.benchmarks.hil import compiled as beside

PROGRAM = "import hil.safety.core as core; print(core.__file__)"


def file_of_the_core(**environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env={**os.environ, **environment}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_all_modules_of_the_decision_are_there() -> None:
    assert all(compiled.source_of(module).is_file() for module in compiled.MODULES)


def test_without_a_compiled_decision_the_same_source_runs_as_python(tmp_path: Path) -> None:
    assert file_of_the_core(MISFIT_CACHE=str(tmp_path), MISFIT_PURE="") == str(compiled.source_of("hil.safety.core"))


def test_machine_code_of_other_sources_is_not_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MISFIT_CACHE", str(tmp_path))
    compiled.folder.cache_clear()
    before = compiled.folder()
    changed = tmp_path / "core.py"
    changed.write_text(compiled.source_of("hil.safety.core").read_text() + "\n")
    source_of = compiled.source_of
    monkeypatch.setattr(compiled, "source_of", lambda name: changed if name == "hil.safety.core" else source_of(name))
    compiled.folder.cache_clear()
    assert compiled.folder() != before
    compiled.folder.cache_clear()


def test_machine_code_is_left_alone_also_where_that_was_said_after_the_package_was_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "hil" / "safety" / f"core{compiled._SUFFIX}"
    file.parent.mkdir(parents=True)
    file.touch()
    finder = compiled._Finder(tmp_path)
    monkeypatch.delenv(compiled.PURE)
    assert finder.find_spec("hil.safety.core", None) is not None
    monkeypatch.setenv(compiled.PURE, "1")
    assert finder.find_spec("hil.safety.core", None) is None


def test_without_mypyc_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "folder", lambda: tmp_path / "none")
    monkeypatch.setattr(compiled.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MisfitError, match="mypyc is not installed; install it: pip install mypy setuptools"):
        compiled.build()


def test_compiled_and_as_python_the_core_decides_alike_and_it_is_the_compiled_one_that_runs(tmp_path: Path) -> None:
    cache = {"MISFIT_CACHE": str(tmp_path), "MISFIT_PURE": ""}
    done = CliRunner(env=cache).invoke(hil, ["compile", "--json", "-"])
    assert done.exit_code == 0, done.output
    compiled.folder.cache_clear()
    assert json.loads(done.output)["schema"] == "misfit.hil-compile/1"
    assert Path(file_of_the_core(**cache)).is_relative_to(tmp_path)
    assert file_of_the_core(**{**cache, "MISFIT_PURE": "1"}) == str(compiled.source_of("hil.safety.core"))
    run = [sys.executable, "-m", beside.__name__, "--cycles", "20000"]
    done = subprocess.run(run, env={**os.environ, **cache}, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith("20000 cycles in 1 blocks: 0 differ"), (
        done.stdout + done.stderr
    )
    program = "import sys, tests.hil.test_compiled_decision as here; here.{}(sys.argv[1])"
    for pure in ("1", ""):  # recorded as Python, replayed compiled, and the other way round
        folder = tmp_path / f"recording{pure}"
        for run_pure, what in ((pure, "record"), ("" if pure else "1", "replay")):
            words = [sys.executable, "-c", program.format(what), str(folder)]
            done = subprocess.run(
                words, env={**os.environ, **cache, "MISFIT_PURE": run_pure}, capture_output=True, text=True
            )
            assert done.returncode == 0, done.stderr


def record(folder: str) -> None:
    """Record a session in virtual time."""
    from hil.recording.recorder import Recorder
    from hil.session.loop import Loop, Wishes
    from hil.session.recorded import ROBOT
    from hil.session.recorded import SETTINGS as FILE
    from tests.hil.bench import SETTINGS, Bench, ExactTimer

    bench, recorder, count = Bench(), Recorder(Path(folder)), 0
    pilot = bench.pilot()

    def wishes() -> Wishes:
        nonlocal count
        count += 1
        bench.plant.force[:] = [0.0, 6.0 if 200 < count < 400 else 0.0, 0.0]
        return Wishes(arm=not pilot.is_armed and count < 50, over=count > 600)

    bench.wire.tap = recorder.frame
    Loop(bench.wire, pilot, ExactTimer(bench), recorder).run(wishes)
    recorder.finish()
    (Path(folder) / FILE).write_text(json.dumps(SETTINGS.to_json()))
    (Path(folder) / ROBOT).write_text(json.dumps(pilot.robot.to_json()))
    bench.wire.close()


def replay(folder: str) -> None:
    """Replay it."""
    from hil.session.recorded import replay_session

    found = replay_session(Path(folder))
    assert found.cycles > 600 and found.first_different is None, found
