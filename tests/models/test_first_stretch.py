"""Start values that no output shows by itself."""

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import expm

from fmus.catalogue import find_modelica_model
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
from orchestrator.models.compiled import CompiledModel
from orchestrator.models.first_stretch import start_of_first_stretch
from orchestrator.models.smoothing import SmoothedTrial

STIFFNESS, LAG = 40.0, 0.03
# x' = v, v' = -k x, r' = (x - r)/tau, and h' = -h, which nothing shows
MATRIX = np.array([[0, 1, 0, 0], [-STIFFNESS, 0, 0, 0], [1 / LAG, 0, -1 / LAG, 0], [0, 0, 0, -1.0]])


def spring_read_late() -> CompiledModel:
    t, x, u, d, p = (ca.SX.sym(name, n) for name, n in zip("txudp", (1, 4, 0, 0, 0), strict=True))
    nothing = ca.SX(0, 1)
    system = SymbolicSystem(
        name="SpringReadLate",
        description="",
        inputs=(),
        states=tuple(Variable(name, start=0.0) for name in ("x", "v", "r", "h")),
        algebraics=(),
        parameters=(),
        dependents=(),
        outputs=("r",),
        rhs=ca.Function("rhs", [t, x, u, d, p], [ca.DM(MATRIX) @ x, nothing]),
        history=ca.Function("history", [t, u, p], [nothing, nothing]),
        dependent=ca.Function("dependent", [p], [nothing]),
        initial=ca.Function("initial", [p], [ca.SX.zeros(4)]),
    )
    return CompiledModel(system, ["r"])


def found_from(first: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    time = np.arange(400) * 0.005
    true = np.array([1.3, -4.0, 0.8, 0.0])
    read = np.array([(expm(MATRIX * at) @ true)[2] for at in time])[:, None]
    nothing = np.zeros((len(time), 0))
    return start_of_first_stretch(
        spring_read_late(), time, nothing, read, np.array([1e-6]), np.zeros(0), first, low, high, 4
    )


def test_position_and_speed_behind_a_slow_sensor_are_found_and_what_nothing_shows_stays() -> None:
    anything = np.full(4, np.inf)

    found = found_from(np.array([0.0, 0.0, 1.0, 0.7]), -anything, anything)

    assert found == pytest.approx([1.3, -4.0, 0.8, 0.7], abs=2e-4)


def test_start_values_stay_within_their_bounds() -> None:
    anything = np.full(4, np.inf)

    found = found_from(np.zeros(4), -anything, np.array([1.0, np.inf, np.inf, np.inf]))

    assert found[0] == 1.0


def test_pendulum_with_a_slow_encoder_begins_where_its_record_does() -> None:
    """Its class begins hanging at rest: free runs from there say nothing of a lag."""
    pendulum = find_modelica_model("pendulum")
    chosen, _ = find_candidates(pendulum, pendulum.compile(), [c for c in effect_library() if c.id == "sensor_lag"])
    model = EffectSet(pendulum, chosen[:1], ["theta"]).model
    time, lag = np.arange(0, 2, 0.004), 0.02
    parameters = model.compiled.with_values([lag])
    names = [v.name for v in model.system.states]
    true = np.array([{"theta": 1.0, "omega": -2.0}.get(name, 1.04) for name in names])
    nothing = np.zeros((len(time), len(model.inputs)))
    read = model.compiled.run(time, nothing, parameters, true, substeps=4).outputs
    noise = np.array([1e-4])
    noisy = read + noise * np.random.default_rng(3).standard_normal(read.shape)

    record = model.record(SmoothedTrial(time, nothing, noisy, noise), parameters)

    again = model.compiled.run(time, nothing, parameters, record.start, substeps=4).outputs
    assert np.sqrt(np.mean((again - read) ** 2)) < 3 * noise[0]
