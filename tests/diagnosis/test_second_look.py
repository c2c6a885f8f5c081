"""What free runs named, and what balance equations name: which of both is the answer."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "report"))
from builders import diagnosis

from orchestrator import diagnose
from orchestrator.diagnosis.referee.referee import Refereed
from orchestrator.simpler_answers import needs_excitation
from orchestrator.verdicts.result import Diagnosis, Step, Verdict


def _answer(verdict: Verdict, left: float, removed: float = 0.9) -> Diagnosis:
    """A diagnosis that leaves so many noise floors of the learning trials, and has removed a share of what exceeds the floor."""
    found = diagnosis(verdict)
    before = 1.0 + (left - 1.0) / (1.0 - removed)
    steps = (_with_error(found.steps[0], before), *found.steps[1:-1], _with_error(found.steps[-1], left))
    return replace(found, steps=steps, seconds=1.0)


def _with_error(step: Step, over_floor: float) -> Step:
    assert step.comparison.learning is not None
    learning = replace(step.comparison.learning, over_floor=over_floor)
    return replace(step, comparison=replace(step.comparison, learning=learning))


@pytest.mark.parametrize(
    ("verdict", "left", "removed", "is_fmu", "asks"),
    [
        ("named", 1.1, 0.9, False, False),
        ("named", 100.0, 0.1, False, True),
        ("named", 100.0, 0.9, False, False),
        ("named", 100.0, 0.9, True, True),
        ("ambiguous", 1.1, 0.9, False, False),
        ("ambiguous", 1.1, 0.9, True, True),
        ("unknown", 1.1, 0.9, False, True),
    ],
)
def test_balance_equations_are_looked_at_where_much_is_left_or_nothing_is_sure(
    verdict: Verdict, left: float, removed: float, is_fmu: bool, asks: bool
) -> None:
    assert diagnose._asks_for_more(_answer(verdict, left, removed), is_fmu) is asks


def test_what_leaves_less_is_the_answer() -> None:
    first, second = _answer("named", 50.0), _answer("named", 2.0)
    assert diagnose._better_of(first, second).steps == second.steps
    assert diagnose._better_of(second, first).steps == second.steps
    assert diagnose._better_of(first, second).seconds == 2.0


def test_what_is_said_of_an_answer_goes_with_it_and_what_is_said_of_the_record_stays() -> None:
    """A geared motor was 0.91 times the noise with dry friction, and "a structured error is left" of the answer before."""
    record = "the data would not show most effects at sensor:current: record trials that move them"
    left = "a structured error is left: on held-out trials the error is 2.79 times its part without structure"
    first = replace(_answer("named", 50.0), warnings=(left, "drift or tremor: odds 3 to 1", record))
    second = replace(_answer("named", 2.0), warnings=())

    assert diagnose._better_of(first, second).warnings == (record,)


def test_two_effects_stay_two_until_balance_equations_have_tried_both() -> None:
    either, one = _answer("ambiguous", 1.0), _answer("named", 1.0)
    one = replace(one, effects=one.effects[:1])
    ranked = one.ranking[0]
    alone = replace(one, ranking=(replace(ranked, effects=("coulomb_friction",), sites=ranked.sites[:1]),))
    both = replace(
        alone, ranking=(*alone.ranking, replace(ranked, effects=("viscous_friction",), sites=ranked.sites[:1]))
    )

    assert diagnose._better_of(either, alone).verdict == "ambiguous"
    assert diagnose._better_of(either, both).verdict == "named"


def test_one_effect_inside_an_fmu_goes_before_three_at_its_borders_that_leave_as_much() -> None:
    one, other = (_answer("named", left) for left in (0.97, 0.95))
    one = replace(one, effects=one.effects[:1])
    three = replace(other, effects=other.effects[:1] * 3, warnings=("payload is not tried: the FMU would have ...",))
    assert diagnose._asks_for_more(three, is_fmu=True) and not diagnose._asks_for_more(one, is_fmu=True)
    best = diagnose._better_of(three, one)
    assert len(best.effects) == 1 and not any("not tried" in note for note in best.warnings)
    assert len(diagnose._better_of(three, _answer("named", 1.5)).effects) == 3


def test_what_names_something_is_the_answer_where_free_runs_named_nothing() -> None:
    assert diagnose._better_of(_answer("unknown", 50.0), _answer("ambiguous", 2.0)).verdict == "ambiguous"
    assert diagnose._better_of(_answer("unknown", 50.0), _answer("unknown", 2.0)).verdict == "unknown"


@pytest.mark.parametrize(("left", "asks"), [(1.0, False), (20.0, True)])
def test_several_effects_that_each_explain_the_record_need_another_experiment_and_no_look_at_the_balance_equations(
    left: float, asks: bool
) -> None:
    """Two masses on a slow ramp: drag, viscous and dry friction each leave noise; *ambiguous*, viscous friction, after 290 s."""
    given = _answer("unknown", 100.0).steps[:1]
    tried = _over_floor(given[0], left)
    alike = (("quadratic_drag", "viscous_friction"),)
    found = replace(
        diagnosis("cannot_tell"), steps=given, confusable=alike, search=Refereed((), (*given, tried), (), 1)
    )

    assert needs_excitation(found) is not asks
    assert diagnose._asks_for_more(found, is_fmu=False) is asks
    assert not needs_excitation(replace(found, confusable=()))


def _over_floor(step: Step, times: float) -> Step:
    given = step.comparison
    assert given.learning is not None and given.held_out is not None
    rmse = {name: times * floor for name, floor in given.noise_floor.items()}
    sides = (replace(each, rmse=rmse, over_floor=times) for each in (given.learning, given.held_out))
    return replace(step, comparison=replace(given, **dict(zip(("learning", "held_out"), sides, strict=True))))


@pytest.mark.parametrize(("was_cut", "verdict"), [(False, "unknown"), (True, "named")])
def test_the_best_set_of_free_runs_stays_where_it_leaves_less_unless_its_search_was_cut(
    was_cut: bool, verdict: Verdict
) -> None:
    """A double pendulum: Stribeck friction and a tremor along learning trials, dry friction at its balances."""
    tried = _answer("named", 2.0, removed=0.95)
    first = replace(
        _answer("unknown", 2.0), best=tried.effects, search=Refereed((), tried.steps, (), 1, was_cut=was_cut)
    )

    assert diagnose._better_of(first, _answer("named", 20.0, removed=0.5)).verdict == verdict


def test_a_set_that_removes_little_is_doubted_where_nothing_helps_at_the_balance_equations() -> None:
    found = diagnose._better_of(_answer("named", 100.0, removed=0.11), _answer("unknown", 100.0))
    assert found.verdict == "unknown" and found.best and not found.effects
    assert "removes 11% of the error along learning trials" in found.warnings[0]
    assert diagnose._better_of(_answer("named", 3.0, removed=0.9), _answer("unknown", 100.0)).verdict == "named"


def test_one_of_several_that_all_leave_much_is_doubted_where_nothing_helps_at_the_balance_equations() -> None:
    assert diagnose._better_of(_answer("ambiguous", 50.0), _answer("unknown", 50.0)).verdict == "unknown"
    assert diagnose._better_of(_answer("ambiguous", 1.1), _answer("unknown", 50.0)).verdict == "ambiguous"


def test_a_set_that_removes_little_gives_way_to_what_balance_equations_name() -> None:
    first, second = _answer("named", 3.0, removed=0.11), _answer("named", 4.0)
    assert diagnose._better_of(first, second).steps == second.steps
