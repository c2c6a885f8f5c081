"""Every bad file gets one line that names the place, the value and what to do."""

from collections.abc import Callable
from pathlib import Path

import pytest

from fmus.errors import MisfitError
from orchestrator.measurements import load_measurements

WriteCase = Callable[..., Path]


def message_of(path: Path) -> str:
    with pytest.raises(MisfitError) as caught:
        load_measurements(path)
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    return message


BAD_CSV = {
    "empty": (b"", ["a.csv: the file is empty"]),
    "header only": (b"time,q\n", ["a.csv, line 1", "no rows of numbers"]),
    "one row": (b"time,q\n0,1\n", ["a.csv", "at least two samples"]),
    "no header": (b"0,1\n1,2\n", ["a.csv, line 1", "column names were expected"]),
    "text in a cell": (b"time,q\n0,1\n\n1,abc\n", ["a.csv, line 4: column 'q' holds 'abc', expected a number"]),
    "empty cell": (b"time,q\n0,\n1,2\n", ["line 2: column 'q' holds ''"]),
    "grouped digits": (b"time,q\n0,1_0\n1,2\n", ["line 2: column 'q' holds '1_0'"]),
    "nan": (b"time,q\n0,1\n1,nan\n", ["line 3: column 'q' is nan, expected a finite number"]),
    "infinity": (b"time,q\n0,-inf\n1,2\n", ["line 2: column 'q' is -inf"]),
    "short row": (b"time,q\n0,1\n1\n2,3\n", ["line 3: 1 cells, but the header names 2 columns"]),
    "long row": (b"time,q\n0,1,2\n1,2,3\n", ["line 2: 3 cells"]),
    "time runs back": (b"time,q\n0,1\n0.5,1\n0.25,1\n", ["line 4: time 0.25 s follows 0.5 s", "sort the rows"]),
    "time stands still": (b"time,q\n3,1\n3,1\n", ["line 3: time 3 s follows 3 s"]),
    "no time": (b"x,q\n0,1\n1,1\n", ["no time column", "'x', 'q'"]),
    "same name twice": (b"time,q,q\n0,1,1\n", ["line 1: two columns are named 'q'"]),
    "unnamed column": (b"time,,q\n0,1,1\n", ["line 1: column 2 has no name"]),
    "semicolons": (b"time;q\n0;1\n", ["line 1", "not separated by commas"]),
    "latin-1": (b"time,q \xb0\n0,1\n", ["byte 0xb0 at position 7 is not UTF-8"]),
    "binary": (b"PAR1\0\0\0", ["a.csv: a binary file"]),
}


@pytest.mark.parametrize("kind", BAD_CSV)
def test_a_bad_csv_file_is_named_with_the_line_and_the_value(write_case: WriteCase, kind: str) -> None:
    content, words = BAD_CSV[kind]
    message = message_of(write_case({"a.csv": content}) / "a.csv")
    assert [word for word in words if word not in message] == []


BAD_CASE = {
    "invalid TOML": ("files = [\n[columns]\nq = \n", "not valid TOML"),
    "line of the syntax error": ("\n\nq = \n", "line 3"),
    "missing file": ('files = ["b.csv"]', "b.csv: does not exist"),
    "file twice": ('files = ["a.csv", "a.csv"]', "files names 'a.csv' twice"),
    "same file, other path": ('files = ["a.csv", "./a.csv"]', "twice"),
    "no file": ("files = []", "no data files"),
    "files is text": ('files = "a.csv"', "expected a list of strings"),
    "missing parquet": ('files = ["a.parquet"]', "a.parquet: does not exist"),
    "other ending": ('files = ["a.dat"]', "ending '.dat'"),
    "missing column": (
        '[columns]\nw = "rad/s"',
        "a.csv: no column 'w', which case.toml names in [columns]; columns found: 'time', 'q'",
    ),
    "missing mapped column": ('[variables]\nw = "speed"', "names in [variables]"),
    "unknown unit": ('[columns]\nq = "furlong"', "[columns]: column 'q'"),
    "unit is no text": ("[columns]\nq = 1", "'q' = 1, expected a string"),
    "time in metres": ('[columns]\ntime = "m"', "expected a unit of time such as s"),
    "two columns, one variable": ('[variables]\ntime = "x"\nq = "x"', "columns 'time' and 'q' are both mapped to 'x'"),
    "negative noise": (
        "[sensors]\nencoder_noise_std_rad = -1e-3",
        "'encoder_noise_std_rad' = -0.001, expected 0 or more",
    ),
    "sensor unit": ("[sensors]\nencoder_noise_std_foo = 1", "'foo' is no unit"),
    "rate of zero": ("[sampling]\nrate_hz = 0", "expected a number above 0"),
    "table is a number": ("columns = 3", "'columns' = 3, expected a table"),
    "flag is text": ('[initial_conditions]\ngiven = "no"', "expected true or false"),
}


@pytest.mark.parametrize("kind", BAD_CASE)
def test_a_bad_case_file_is_named_with_the_key_and_the_value(write_case: WriteCase, swing: str, kind: str) -> None:
    case, words = BAD_CASE[kind]
    message = message_of(write_case({"a.csv": swing}, case))
    assert words in message


def test_a_path_that_does_not_exist_is_named(tmp_path: Path) -> None:
    message = message_of(tmp_path / "nowhere")
    assert "nowhere: does not exist; expected a folder with case.toml" in message


def test_a_folder_without_data_says_what_was_expected(tmp_path: Path) -> None:
    assert "no case.toml and no *.csv file" in message_of(tmp_path)


@pytest.mark.parametrize(("ending", "words"), [("parquet", "Parquet"), ("mf4", "MF4"), ("h5", "HDF5")])
def test_a_damaged_typed_file_is_named(write_case: WriteCase, ending: str, words: str) -> None:
    message = message_of(write_case({f"a.{ending}": b"PAR1"}) / f"a.{ending}")
    assert f"a.{ending} cannot be read as {words}" in message


def test_a_folder_in_the_place_of_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.csv").mkdir()
    assert "a.csv: cannot be read" in message_of(tmp_path)


def test_a_case_file_in_another_encoding_is_refused(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_bytes("files = []".encode("utf-16"))
    assert "byte 0xff at position 0 is not UTF-8" in message_of(tmp_path)


def test_an_error_in_a_deeply_nested_case_file_is_still_one_line(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text("a = " + "[" * 5000)
    assert "not valid TOML" in message_of(tmp_path)
