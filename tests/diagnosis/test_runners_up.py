"""After a set that held-out trials refuse, those are asked that the learning trials do not tell from it; by hand-made fits."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from orchestrator.diagnosis.referee import referee as module
from orchestrator.diagnosis.referee.referee import Referee, Refereed
from orchestrator.diagnosis.referee.runners_up import runners_up
from orchestrator.diagnosis.search.trace import Accepted, Trace
from orchestrator.models.estimation import Fit

ROWS = 1000


def fit(misfit: float) -> Fit:
    return Fit(np.zeros(0), np.zeros(0), (), misfit / ROWS, np.zeros(0, bool), ROWS)


def fitted(name: str, misfit: float, *, is_present: bool = True) -> Any:
    """A set of effects, a letter each with a parameter, that leaves a misfit of the learning trials."""
    return SimpleNamespace(
        ids=tuple(name),
        labels=frozenset(name),
        size=len(name),
        values=np.zeros(len(name)),
        fit=fit(misfit),
        effects=SimpleNamespace(fixed=lambda *args: None),
        is_present=lambda: is_present,
    )


def judged(
    monkeypatch: pytest.MonkeyPatch, path: list[str], tied: list[str], held_out: Mapping[str, float]
) -> tuple[list[str], list[str]]:
    """What a referee accepts and refuses, by the misfits of held-out trials; learning trials show each effect as clearly."""
    monkeypatch.setattr(Referee, "_follow", lambda self, found: fit(held_out["".join(sorted(found.labels))]))
    monkeypatch.setattr(Referee, "_compared", lambda self, found, model: None)
    monkeypatch.setattr(module, "adjusted_parameters", lambda found: ())
    source: Any = SimpleNamespace(class_name="Arm")
    nothing: Any = None
    referee, base = Referee(source, nothing, nothing, nothing, 1), fitted("", 1100.0)

    def entries(names: list[str]) -> list[Accepted]:
        return [Accepted(fitted(name, 1100.0 - 30.0 * len(name)), 0.005) for name in names]

    def quietly(message: str) -> None:
        pass

    first: Refereed = referee.judge(base, entries(path), 1.0, lambda found: (), quietly)
    found = referee.instead(first, base, entries(tied), 1.0, lambda found: (), quietly)
    assert len(found.steps) == len(found.held_out) == 1 + len(found.accepted)
    return ["".join(e.refit.ids) for e in found.accepted], ["".join(sorted(labels)) for labels in found.refused]


def test_runner_up_that_held_out_trials_confirm_takes_the_place_of_a_refused_set(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    held_out = {"": 1000.0, "a": 999.0, "b": 998.0, "c": 980.0, "d": 900.0}
    assert judged(monkeypatch, ["a"], ["b", "c", "d"], held_out) == (["c"], ["a", "b"])


def test_each_set_that_is_asked_in_place_of_others_needs_odds_as_many_times_as_large(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Twice the logarithm of 20 is 5.99, of 40 it is 7.38."""
    assert judged(monkeypatch, ["b"], [], {"": 1000.0, "b": 993.0}) == (["b"], [])
    assert judged(monkeypatch, ["a"], ["b"], {"": 1000.0, "a": 999.0, "b": 993.0}) == ([], ["a", "b"])
    assert judged(monkeypatch, ["a"], ["b"], {"": 1000.0, "a": 999.0, "b": 992.0}) == (["b"], ["a"])


def test_runners_up_of_a_refused_pair_hold_what_is_confirmed_already(monkeypatch: pytest.MonkeyPatch) -> None:
    held_out = {"": 1000.0, "a": 980.0, "ab": 979.0, "cd": 900.0, "ac": 950.0}
    assert judged(monkeypatch, ["a", "ab"], ["cd", "ac"], held_out) == (["a", "ac"], ["ab"])


def test_runners_up_are_those_the_learning_trials_do_not_tell_from_the_refused_set(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A misfit of 6 is a half BIC of 3: odds of 20 to 1. What was fitted roughly is finished first."""
    monkeypatch.setattr(Trace, "objection", lambda self, found: "noise" if "n" in found.ids else "")
    monkeypatch.setattr(Trace, "p_value", lambda self, found: 0.005)
    refused, rough, better = fitted("a", 1000.0), fitted("c", 1007.0), fitted("c", 1001.0)
    others = [fitted("f", 1006.5), fitted("b", 1005.5), fitted("n", 1001.0), fitted("o", 1001.0, is_present=False)]
    trace = Trace(1, refitted=[refused, rough, *others])

    found = runners_up(refused, trace, 1.0, lambda r: better if r is rough else r)

    assert [entry.refit.ids for entry in found] == [("c",), ("b",)]
    assert better in trace.refitted
