"""Case files: what is read, and how mistakes are told."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.errors import MisfitError
from orchestrator.regress.case_file import read_cases
from orchestrator.regress.check_tables import check_kinds
from orchestrator.regress.wave import GENERATORS, Wave, generated


def _read(folder: Path, text: str):
    path = folder / "ball.regress.toml"
    path.write_text(text)
    return read_cases(path)


def test_cases_of_a_file_share_what_stands_before_them_and_add_their_own(tmp_path: Path) -> None:
    first, second = _read(
        tmp_path,
        """
        model = "ball.fmu"
        run = { stop = 2.0, step = 0.01 }
        parameters = { e = 0.7 }
        [[case]]
        name = "drop"
        [[case]]
        name = "on the moon"
        parameters = { g = "1.62 m/s2" }
        run = { stop = 9.0 }
        """,
    )

    assert (first.name, first.stop, first.step) == ("ball/drop", 2.0, 0.01)
    assert (second.name, second.stop, second.step) == ("ball/on the moon", 9.0, 0.01)
    assert {name: value.value for name, value in second.parameters.items()} == {"e": 0.7, "g": "1.62 m/s2"}


def test_a_signal_takes_what_its_table_leaves_out_from_the_tolerance_of_the_case(tmp_path: Path) -> None:
    (case,) = _read(
        tmp_path,
        """
        model = "ball.fmu"
        tolerance = { relative = 0.01, time_shift_s = 0.002 }
        [signals.h]
        absolute = 0.5
        [[signals.v]]
        [[signals.v]]
        check = "bounds"
        lower = -20.0
        """,
    )

    (tube,), (usual, bounds) = case.signals["h"], case.signals["v"]
    assert (tube.tolerance.absolute, tube.tolerance.relative, tube.tolerance.time_shift_s) == (0.5, 0.01, 0.002)
    assert (usual.tolerance.absolute, usual.tolerance.relative) == (None, 0.01)
    assert bounds.lower == -20.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no model"),
        ("model = 3", "'model' = 3, expected a string"),
        ("model = 'a.fmu'\nmodle = 1", "unknown key 'modle'; did you mean 'model'?"),
        ("model = 'a.fmu'\n[run]\nstop = inf", "expected a finite number"),
        ("model = 'a.fmu'\n[run]\nstep = 0.0", "expected a number above 0"),
        ("model = 'a.fmu'\n[run]\ninterface = 'ME'", "expected CoSimulation or ModelExchange"),
        ("model = 'a.fmu'\n[reference]\nfile = 'a.csv'\nown = true", "file and own; expected one of"),
        ("model = 'a.fmu'\n[signals.h]\ncheck = 'tub'", "did you mean 'tube'?"),
        ("model = 'a.fmu'\n[signals.h]\nabsolut = 1", "did you mean 'absolute'?"),
        ("model = 'a.fmu'\n[signals.h]\nabsolute = -1.0", "0 or more"),
        ("model = 'a.fmu'\n[checks]\ndeterminsm = true", "did you mean 'determinism'?"),
        ("model = 'a.fmu'\n[checks]\nspeed = true", "no fmu"),
        ("model = 'a.fmu'\n[limits]\nretries = 11", "from 0 to 10"),
        ("model = 'a.fmu'\n[[case]]\nname = 'x'\n[[case]]\nname = 'x'", "two cases are called"),
        ("model = 'a.fmu'\n[inputs]\nu = 'fast'", "a number or a generator"),
        ("model = ", "not valid TOML"),
    ],
)
def test_a_mistake_names_the_file_and_what_was_expected(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(MisfitError) as raised:
        _read(tmp_path, text)

    assert words in str(raised.value)
    assert "ball.regress.toml" in str(raised.value)
    assert "\n" not in str(raised.value)


def test_every_kind_of_check_can_be_written_in_a_case_file() -> None:
    assert {"tube", "funnel", "pointwise", "events", "end_value", "bounds", "conserved", "statistics"} <= set(
        check_kinds()
    )


_EXAMPLES = {
    "constant": {"value": 2.0},
    "step": {"at": 0.5, "from": 1.0, "to": 2.0},
    "ramp": {"at": 0.2, "until": 0.7, "from": 1.0, "to": 2.0},
    "pulse": {"at": 0.3, "width": 0.2, "to": 5.0},
    "sine": {"amplitude": 2.0, "frequency": 1.0},
    "chirp": {"amplitude": 2.0, "from_hz": 1.0, "to_hz": 3.0},
    "random": {"low": -1.0, "high": 1.0, "hold_s": 0.1},
    "table": {"times": [0.0, 0.5, 0.5], "values": [1.0, 1.0, 3.0]},
}
# Values at 0.25 s and 0.75 s by hand; the chirp's phase is 2 pi (f t + (f_end - f) t^2 / 2).
_EXPECTED = {
    "constant": (2.0, 2.0),
    "step": (1.0, 2.0),
    "ramp": (1.1, 2.0),
    "pulse": (0.0, 0.0),
    "sine": (2.0, -2.0),
    "chirp": (2.0 * np.sin(2 * np.pi * (0.25 + 0.0625)), 2.0 * np.sin(2 * np.pi * (0.75 + 0.5625))),
    "table": (1.0, 3.0),
}


@pytest.mark.parametrize("kind", GENERATORS)
def test_a_generator_gives_the_values_that_its_formula_says(kind: str) -> None:
    wave = generated({"kind": kind, **_EXAMPLES[kind]}, 0.0, 1.0, 0.01)

    found = wave.at(0.25), wave.at(0.75)
    if kind == "random":
        again = generated({"kind": kind, **_EXAMPLES[kind]}, 0.0, 1.0, 0.01)
        assert found == (again.at(0.25), again.at(0.75))
        assert all(-1.0 <= value <= 1.0 for value in found)
    else:
        np.testing.assert_allclose(found, _EXPECTED[kind], atol=1e-12)


@given(
    st.lists(st.tuples(st.floats(0.0, 10.0), st.floats(-5.0, 5.0)), min_size=1, max_size=12),
    st.floats(-1.0, 11.0),
    st.booleans(),
)
def test_a_wave_never_leaves_the_range_of_its_points(
    points: list[tuple[float, float]], time: float, hold: bool
) -> None:
    times, values = (np.array(column) for column in zip(*sorted(points), strict=True))

    assert min(values) - 1e-12 <= Wave(times, values, hold).at(time) <= max(values) + 1e-12
