"""An FMU that can only be stepped: wrong parameters are varied before runs and named, and sensors do what their laws say."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.children import SilentWorker
from fmus.errors import ComponentError
from fmus.package import build_fmu
from orchestrator.blackbox.source import FmuSource
from orchestrator.cosim import Simulation, load_system
from orchestrator.diagnose import diagnose
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.measurements import load_measurements
from orchestrator.versions import add_effects

TIME = np.arange(0.0, 4.0, 0.02)
LAG = (
    'model Lag\n  parameter Real T(unit="s") = 0.5;\n  parameter Real k = 2;\n  input Real u;\n  output Real y(start=0, fixed=true);\n'
    "equation\n  T*der(y) = k*u - y;\nend Lag;\n"
)
TRUE_T = 0.6


def first_order(inputs: np.ndarray, lag: float) -> np.ndarray:
    """Exact answer from 0 to an input that holds from sample to sample."""
    y, keep = [0.0], np.exp(-(TIME[1] - TIME[0]) / lag)
    for u in inputs[:-1]:
        y.append(2.0 * u + (y[-1] - 2.0 * u) * keep)
    return np.array(y)


@pytest.fixture
def source(tmp_path: Path) -> FmuSource:
    random, data = np.random.default_rng(3), tmp_path / "data"
    data.mkdir()
    for k in range(3):
        u = np.repeat(random.uniform(-1, 1, 8), 25)
        y = first_order(u, TRUE_T) + 0.002 * random.standard_normal(len(TIME))
        rows = np.column_stack([TIME, u, y])
        np.savetxt(data / f"run_{k}.csv", rows, delimiter=",", header="time,u,y", comments="", fmt="%.9g")
    file = tmp_path / "Lag.mo"
    file.write_text(LAG)
    fmu = build_fmu(ModelicaModel("Lag", "Lag", file).compile(), tmp_path / "Lag.fmu")
    return FmuSource.prepare(fmu, load_measurements(str(data)), stepped=True)


def test_slopes_in_a_share_are_those_of_the_closed_form(source: FmuSource) -> None:
    wrong = next(c for c in source.candidates() if (c.card.id, c.site) == ("parameter_error", "T"))
    compiled = EffectSet(source, [wrong], ("y",)).model.compiled
    u = np.ones((len(TIME), 1))
    run = compiled.run(TIME, u, compiled.with_values(np.array([0.2])), np.zeros(1), sensitivities=True)
    np.testing.assert_allclose(run.outputs[:, 0], 2 - 2 * np.exp(-TIME / 0.6), atol=1e-4)
    assert run.sensitivities is not None
    # d/dshare of 2 - 2 exp(-t/(T (1 + share))) is -2 t/(T (1 + share)^2) exp(...)
    expected = -2 * TIME / (0.5 * 1.2**2) * np.exp(-TIME / 0.6)
    np.testing.assert_allclose(run.sensitivities[:, 0, -1], expected, atol=2e-3)


@pytest.mark.slow
def test_a_wrong_time_constant_is_named_and_written(source: FmuSource, tmp_path: Path) -> None:
    found = diagnose(source, source.measurements, workers=1)
    assert [(effect.id, effect.site) for effect in found.effects] == [("parameter_error", "T")]
    (share,) = found.effects[0].parameters.values()
    assert share.ci90[0] <= TRUE_T / 0.5 - 1 <= share.ci90[1]
    version = add_effects(source, found.effects, tmp_path / "out")
    with Simulation(load_system(version.file)) as simulation:
        simulation.set("u", 1.0)
        simulation.run(0.6)
        assert simulation.get("y") == pytest.approx(2 - 2 * np.exp(-0.6 / (0.5 * (1 + share.value))), rel=1e-3)


@pytest.mark.parametrize(
    ("effect", "shown"),
    [
        ("sensor_delay", lambda t: np.where(t > 0.1, 2 - 2 * np.exp(-(t - 0.1) / 0.5), 0.0)),
        # A lag of 0.1 s behind one of 0.5 s, from 0.
        ("sensor_lag", lambda t: 2 * (1 - (0.5 * np.exp(-t / 0.5) - 0.1 * np.exp(-t / 0.1)) / 0.4)),
    ],
)
def test_a_sensor_shows_what_its_law_says_although_the_fmu_is_stepped(
    source: FmuSource, effect: str, shown: Callable[[np.ndarray], np.ndarray]
) -> None:
    candidate = next(c for c in source.candidates() if c.card.id == effect)
    compiled = EffectSet(source, [candidate], ("y",)).model.compiled
    u, states = np.ones((len(TIME), 1)), np.zeros(len(compiled.system.states))
    assert compiled.has_own_steps  # nothing of the FMU depends on it, so it is stepped no finer
    run = compiled.run(TIME, u, compiled.with_values(np.array([0.1])), states)
    np.testing.assert_allclose(run.outputs[:, 0], shown(TIME), atol=5e-3 if effect == "sensor_delay" else 1e-3)


def test_friction_brakes_whatever_the_direction_in_which_the_force_of_an_fmu_pushes(tmp_path: Path) -> None:
    """A vendor's chassis counted its force against its position, and friction that could only push on explained nothing."""
    text = (
        'model Chassis\n  parameter Real m(unit="kg") = 2;\n  input Real f(unit="N");\n'
        '  output Real x(unit="m", start=0, fixed=true);\n  Real v(unit="m/s", start=0, fixed=true);\n'
        "equation\n  der(x) = v;\n  m*der(v) = -f;\nend Chassis;\n"
    )
    (tmp_path / "Chassis.mo").write_text(text)
    fmu = build_fmu(ModelicaModel("Chassis", "Chassis", tmp_path / "Chassis.mo").compile(), tmp_path / "Chassis.fmu")
    rows = np.column_stack([TIME, np.sin(TIME), np.sin(TIME) / 2 - TIME / 2])
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header="time,f,x", comments="", fmt="%.9g")
    b, f = 3.0, np.ones((len(TIME), 1))
    settled = -(TIME - 2 / b * (1 - np.exp(-b * TIME / 2))) / b  # 2 dv/dt = -1 - b v, from rest
    for stepped in (False, True):
        source = FmuSource.prepare(fmu, load_measurements(str(tmp_path / "run.csv")), stepped=stepped)
        candidate = next(c for c in source.candidates() if c.card.id == "viscous_friction")
        compiled = EffectSet(source, [candidate], ("x",)).model.compiled
        run = compiled.run(TIME, f, compiled.with_values(np.array([b])), np.zeros(len(compiled.system.states)))
        np.testing.assert_allclose(run.outputs[:, 0], settled, atol=0.02)


def test_an_error_of_many_times_the_noise_that_no_candidate_explains_is_never_adequate(tmp_path: Path) -> None:
    text = (
        "model Two\n  parameter Real idle = 3;\n  input Real u;\n  output Real x(start=0, fixed=true);\n"
        "  output Real y(start=0, fixed=true);\nequation\n  0.5*der(x) = u - x;\n  0.5*der(y) = 2*u - y;\nend Two;\n"
    )
    (tmp_path / "Two.mo").write_text(text)
    fmu = build_fmu(ModelicaModel("Two", "Two", tmp_path / "Two.mo").compile(), tmp_path / "Two.fmu")
    (data := tmp_path / "data").mkdir()
    for k in range(3):
        random = np.random.default_rng(k)
        u = np.repeat(random.uniform(-1, 1, 8), 25)
        y = first_order(u, 0.5)
        late = np.interp(TIME - 0.1, TIME, y / 2)
        noisy = np.column_stack([late, y]) + 0.002 * random.standard_normal((len(TIME), 2))
        rows = np.column_stack([TIME, u, noisy])
        np.savetxt(data / f"run_{k}.csv", rows, delimiter=",", header="time,u,x,y", comments="", fmt="%.9g")
    source = FmuSource.prepare(fmu, load_measurements(str(data)), stepped=True)
    assert "idle" not in {c.site for c in source.candidates()}  # a value that no output shows is none that is missing
    found = diagnose(source, source.measurements, workers=1)
    assert found.steps[0].comparison.learning.over_floor > 5
    assert found.verdict == "unknown", found.warnings  # sensors of a stepped FMU are late together or not at all


def test_an_fmu_whose_solver_does_not_end_is_stopped_soon_after_what_its_runs_take(
    source: FmuSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled, start = source.model(source.compile()).compiled, np.zeros(0)
    compiled.run(TIME, np.ones((len(TIME), 1)), compiled.parameters, start)

    def silent(function: object, *arguments: object, timeout_s: float) -> None:
        raise SilentWorker(f"{timeout_s}")

    monkeypatch.setattr(compiled.processes._workers, "call", silent)
    with pytest.raises(ComponentError, match=r"gave no answer for 1\d s"):
        compiled.run(TIME, np.ones((len(TIME), 1)), compiled.parameters, start)
