"""Held-out trials confirm or refuse what learning trials chose, and choose nothing between sets; by hand-made fits."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.diagnosis.referee import referee as module
from orchestrator.diagnosis.referee.referee import Referee
from orchestrator.diagnosis.search.trace import Accepted
from orchestrator.library.cards import effect_library
from orchestrator.measurements import Trial, load_measurements
from orchestrator.models.estimation import Fit

ROWS = 1000


def fit(misfit: float) -> Fit:
    return Fit(np.zeros(0), np.zeros(0), (), misfit / ROWS, np.zeros(0, bool), ROWS)


def fitted(name: str, misfit: float) -> Any:
    """A set of effects, a letter each with a parameter, that leaves a misfit of the learning trials."""
    return SimpleNamespace(
        ids=tuple(name),
        labels=frozenset(name),
        size=len(name),
        values=np.zeros(len(name)),
        fit=fit(misfit),
        effects=SimpleNamespace(fixed=lambda *args: None),
    )


def judged(
    monkeypatch: pytest.MonkeyPatch, path: list[str], held_out: Mapping[str, float]
) -> tuple[list[str], list[str]]:
    """What a referee accepts and refuses, by the misfits of held-out trials; learning trials show each effect as clearly."""
    monkeypatch.setattr(Referee, "_follow", lambda self, found: fit(held_out["".join(sorted(found.labels))]))
    monkeypatch.setattr(Referee, "compared", lambda self, found, model: None)
    monkeypatch.setattr(module, "adjusted_parameters", lambda found: ())
    source: Any = SimpleNamespace(class_name="Arm")
    nothing: Any = None
    entries = [Accepted(fitted(name, 1100.0 - 30.0 * len(name)), 0.005) for name in path]
    referee, base = Referee(source, nothing, nothing, nothing, 1), fitted("", 1100.0)
    found = referee.judge(base, entries, 1.0, lambda found: (), lambda message: None)
    assert len(found.steps) == len(found.held_out) == 1 + len(found.accepted)
    return ["".join(e.refit.ids) for e in found.accepted], ["".join(sorted(labels)) for labels in found.refused]


def test_a_step_of_the_path_stays_if_held_out_trials_give_odds_of_20_to_1(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice the logarithm of 20 is 5.99."""
    assert judged(monkeypatch, ["a"], {"": 1000.0, "a": 994.0}) == (["a"], [])
    assert judged(monkeypatch, ["a"], {"": 1000.0, "a": 994.1}) == ([], ["a"])


def test_a_refused_step_leaves_what_was_confirmed_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    assert judged(monkeypatch, ["a", "ab"], {"": 1000.0, "a": 980.0, "ab": 979.0}) == (["a"], ["ab"])


def test_what_a_pendulum_is_asked_of_held_out_trials_depends_on_learning_trials_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Held-out records of another motion, mirrored and half as large, change nothing of what they are asked: of the effect
    that test_pendulum.py names by the records as they are."""

    class Asked(Exception):
        """What the referee is asked."""

    def judge(self: Referee, base: Any, path: Sequence[Accepted], *rest: Any) -> Any:
        raise Asked([sorted(entry.refit.labels) for entry in path])

    monkeypatch.setattr(Referee, "judge", judge)
    model, data = find_modelica_model("pendulum"), load_measurements(Path(__file__).parents[1] / "cases/pendulum")
    few = [
        card for card in effect_library() if card.id in ("viscous_friction", "coulomb_friction", "passive_stiffness")
    ]
    changed = tuple(_thinned(trial, -0.5 if trial.subset == "held_out" else 1.0) for trial in data.trials)
    with pytest.raises(Asked) as asked:
        diagnose(model, replace(data, trials=changed), cards=few, workers=1)
    assert asked.value.args[0] == [["viscous_friction at joint1"]]


def _thinned(trial: Trial, scale: float) -> Trial:
    """Every tenth sample, with angles times `scale`."""
    columns = {name: values[::10] * (scale if name == "theta_rad" else 1.0) for name, values in trial.columns.items()}
    return replace(trial, time=trial.time[::10], columns=columns)
