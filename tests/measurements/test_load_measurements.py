"""What a measurement set contains once it is loaded."""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from orchestrator.measurements import load_measurements
from orchestrator.measurements.load import load_records

WriteCase = Callable[..., Path]

CASE = """
files = ["b.csv", "a.csv"]
learning = [1]
held_out = [2]
[columns]
time = "ms"
q = "deg"
[variables]
q = "angle"
[sensors]
encoder_noise_std_rad = 2.0e-4
[initial_conditions]
given = true
"""


def test_a_case_keeps_file_order_units_mapping_and_sensors(write_case: WriteCase, swing: str) -> None:
    measurements = load_measurements(write_case({"a.csv": swing, "b.csv": swing}, CASE))

    assert [(t.name, t.subset) for t in measurements.trials] == [("b.csv", "learning"), ("a.csv", "held_out")]
    assert measurements.learning == measurements.trials[:1]
    assert measurements.held_out == measurements.trials[1:]
    assert measurements.trials[0].units == {"q": "deg"}
    assert measurements.variables == {"q": "angle"}
    assert measurements.sensors == {"encoder_noise_std_rad": 2.0e-4}
    assert measurements.initial_conditions_given
    assert measurements.notes == ()


def test_time_in_milliseconds_is_returned_in_seconds(write_case: WriteCase, swing: str) -> None:
    folder = write_case({"a.csv": swing, "b.csv": swing}, CASE)
    (trial, _) = load_measurements(folder / "case.toml").trials
    np.testing.assert_allclose(trial.time, np.arange(10) * 1e-4, rtol=1e-15)


def test_the_hash_is_that_of_the_case_file_and_every_data_file(write_case: WriteCase) -> None:
    data = "t,q\n0,1\n1,2\n"
    folder = write_case({"a.csv": data}, "learning = [1]\nheld_out = []\n")
    expected = hashlib.sha256((folder / "case.toml").read_bytes())
    expected.update(f"a.csv\0{len(data)}\0{data}".encode())
    assert load_measurements(folder).content_hash == expected.hexdigest()


@pytest.mark.parametrize("changed", ["case.toml", "a.csv", "b.csv"])
def test_a_change_in_any_file_changes_the_hash(write_case: WriteCase, swing: str, changed: str) -> None:
    folder = write_case({"a.csv": swing, "b.csv": swing}, CASE)
    before = load_measurements(folder).content_hash
    (folder / changed).write_text((folder / changed).read_text() + "\n")
    assert load_measurements(folder).content_hash != before


@pytest.mark.parametrize(
    ("header", "case"),
    [("time,q", None), ("q2,t", None), ("q,time_s", None), ("t,Clock [s]", '[variables]\n"Clock [s]" = "time"\n')],
)
def test_the_time_column_is_found_and_is_no_ordinary_column(
    write_case: WriteCase, header: str, case: str | None
) -> None:
    rows = {"time,q": "0,7\n1,7", "q2,t": "7,0\n7,1"}.get(header, "7,0\n7,1")
    trial = load_measurements(write_case({"a.csv": f"{header}\n{rows}\n"}, case)).trials[0]
    assert trial.time.tolist() == [0.0, 1.0]
    assert [values.tolist() for values in trial.columns.values()] == [[7.0, 7.0]]


def test_without_a_time_column_time_is_counted_from_the_sampling_rate(write_case: WriteCase) -> None:
    folder = write_case({"a.csv": "q\n1\n2\n3\n"}, "[sampling]\nrate_hz = 4\n")
    assert load_measurements(folder).trials[0].time.tolist() == [0.0, 0.25, 0.5]


def test_a_rate_that_contradicts_the_time_column_is_noted(write_case: WriteCase, swing: str) -> None:
    folder = write_case({"a.csv": swing}, "[sampling]\nrate_hz = 250.0\n")
    notes = load_measurements(folder).notes
    assert any("10 Hz" in note and "250 Hz" in note for note in notes)


def test_windows_line_ends_blank_lines_quotes_and_a_byte_order_mark_change_nothing(write_case: WriteCase) -> None:
    plain = write_case({"a.csv": "time,q\n0,1.5\n1,-2e-3\n"})
    expected = load_measurements(plain / "a.csv").trials[0]
    odd = '\ufeff\r\n"time", q\r\n0, 1.5\r\n\r\n"1",-2e-3\r\n'
    trial = load_measurements(write_case({"a.csv": odd}) / "a.csv").trials[0]
    assert trial.time.tolist() == expected.time.tolist()
    assert trial.columns["q"].tolist() == expected.columns["q"].tolist() == [1.5, -2e-3]


def test_a_loaded_array_cannot_be_changed(write_case: WriteCase, swing: str) -> None:
    trial = load_measurements(write_case({"a.csv": swing})).trials[0]
    with pytest.raises(ValueError, match="read-only"):
        trial.columns["q"][0] = 1.0


def test_a_misspelt_key_is_noted_with_the_right_one(write_case: WriteCase, swing: str) -> None:
    folder = write_case({"a.csv": swing}, "leaning = [1]\n")
    notes = load_measurements(folder).notes
    assert any("'leaning'" in n and "did you mean learning?" in n for n in notes)


def test_a_path_may_be_a_string_relative_to_the_working_folder(
    write_case: WriteCase, swing: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(write_case({"a.csv": swing}))
    assert load_measurements("a.csv").path == Path("a.csv")
    assert load_measurements(os.curdir).path == Path(os.curdir)


def test_units_in_headers_of_csv_files_are_those_of_their_columns(tmp_path: Path) -> None:
    (tmp_path / "swing.csv").write_text('t [ms],phi [deg],"T / degC",F (kN),q[1],x_m\n0,1,2,3,4,5\n500,2,3,4,5,6\n')
    (trial,) = load_measurements(tmp_path / "swing.csv").trials[:1]
    assert trial.units == {"phi": "deg", "T": "degC", "F": "kN", "q[1]": "", "x_m": ""}
    record = load_records(tmp_path / "swing.csv")[0]
    assert record.time.tolist() == [0.0, 0.5]


def test_headers_that_case_toml_names_or_that_differ_in_the_unit_alone_stay_whole(write_case: WriteCase) -> None:
    text = "t [s],x [m],y [m],y [mm]\n0,1,2,3\n1,2,3,4\n"
    folder = write_case({"a.csv": text}, 'learning = [1]\nheld_out = []\n[columns]\n"x [m]" = "mm"\n')
    (trial,) = load_measurements(folder).trials
    assert trial.units == {"x [m]": "mm", "y [m]": "", "y [mm]": ""}
