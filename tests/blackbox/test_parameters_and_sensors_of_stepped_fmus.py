"""An FMU that can only be stepped: wrong parameters are varied before runs and named, and sensors do what their laws say."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
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
