"""Importers that others wrote run every FMU of the library alike."""

import json
import subprocess
import sys
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description  # type: ignore[import-untyped]
from importers import Job, Rows, tbb_library

from fmus.validate import validate_fmu

CHILD = Path(__file__).with_name("importers.py")
STEPS = 50
CO_SIMULATION, MODEL_EXCHANGE = 1e-12, 1e-6  # the same steps; another integrator


@pytest.fixture(scope="session")
def jobs(library: list[Path]) -> list[Job]:
    """Half a hundred steps of each FMU, with inputs that differ from each other and from zero."""
    return [_job(fmu) for fmu in library]


@pytest.fixture(scope="session")
def expected(jobs: list[Job], tmp_path_factory: pytest.TempPathFactory) -> list[Rows]:
    """What FMPy gets by co-simulation."""
    return _run("fmpy_co_simulation", jobs, tmp_path_factory.mktemp("expected"))


def _job(fmu: Path) -> Job:
    description = read_model_description(str(fmu))
    inputs = [v for v in description.modelVariables if v.causality == "input"]
    outputs = [v.name for v in description.modelVariables if v.causality == "output" and not v.dimensions]
    step = float(description.defaultExperiment.stepSize)
    # A newton moves the kilograms of the plants by too little in so short a time.
    sizes = [10.0 if v.unit == "N" else 1.0 for v in inputs]
    values = {v.name: size * (0.2 + 0.05 * i) for i, (v, size) in enumerate(zip(inputs, sizes, strict=True))}
    return Job(str(fmu), step, STEPS, values, outputs)


def _run(importer: str, jobs: list[Job], folder: Path) -> list[Rows]:
    files = (folder / "jobs.json", folder / "results.json")
    files[0].write_text(json.dumps([asdict(job) for job in jobs]))
    command = [sys.executable, str(CHILD), importer, *map(str, files)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    rows = [json.loads(line) for line in files[1].read_text().splitlines()]
    at = Path(jobs[len(rows)].fmu).name if len(rows) < len(jobs) else "the end"
    assert done.returncode == 0, f"{importer} at {at}: {done.returncode} {done.stderr[-2000:]}"
    return rows


def _worst(jobs: list[Job], rows: list[Rows], expected: list[Rows]) -> dict[str, float]:
    """Largest difference of each FMU, relative to the largest value of each output."""
    worst = {}
    for job, mine, other in zip(jobs, rows, expected, strict=True):
        reference = np.array(other)
        assert np.shape(mine) == reference.shape == (STEPS, len(job.outputs))
        assert np.abs(reference).max() > 0.01, f"nothing happens in {job.fmu}"
        scale = np.abs(reference).max(axis=0) + 1e-9
        worst[Path(job.fmu).name] = float((np.abs(np.array(mine) - reference) / scale).max())
    return worst


def test_every_fmu_of_the_library_is_without_findings(library: list[Path]) -> None:
    findings = {fmu.name: validate_fmu(fmu) for fmu in library}
    assert findings == {name: [] for name in findings}


@pytest.mark.parametrize(
    ("importer", "module", "fmi_versions", "tolerance"),
    [
        ("fmpy_model_exchange", "fmpy", "23", MODEL_EXCHANGE),
        ("fmu_container", "fmu_manipulation_toolbox", "23", CO_SIMULATION),
        # Version 0.0.6 ends with a segmentation fault while it loads any FMU of FMI 3.
        ("libcosim", "libcosimpy", "2", CO_SIMULATION),
        ("ecos", "ecospy", "23", CO_SIMULATION),
        ("pathsim", "pathsim_fmi", "23", MODEL_EXCHANGE),
    ],
)
def test_every_fmu_of_the_library_takes_the_same_course(
    importer: str,
    module: str,
    fmi_versions: str,
    tolerance: float,
    jobs: list[Job],
    expected: list[Rows],
    tmp_path: Path,
) -> None:
    if find_spec(module) is None:
        pytest.skip(f"{module} is not installed")
    if importer == "ecos" and tbb_library() is None:
        pytest.skip("ecospy needs libtbb.so.12, which its wheel lacks; install Debian's libtbb12 or the wheel tbb")
    chosen = [i for i, job in enumerate(jobs) if ("3" if ".fmi3." in job.fmu else "2") in fmi_versions]
    # For model exchange PathSim has no blocks without states, and in fixed steps it does not locate events.
    chosen = [i for i in chosen if importer != "pathsim" or _is_smooth(jobs[i].fmu)]
    work = [jobs[i] for i in chosen]

    worst = _worst(work, _run(importer, work, tmp_path), [expected[i] for i in chosen])

    assert worst and {name: error for name, error in worst.items() if not error < tolerance} == {}


def _is_smooth(fmu: str) -> bool:
    description = read_model_description(fmu)
    return bool(description.numberOfContinuousStates) and not description.numberOfEventIndicators
