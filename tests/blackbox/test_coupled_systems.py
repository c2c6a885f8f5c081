"""A coupled system is a model: compared as one model of the whole is, and extended at inputs, outputs and connected forces."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import misfit
from fmus.errors import ComponentError
from orchestrator.blackbox import worker
from orchestrator.blackbox.exposed import exposed
from orchestrator.blackbox.source import fmu_model
from orchestrator.blackbox.system_runs import SystemInstance
from orchestrator.cli.analyse import compare
from orchestrator.cosim import load_system

TIME = np.arange(0, 1.5, 0.01)
INERTIA, GAIN, VISCOUS, NOISE = 0.02, 0.5, 0.03, 5e-4
AMPLIFIER = """
model Amplifier "Torque for a command"
  parameter Real k(unit="N.m/V") = 0.5 "Gain";
  input Real u(unit="V", start=0) "Command";
  output Real tau(unit="N.m") "Torque";
equation
  tau = k*u;
end Amplifier;
"""
WHEEL = """
model Wheel "Inertia under a torque"
  parameter Real J(unit="kg.m2") = 0.02 "Inertia";
  input Real torque(unit="N.m", start=0) "Torque";
  output Real phi(unit="rad") "Angle";
  Real q(unit="rad", start=0, fixed=true) "Angle";
  Real w(unit="rad/s", start=0, fixed=true) "Speed";
equation
  phi = q;
  der(q) = w;
  J*der(w) = torque;
end Wheel;
"""
SYSTEM = """
[run]
step = 0.002
[components.amplifier]
modelica = "Amplifier.mo:Amplifier"
[components.wheel]
modelica = "Wheel.mo:Wheel"
[[connections]]
from = "amplifier.tau"
to = "wheel.torque"
"""


def angle(volts: np.ndarray, viscous: float) -> np.ndarray:
    """J w' = k u - b w, q' = w from rest at 0.1 rad, exactly for a command that is linear between samples."""
    h, a = TIME[1], viscous / INERTIA
    q, w, out = 0.1, 0.0, []
    for k in range(len(TIME)):
        out.append(q)
        if k == len(TIME) - 1:
            break
        u0, u1 = (GAIN * volts[j] / INERTIA for j in (k, k + 1))
        s = (u1 - u0) / h
        if a == 0.0:
            q, w = q + w * h + u0 * h**2 / 2 + s * h**3 / 6, w + u0 * h + s * h**2 / 2
            continue
        # w' = -a w + u0 + s t: particular solution (s/a) t + (u0 - s/a)/a.
        c = w - (u0 - s / a) / a
        e = np.exp(-a * h)
        q += c * (1 - e) / a + (u0 - s / a) / a * h + s / a * h**2 / 2
        w = c * e + (u0 - s / a) / a + s / a * h
    return np.array(out)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The system file, and a folder of three trials of it with viscous friction that it lacks."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "Amplifier.mo").write_text(AMPLIFIER)
    (folder / "Wheel.mo").write_text(WHEEL)
    (folder / "bench.toml").write_text(SYSTEM)
    data, random = folder / "data", np.random.default_rng(3)
    data.mkdir()
    for number in (1, 2, 3):
        volts = sum(0.1 * np.sin(2 * np.pi * f * TIME + p) for f, p in random.uniform(0.3, 3.0, (4, 2)))
        phi = angle(volts, VISCOUS) + NOISE * random.standard_normal(len(TIME))
        rows = np.column_stack([TIME, volts, phi])
        np.savetxt(data / f"trial_{number}.csv", rows, delimiter=",", header="time,u,phi", comments="", fmt="%.10g")
    (data / "case.toml").write_text(
        'files = ["trial_1.csv", "trial_2.csv", "trial_3.csv"]\nlearning = [1, 2]\nheld_out = [3]\n'
        '[columns]\ntime = "s"\nu = "V"\nphi = "rad"\n[sensors]\nencoder_noise_std_rad = 5e-4\n'
    )
    return folder / "bench.toml", data


def viscous(value: float) -> misfit.NamedEffect:
    return misfit.NamedEffect(
        "viscous_friction", "wheel.phi", {"b[1]": misfit.Estimate(value, "N.m.s/rad", (value, value))}
    )


def test_comparison_is_that_of_an_inertia_alone_under_the_amplified_torque(
    bench: tuple[Path, Path], tmp_path: Path
) -> None:
    system, data = bench
    target = tmp_path / "found.json"
    done = CliRunner().invoke(compare, [str(system), str(data), "--json", str(target)], catch_exceptions=False)
    found = json.loads(target.read_text())

    assert done.exit_code == 0
    assert found["signals"] == ["wheel.phi"]
    trials = [np.loadtxt(data / f"trial_{k}.csv", delimiter=",", skiprows=1).T for k in (1, 2, 3)]
    arrays = [{"time": TIME, "torque": GAIN * volts, "phi": phi} for _, volts, phi in trials]
    alone = misfit.compare(
        "drive", misfit.Data.of(arrays, units={"torque": "N.m", "phi": "rad"}, noise={"phi": NOISE}), workers=1
    )
    assert found["trials"][2]["rmse"]["wheel.phi"] == pytest.approx(alone.trials[2].rmse["phi"], rel=1e-3)
    assert found["noise_floor"]["wheel.phi"] == pytest.approx(alone.noise_floor["phi"], rel=0.05)
    assert any("column 'phi' is taken as 'wheel.phi'" in note for note in found["notes"])


def test_a_system_in_one_fmu_gives_what_it_gives_step_by_step(
    bench: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, seen = fmu_model(bench[0]), exposed(load_system(bench[0]), "bench.toml")
    inputs = np.sin(5 * TIME)[:, None]
    found = []
    for instance in (worker.opened_system(bench[0], False), SystemInstance(seen)):
        monkeypatch.setattr(model.compiled.processes, "ask", partial(worker.ANSWERS[worker.RunRequest], instance))
        found.append(model.simulate(TIME, inputs, ["wheel.phi"], {"wheel.q": 0.3, "wheel.w": 0.2})[:, 0])
        assert isinstance(instance, SystemInstance) == (len(found) == 2)

    # J w' = k sin(5 t) from (0.3, 0.2); the master holds the torque over 2 ms, and the command over a sample.
    exact = 0.3 + 0.2 * TIME + GAIN / INERTIA * (TIME / 5 - np.sin(5 * TIME) / 25)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)
    np.testing.assert_allclose(found[0], exact, atol=2e-2)


@pytest.mark.parametrize("fails", [True, False])
def test_an_fmu_that_cannot_be_reset_gets_a_new_instance_for_each_run(
    fails: bool, bench: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, instance = fmu_model(bench[0]), worker.opened_system(bench[0], False)
    plain, stale = type(instance.fmu).reset, [0]

    def reset(fmu: object) -> None:
        if fails:
            raise ComponentError("FMU refused the reset")
        plain(fmu)
        stale[0] += 1

    def run() -> np.ndarray:
        return model.simulate(TIME, np.sin(5 * TIME)[:, None], ["wheel.phi"], {"wheel.q": 0.3, "wheel.w": 0.2})

    monkeypatch.setattr(type(instance.fmu), "reset", reset)
    monkeypatch.setattr(model.compiled.processes, "ask", partial(worker.ANSWERS[worker.RunRequest], instance))
    once, again = run(), run()

    assert instance.resets is not fails
    assert np.ptp(once) > 0.1
    np.testing.assert_array_equal(once, again)
    assert stale[0] == (0 if fails else 3)


@pytest.mark.slow
def test_an_effect_at_a_connected_force_gives_a_new_system_that_explains_the_data(
    bench: tuple[Path, Path], tmp_path: Path
) -> None:
    system, data = bench
    model = misfit.Model(system)
    before = model.compare(data)
    better = model.add(viscous(VISCOUS))
    again = misfit.compare(better.to_system(tmp_path / "better.toml"), data)

    assert before.held_out is not None and again.held_out is not None
    # What is left is the master's: a torque that is a difference of samples acts a step late.
    assert again.held_out.over_floor < 0.1 * before.held_out.over_floor
    written = load_system(tmp_path / "better.toml")
    assert {"amplifier", "wheel"} < set(written.components)
    assert not any(each.source == "amplifier.tau" and each.target == "wheel.torque" for each in written.connections)


@pytest.mark.slow
def test_a_joint_that_no_effect_uses_is_not_written(bench: tuple[Path, Path], tmp_path: Path) -> None:
    system, data = bench
    model = misfit.Model(system)
    model.compare(data)
    offset = misfit.NamedEffect("joint_offset", "sensor:wheel.phi", {"c[1]": misfit.Estimate(0.1, "rad", (0.1, 0.1))})
    written = load_system(model.add(offset).to_system(tmp_path / "offset.toml"))

    assert any(each.source == "amplifier.tau" and each.target == "wheel.torque" for each in written.connections)
    assert len(written.components) == 3


@pytest.mark.slow
def test_diagnosis_names_friction_at_the_wheel(bench: tuple[Path, Path]) -> None:
    system, data = bench
    found = misfit.Model(system).diagnose(data)

    assert [(effect.id, effect.site) for effect in found.effects] == [("viscous_friction", "wheel.phi")]
    assert found.effects[0].parameters["b[1]"].value == pytest.approx(VISCOUS, rel=0.1)
