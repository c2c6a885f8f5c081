"""What data leave open is said in words: dead, flat, traded, not pinned; intervals where curvature misleads."""

import numpy as np
import pytest
from scipy.stats import chi2

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.advise.identifiability import Fitted, doubts, doubts_of
from orchestrator.diagnosis.advise.profile import profiles
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, fit_nominal, refit
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.linear.coverage import coverage
from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.noise.nuisances import Nuisances
from orchestrator.library.cards import effect_library
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.verdicts.open_questions import Doubt

DRIVE = find_modelica_model("drive")
TIME = np.arange(0, 4, 0.01)
NOISE = np.array([1e-3])


def effect_set(*ids: str) -> EffectSet:
    found = find_candidates(DRIVE, DRIVE.compile(), effect_library())[0]
    chosen, slots = [], iter(("jointTorque1", "jointTorque2", "jointTorque3"))
    for name in ids:
        candidate = next(c for c in found if c.card.id == name)
        chosen.append(type(candidate)(candidate.card, next(slots), candidate.element, candidate.site))
    return EffectSet(DRIVE, chosen, ["phi"])


def learning(
    effects: EffectSet, values: list[float], torque: np.ndarray, seed: int = 1, **extra: object
) -> LearningData:
    inputs = np.column_stack([torque, np.zeros(len(TIME))])
    model = effects.model
    start = np.zeros(len(model.system.states))
    true = model.compiled.run(TIME, inputs, model.compiled.with_values(values), start, substeps=4).outputs
    measured = true + NOISE * np.random.default_rng(seed).standard_normal(true.shape)
    return LearningData((SmoothedTrial(TIME, inputs, measured, NOISE),), NOISE, **extra)  # type: ignore[arg-type]


def fitted(effects: EffectSet, values: list[float], data: LearningData) -> Refit:
    return refit(effects, data, np.array(values))


def response(found: Refit, data: LearningData) -> Response:
    return Response(found, [t.smoother for t in data.trials])


def kinds(found: list[Doubt]) -> dict[str, list[tuple[str, ...]]]:
    result: dict[str, list[tuple[str, ...]]] = {}
    for doubt in found:
        result.setdefault(doubt.kind, []).append(doubt.parameters)
    return result


SWING = 0.05 * np.sin(2 * np.pi * 0.6 * TIME) + 0.03 * np.sin(2 * np.pi * 1.7 * TIME)


def parameter(name: str, value: float = 1.0, std: float = 0.01, **more: object) -> Fitted:
    return Fitted(name, "N", value, std, abs(value), **more)  # type: ignore[arg-type]


def test_column_of_zeros_is_dead_and_says_by_how_much_it_could_change() -> None:
    found = doubts([parameter("a"), parameter("b", 5.0)], np.array([[100.0, 0.0], [0.0, 0.01]]))

    assert kinds(found) == {"dead": [("b",)]}
    assert found[0].message == "the data do not depend on b: a change by 5 N would not show"


def test_flat_direction_is_the_null_vector_of_the_slopes() -> None:
    """Data that show 3 a - 2 b and c only: a and b may rise by 2 : 3."""
    columns = np.array([[300.0, -200.0, 0.0], [0.0, 0.0, 50.0]])

    found = doubts([parameter("a"), parameter("b"), parameter("c")], columns)

    assert kinds(found) == {"flat": [("a", "b")]}
    step = np.array([2.0, 3.0]) / np.sqrt(13)
    assert (
        found[0].message == f"the data do not show whether a rises by {step[0]:.3g} N while b rises by {step[1]:.3g} N"
    )


@pytest.mark.parametrize(("correlation", "way"), [(0.99, "together"), (-0.99, "in opposite directions"), (0.9, "")])
def test_pair_trades_off_beyond_a_correlation_of_0_95(correlation: float, way: str) -> None:
    covariance = 1e-4 * np.array([[1.0, correlation], [correlation, 1.0]])
    columns = np.linalg.cholesky(np.linalg.inv(covariance)).T

    found = [d for d in doubts([parameter("a"), parameter("b")], columns) if d.kind == "trade-off"]

    assert len(found) == bool(way)
    assert all(f"they can move {way} (correlation {correlation:+.3f})" in d.message for d in found)


def test_two_tolerances_that_trade_off_are_no_news() -> None:
    columns = np.array([[1000.0, -999.0], [0.0, 10.0]])
    a, b = (parameter(name, is_tolerance=True) for name in "ab")

    assert doubts([a, b], columns) == []
    assert kinds(doubts([a, parameter("b")], columns)) == {"trade-off": [("a", "b")]}


def test_added_inertia_trades_off_with_the_inertia_of_a_stated_tolerance() -> None:
    effects = effect_set("rotor_inertia")
    tolerance = Nuisances(("J",), np.array([0.02]), np.array([0.001]))
    data = learning(effects, [0.01], SWING, nuisances=tolerance)

    found = doubts_of(fitted(effects, [0.005], data), data)

    assert kinds(found)["trade-off"] == [("rotor_inertia J[1]", "J")]
    assert "in opposite directions" in found[0].message


def test_breakaway_that_never_showed_leaves_its_speed_dead() -> None:
    """Pushed so hard that it moves fast from the first sample on, the drive shows no Stribeck speed."""
    effects = effect_set("stribeck_friction")
    data = learning(effects, [0.02, 0.02, 0.05], np.full(len(TIME), 0.1))

    best = fitted(effects, [0.02, 0.02, 0.05], data)
    found = doubts_of(best, data)

    open_ones = {name for d in found for name in d.parameters}
    assert {"stribeck_friction tauExtra[1]", "stribeck_friction vS"} <= open_ones
    needs = coverage(response(best, data), best.effects.candidates, {})
    (slow,) = [c for c in needs if "below" in c.words]
    assert (slow.site, slow.words) == ("joint1", "|speed| below 0.2 rad/s for at least 50 samples")
    speeds = np.arange(len(TIME)) * 0.01 * (0.1 - 0.02) / 0.02  # of constant acceleration, but for the breakaway
    assert slow.found == pytest.approx(np.count_nonzero(speeds < 0.2), abs=2)
    assert slow.message.endswith(f"samples; these data have {slow.found:.3g}")


def test_coverage_of_slots_that_are_still_free_is_known_too() -> None:
    effects = effect_set("viscous_friction")
    data = learning(effects, [0.0], np.full(len(TIME), 0.05))
    base = fit_nominal(EffectSet(DRIVE, (), ["phi"]), effects.model.restricted(["phi"]), data)
    candidates = find_candidates(DRIVE, DRIVE.compile(), effect_library())[0]

    found = {c.effect: c for c in coverage(response(base, data), candidates, {})}

    assert not found["coulomb_friction"].is_enough  # speed never reverses
    assert found["passive_stiffness"].is_enough


def test_profile_of_a_parameter_at_its_bound_ends_there_and_covers_the_rest() -> None:
    """Without friction in the truth the interval begins at 0, and ends where a direct scan of the misfit does."""
    effects = effect_set("viscous_friction")
    data = learning(effects, [0.0], SWING)
    best = fitted(effects, [0.001], data)

    (found,) = profiles(best, data)

    assert found.open_low
    assert found.low == pytest.approx(0.0, abs=1e-12)
    held = [_misfit_at(effects, data, b) for b in (found.high, best.values[0])]
    rise = (held[0] - held[1]) / best.cost
    wanted = chi2.ppf(0.9, 1) * (best.std[0] / _white_std(best, data)) ** 2
    assert rise == pytest.approx(wanted, rel=0.25)


def test_parabola_is_left_as_it_is() -> None:
    effects = effect_set("viscous_friction")
    data = learning(effects, [0.02], SWING)

    assert profiles(fitted(effects, [0.01], data), data) == []


def _misfit_at(effects: EffectSet, data: LearningData, b: float) -> float:
    """Least misfit with friction b, over start values, by a fit that knows of no friction to be found."""
    fixed = effects.fixed(np.array([b]), "Fixed").restricted(["phi"])
    return fit_nominal(EffectSet(DRIVE, (), ["phi"]), fixed, data).fit.misfit


def _white_std(best: Refit, data: LearningData) -> float:
    """Standard deviation for white residuals of the size that is left, from slopes by differences of whole fits."""
    b, h = float(best.values[0]), 1e-5
    effects = best.effects
    up, middle, down = (_misfit_at(effects, data, b + k * h) for k in (2, 1, 0))
    return float(np.sqrt(2 * best.cost / ((up - 2 * middle + down) / h**2)))
