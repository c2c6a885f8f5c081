"""What is recorded is read back, in every format, also when the recording process is killed."""

import os
import signal
import subprocess
import sys
import time as clock
from pathlib import Path

import numpy as np
import pytest

from fmus.errors import MisfitError
from orchestrator.results import Column, MemoryRecorder, Result, chosen, compare_results, read_result, recorder_for
from orchestrator.results.journal import Journal

ENDINGS = (".parquet", ".csv", ".h5", ".mf4")
COLUMNS = (
    Column("mass.x", "m", "Float64", "position of the mass"),
    Column("tank/1.valve[2]", "1", "Boolean"),
    Column("gear.n", "", "Int32"),
)
PROVENANCE = {"system": "demo", "components": {"mass": {"sha256": "ab12"}}, "seed": 7}


def _rows(n: int = 5000) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(n) * 1e-3
    return time, np.column_stack([np.sin(7 * time) / 3, time > 2, np.floor(time * 10)])


def _record(path: Path | None, n: int = 5000, finish: bool = True) -> MemoryRecorder:
    time, values = _rows(n)
    recorder = recorder_for(path)
    recorder.begin(COLUMNS, PROVENANCE)
    for k in range(0, n, 700):
        recorder.rows(time[k : k + 700], values[k : k + 700])
    if finish:
        recorder.finish()
    return recorder


def _expect_rows(result: Result, n: int = 5000) -> None:
    time, values = _rows(n)
    assert np.array_equal(result.time, time)
    for k, column in enumerate(COLUMNS):
        assert np.array_equal(result[column.name], values[:, k])
        assert result[column.name].dtype == column.stored_as


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_file_gives_back_every_bit_with_units_types_and_provenance(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"run{ending}"
    _record(path)
    result = read_result(path)
    _expect_rows(result)
    assert result.columns == COLUMNS
    assert result.provenance == PROVENANCE
    assert result.complete
    assert not [file for file in tmp_path.iterdir() if "unfinished" in file.name]


def test_memory_gives_back_every_row() -> None:
    recorder = _record(None)
    result = recorder.result()
    _expect_rows(result)
    assert result.columns == COLUMNS and result.complete


@pytest.mark.parametrize("ending", ENDINGS)
def test_only_the_asked_columns_are_read(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"run{ending}"
    _record(path)
    assert read_result(path, ["gear.n"]).names == ("gear.n",)


KILLED = """
import os, signal, sys, time
from pathlib import Path
import numpy as np
sys.path.insert(0, {tests!r})
from test_results import COLUMNS, PROVENANCE, _rows
from orchestrator.results import recorder_for
recorder = recorder_for(Path({path!r}))
recorder.begin(COLUMNS, PROVENANCE)
times, values = _rows(5000)
recorder.rows(times, values)
recorder.rows(times[:100] + 5.0, values[:100])
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize("ending", ENDINGS)
def test_rows_survive_a_killed_process_up_to_the_last_flush(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"run{ending}"
    script = KILLED.format(tests=str(Path(__file__).parent), path=str(path))
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=Path(__file__).parents[2], env=_environment(), check=False
    )
    assert done.returncode == -signal.SIGKILL
    result = read_result(path)
    _expect_rows(result)  # the 100 rows after the flush are lost
    assert not result.complete
    assert result.failure == "the run was killed before it ended"
    assert result.provenance == PROVENANCE
    # Reading made the file proper, for the tools of others.
    assert path.is_file() and not path.with_name(path.name + ".unfinished").exists()


def _environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}


def test_a_run_can_be_read_while_it_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    recorder = _record(path, finish=False)
    recorder.flush()
    before = read_result(path)
    assert len(before.time) == 5000 and not before.complete
    assert not path.exists()
    recorder.finish()
    assert read_result(path).complete


def test_half_a_batch_at_the_end_of_a_side_file_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    recorder = _record(path, finish=False)
    recorder.flush()
    recorder._journal._file.close()
    journal = tmp_path / "run.parquet.unfinished"
    journal.write_bytes(journal.read_bytes()[:-1000])
    result = read_result(path)
    assert 0 < len(result.time) < 5000
    assert np.array_equal(result["mass.x"], _rows()[1][: len(result.time), 0])


def test_two_runs_cannot_write_the_same_file(tmp_path: Path) -> None:
    first = _record(tmp_path / "run.parquet", finish=False)
    with pytest.raises(MisfitError, match="is being written by another run; choose another name"):
        _record(tmp_path / "run.parquet")
    first.finish()
    _expect_rows(read_result(tmp_path / "run.parquet"))


def test_a_failure_is_in_the_file(tmp_path: Path) -> None:
    recorder = _record(tmp_path / "run.h5", finish=False)
    recorder.finish("FMU 'mass' crashed at t = 1.2 s")
    result = read_result(tmp_path / "run.h5")
    assert result.failure == "FMU 'mass' crashed at t = 1.2 s" and not result.complete
    _expect_rows(result)


def test_an_unknown_ending_is_refused_before_the_run() -> None:
    with pytest.raises(MisfitError, match=r"ending '.mat' is no format of results; use .parquet, .csv"):
        recorder_for("run.mat")


def test_values_are_converted_and_missing_columns_name_similar_ones() -> None:
    result = _record(None).result()
    assert result.values_in("mass.x", "mm") == pytest.approx(1000 * result["mass.x"], rel=1e-15)
    with pytest.raises(MisfitError, match="no column 'mass.y'; there are, for example, mass.x"):
        result["mass.y"]
    with pytest.raises(MisfitError, match="dimensions differ"):
        result.values_in("mass.x", "N")


def test_patterns_choose_columns_and_brackets_mean_themselves() -> None:
    columns = [Column(name) for name in ("arm.q[1]", "arm.q[2]", "arm.tau", "load.q")]
    assert chosen(columns, ["arm.q[1]"]) == [0]
    assert chosen(columns, ["*.q*"]) == [0, 1, 3]
    assert chosen(columns, []) == [0, 1, 2, 3]
    with pytest.raises(MisfitError, match="--record leg.* matches no variable"):
        chosen(columns, ["leg.*"])


def _result(time: np.ndarray, unit: str = "m", **arrays: np.ndarray) -> Result:
    return Result(time, tuple(Column(name, unit) for name in arrays), arrays)


def test_comparison_finds_size_place_and_first_parting() -> None:
    time = np.linspace(0, 1, 101)
    first = _result(time, x=np.sin(time), y=time)
    second = _result(time, x=np.sin(time), y=time + np.where(time > 0.495, 0.1 * time, 0))
    found = compare_results(first, second)
    y, x = found.signals
    assert (y.name, x.name) == ("y", "x")
    assert y.largest == pytest.approx(0.1) and y.largest_at == 1.0 and y.parted_at == pytest.approx(0.5)
    assert y.rms == pytest.approx(np.sqrt(np.sum((0.1 * time[50:]) ** 2) / 101))
    assert x.largest == 0 and x.parted_at is None
    assert not found.same and compare_results(first, first).same


def test_comparison_converts_units_and_interpolates_other_times() -> None:
    first = _result(np.linspace(0, 1, 11), x=np.linspace(0, 2, 11))
    second = _result(np.linspace(0, 0.9, 7), "mm", x=np.linspace(0, 1800, 7))
    found = compare_results(first, second)
    assert found.stop == 0.9
    assert found.signals[0].largest == pytest.approx(0, abs=1e-15 * 2000)
    with pytest.raises(MisfitError, match="signal x cannot be compared: cannot convert 'N'"):
        compare_results(first, _result(first.time, "N", x=first.time))


def test_comparison_counts_a_value_that_is_no_number_as_infinitely_far() -> None:
    time = np.linspace(0, 1, 3)
    found = compare_results(_result(time, x=time), _result(time, x=np.array([0, np.nan, 1.0])))
    assert found.signals[0].largest == np.inf and found.signals[0].parted_at == 0.5
    assert found.to_json()["signals"][0]["largest"] is None


def test_comparison_lists_what_only_one_has_and_refuses_other_times() -> None:
    time = np.linspace(0, 1, 3)
    found = compare_results(_result(time, x=time, y=time), _result(time, x=time, z=time))
    assert (found.only_first, found.only_second) == (("y",), ("z",)) and not found.same
    with pytest.raises(MisfitError, match="share no time: one covers 0 to 1 s, the other 5 to 6 s"):
        compare_results(_result(time, x=time), _result(time + 5, x=time))


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 0.99])
def test_a_truncated_file_is_refused_or_read_in_part_but_never_breaks(
    ending: str, share: float, tmp_path: Path
) -> None:
    whole, cut = tmp_path / f"whole{ending}", tmp_path / f"cut{ending}"
    _record(whole, 500)
    content = whole.read_bytes()
    cut.write_bytes(content[: int(share * len(content))])
    try:
        result = read_result(cut)
    except MisfitError as error:
        assert str(cut) in str(error) and "\n" not in str(error)
    else:
        assert len(result.time) <= 500


@pytest.mark.parametrize("ending", ENDINGS)
def test_bytes_of_something_else_are_refused(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"other{ending}"
    path.write_bytes(np.random.default_rng(1).bytes(5000))
    with pytest.raises(MisfitError, match="cannot be read|has no column 'time'"):
        read_result(path)


def test_a_table_of_somebody_else_is_a_result_too(tmp_path: Path) -> None:
    (tmp_path / "table.csv").write_text("time,q,name\n0,1.5,a\n0.1,2,b\n")
    result = read_result(tmp_path / "table.csv")
    assert result.names == ("q",) and result["q"].tolist() == [1.5, 2.0]


def test_a_table_with_a_hundred_thousand_columns_is_read_in_seconds(tmp_path: Path) -> None:
    """Arrow takes half a minute for it, and as long as this for a thousand of them."""
    names = [f"c{k}" for k in range(100_000)]
    rows = "\n".join(",".join([f"{t}.0", *(["1.5"] * len(names))]) for t in range(3))
    (tmp_path / "wide.csv").write_text(f"time,{','.join(names)}\n{rows}\n")
    began = clock.process_time()
    result = read_result(tmp_path / "wide.csv")
    assert clock.process_time() - began < 10.0
    assert list(result.names) == names and result["c99999"].tolist() == [1.5, 1.5, 1.5]


def test_ctrl_c_while_rows_are_written_loses_none_of_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The signal arrives in the middle of a batch: it is heard once the batch is whole."""
    path = tmp_path / "run.parquet"
    recorder = _record(path, finish=False)
    write = Journal.write

    def interrupted(journal: Journal, time: np.ndarray, values: np.ndarray) -> None:
        signal.raise_signal(signal.SIGINT)
        write(journal, time, values)

    monkeypatch.setattr(Journal, "write", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            recorder.flush()
    finally:
        signal.signal(signal.SIGINT, before)
    monkeypatch.undo()
    recorder.finish("interrupted")
    _expect_rows(read_result(path))
    assert read_result(path).failure == "interrupted"
