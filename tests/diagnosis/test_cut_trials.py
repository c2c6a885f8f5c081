"""Trials are cut into stretches where contacts let free runs follow no whole trial."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.diagnosis import free_runs as module
from orchestrator.diagnosis.search.cutting import TooLong, cut
from orchestrator.diagnosis.search.thresholds import MOST_STRETCHES
from orchestrator.library.cards import effect_library
from orchestrator.measurements import MeasurementSet, Trial
from orchestrator.verdicts.result import NamedEffect


def measured(seconds: float = 10.0, step: float = 0.01) -> MeasurementSet:
    time = 3.0 + np.arange(round(seconds / step)) * step
    trials = tuple(Trial(f"{s}.csv", s, time, {"y": 2 * time}, {"y": "rad"}) for s in ("learning", "held_out"))  # type: ignore[arg-type]
    return MeasurementSet(Path("case"), trials, {}, {}, True, (), "hash")


def test_stretches_are_as_long_as_asked_and_spread_over_the_trial() -> None:
    found = cut(measured(), 0.8)

    assert len(found.learning) == len(found.held_out) == MOST_STRETCHES
    assert all(t.time[-1] - t.time[0] == pytest.approx(0.8, abs=0.011) for t in found.trials)
    assert found.learning[0].time[0] == 3.0
    assert found.learning[-1].time[-1] > 12.0
    assert np.all(np.concatenate([t.columns["y"] - 2 * t.time for t in found.trials]) == 0.0)
    assert found.learning[0].name == "learning.csv [3, 3.8] s"
    # A stretch begins anywhere in the record, and not where that does.
    assert not found.initial_conditions_given


def test_trials_that_hold_no_two_stretches_stay_whole() -> None:
    assert [t.name for t in cut(measured(), 6.0).trials] == ["learning.csv", "held_out.csv"]


@pytest.mark.parametrize("is_proven", [True, False])
@pytest.mark.parametrize(("named", "stretches", "asked"), [("backlash", 6, 2), ("cogging", 1, 3)])
def test_diagnosis_over_stretches_counts_only_if_its_best_effects_hold_one_with_contacts(
    monkeypatch: pytest.MonkeyPatch, named: str, stretches: int, asked: int, is_proven: bool
) -> None:
    seen, of_noise = list[int](), list[MeasurementSet]()

    def diagnosed(source: Any, shown: MeasurementSet, whole: MeasurementSet, *args: Any, may_cut: bool = False) -> Any:
        seen.append(len(shown.learning))
        of_noise.append(whole)
        if may_cut and len(seen) == 1:
            raise TooLong(0.8)
        best = (NamedEffect(named, "joint1", {}),)
        return Answer(best, ()) if is_proven else Answer((), (), best)

    monkeypatch.setattr(module, "_diagnosed", diagnosed)
    monkeypatch.setattr(
        module, "replace", lambda found, **changed: Answer(found.effects, changed.get("warnings", found.warnings))
    )

    nothing: Any = None
    trials = measured()
    found: Any = module.search_slots(nothing, trials, nothing, effect_library(), 1, lambda message: None, None)

    assert len(seen) == asked
    assert seen[-1] == stretches
    assert all(each is trials for each in of_noise), "stretches show less of the noise"
    assert ["stretches of 0.8 s" in each for each in found.warnings] == [True] * (named == "backlash")


def test_stretches_of_the_last_cut_are_judged_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = list[bool]()

    def diagnosed(*args: Any, may_cut: bool = False) -> Any:
        asked.append(may_cut)
        if may_cut:
            raise TooLong(0.8 / len(asked))
        return Answer((NamedEffect("backlash", "joint1", {}),), ())

    monkeypatch.setattr(module, "_diagnosed", diagnosed)
    monkeypatch.setattr(module, "replace", lambda found, **changed: Answer(found.effects, changed["warnings"]))

    nothing: Any = None
    found: Any = module.search_slots(nothing, measured(), nothing, effect_library(), 1, lambda message: None, None)

    assert asked == [True] * module.MOST_CUTS + [False]
    assert "stretches of 0.267 s" in found.warnings[0]


class Answer:
    """What counts of a diagnosis."""

    def __init__(
        self, effects: tuple[NamedEffect, ...], warnings: tuple[str, ...], best: tuple[NamedEffect, ...] = ()
    ) -> None:
        self.effects, self.warnings, self.best = effects, warnings, best
