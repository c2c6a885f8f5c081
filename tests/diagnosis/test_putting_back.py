"""An effect of a set is started anew where the others alone put it."""

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.candidates import EffectSet, find_candidates
from orchestrator.diagnosis.cards import effect_library
from orchestrator.diagnosis.evidence import LearningData, refit
from orchestrator.diagnosis.fitting import Fitter, Setting
from orchestrator.diagnosis.trace import Trace
from orchestrator.diagnosis.work import Here
from orchestrator.models.patch import free_slots
from orchestrator.models.smoothing import SmoothedTrial

NOISE = np.array([1e-4])


def test_cogging_that_was_fitted_before_a_lag_was_known_finds_its_number_of_waves_once_it_is() -> None:
    """Between 24 and 17 waves of cogging a turn, which is right, lie others that fit worse than both."""
    pendulum = find_modelica_model("pendulum")
    system = pendulum.compile()
    chosen, _ = find_candidates(pendulum, system, [c for c in effect_library() if c.id in ("cogging", "sensor_lag")])
    effects = EffectSet(pendulum, chosen, ["theta"])
    model, names = effects.model, [v.name.split(".")[-1].split("[")[0] for v in effects.variables]
    right = {"sine": -1e-5, "cosine": -1.4e-4, "periods": 16.9, "tau": 0.006}
    wrong = {"sine": 6e-5, "cosine": -1e-5, "periods": 23.8, "tau": 0.006}
    time = np.arange(0, 6, 0.01)
    nothing, random = np.zeros((len(time), len(model.inputs))), np.random.default_rng(2)
    true, trials = model.compiled.with_values([right[name] for name in names]), []
    for angle in (1.2, 2.2, 4.4):
        first = {"theta": angle, "omega": 0.0}
        start = np.array([first.get(v.name, angle) for v in model.system.states])
        read = model.compiled.run(time, nothing, true, start, substeps=4).outputs
        trials.append(SmoothedTrial(time, nothing, read + NOISE * random.standard_normal(read.shape), NOISE))
    learning = LearningData(tuple(trials), NOISE)
    lost = refit(effects, learning, np.array([wrong[name] for name in names]))
    setting = Setting(
        pendulum,
        EffectSet(pendulum, (), ["theta"]).model,
        tuple(free_slots(system)),
        learning,
        Here(),
        1,
        lambda message: None,
        Trace(),
    )

    found = Fitter(setting).put_back(lost)

    assert lost.cost > 2.0  # no descent leads from there to the right number
    assert found.cost < 1.0 + 5 * (2 / found.fit.rows) ** 0.5
    place = names.index("periods")
    assert abs(found.values[place] - right["periods"]) < 5 * found.std[place]
    assert Fitter(setting).put_back(found) is found  # what leaves but noise stays
