"""How far predictions are compared: as far as the plant can be predicted at all."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from orchestrator.greybox.decide import Judge
from orchestrator.greybox.diagnose import _judged
from orchestrator.greybox.prediction import HORIZONS
from orchestrator.greybox.search import FittedSet
from orchestrator.greybox.thresholds import Thresholds


class Likely:
    """A fitted set of which only the loss is asked."""

    def __init__(self, loss: float) -> None:
        self.loss = loss


class ByTable(Judge):
    """A judge whose errors are given: of each loss, over windows of each length."""

    table: dict[float, tuple[float, float, float]]

    def error(self, found: FittedSet, windows: int = 0) -> float:
        return self.table[found.loss][HORIZONS.index(windows or self.windows)]


def _windows(table: dict[float, tuple[float, float, float]], given: float = 1.0) -> int:
    ByTable.table = {**table, np.inf: (given, given, given)}
    sets: list[Any] = [Likely(loss) for loss in table]
    nominal: Any = Likely(np.inf)
    return ByTable.of(nominal, sets, Thresholds(), np.ones(1)).windows


@pytest.mark.parametrize(
    ("errors", "windows"),
    [((0.1, 0.05, 0.01), HORIZONS[0]), ((0.9, 0.1, 0.01), HORIZONS[1]), ((9.0, 0.9, 0.1), HORIZONS[2])],
)
def test_windows_are_the_longest_over_which_a_likely_set_predicts(
    errors: tuple[float, float, float], windows: int
) -> None:
    assert _windows({1.0: errors, 5.0: (9.0, 9.0, 9.0)}) == windows


def test_where_nothing_predicts_windows_are_the_shortest() -> None:
    assert _windows({1.0: (9.0, 9.0, 9.0)}) == HORIZONS[-1]


def test_errors_that_are_a_small_share_of_those_of_the_model_as_given_are_predictions_though_signals_are_smaller() -> (
    None
):
    # A ball that rolls off its beam in the model and lies against a stop on the bench.
    errors = {1.0: (0.8, 0.4, 0.2)}
    assert [_windows(errors, given) for given in (0.9, 2.0, 7.0)] == [HORIZONS[2], HORIZONS[1], HORIZONS[0]]


def test_a_set_that_is_far_less_likely_has_no_say() -> None:
    likely = {float(k): (9.0, 0.9, 0.1) for k in range(Thresholds().likeliest)}
    assert _windows({**likely, 99.0: (0.1, 0.1, 0.1)}) == HORIZONS[-1]


class Noisy:
    """A fitted set of which only forces at two balances and one sensor's noise are asked."""

    def __init__(self, *forces: float) -> None:
        noise = SimpleNamespace(intensity=np.array(forces), sensors=np.array([0.1]))
        self.fit = SimpleNamespace(noise=[noise])


class Even(Judge):
    """A judge with errors of 1."""

    def squares(self, found: FittedSet, windows: int = 0) -> np.ndarray:
        return np.ones((3, 1))


def test_what_an_effect_takes_away_at_one_balance_counts_though_another_is_explained_already() -> None:
    given, one, both = (Noisy(*forces) for forces in ((2.0, 2.0), (0.0, 2.0), (0.0, 1.0)))
    judge = Even(given, Thresholds(), np.ones(1))  # type: ignore[arg-type]
    assert judge.explained(one) == judge.explained(both) == 1.0  # type: ignore[arg-type]
    assert judge.takes_away(both, one, given) == pytest.approx(0.75)  # type: ignore[arg-type]
    assert judge.takes_away(one, given, given) == pytest.approx(1.0)  # type: ignore[arg-type]


class Quiet(Judge):
    """A judge of two outputs, of which predictions miss the first one alone."""

    def squares(self, found: FittedSet, windows: int = 0) -> np.ndarray:
        return np.tile([1.0, 0.02**2], (3, 1))


def test_an_output_that_predictions_hardly_miss_has_its_own_noise_back() -> None:
    given, found, hidden = (Noisy(force) for force in (2.0, 0.0, 0.0))
    given.fit.noise[0].sensors = np.array([0.01, 0.002])
    found.fit.noise[0].sensors = np.array([0.01, 0.02])
    hidden.fit.noise[0].sensors = np.array([0.9, 0.02])
    judge = Quiet(given, Thresholds(), np.ones(2))  # type: ignore[arg-type]
    assert judge.explained(found) > 0.99  # type: ignore[arg-type]
    assert judge.explained(hidden) < 0.2  # type: ignore[arg-type]


def test_a_signal_that_is_half_noise_does_not_hide_what_a_clean_one_says() -> None:
    """A conversion measured with 0.2 % beside 14 degC of temperature: a heat loss takes 20 times the error of T, and was not proven."""
    random = np.random.default_rng(1)
    slow = np.sin(np.linspace(0.0, 6.0, 400))
    measured = np.stack(
        [18.0 * slow + random.normal(0.0, 0.1, 400), 0.46 * slow + random.normal(0.0, 0.2, 400)], axis=1
    )
    spread = measured.std(axis=0)
    scale = _judged(SimpleNamespace(trials=[SimpleNamespace(measured=measured)]))  # type: ignore[arg-type]
    given, chosen = (np.sqrt(np.mean((np.array(e) / scale) ** 2)) for e in ((4.7, 0.26), (0.1, 0.21)))
    assert chosen / given < 1 - Thresholds().least_improvement
    assert np.mean(spread**2 / scale**2) == pytest.approx(1.0)

    alone = _judged(SimpleNamespace(trials=[SimpleNamespace(measured=measured[:, 1:])]))  # type: ignore[arg-type]
    assert alone == pytest.approx(spread[1:])
