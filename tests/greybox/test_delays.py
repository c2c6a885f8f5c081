"""A late sensor is called a late sensor, and cannot be told from a late input where all that is measured is late alike."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import ModelicaModel, find_modelica_model
from fmus.package import build_fmu
from orchestrator.blackbox.source import FmuSource, Source
from orchestrator.diagnose import diagnose
from orchestrator.greybox.diagnose import diagnose_greybox
from orchestrator.greybox.effects import with_effects
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Diagnosis, Estimate, NamedEffect
from tests.three_trials import three_trials

PENDULUM = """model Pendulum "A pendulum with a motor"
  parameter Real m(unit="kg") = 1.2;
  parameter Real l(unit="m") = 0.4;
  parameter Real d(unit="N.m.s/rad") = 0.05;
  input Real tau(unit="N.m");
  output Real phi(unit="rad", start=0, fixed=true);
  output Real w(unit="rad/s", start=0, fixed=true);
equation
  der(phi) = w;
  m*l^2*der(w) = tau - d*w - m*9.81*l*sin(phi);
end Pendulum;
"""
DELAY, STEP, SAMPLES = 0.035, 0.01, 250
UNITS = {"tau": "N.m", "phi": "rad", "w": "rad/s"}


def record(
    folder: Path, measured: Sequence[str], late: Sequence[str], *, straight: bool = True, said: str = ""
) -> Path:
    """Three records by SciPy's solver; the sensors in `late` show what was 35 ms ago. Between samples the torque is straight, or the
    sum of sines that was sampled; the case file says that the one that is `said` is straight."""
    random, time = np.random.default_rng(5), np.arange(SAMPLES) * STEP
    (folder / "Pendulum.mo").write_text(PENDULUM)
    (folder / "case.toml").write_text(three_trials({name: UNITS[name] for name in ("tau", *measured)}, straight=said))
    for trial in (1, 2, 3):
        waves = list(zip(random.uniform(0.2, 1.5 if straight else 2.4, 4), random.uniform(0, 6.28, 4), strict=True))

        def torque(t: np.ndarray | float, waves: list[tuple[float, float]] = waves) -> np.ndarray:
            return np.minimum(t / 0.3, 1.0) * sum(0.8 * np.sin(2 * np.pi * f * t + p) for f, p in waves)

        tau = torque(time)

        def rate(t: float, x: np.ndarray, torque: Callable = torque, tau: np.ndarray = tau) -> list[float]:
            pushed = np.interp(t, time, tau) if straight else torque(t)
            return [x[1], float(pushed - 0.05 * x[1] - 1.2 * 9.81 * 0.4 * np.sin(x[0])) / (1.2 * 0.16)]

        run = solve_ivp(rate, (0, time[-1]), [0, 0], rtol=1e-8, atol=1e-9, max_step=STEP, dense_output=True)
        columns = [time, tau]
        for name in measured:
            k, noise = {"phi": (0, 2e-4), "w": (1, 2e-3)}[name]
            then = time - DELAY * (name in late)
            columns.append(
                np.where(then < 0, 0.0, run.sol(np.maximum(then, 0))[k]) + noise * random.standard_normal(SAMPLES)
            )
        header = ",".join(("t", "tau", *measured))
        np.savetxt(folder / f"trial_{trial}.csv", np.column_stack(columns), "%.9g", ",", header=header, comments="")
    return folder


def diagnosed(folder: Path, source: Source | None = None) -> Diagnosis:
    source = source or find_modelica_model(f"{folder / 'Pendulum.mo'}:Pendulum")
    return diagnose(source, load_measurements(str(folder)), workers=1)


def named(found: Diagnosis) -> dict[str, float]:
    return {f"{e.id} of {e.site}": e.parameters["T"].value for e in found.effects}


def test_one_late_sensor_of_two_is_named_with_its_delay(tmp_path: Path) -> None:
    found = diagnosed(record(tmp_path, ("phi", "w"), ("phi",)))
    assert found.verdict == "named"
    assert named(found) == pytest.approx({"sensor_delay of sensor:phi": DELAY}, rel=0.02)


@pytest.mark.parametrize("measured", [("phi",), ("phi", "w")])
def test_sensors_that_are_all_late_are_called_like_a_late_input(measured: tuple[str, ...], tmp_path: Path) -> None:
    # Asking how the torque runs takes two further searches of the angle alone.
    found = diagnosed(record(tmp_path, measured, measured, said="" if "w" in measured else "tau"))
    assert found.verdict == "ambiguous"
    assert {"sensor_delay", "input_delay"} <= {name for group in found.confusable for name in group}
    assert all(value == pytest.approx(DELAY, rel=0.05) for value in named(found).values())


def test_a_late_sensor_of_an_fmu_is_named_and_no_value_of_the_fmu_with_it(tmp_path: Path) -> None:
    """The FMU's rates are taken as lines about the record, and taken again about what the answer shows."""
    folder = record(tmp_path, ("phi", "w"), ("phi",))
    system = ModelicaModel("Pendulum", "Pendulum", folder / "Pendulum.mo").compile()
    source = FmuSource.prepare(build_fmu(system, folder / "Pendulum.fmu"), load_measurements(str(folder)))
    found = diagnose_greybox(source, load_measurements(str(folder)), workers=1)
    assert named(found) == pytest.approx({"sensor_delay of sensor:phi": DELAY}, rel=0.02)
    assert found.verdict == "named" and found.held_out.reducible_removed > 0.98


def test_nothing_is_missing_where_an_input_bends_between_its_samples(tmp_path: Path) -> None:
    """Free runs leave 1.2 times the floor, and no effect can be named for it."""
    found = diagnosed(record(tmp_path, ("phi", "w"), (), straight=False))
    assert found.verdict == "adequate"


def test_a_late_sensor_is_written_behind_the_output(tmp_path: Path) -> None:
    (tmp_path / "Pendulum.mo").write_text(PENDULUM)
    values = {"share": Estimate(1.0, "1", (1.0, 1.0)), "T": Estimate(DELAY, "s", (DELAY, DELAY))}
    base = find_modelica_model(f"{tmp_path / 'Pendulum.mo'}:Pendulum")
    system = with_effects(base, [NamedEffect("sensor_delay", "sensor:phi", values)], "Late").compile()
    assert len(system.states) == 4 and system.outputs == ("phi", "w")
