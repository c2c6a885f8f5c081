"""A cache that cannot be made or written is told in one line, by commands that need it, and only by these."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from faulty import faulty_fmu

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.cosim.fmu import read_description
from orchestrator.cosim.fmu.unpacked import unpacked

MISFIT = str(Path(sys.executable).with_name("misfit"))


def misfit(cache: Path, *arguments: object) -> "subprocess.CompletedProcess[str]":
    environment = {**os.environ, "MISFIT_CACHE": str(cache)}
    return subprocess.run([MISFIT, *map(str, arguments)], env=environment, capture_output=True, text=True, check=False)


def test_a_cache_that_cannot_be_made_is_one_line_where_it_is_needed(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")

    assert misfit(file, "--help").returncode == 0
    done = misfit(file, "run", faulty_fmu(tmp_path, "none"), "--stop", 1, "--step", 0.1)

    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1, done.stderr
    assert str(file) in done.stderr and "MISFIT_CACHE" in done.stderr


def test_a_full_disk_of_the_cache_names_the_fmu_and_the_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setenv("MISFIT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("fmus.archive.extract_fmu", full)
    with pytest.raises(MisfitError, match=r"none.*unpacked.*No space left.*MISFIT_CACHE"):
        unpacked(read_description(faulty_fmu(tmp_path, "none")))
    assert list((tmp_path / "cache" / "unpacked").iterdir()) == []


def test_a_file_that_a_full_disk_did_not_take_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fmus.files.os.fsync", lambda _: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    with pytest.raises(OSError, match="wanted") as caught:
        write_atomically(tmp_path / "wanted", b"x")
    assert caught.value.filename == str(tmp_path / "wanted") and list(tmp_path.iterdir()) == []
