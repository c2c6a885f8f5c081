"""The gate on a small folder: what is sound passes everything, what is not says why."""

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "cosim"))

from small_fmus import small_fmu  # noqa: E402

from tests.benchmarks.fmus.one import main  # noqa: E402
from tests.benchmarks.fmus.page import page  # noqa: E402
from tests.benchmarks.fmus.run import distinct  # noqa: E402


def gate(path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> dict:
    monkeypatch.setattr(sys, "argv", ["one", str(path)])
    main()
    return json.loads(capsys.readouterr().out.splitlines()[-1])


def test_a_sound_fmu_passes_and_agrees_with_fmpy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = gate(small_fmu("decay", interfaces=("CoSimulation",)), monkeypatch, capsys)
    assert {found[name] for name in ("run", "fmpy", "repeat", "swap", "regress")} == {"ok"}
    assert found["difference"] < 1e-12


def test_an_fmu_for_another_system_says_so(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    found = gate(small_fmu("decay", platform="win64"), monkeypatch, capsys)
    assert "has no binary" in found["run"] and "not run" in found["validate"]


def test_equal_files_count_once_and_the_page_counts_what_agrees(tmp_path: Path) -> None:
    for name in ("a.fmu", "b.fmu", "c.fmu"):
        (tmp_path / name).write_text(name if name == "c.fmu" else "same")
    assert [path.name for path in distinct(tmp_path, (".fmu",))] == ["a.fmu", "c.fmu"]

    row = {"source": "s@1", "file": "x.fmu", "tool": "Maker 7", "version": "2", "run": "ok", "fmpy": "ok"}
    text = page([{**row, "difference": 1e-9}, {**row, "difference": 1e-3}, {**row, "run": "a|b"}], [])
    assert "| of these, with outputs that agree to 1e-06 | 1 |" in text
    assert "| run by FMPy and here | 2 |" in text and "a/b" in text
    assert "| Maker 7 | 2 | 3 | 2 | 3 | 1 |" in text
