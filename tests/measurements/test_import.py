"""Files as people have them become measurement sets without a line of TOML written by hand."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from fmus.errors import MisfitError
from orchestrator.cli.analyse import compare
from orchestrator.cli.import_data import import_data
from orchestrator.measurements import bind, load_measurements
from orchestrator.measurements.dirty.header_units import split_header
from orchestrator.measurements.dirty.plan import proposed_plan
from orchestrator.model_argument import load_model
from tests.measurements.dirty_files import KINDS, SAMPLES, dirty_files, recording


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(import_data, [str(each) for each in arguments])


def imported(folder: Path, kind: str) -> Path:
    dirty = dirty_files()[kind]
    (folder / f"record{dirty.ending}").write_bytes(dirty.content)
    done = run(folder / f"record{dirty.ending}", "--model", "drive", "--yes", *dirty.options)
    assert done.exit_code == 0, (done.output, done.exception)
    return folder


def test_there_are_forty_one_dirty_files() -> None:
    assert len(KINDS) == 41 and tuple(dirty_files()) == KINDS


def test_times_without_rows_are_told(tmp_path: Path) -> None:
    rows = [f"{k / 100},{k % 7},{np.sin(k / 20):.5f}" for k in range(600) if not 200 <= k < 260]
    (tmp_path / "a.csv").write_text("\n".join(["time,torque,phi", *rows]))

    told = " ".join(run(tmp_path / "a.csv", "--model", "drive", "--yes").output.split())

    assert "a.csv: no rows from 1.99 to 2.6 s: nothing is compared there" in told


def test_an_input_that_is_sampled_slower_keeps_the_rows_of_the_others(tmp_path: Path) -> None:
    rows = [f"{k / 100},{np.sin(k / 50) if k % 10 == 0 else ''},{np.sin(k / 20):.5f}" for k in range(305)]
    (tmp_path / "a.csv").write_text("\n".join(["t [s],torque [N.m],phi [rad]", *rows]))
    assert run(tmp_path, "--model", "drive", "--yes").exit_code == 0

    trials = load_measurements(tmp_path).trials

    assert sum(len(trial.time) for trial in trials) == 301
    torque = np.concatenate([trial.columns["torque [N.m]"] for trial in trials])
    assert np.allclose(torque, np.sin(np.arange(301) / 50), atol=0.006)  # (0.2)^2 / 8 between the samples


def test_a_mode_beside_one_signal_is_no_name_of_a_signal(tmp_path: Path) -> None:
    rows = [f"{k / 100},{'RUN' if k % 40 < 20 else 'STOP'},{np.sin(k / 20):.5f}" for k in range(200)]
    (tmp_path / "a.csv").write_text("\n".join(["t,mode,phi", *rows]))
    assert run(tmp_path, "--model", "drive", "--yes").exit_code == 0

    assert set(load_measurements(tmp_path).trials[0].columns) == {"phi"}


def test_seconds_of_a_machine_that_has_run_for_long_are_no_days(tmp_path: Path) -> None:
    rows = [f"{45000 + k / 10:.1f},{np.sin(k / 20):.5f}" for k in range(200)]
    (tmp_path / "a.csv").write_text("\n".join(["t,phi", *rows]))
    assert run(tmp_path, "--model", "drive", "--yes").exit_code == 0

    (trial, *_) = load_measurements(tmp_path).learning
    assert trial.time[1] - trial.time[0] == pytest.approx(0.1)


@pytest.mark.parametrize("kind", KINDS)
def test_a_dirty_file_is_read_as_the_numbers_that_were_recorded(kind: str, tmp_path: Path) -> None:
    measurements = load_measurements(imported(tmp_path, kind))
    model = load_model("drive")
    bound = bind(measurements, model.inputs, model.outputs)
    time, torque, angle = recording()

    assert "torque" not in bound.unconnected_inputs
    joined = np.concatenate([trial.time for trial in bound.trials])
    joined -= joined[0]
    scale = 3.0 if "midnight" in kind else 1.0
    rows = np.rint(joined / scale * 100).astype(int)
    assert len(rows) == dirty_files()[kind].kept and rows[-1] == SAMPLES - 1
    assert np.allclose(joined, scale * time[rows], atol=2e-3)
    driven = np.concatenate([trial.inputs[:, list(bound.input_names).index("torque")] for trial in bound.trials])
    # The two samples beside a gap are moved, so that the line between them has the mean of a smooth curve.
    assert np.quantile(np.abs(driven - torque[rows]), 0.99 if "gap" in kind else 1.0) < 2e-6
    seen = np.concatenate([trial.outputs[:, 0] for trial in bound.trials])
    assert np.quantile(np.abs(seen - angle[rows]), 0.97) < 2e-6


@pytest.mark.parametrize("kind", ["tabs, units in brackets, degrees", "holes, markers and a long gap", "ISO stamps"])
def test_what_was_imported_can_be_compared_and_fits_its_own_model(kind: str, tmp_path: Path) -> None:
    folder = imported(tmp_path, kind)

    done = CliRunner().invoke(compare, ["drive", str(folder), "--json", str(tmp_path / "c.json"), "--quiet"])

    assert done.exit_code == 0, (done.output, done.exception)
    assert json.loads((tmp_path / "c.json").read_text())["held_out"]["over_floor"] < 1.5


def test_an_input_that_stays_and_jumps_is_proposed_as_held_and_can_be_set(tmp_path: Path) -> None:
    rows = [f"{k / 100:.2f},{[0.0, 0.3, 0.1][k // 10 % 3]},{np.sin(k / 20):.5f}" for k in range(200)]
    (tmp_path / "a.csv").write_text("\n".join(["time,torque,phi", *rows]))
    model = load_model("drive")

    def held(*options: str) -> tuple[str, ...]:
        done = run(tmp_path / "a.csv", "--model", "drive", "--yes", *options)
        assert done.exit_code == 0, done.exception
        return bind(load_measurements(tmp_path), model.inputs, model.outputs).trials[0].held

    assert held() == ("torque",)
    assert held("--interpolation", "torque=linear") == ()


def test_the_course_of_an_input_that_neither_jumps_nor_was_set_stays_open_for_model_and_record(tmp_path: Path) -> None:
    """The import said "linear" of every input that does not stay, so a held torque was never found out."""
    rows = [f"{k / 100:.2f},{np.sin(k / 7):.5f},{np.sin(k / 20):.5f}" for k in range(200)]
    (tmp_path / "a.csv").write_text("\n".join(["time,torque,phi", *rows]))

    def said(*options: str) -> dict[str, str]:
        assert run(tmp_path / "a.csv", "--model", "drive", "--yes", *options).exit_code == 0
        return dict(load_measurements(tmp_path).interpolation)

    assert said() == {}
    assert said("--interpolation", "torque=linear") == {"torque": "linear"}


def test_a_column_in_the_wrong_dimension_is_never_matched_even_under_the_right_name(tmp_path: Path) -> None:
    rows = [f"{k / 100},{k % 7},{k / 50}" for k in range(50)]
    (tmp_path / "a.csv").write_text("\n".join(["time,torque [N],phi [rad]", *rows]))

    done = run(tmp_path / "a.csv", "--model", "drive", "--yes", "--json", "-", "--quiet")

    columns = {row["column"]: row["variable"] for row in json.loads(done.output)["columns"]}
    assert columns == {"torque [N]": "", "phi [rad]": "phi"}


def test_a_temperature_in_degrees_celsius_is_a_kelvin_variable_with_its_offset(tmp_path: Path) -> None:
    from fmus.symbolic.system import Variable

    rows = [f"{k},{20 + k / 100}" for k in range(60)]
    (tmp_path / "a.csv").write_text("\n".join(["time [s],T_room [°C]", *rows]))
    assert run(tmp_path / "a.csv", "--yes").exit_code == 0

    plan = proposed_plan([tmp_path / "a.csv"], (), (Variable("room.T", "K"),))
    assert plan.variable_of == {"T_room [°C]": "room.T"}
    (tmp_path / "case.toml").write_text(
        'files = ["a.csv"]\n[columns]\n"T_room [°C]" = "degC"\n[variables]\n"time [s]" = "time"\n"T_room [°C]" = "room.T"\n'
    )
    kelvin = bind(load_measurements(tmp_path), (), (Variable("room.T", "K"),)).trials[0].outputs[:, 0]
    assert kelvin[0] == pytest.approx(293.15) and kelvin[-1] - kelvin[0] < 1.0


def test_a_unit_that_no_header_states_is_said_to_be_taken_from_the_model(tmp_path: Path) -> None:
    rows = "".join(f"{k / 100},{k % 7},{k / 50}\n" for k in range(100))
    (tmp_path / "a.csv").write_text(f"time,torque [N.m],phi\n{rows}")

    told = " ".join(run(tmp_path / "a.csv", "--model", "drive", "--yes").output.split())

    assert "no unit is stated, so the model's is taken: phi (rad);" in told


def test_several_files_are_trials_of_which_the_last_third_is_held_out(tmp_path: Path) -> None:
    for number in range(1, 7):
        rows = [f"{k / 100:.2f};{k / 50:.3f}".replace(".", ",") for k in range(40)]
        (tmp_path / f"run_{number}.csv").write_text("\n".join(["time;phi", *rows]))
    (tmp_path / "readme.txt").write_text("Six runs of the drive.\n")

    assert run(tmp_path, "--model", "drive", "--yes").exit_code == 0

    found = load_measurements(tmp_path)
    assert [trial.name for trial in found.held_out] == ["run_5.csv", "run_6.csv"]


def test_a_hand_written_case_is_never_written_over(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,phi\n0,1\n1,2\n2,3\n")
    (tmp_path / "case.toml").write_text('files = ["a.csv"]\n')

    done = run(tmp_path / "a.csv", "--yes")

    assert isinstance(done.exception, MisfitError) and "--out" in str(done.exception)
    assert (tmp_path / "case.toml").read_text() == 'files = ["a.csv"]\n'


def test_a_column_in_newton_cannot_be_made_a_torque(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,x [N],phi\n0,1,2\n1,2,3\n2,3,4\n")

    error = run(tmp_path / "a.csv", "--model", "drive", "--yes", "--map", "x [N]=torque").exception

    assert isinstance(error, MisfitError) and "is in N, which is no N.m" in str(error)


def test_without_a_terminal_the_answer_has_to_be_given_by_yes(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,phi\n0,1\n1,2\n2,3\n")

    assert "--yes" in str(run(tmp_path / "a.csv").exception)
    assert not (tmp_path / "case.toml").exists()


BAD = {
    "binary": (b"PAR1\0\0\0\1\2\3", "a binary file"),
    "empty": (b"", "the file is empty"),
    "prose": (b"Dear colleague,\nthe data follow.\n", "no table of numbers"),
    "no time": (b"q;u\n1,5;2\n1,2;3\n1,7;1\n", "no column holds time"),
    "two recordings": (
        ("time,q\n" + "".join(f"{k % 50},{k}\n" for k in range(100))).encode(),
        "time (column 'time') goes back from 49 s to 0 s",
    ),
}


@pytest.mark.parametrize("kind", BAD)
def test_what_is_no_recording_is_refused_in_one_line_that_says_why(kind: str, tmp_path: Path) -> None:
    content, words = BAD[kind]
    (tmp_path / "a.csv").write_bytes(content)

    error = run(tmp_path / "a.csv", "--yes").exception

    assert isinstance(error, MisfitError) and words in str(error) and "\n" not in str(error)


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("alpha[1]", "alpha[1]", None),
        ("theta [deg]", "theta", "deg"),
        ("Torque/N.m", "Torque", "N.m"),
        ("p (mbar)", "p", "mbar"),
        ("u_a", "u_a", None),
        ("speed [1/min]", "speed", "rpm"),
    ],
)
def test_a_header_is_split_into_name_and_unit(header: str, name: str, unit: str | None) -> None:
    assert split_header(header) == (name, unit)


def test_units_in_brackets_are_shown_on_a_terminal(tmp_path: Path) -> None:
    """Console markup had swallowed `[rad]` and `[s]`."""
    rows = "".join(f"{k / 100},{k % 7},{k / 50}\n" for k in range(100))
    (tmp_path / "a.csv").write_text(f"time [s],torque [N.m],phi [rad]\n{rows}")

    done = CliRunner().invoke(import_data, [str(tmp_path), "--model", "drive", "--yes"])

    assert "phi [rad]" in done.output
    assert "time: time [s]" in done.output


def test_a_flow_behind_an_underscore_is_a_unit_and_an_input_without_a_column_is_told(tmp_path: Path) -> None:
    text = 'model Tank\n  input Real pump(unit="m3/s");\n  input Real drain(unit="m3/s");\n'
    text += '  output Real h(unit="m", start=0.2, fixed=true);\nequation\n  0.05*der(h) = pump - drain;\nend Tank;\n'
    (tmp_path / "Tank.mo").write_text(text)
    rows = [f"{t},{60 + t},{20 + 2 * t}" for t in range(20)]
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "run.csv").write_text("\n".join(["t_s,pump_l_min,h_cm", *rows]))
    done = run(tmp_path / "data", "--model", f"{tmp_path / 'Tank.mo'}:Tank", "--yes", "--library", tmp_path)
    assert done.exit_code == 0, done.output
    assert "no column is the input 'drain' of the model" in " ".join(done.output.split())
    model = load_model(f"{tmp_path / 'Tank.mo'}:Tank")
    bound = bind(load_measurements(tmp_path / "data"), model.inputs, model.outputs)
    assert bound.unconnected_inputs == ("drain",)
    assert bound.trials[0].inputs[0, 0] == pytest.approx(60e-3 / 60)
