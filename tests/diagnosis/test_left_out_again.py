"""What becomes of a set once its effects are known together: one turns out to be none."""

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet, can_join
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.fit.thresholds import TOLERANCE
from orchestrator.diagnosis.search.fitting import Fitter, Setting
from orchestrator.diagnosis.search.tasks import Wanted
from orchestrator.diagnosis.search.trace import Trace
from orchestrator.library.cards import effect_library
from orchestrator.models.patch import free_slots
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.work import Here

NOISE = np.array([1e-4])
RIGHT = {"sine": -1e-5, "cosine": -1.4e-4, "periods": 16.9, "tau": 0.006}
PENDULUM = find_modelica_model("pendulum")
CHOSEN = find_candidates(
    PENDULUM, PENDULUM.compile(), [c for c in effect_library() if c.id in ("cogging", "sensor_lag")]
)[0]
BOTH = EffectSet(PENDULUM, CHOSEN, ["theta"])
COGGING = EffectSet(PENDULUM, [c for c in CHOSEN if c.card.id == "cogging"], ["theta"])


def parameters(effects: EffectSet) -> list[str]:
    return [v.name.split(".")[-1].split("[")[0] for v in effects.variables]


def recorded(effects: EffectSet) -> LearningData:
    """Three trials of a pendulum with effects."""
    model, time, trials = effects.model, np.arange(0, 6, 0.01), []
    nothing, random = np.zeros((len(time), len(model.inputs))), np.random.default_rng(2)
    true = model.compiled.with_values([RIGHT[name] for name in parameters(effects)])
    for angle in (1.2, 2.2, 4.4):
        first = {"theta": angle, "omega": 0.0}
        start = np.array([first.get(v.name, angle) for v in model.system.states])
        read = model.compiled.run(time, nothing, true, start, substeps=4).outputs
        trials.append(SmoothedTrial(time, nothing, read + NOISE * random.standard_normal(read.shape), NOISE))
    return LearningData(tuple(trials), NOISE)


def fitter(learning: LearningData) -> Fitter:
    nominal, slots = EffectSet(PENDULUM, (), ["theta"]).model, tuple(free_slots(PENDULUM.compile()))
    return Fitter(Setting(PENDULUM, nominal, slots, learning, Here(), 1, lambda message: None, Trace()))


def cogging_of(learning: LearningData, waves: float, tolerance: float = TOLERANCE) -> Refit:
    """Cogging alone, fitted from another number of waves a turn."""
    first = [(RIGHT | {"periods": waves})[name] for name in parameters(COGGING)]
    return refit(COGGING, learning, np.array(first), tolerance=tolerance)


def never(left: Refit, whole: Refit) -> bool:
    return False


def fitted(learning: LearningData, **first: float) -> Refit:
    return refit(BOTH, learning, np.array([(RIGHT | first)[name] for name in parameters(BOTH)]))


@pytest.mark.parametrize(("true", "left"), [(COGGING, ("cogging",)), (BOTH, ("cogging", "sensor_lag"))])
def test_effect_of_a_set_stays_only_if_the_set_is_likelier_with_it(true: EffectSet, left: tuple[str, ...]) -> None:
    learning = recorded(true)
    found = fitted(learning, tau=0.002)

    simple = fitter(learning).simplified(found, lambda r: r.half_bic, never)

    assert tuple(sorted(simple.ids)) == left
    assert simple.cost < 1.0 + 5 * (2 / simple.fit.rows) ** 0.5


def test_redundant_effect_of_a_set_goes_though_the_set_is_likelier_with_it() -> None:
    """Such as one that takes away noise of inputs."""
    learning = recorded(BOTH)

    simple = fitter(learning).simplified(
        fitted(learning), lambda r: r.half_bic, lambda left, whole: left.ids == ("cogging",)
    )

    assert simple.ids == ("cogging",)


def test_what_is_left_of_a_set_begins_where_it_did(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a motion that is sensitive to its start goes astray on the way, and the effect left out seems to be needed."""
    learning = recorded(BOTH)
    found, wanted = fitted(learning, tau=0.002), list[Wanted]()
    work = fitter(learning)
    monkeypatch.setattr(work, "attempt", wanted.append)

    work.simplified(found, lambda r: r.half_bic, never)

    assert sorted(w.candidates[0].card.id for w in wanted) == ["cogging", "sensor_lag"]
    for one in wanted:
        assert one.near is not None and one.settled
        begun = one.near.in_model(EffectSet(PENDULUM, one.candidates, ["theta"]).model, one.first, learning.trials)
        for start, known in zip(begun.starts, found.fit.starts, strict=True):
            np.testing.assert_array_equal(start[:2], known[:2])  # angle and speed


def test_what_is_left_without_an_absent_effect_is_fitted_again_if_it_went_astray_by_itself() -> None:
    """Cogging beside an end stop that the data did not show had the right number of waves, cogging alone had 40 for 25."""
    learning = recorded(COGGING)
    astray, right = cogging_of(learning, 23.8), cogging_of(learning, RIGHT["periods"])
    (drag,) = find_candidates(
        PENDULUM, PENDULUM.compile(), [c for c in effect_library() if c.id == "viscous_friction"]
    )[0]
    beside = can_join(COGGING.candidates, drag, free_slots(PENDULUM.compile()))
    assert beside is not None
    both = refit(EffectSet(PENDULUM, [*COGGING.candidates, beside], ["theta"]), learning, np.r_[right.values, 1e-6])

    (again,) = fitter(learning).pruned([both, astray])

    assert not both.is_present() and astray.cost > 2.0 > both.cost
    assert again.ids == ("cogging",)
    assert again.cost < 1.0 + 5 * (2 / again.fit.rows) ** 0.5
    assert fitter(learning).pruned([both, right]) == []
