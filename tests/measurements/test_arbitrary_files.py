"""No content of a file raises anything but the error for users."""

import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from fmus.errors import MisfitError
from orchestrator.measurements import MeasurementSet, load_measurements

GOOD_CSV = b"time,q\n0,1\n1,2\n2,3\n3,4\n"

# Bytes that nearly are a csv or TOML file reach further than random ones.
csv_like = st.lists(
    st.sampled_from(["time", "q", "0", "1.5", "-2e-3", "nan", "", '"', "1_0", "x", "9e99"]), max_size=12
).flatmap(
    lambda cells: st.lists(
        st.sampled_from([",", "\n", "\r\n", "\r", ";", "\x0b", "\u2028", " "]), min_size=len(cells), max_size=len(cells)
    ).map(lambda gaps: "".join(c + g for c, g in zip(cells, gaps, strict=True)))
)
key = st.sampled_from(
    ["files", "learning", "held_out", "learning_window_s", "held_out_window_s"]
    + ["sampling.rate_hz", "columns.q", "columns.time", "variables.q", "sensors.q"]
    + ["sensors.q_noise_std_rad", "initial_conditions.given", "columns", "other"]
)
value = st.sampled_from(
    ["1", "-1", "1e400", "nan", "true", '"s"', '"a.csv"', '["a.csv"]', "[]", "[1]"]
    + ["[0.0, 2.0]", "[2, 4]", "{}", "1979-05-27", '"time"', "9" * 400, '"m"', '"\\n"']
)
toml_like = st.lists(st.tuples(key, value), max_size=5).map(lambda pairs: "\n".join(f"{k} = {v}" for k, v in pairs))


def load_or_refuse(files: dict[str, bytes]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for name, content in files.items():
            (Path(folder) / name).write_bytes(content)
        try:
            loaded = load_measurements(folder)
        except MisfitError as error:
            assert len(str(error).splitlines()) == 1
        else:
            assert isinstance(loaded, MeasurementSet)
            assert all(len(trial.time) >= 2 for trial in loaded.trials)


@settings(deadline=None, max_examples=150, derandomize=True)
@given(st.binary(max_size=200) | csv_like.map(str.encode))
def test_any_csv_content_loads_or_is_refused_in_one_line(content: bytes) -> None:
    load_or_refuse({"a.csv": content})


@settings(deadline=None, max_examples=150, derandomize=True)
@given(st.binary(max_size=200) | toml_like.map(str.encode))
def test_any_case_content_loads_or_is_refused_in_one_line(content: bytes) -> None:
    load_or_refuse({"case.toml": content, "a.csv": GOOD_CSV})
