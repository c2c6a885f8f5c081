"""A parameter of a model with slots that is off by 3 %: named where effects stand for it, fitted where a tolerance is stated."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from orchestrator.compare.comparison import compare
from orchestrator.diagnosis.fit.extensible import model_of
from orchestrator.discover import discover
from orchestrator.measurements import MeasurementSet, load_measurements
from orchestrator.model_argument import load_modelica
from orchestrator.simpler_answers import or_one_law
from orchestrator.verdicts.cannot_tell import cannot_tell
from orchestrator.verdicts.result import Diagnosis, Estimate, NamedEffect

NOISE, OFF = 1e-3, 0.03


def write(folder: Path, columns: str, trials: list[np.ndarray], tolerance: float | None) -> MeasurementSet:
    names = columns.split(",")
    units = {"time": "s", "torque": "N.m", "phi": "rad", "theta": "rad"}
    for k, trial in enumerate(trials):
        np.savetxt(folder / f"trial_{k}.csv", trial, fmt="%.9g", delimiter=",", header=columns, comments="")
    lines = [
        f"files = {[f'trial_{k}.csv' for k in range(len(trials))]}",
        "learning = [1, 2]",
        "held_out = [3]",
        "[columns]",
        *(f'{name} = "{units[name]}"' for name in names),
    ]
    if tolerance is not None:
        lines += ["[tolerances]", f"default = {tolerance}"]
    (folder / "case.toml").write_text("\n".join(lines) + "\n")
    return load_measurements(folder)


def pendulum(folder: Path) -> MeasurementSet:
    """Swings of a pendulum whose centre of mass is 3 % farther from its pivot than the model says."""
    random, t = np.random.default_rng(5), np.arange(0, 4, 0.01)
    a, m, inertia, g = 0.147755 * (1 + OFF), 0.147585, 1.0912e-4, 9.81001

    def swing(first: float) -> np.ndarray:
        def rates(_: float, x: np.ndarray) -> list[float]:
            return [x[1], m * g * a * np.sin(x[0]) / (inertia + m * a**2)]

        run = solve_ivp(rates, (0, t[-1]), [first, 0.0], t_eval=t, rtol=1e-10, atol=1e-12)
        return np.column_stack([t, run.y[0] + NOISE * random.standard_normal(len(t))])

    return write(folder, "time,theta", [swing(first) for first in (2.0, 1.2, 4.6)], None)


def drive(folder: Path, tolerance: float, off: float = OFF) -> MeasurementSet:
    """Swings of an inertia under a torque; it is 3 % larger than the model says."""
    random, t = np.random.default_rng(6), np.arange(0, 6, 0.01)
    inertia = 0.02 * (1 + off)

    def moved(w: float) -> np.ndarray:
        # J phi'' = T sin(w t) from rest
        torque, phi = 0.1 * np.sin(w * t), 0.1 / inertia * (t / w - np.sin(w * t) / w**2)
        return np.column_stack([t, torque, phi + NOISE * random.standard_normal(len(t))])

    return write(folder, "time,torque,phi", [moved(w) for w in (2.0, 3.1, 2.6)], tolerance)


def asked(name: str, measurements: MeasurementSet, effects: tuple[NamedEffect, ...] = ()) -> Diagnosis:
    """What becomes of an answer that names these effects, or none, and leaves all of the error."""
    source = load_modelica(name)
    given = compare(model_of(source, source.compile()), measurements, workers=1)
    found = replace(cannot_tell(given, ()), verdict="named" if effects else "unknown", effects=effects)
    return or_one_law(source, measurements, found, given, 1, lambda message: None)


def test_where_nothing_is_named_the_parameter_is(tmp_path: Path) -> None:
    found = asked("pendulum", pendulum(tmp_path))
    assert found.verdict == "named"
    # Of a point mass, w' = g/a sin q: a wrong gravity is the same model.
    (effect,) = found.effects
    assert (effect.id, effect.site) in (("parameter_error", "a"), ("parameter_error", "g"))
    ratio = 1 + effect.parameters["share"].value
    assert (ratio if effect.site == "a" else 1 / ratio) == pytest.approx(1 + OFF, abs=0.002)
    other = "g" if effect.site == "a" else "a"
    assert any(f"parameter error at {other} would be the same change" in note for note in found.warnings)
    held_out = found.steps[-1].comparison.held_out
    assert held_out is not None and held_out.rmse["theta"] == pytest.approx(NOISE, rel=0.2)


def test_one_number_goes_before_two_and_not_before_one(tmp_path: Path) -> None:
    measurements = pendulum(tmp_path)
    one = Estimate(1.0, "1", (0.9, 1.1))
    two = NamedEffect("passive_stiffness", "joint1", {"k[1]": one, "tau0[1]": one})
    assert [e.id for e in asked("pendulum", measurements, (two,)).effects] == ["parameter_error"]
    alone = NamedEffect("viscous_friction", "joint1", {"b[1]": one})
    assert [e.id for e in asked("pendulum", measurements, (alone,)).effects] == ["viscous_friction"]


def test_within_a_stated_tolerance_nothing_is_missing_and_the_fitted_model_is_written(tmp_path: Path) -> None:
    measurements = drive(tmp_path, tolerance=0.05)
    done = discover(load_modelica("drive"), measurements, tmp_path / "out", workers=1)
    found = done.diagnosis
    assert (found.verdict, found.effects) == ("adequate", ())
    assert found.adjusted[0].name == "J" and found.adjusted[0].share == pytest.approx(OFF, abs=0.003)
    before, after = (step.comparison.held_out for step in found.steps)
    assert before is not None and after is not None
    assert before.rmse["phi"] > 10 * NOISE and after.rmse["phi"] == pytest.approx(NOISE, rel=0.2)
    assert [(e.id, e.site) for e in done.entries[-1].effects] == [("parameter_error", "J")]
    again = done.entries[-1].held_out
    assert again is not None and again.rmse["phi"] == pytest.approx(after.rmse["phi"], rel=0.02)
    assert found.patched_model and Path(found.patched_model).name == "Drive_1.fmu"


def test_a_right_model_stays_as_it_is_whatever_its_tolerances(tmp_path: Path) -> None:
    done = discover(load_modelica("drive"), drive(tmp_path, tolerance=0.05, off=0.0), tmp_path / "out", workers=1)
    assert done.diagnosis.verdict == "adequate"
    assert len(done.diagnosis.steps) == 1 and done.versions == () and done.diagnosis.patched_model is None
