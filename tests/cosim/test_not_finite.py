"""What a run does with outputs that are not finite numbers is said for each of them: stop, hold or warn."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from faulty import faulty_fmu
from systems import spec, system

from fmus.errors import ComponentError, MisfitError
from orchestrator.cli.cosim import run
from orchestrator.cosim import ComponentSpec, Connection, Simulation, System
from orchestrator.cosim.toml_file import read_toml, write_toml
from orchestrator.results.recorder import MemoryRecorder


def broken(folder: Path, **nan: str) -> System:
    """An FMU whose output y, the integral of 1, becomes NaN, drives a gain."""
    what = system(
        [ComponentSpec("odd", source=str(faulty_fmu(folder, "nan"))), spec("gain", "gain", a=2.0, b=0.0)],
        [],
        step=0.05,
        nan=nan,
    )
    return replace(what, connections=(Connection("odd.y", "gain.u", convert=False),))


def ran(what: System, **options: bool) -> tuple[dict[str, np.ndarray], list[str]]:
    recorder = MemoryRecorder()
    with Simulation(what, stop=1.0, **options) as simulation:
        simulation.run(1.0, recorder)
        lines = simulation.report.lines
    result = recorder.result()
    return {name: result[name] for name in result.names}, lines


def test_a_run_stops_unless_something_else_is_said(tmp_path: Path) -> None:
    with pytest.raises(ComponentError, match=r"odd.y = nan m at t = .* is not a finite number"):
        ran(broken(tmp_path))


@pytest.mark.parametrize("engine", [True, False])
def test_the_last_finite_value_is_held(engine: bool, tmp_path: Path) -> None:
    found, lines = ran(broken(tmp_path, **{"odd.*": "hold"}), engine=engine)

    y = found["odd.y"]
    first = next(k for k in range(1, len(y)) if y[k] == y[k - 1])
    assert np.all(np.isfinite(y))
    assert np.all(y[first:] == y[first - 1])
    np.testing.assert_array_equal(found["gain.y"], 2.0 * y)
    assert any(
        "odd.y was not a finite number in" in line and "its last finite value was used" in line for line in lines
    )


@pytest.mark.parametrize("engine", [True, False])
def test_a_warning_passes_values_on_as_they_are(engine: bool, tmp_path: Path) -> None:
    found, lines = ran(broken(tmp_path, **{"odd.y": "warn", "gain.y": "warn"}), engine=engine)

    assert np.isnan(found["odd.y"]).any()
    np.testing.assert_array_equal(np.isnan(found["gain.y"]), np.isnan(found["odd.y"]))
    assert any("odd.y was not a finite number in" in line and "passed on as it was" in line for line in lines)


def test_the_last_pattern_that_fits_counts(tmp_path: Path) -> None:
    with pytest.raises(ComponentError, match=r"odd.y = nan"):
        ran(broken(tmp_path, **{"*": "hold", "odd.y": "stop"}))


@pytest.mark.parametrize(
    ("pattern", "policy", "words"),
    [("odd.z", "hold", r"nan: odd.z matches no output of real numbers"), ("odd.y", "skip", r"nan: odd.y = .*skip.*expected stop, hold, warn")],
)  # fmt: skip
def test_a_pattern_that_fits_nothing_and_an_unknown_policy_are_refused(
    pattern: str, policy: str, words: str, tmp_path: Path
) -> None:
    with pytest.raises(MisfitError, match=words):
        ran(broken(tmp_path, **{pattern: policy}))


def test_the_command_and_the_file_say_it_alike(tmp_path: Path) -> None:
    file = tmp_path / "odd.toml"
    file.write_text(write_toml(broken(tmp_path, **{"odd.*": "hold"})))
    report = tmp_path / "run.json"

    kept = CliRunner().invoke(run, [str(file), "--stop", "1", "--json", str(report)])
    stopped = CliRunner().invoke(run, [str(file), "--stop", "1", "--nan", "odd.y=stop"])

    assert dict(read_toml(file).run.nan) == {"odd.*": "hold"}
    assert kept.exit_code == 0, kept.output
    assert "its last finite value was used instead" in kept.output
    assert json.loads(report.read_text())["not_finite"]["odd.y"]["policy"] == "hold"
    assert isinstance(stopped.exception, ComponentError)
