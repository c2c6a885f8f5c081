"""Parquet, MF4 and HDF5 files of others are measurement sets too."""

from pathlib import Path

import asammdf
import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from fmus.errors import MisfitError
from orchestrator.measurements import load_measurements

TIME = np.arange(10) / 10
Q = np.sin(TIME)


def _parquet(path: Path, q: np.ndarray = Q) -> None:
    fields = [
        pa.field("time", pa.float64()),
        pa.field("q", pa.float32(), metadata={"unit": "deg"}),
        ("note", pa.string()),
    ]
    pq.write_table(pa.table([TIME, q.astype(np.float32), ["x"] * 10], schema=pa.schema(fields)), path)


def _mf4(path: Path) -> None:
    with asammdf.MDF() as file:
        file.append([asammdf.Signal(Q.astype(np.float32), TIME, unit="deg", name="q")])
        file.save(path)


def _hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["time"] = TIME
        file["q"] = Q.astype(np.float32)
        file["q"].attrs["unit"] = "deg"


@pytest.mark.parametrize(("ending", "write"), [("parquet", _parquet), ("mf4", _mf4), ("h5", _hdf5)])
def test_a_typed_file_gives_its_numbers_and_units(ending: str, write, tmp_path: Path) -> None:
    write(tmp_path / f"swing.{ending}")
    (tmp_path / "case.toml").write_text(
        f'files = ["swing.{ending}"]\nlearning_window_s = [0.0, 0.5]\nheld_out_window_s = [0.6, 0.9]\n'
    )
    trial = load_measurements(tmp_path).trials[0]
    assert np.array_equal(trial.time, TIME[TIME < 0.5])
    assert np.array_equal(trial.columns["q"], Q.astype(np.float32)[TIME < 0.5])
    assert trial.units["q"] == "deg"


def test_a_case_file_goes_before_the_units_of_the_file(tmp_path: Path) -> None:
    _parquet(tmp_path / "swing.parquet")
    (tmp_path / "case.toml").write_text('files = ["swing.parquet"]\n[columns]\nq = "rad"\n')
    assert load_measurements(tmp_path).trials[0].units["q"] == "rad"


def test_a_folder_without_case_file_takes_typed_files_as_trials(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        _parquet(tmp_path / f"{name}.parquet")
    assert [trial.name for trial in load_measurements(tmp_path).trials] == ["a.parquet", "b.parquet", "c.parquet"]


def test_a_missing_number_in_a_typed_file_is_named_with_its_row(tmp_path: Path) -> None:
    _parquet(tmp_path / "swing.parquet", np.where(np.arange(10) == 3, np.nan, Q))
    with pytest.raises(MisfitError, match="line 4: column 'q' is nan, expected a finite number"):
        load_measurements(tmp_path / "swing.parquet")


def test_channels_with_times_of_their_own_are_refused(tmp_path: Path) -> None:
    with asammdf.MDF() as file:
        file.append([asammdf.Signal(Q, TIME, name="q")])
        file.append([asammdf.Signal(Q[:5], TIME[:5], name="w")])
        file.save(tmp_path / "swing.mf4")
    with pytest.raises(MisfitError, match="channel 'w' has other times than 'q'; resample"):
        load_measurements(tmp_path / "swing.mf4")
