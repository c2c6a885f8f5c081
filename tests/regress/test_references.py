"""References from wherever they come: files of every format, the FMU itself, other FMUs, measurements."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cases_of_balls import case_file, decay_reference, fmu

from fmus.reference_files import FOLDER, MANIFEST
from orchestrator.regress.case import Case, Reference
from orchestrator.regress.case_file import read_cases
from orchestrator.regress.collect import collect
from orchestrator.regress.execute import execute
from orchestrator.results.column import Column
from orchestrator.results.recorder import recorder_for

RUN = '\n[run]\nstop = 2.0\nstep = 0.01\ninterface = "CoSimulation"\n'


def _case(folder: Path, text: str) -> Case:
    return read_cases(case_file(folder, "c", text))[0]


def _table(path: Path, columns: dict[str, tuple[str, np.ndarray]], time: np.ndarray) -> None:
    recorder = recorder_for(path)
    recorder.begin([Column(name, unit) for name, (unit, _) in columns.items()], {})
    recorder.rows(time, np.column_stack([values for _, values in columns.values()]))
    recorder.finish()


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".h5", ".mf4"])
def test_a_reference_in_any_format_tells_right_from_wrong(ending: str, tmp_path: Path) -> None:
    fmu(tmp_path, "decay")
    time = np.linspace(0.0, 2.0, 201)
    _table(tmp_path / f"ref{ending}", {"x": ("", np.exp(-time))}, time)
    case = _case(tmp_path, f'model = "decay.fmu"\nreference = "ref{ending}"{RUN}')

    wrong = replace(case, parameters={"k": _value(1.01)})

    assert execute(case).verdict == "passed"
    assert execute(wrong).verdict == "failed"


def test_a_reference_in_another_unit_is_converted_and_in_another_dimension_refused(tmp_path: Path) -> None:
    """A mass of 1 kg at rest at x0 = 1 m stays there."""
    fmu(tmp_path, "mass")
    time = np.linspace(0.0, 2.0, 201)
    for name, unit, value in (("mm", "mm", 1000.0), ("wrong", "mm", 1.0), ("volts", "V", 1.0)):
        _table(tmp_path / f"{name}.parquet", {"x": (unit, np.full(201, value))}, time)
    cases = {
        name: _case(tmp_path, f'model = "mass.fmu"\nreference = "{name}.parquet"{RUN}[signals.x]\n')
        for name in ("mm", "wrong", "volts")
    }

    found = {name: execute(case) for name, case in cases.items()}

    assert found["mm"].verdict == "passed", found["mm"].reason
    assert found["wrong"].verdict == "failed"
    assert found["volts"].verdict == "failed" and "dimension" in found["volts"].reason


def test_another_fmu_is_run_beside_with_the_same_inputs(tmp_path: Path) -> None:
    fmu(tmp_path, "decay", to="old")
    fmu(tmp_path, "decay", to="new")
    text = (
        'model = "new.fmu"\nreference = { model = "old.fmu" }\ninputs = { u = { kind = "step", at = 0.5, to = 1.0 } }'
    )
    case = _case(tmp_path, text + RUN)

    outcome = execute(case)

    assert outcome.verdict == "passed" and "old.fmu, run beside" in outcome.where


def test_a_driven_decay_follows_its_closed_form(tmp_path: Path) -> None:
    """x = e^-t until the step at 0.5 s, then x = 1 + (e^-0.5 - 1) e^-(t - 0.5)."""
    fmu(tmp_path, "decay")
    time = np.linspace(0.0, 2.0, 201)
    after = 1.0 + (np.exp(-0.5) - 1.0) * np.exp(-(time - 0.5))
    _table(tmp_path / "ref.csv", {"x": ("", np.where(time < 0.5, np.exp(-time), after))}, time)
    _table(tmp_path / "in.csv", {"drive": ("", np.where(time < 0.5 - 1e-9, 0.0, 1.0))}, time)
    head = 'model = "decay.fmu"\nreference = "ref.csv"\ntolerance = { relative = 0.0, absolute = 1e-9 }'

    generated = _case(tmp_path, head + '\ninputs = { u = { kind = "step", at = 0.5, to = 1.0 } }' + RUN)
    recorded = _case(tmp_path, head + '\ninputs = { file = "in.csv", hold = true, columns = { u = "drive" } }' + RUN)

    assert execute(generated).verdict == "passed", execute(generated).reason
    assert execute(recorded).verdict == "passed", execute(recorded).reason


@pytest.mark.parametrize(("rate", "verdict"), [(1.0, "passed"), (1.3, "failed")])
def test_a_measurement_is_met_within_its_noise(rate: float, verdict: str, tmp_path: Path) -> None:
    fmu(tmp_path, "decay")
    folder = tmp_path / "bench"
    folder.mkdir()
    time = np.arange(201) * 0.01
    noise = np.random.default_rng(7).normal(0.0, 0.01, 201)
    rows = "\n".join(f"{t:.6f},{x:.9f},0.0" for t, x in zip(time, np.exp(-rate * time) + noise, strict=True))
    (folder / "trial_01.csv").write_text(f"time,x,u\n{rows}\n")
    (folder / "case.toml").write_text(
        'files = ["trial_01.csv"]\nlearning = [1]\n[columns]\ntime = "s"\nx = "1"\nu = "1"\n'
    )
    case = _case(tmp_path, 'model = "decay.fmu"\nreference = { measurement = "bench" }\n')

    outcome = execute(case)

    assert outcome.verdict == verdict, outcome.reason
    assert "5 x its noise" in outcome.where


def test_results_that_the_manifest_of_an_fmu_names_are_its_case(tmp_path: Path) -> None:
    """fmi-ls-ref says which file holds results, nothing of inputs or tolerances."""
    import zipfile

    path = fmu(tmp_path, "decay")
    decay_reference(tmp_path / "ref.csv", stop=10.0)
    manifest = (
        '<fmiReferences xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest" fmi-ls:fmi-ls-name="org.fmi-standard.fmi-ls-ref" '
        'fmi-ls:fmi-ls-version="1.0.0-alpha.1" fmi-ls:fmi-ls-description="x"><Related source="ref.csv" role="result" type="text/csv"/></fmiReferences>'
    )
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(MANIFEST, manifest)
        archive.write(tmp_path / "ref.csv", f"{FOLDER}/ref.csv")

    (case,), _ = collect([path])

    assert case.reference == Reference("own", points=True)
    assert execute(case).verdict == "passed", execute(case).reason


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("time,x\n", "no column time"),
        ("time,x\n0.0,1.0\n0.0,1.0\n0.0,1.0\n0.0,1.0\n2.0,0.1\n", ""),
        ("seconds,x\n0.0,1.0\n", "no column time, t or time_s"),
        ("time,x\n0.0,1.0\n1.0,0.36788\n0.5,0.60653\n2.0,0.13534\n", "back"),
        ("time,x\n0.0,1.0\n1.0,nan\n2.0,0.13534\n", "nan"),
    ],
)
def test_a_damaged_reference_is_never_green(rows: str, words: str, tmp_path: Path) -> None:
    fmu(tmp_path, "decay")
    (tmp_path / "ref.csv").write_text(rows)

    outcome = execute(_case(tmp_path, f'model = "decay.fmu"\nreference = "ref.csv"{RUN}'))

    assert outcome.verdict != "passed"
    assert words in outcome.reason.lower()


@pytest.mark.parametrize("stop", [1.0, 3.0])
def test_a_result_of_another_length_than_its_reference_is_never_green(stop: float, tmp_path: Path) -> None:
    fmu(tmp_path, "decay")
    decay_reference(tmp_path / "ref.csv", stop=stop)

    assert execute(_case(tmp_path, f'model = "decay.fmu"\nreference = "ref.csv"{RUN}')).verdict == "failed"


def _value(value: float):
    from orchestrator.cosim.system import Value

    return Value(value)
