"""Fits of play, whose contacts a free run that is off makes at other times: they begin over short stretches."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.errors import MisfitError
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, follow, refit, with_nuisances
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.diagnosis.fit.start_values import beginning_at
from orchestrator.diagnosis.noise.metric import Metric
from orchestrator.diagnosis.search.stretches import Followed, follow_closely, follow_stretches, lost_after
from orchestrator.diagnosis.search.tasks import FollowTask
from orchestrator.library.cards import SHIPPED, effect_library, read_card
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.work import Here, Resumable
from tests.benchmarks.diagnosis.truth.machines import MACHINES
from tests.benchmarks.diagnosis.truth.native import simulate

STEP, EVERY, NOISE, GAP = 1e-3, 4, 1e-4, 0.03


def rattling(gap: float = GAP) -> LearningData:
    """Two trials of two masses with play by the truth simulator, which finds each contact by bisection."""
    trials = []
    for seed in range(2):
        random, fine = np.random.default_rng(seed), np.arange(375 * EVERY + 1) * STEP
        time = fine[::EVERY]
        tones = sum(a * np.sin(2 * np.pi * hz * time + random.uniform(0, 6)) for a, hz in ((0.3, 1.1), (0.2, 2.9)))
        u = np.interp(fine, time, np.asarray(tones))[:, None]
        values = {**MACHINES["two-mass"].values, "gap": gap}
        q, _ = simulate("two-mass", values, u, [0.0, 0.0], [0.0, 0.0], step=STEP)
        shown = q[::EVERY] + NOISE * random.normal(size=(len(time), 2))
        inputs = np.column_stack([tones, np.zeros((len(time), 2))])
        trials.append(SmoothedTrial(time, inputs, shown, np.full(2, NOISE)))
    return LearningData(tuple(trials), np.full(2, NOISE))


def play() -> EffectSet:
    base = find_modelica_model("two-mass")
    cards = [card for card in effect_library() if card.id == "backlash"]
    return EffectSet(base, find_candidates(base, base.compile(), cards)[0], ("phiMotor", "phiLoad"))


def test_true_play_follows_other_trials_over_growing_stretches_where_start_values_fitted_at_once_go_astray() -> None:
    effects, learning = play(), rattling(0.1)
    found = Refit(effects, with_nuisances(effects, learning), (), beginning_at(np.array([0.1]), ()), 1)

    assert follow(found, learning).cost > 100.0
    assert follow_closely(found, learning).cost == pytest.approx(1.0, abs=0.2)
    assert lost_after(found, learning) is None


def test_play_that_is_off_is_lost_on_other_trials() -> None:
    effects, learning = play(), rattling(0.1)
    found = Refit(effects, with_nuisances(effects, learning), (), beginning_at(np.array([0.11]), ()), 1)

    assert 8 <= (lost_after(found, learning) or 0) < learning.longest / 2


def test_play_is_found_over_growing_stretches_where_a_fit_of_whole_trials_goes_astray() -> None:
    effects, learning = play(), rattling()
    astray = refit(effects, learning, np.array([0.4 * GAP]), tolerance=1e-3)
    assert astray.cost > 9.0

    followed = follow_stretches(astray, learning)

    assert followed is not None
    assert followed.samples == len(learning.trials[0].time)
    found = refit(effects, learning, followed.fit.values, earlier=followed.fit)
    assert found.cost == pytest.approx(1.0, abs=0.2)
    assert found.values[0] == pytest.approx(GAP, abs=4 * found.std[0] + 1e-3 * GAP)


def followed_with_a_step(of: float) -> Followed:
    """How far play follows two trials of which the second is off by so many deviations of the noise after 240 samples."""
    effects, whole = play(), rattling()
    kept, moved = whole.trials
    moved = replace(moved, measured=moved.measured + of * NOISE * (np.arange(len(moved.time)) > 240)[:, None])
    found = Refit(effects, with_nuisances(effects, whole), (), beginning_at(np.array([GAP]), ()), 1)
    followed = follow_stretches(found, LearningData((kept, moved), whole.floor))
    assert followed is not None
    return followed


def test_stretches_end_where_one_trial_is_lost_though_the_mean_over_trials_is_not_large() -> None:
    """The second trial is off by eleven deviations of the noise after 240 samples, of which start values take a part: that
    leaves about 5 of both trials at last, and 10 of the second one."""
    followed = followed_with_a_step(of=11)

    assert followed.samples == followed.clean == 210


def test_what_is_clean_ends_before_a_trial_leaves_more_than_noise() -> None:
    followed = followed_with_a_step(of=8)

    assert (followed.samples, followed.clean) == (rattling().longest, 210)


@pytest.mark.parametrize(("samples", "clean", "stretch"), [(210, 140, 140), (62, 41, 50), (27, 18, 27)])
def test_trials_are_cut_into_clean_stretches_unless_those_are_too_short(samples: int, clean: int, stretch: int) -> None:
    """Play of 1.4 rad beside hysteresis left 1.3 times the noise after 41 samples and 2.4 times after 62."""
    assert Followed(beginning_at(np.array([GAP]), ()), samples, clean).stretch == stretch


def test_following_is_a_task_that_is_done_once_and_gives_the_same(tmp_path: Path) -> None:
    effects, learning = play(), rattling()
    found = Refit(effects, with_nuisances(effects, learning), (), beginning_at(np.array([GAP]), ()), 1)
    task = FollowTask(effects.base, effects.signals, learning, effects.candidates, found.fit)
    first, again = (Resumable(Here(), tmp_path) for _ in range(2))

    done, kept, direct = first.do(task), again.do(task), follow_stretches(found, learning)

    assert (first.remembered, again.remembered) == (0, 1)
    assert direct is not None
    assert done.samples == kept.samples == direct.samples == learning.longest
    np.testing.assert_array_equal(done.fit.values, direct.fit.values)
    np.testing.assert_array_equal(kept.fit.values, direct.fit.values)


def test_metric_of_first_samples_whitens_as_that_of_the_whole_trial_does() -> None:
    random = np.random.default_rng(3)
    whole = Metric(2, np.asfortranarray(np.tril(random.normal(size=(12, 12)))))
    series = random.normal(size=(12, 2))

    assert whole.of_first(7, 2)(series[:7]) == pytest.approx(whole(series)[:6])


def test_a_card_says_whether_its_effect_makes_contacts(tmp_path: Path) -> None:
    text = (SHIPPED / "backlash.toml").read_text()
    said = {card.id: card.contacts for card in effect_library()}
    (tmp_path / "maybe.toml").write_text(text.replace("contacts = true", 'contacts = "maybe"'))

    assert said["backlash"] and not said["viscous_friction"]
    with pytest.raises(MisfitError, match="'contacts' = 'maybe', expected true or false"):
        read_card(tmp_path / "maybe.toml")
