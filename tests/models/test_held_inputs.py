"""Inputs that are held from sample to sample, against closed forms."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator.compare.comparison import compare
from orchestrator.datacheck.holding import with_interpolation
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_model
from orchestrator.models.missing_force import missing_forces
from orchestrator.models.smoothing import SmoothedTrial
from tests.datacheck.records import drive

J = 0.02


def angles(time: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """Angle of an inertia under torques that stay, step by step: parabolas."""
    phi, speed, found = 0.0, 0.0, [0.0]
    for step, now in zip(np.diff(time), torque, strict=False):
        phi += speed * step + 0.5 * now / J * step**2
        speed += now / J * step
        found.append(phi)
    return np.array(found)


def test_a_held_input_gives_the_parabolas_of_constant_torques() -> None:
    random = np.random.default_rng(2)
    time, torque = 0.1 * np.arange(30), random.normal(size=30)
    model = load_model("drive").with_held(["torque"])  # type: ignore[attr-defined]
    inputs = np.zeros((30, len(model.inputs)))
    inputs[:, [v.name for v in model.inputs].index("torque")] = torque
    run = model.simulate(time, inputs, ["phi"], {v.name: 0.0 for v in model.system.states})
    np.testing.assert_allclose(run[:, 0], angles(time, torque), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("held", "lacks"), [(["torque"], False), ([], True)])
def test_a_held_torque_is_no_missing_force_unless_it_is_taken_for_straight_lines(held: list[str], lacks: bool) -> None:
    random = np.random.default_rng(6)
    time, torque = 0.02 * np.arange(200), np.repeat(random.normal(size=20), 10)
    model = load_model("drive").restricted(["phi"]).with_held(held)  # type: ignore[attr-defined]
    inputs = np.zeros((200, len(model.inputs)))
    inputs[:, [v.name for v in model.inputs].index("torque")] = torque
    phi = angles(time, torque)[:, None] + 1e-5 * random.normal(size=(200, 1))
    (force,) = missing_forces(model, [SmoothedTrial(time, inputs, phi, np.array([1e-5]))])
    inside = np.abs(force.mean[10:-10]) < 3 * force.std[10:-10]
    assert bool(np.sqrt(np.mean(force.mean**2)) > 0.02) is lacks  # N.m, where torques have 1
    assert lacks or inside.mean() > 0.95


@pytest.mark.parametrize(("interpolation", "most"), [("hold", 2e-6), ("linear", np.inf)])
def test_compare_honours_what_the_case_says_of_a_column(tmp_path: Path, interpolation: str, most: float) -> None:
    random = np.random.default_rng(3)
    time = 0.1 * np.arange(60)
    torque = np.repeat(random.normal(size=12), 5)
    rows = np.column_stack([time, torque, angles(time, torque) + 1e-7 * random.normal(size=60)])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="time,torque,phi", comments="", fmt="%.12g")
    text = 'files = ["a.csv"]\n[columns]\ntime = "s"\ntorque = "N.m"\nphi = "rad"\n'
    (tmp_path / "case.toml").write_text(f'{text}[interpolation]\ntorque = "{interpolation}"\n')
    found = compare(load_model("drive"), load_measurements(tmp_path), checks=())
    error = found.learning.rmse["phi"]
    assert error < most
    assert interpolation == "hold" or error > 1e-4


def test_a_record_that_stays_and_jumps_is_held_without_being_told(tmp_path: Path) -> None:
    random = np.random.default_rng(3)
    time = 0.1 * np.arange(60)
    torque = np.repeat(random.normal(size=12), 5)
    rows = np.column_stack([time, torque, angles(time, torque) + 1e-7 * random.normal(size=60)])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="time,torque,phi", comments="", fmt="%.12g")
    found = compare(load_model("drive"), load_measurements(tmp_path))
    assert found.learning.rmse["phi"] < 2e-6
    assert any("torque is held from sample to sample" in note for note in found.notes)


def test_a_smooth_input_runs_in_lines(tmp_path: Path) -> None:
    columns = drive(1)
    rows = np.column_stack(list(columns.values()))
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header=",".join(columns), comments="", fmt="%.12g")
    chosen = with_interpolation(load_model("drive"), load_measurements(tmp_path))
    assert "hold" not in chosen.interpolation.values() and chosen.interpolation
    assert with_interpolation(load_model("drive"), chosen) is chosen  # the choice is made once


SHAFT = """model Shaft
  parameter Real J(unit="kg.m2") = 0.02;
  input Real torque(unit="N.m");
  output Real phi(unit="rad", start=0), w(unit="rad/s", start=0);
equation
  der(phi) = w;
  J*der(w) = torque;
end Shaft;
"""


def test_a_command_that_moves_with_each_sample_is_held_although_a_noisy_sensor_does_not_tell(tmp_path: Path) -> None:
    (tmp_path / "Shaft.mo").write_text(SHAFT)
    random = np.random.default_rng(4)
    time = 0.02 * np.arange(300)
    torque = 0.2 * np.sin(5 * time) + 0.1 * np.cos(17 * time)
    speed = np.concatenate([[0.0], np.cumsum(torque[:-1] * np.diff(time) / J)])
    rows = np.column_stack([time, torque, angles(time, torque), speed])
    rows[:, 2:] += [1e-5, 0.06] * random.normal(size=(300, 2))
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="time,torque,phi,w", comments="", fmt="%.12g")
    found = with_interpolation(load_model(f"{tmp_path / 'Shaft.mo'}:Shaft"), load_measurements(tmp_path))
    assert dict(found.interpolation) == {"torque": "hold"}
