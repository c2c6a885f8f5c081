"""Reference results: right by algebra, repeatable, no longer than they mean something, and kept by every built-in."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers_systems import integrator, lag, oscillator, pendulum, root

from fmus.archive import extract_fmu
from fmus.catalogue import built_in_models
from fmus.package import build_fmu
from fmus.reference import pulses, solve_reference
from fmus.reference_files import MANIFEST, read_replay, reference_files
from fmus.symbolic.system import SymbolicSystem
from fmus.validate import validate_fmu

LS = "{http://fmi-standard.org/fmi-ls-manifest}"


def test_a_lag_behind_a_delay_follows_the_exponential() -> None:
    tau, delay = 0.2, 0.13
    system = lag(delay_is_parameter=False, constant_delay=delay)
    experiment = pulses(system, 2.0, 0.01)
    reference = solve_reference(system, experiment)
    assert reference is not None

    def rise(since: float) -> np.ndarray:
        return 1.0 - np.exp(-np.maximum(reference.times - since - delay, 0.0) / tau)

    (_, on, off), height = experiment.jumps[[0, 1, 3]], experiment.levels[1, 0]
    assert height != 0.0
    assert reference.values[:, 0] == pytest.approx(height * (rise(on) - rise(off)), abs=1e-9)


def test_an_experiment_pulses_every_input_within_its_range_and_away_from_results() -> None:
    for model in built_in_models().values():
        system = model.compile()
        experiment = pulses(system, model.stop_time_s, model.step_size_s)
        assert (np.ptp(experiment.levels, axis=0) > 0.0).all()
        for variable, levels in zip(system.inputs, experiment.levels.T, strict=True):
            assert (variable.minimum is None) or levels.min() >= variable.minimum
            assert (variable.maximum is None) or levels.max() <= variable.maximum
        distance = np.abs(experiment.times[:, None] - experiment.jumps[None, 1:]).min()
        assert distance >= 0.99 * model.step_size_s


def test_results_end_where_chaos_begins() -> None:
    model = built_in_models()["double-pendulum"]
    experiment = pulses(model.compile(), model.stop_time_s, model.step_size_s)
    reference = solve_reference(model.compile(), experiment)
    assert reference is not None
    assert 1.0 < reference.times[-1] < model.stop_time_s


def test_results_end_where_there_is_no_solution() -> None:
    # der(x) = -sqrt(x) - 1 from 1 reaches 0 at t = 2 - 2 ln 2.
    reference = solve_reference(root(), pulses(root(), 10.0, 0.01))
    assert reference is not None
    assert reference.times[-1] <= 2.0 - 2.0 * np.log(2.0)


def test_without_useful_results_there_are_no_files() -> None:
    assert reference_files(root(), 1000.0, 1.0) == {}


@pytest.mark.parametrize("make", [lag, oscillator, pendulum, integrator])
def test_files_are_the_same_every_time_and_can_be_read_back(make: type[SymbolicSystem], tmp_path: Path) -> None:
    files = reference_files(make(), 3.0, 0.01)
    assert files == reference_files(make(), 3.0, 0.01)
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(content)
    replay = read_replay(tmp_path)
    assert replay is not None
    assert set(replay.tolerances) == set(make().outputs)
    assert replay.step == 0.01
    experiment = pulses(make(), 3.0, 0.01)
    assert replay.inputs.values.max(initial=0.0) == pytest.approx(experiment.levels.max(initial=0.0))


def test_the_manifest_is_that_of_the_layered_standard() -> None:
    manifest = ElementTree.fromstring(reference_files(lag(), 3.0, 0.01)[MANIFEST])
    assert manifest.get(f"{LS}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    assert {e.get("role"): e.get("source") for e in manifest} == {
        "experiment/validation": "inputs.csv",
        "result": "reference.csv",
    }
    tolerance = manifest.find("Related[@role='result']//Tolerance[@name='x']")
    # 1e-4 of the nominal value 2 N.m of x.
    assert tolerance is not None and (tolerance.get("absolute"), tolerance.get("unit")) == ("0.0002", "N.m")


@pytest.mark.parametrize("name", built_in_models())
def test_a_built_in_model_keeps_its_reference_and_has_no_findings(name: str, tmp_path: Path) -> None:
    model = built_in_models()[name]
    system = model.compile()
    files = reference_files(system, model.stop_time_s, model.step_size_s)
    times = {"stop_time": model.stop_time_s, "step_size": model.step_size_s}
    fmu = build_fmu(system, tmp_path / "m.fmu", fmi_version="3.0", extra_files=files, **times)
    assert (extract_fmu(fmu, tmp_path / "files") / MANIFEST).is_file()
    assert validate_fmu(fmu) == []
