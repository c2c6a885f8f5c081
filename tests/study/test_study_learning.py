"""What the study computes from corrections, against direct conditioning and brute force."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from learning_cases import corrections, models
from threadpoolctl import threadpool_limits

from fmus.errors import MisfitError
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.study.conditioned import GRID, coefficients, given_bench, size_over_grid
from orchestrator.study.draws import DrawTask, Problem, tasks
from orchestrator.study.muscles import MUSCLES, capabilities
from orchestrator.study.noise_models import learn
from orchestrator.study.study import Case, Study
from orchestrator.study.summary import bars
from orchestrator.study.variants import EXCLUDED_N, VARIANTS, Setting, clear_of_stops, only, outcome, settled
from orchestrator.study.work import Processes, alone, digest, do_all
from orchestrator.work import Resumable

CLAIMS = ("mean improvement of the four strong muscles, %", "least improvement of any muscle in any seed, %")


def directly(problem: Problem, chosen: np.ndarray) -> np.ndarray:
    """Errors over the grid by conditioning on all data at once, (6,)."""
    some = problem.corrections.rows(chosen)
    seen = observe("all", some.state, coefficients(some), some.force, problem.deviation[chosen])
    posterior = condition(problem.initial.latents, [*problem.initial.observations, seen])
    true = capabilities(GRID)
    return np.array([size_over_grid(posterior.mean(m, GRID) - true[:, k]) for k, m in enumerate(MUSCLES)])


def problem(count: int = 60) -> Problem:
    return Problem(models(), corrections(count), np.random.default_rng(1).uniform(0.5, 5.0, count))


def test_draws_are_what_direct_conditioning_on_their_corrections_gives() -> None:
    case, sizes = problem(), (5, 20, 50)
    (task,) = tasks(case, sizes, 3, seed=9)

    found = task.run()

    rng = np.random.default_rng([9, 5, 0])
    for draw in range(3):
        order = rng.permutation(60)[:50]
        for place, size in enumerate(sizes):
            assert found[draw, place] == pytest.approx(directly(case, order[:size]), abs=1e-8)


def test_all_corrections_are_what_direct_conditioning_gives_in_any_order() -> None:
    case = problem()
    given = given_bench(case.initial, case.corrections)
    rows = np.random.default_rng(2).permutation(60)

    assert given.errors(case.deviation, rows) == pytest.approx(directly(case, np.arange(60)), abs=1e-8)


def test_excluded_corrections_are_as_if_they_were_not_there() -> None:
    case = problem()
    kept = np.arange(60) < 25
    given = given_bench(case.initial, case.corrections)

    without = given.errors(only(case.deviation[kept], kept), np.arange(60))

    assert without == pytest.approx(directly(case, np.flatnonzero(kept)), abs=1e-6)


def test_workers_and_chunks_do_not_change_a_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    case = problem()
    monkeypatch.setattr("orchestrator.study.draws.CHUNK", 4)
    todo = tasks(case, (10, 40), 10, seed=3)
    pool = Processes(2)
    try:
        elsewhere = do_all(pool, todo)
    finally:
        pool.close()

    here = do_all(Processes(1), todo)

    assert [each.count for each in todo] == [4, 4, 2]
    assert np.concatenate(here).tobytes() == np.concatenate(elsewhere).tobytes()


def test_models_fitted_in_another_process_have_the_same_content() -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        other = pool.submit(models).result()

    assert digest(other) == digest(models())


def bits(name: str) -> bytes:
    return outcome(name, Setting(models(), models(False), corrections(90))).improvement.tobytes()


def test_every_way_to_learn_gives_the_same_bits_in_another_process() -> None:
    """Another process hashes strings in another way, so sets of names have another order there."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        elsewhere = list(pool.map(bits, VARIANTS))

    differ = [name for name, there in zip(VARIANTS, elsewhere, strict=True) if bits(name) != there]

    assert differ == []


def test_noise_of_outliers_has_the_same_bits_on_one_processor() -> None:
    with threadpool_limits(limits=1, user_api="blas"):
        alone = bits("no outliers")

    assert bits("no outliers") == alone


def test_a_dask_cluster_gives_the_same_bits() -> None:
    distributed = pytest.importorskip("distributed")
    from orchestrator.work import Cluster

    todo = tasks(problem(), (10, 40), 6, seed=3)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, protocol="tcp"
    ) as cluster:
        far = Cluster(cluster.scheduler_address)
        try:
            elsewhere = do_all(far, todo)
        finally:
            far.close()

    assert np.concatenate(elsewhere).tobytes() == np.concatenate(do_all(Processes(1), todo)).tobytes()


def test_finished_tasks_are_found_again_after_an_interruption(tmp_path: Path) -> None:
    (task,) = tasks(problem(), (10,), 2, seed=3)
    first = Resumable(Processes(1), tmp_path)
    result = first.do(task)
    again = Resumable(Processes(1), tmp_path)

    assert again.do(task).tobytes() == result.tobytes()
    assert again.remembered == 1


def test_another_number_anywhere_is_another_task() -> None:
    case = problem()
    other = replace(case, deviation=case.deviation + np.eye(60)[30] * 1e-12)
    keys = {task.key for each in (case, other) for task in (*tasks(each, (10,), 2, 3), *tasks(each, (10,), 2, 4))}

    assert len(keys) == 4
    assert digest(problem()) == digest(case)


def test_noise_that_is_learnt_tells_stops_from_the_rest() -> None:
    seen = corrections(150)
    found = learn("observed", given_bench(models(), seen), seen)

    assert np.median(found.noise.deviation[seen.at_stop]) == pytest.approx(50.0, rel=0.3)
    assert np.median(found.noise.deviation[~seen.at_stop]) < 3.0
    assert found.value < learn("constant", given_bench(models(), seen), seen).value - 50.0


def test_coverage_is_that_of_predictions_made_without_the_group() -> None:
    """Each group of four left out in turn, with a posterior of its own."""
    case, groups = problem(24), np.arange(24) // 4
    inside = 0
    for group in range(6):
        left, rest = case.corrections.rows(groups == group), case.corrections.rows(groups != group)
        seen = observe("rest", rest.state, coefficients(rest), rest.force, case.deviation[groups != group])
        posterior = condition(case.initial.latents, [*case.initial.observations, seen])
        variance = posterior.variance(coefficients(left), left.state) + case.deviation[groups == group] ** 2
        error = left.force - posterior.mean(coefficients(left), left.state)
        inside += int(np.count_nonzero(np.abs(error) < 1.6448536 * np.sqrt(variance)[:, None]))

    given = given_bench(case.initial, case.corrections)

    assert 0 < inside < 48
    assert given.coverage(case.deviation, groups) == pytest.approx(inside / 48, abs=1e-12)


def test_hyperparameters_fitted_anew_leave_weak_muscles_alone() -> None:
    setting = Setting(models(), models(False), corrections(90))
    found = outcome("refitted", setting).problem

    assert found is not None
    for name in MUSCLES:
        same = found.initial.latents[name] == setting.initial.latents[name]
        assert same == (name in ("biceps", "triceps short head"))


def test_an_unknown_kind_of_noise_is_refused_by_name() -> None:
    with pytest.raises(MisfitError, match="'white'; expected one of constant, force, observed"):
        learn("white", given_bench(models(), corrections()), corrections())


def test_students_errors_trust_stops_less_without_being_told_of_them() -> None:
    seen = corrections(90)
    found = outcome("no outliers", Setting(models(), models(False), seen)).problem
    assert found is not None
    deviation = found.deviation

    assert np.median(deviation[seen.at_stop]) > 2.0 * np.median(deviation[~seen.at_stop])


def test_settled_corrections_are_clear_of_stops_too() -> None:
    seen = corrections()

    assert np.all(clear_of_stops(seen)[settled(seen)])
    assert 0 < settled(seen).sum() < clear_of_stops(seen).sum()


def test_good_corrections_improve_all_strong_muscles_and_bad_ones_taken_for_good_harm() -> None:
    seen = corrections(150)
    setting = Setting(models(), models(False), seen)

    clear, one = outcome("clear of stops", setting), outcome("one noise", setting)

    assert clear.used == 100
    assert clear.improvement[[0, 1, 3, 5]].min() > 0.1
    assert clear.improvement[[0, 1, 3, 5]].mean() > one.improvement[[0, 1, 3, 5]].mean() + 0.1


def test_the_printed_form_harms_all_muscles_if_read_raw_and_none_much_if_read_as_a_sum() -> None:
    setting = Setting(models(), models(False), corrections(30))
    raw, summed, exact = (outcome(name, setting) for name in ("printed raw", "printed sum", "joint"))

    assert raw.improvement.max() < -1.0
    assert np.abs(summed.improvement - exact.improvement).max() < 0.3


def test_a_task_runs_with_one_blas_thread() -> None:
    from threadpoolctl import threadpool_info

    class Look:
        key = "look"

        def run(self) -> list[int]:
            return [each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"]

    assert set(alone(Look())) == {1}


def test_draw_tasks_hold_all_draws_once() -> None:
    todo = tasks(problem(), (10,), 300, seed=1)

    assert [(task.chunk, task.count) for task in todo] == [(0, 128), (1, 128), (2, 44)]
    assert all(isinstance(task, DrawTask) for task in todo)
    assert EXCLUDED_N > 1e5


@pytest.mark.parametrize(
    ("strength", "worst", "missed"),
    [
        (36.0, -4.0, []),
        (34.0, -4.0, ["mean improvement of the four strong muscles, %"]),
        (36.0, -6.0, ["least improvement of any muscle in any seed, %"]),
    ],
)
def test_at_both_strengths_the_strong_four_gain_35_and_no_muscle_of_any_seed_loses_more_than_5_percent(
    strength: float, worst: float, missed: list[str]
) -> None:
    gains = {seed: np.full(6, strength) / 100.0 for seed in range(10)}
    gains[7][2] = worst / 100.0  # the biceps of one seed
    cases = [
        Case(seed, "small", limit, way, SimpleNamespace(improvement=gain))  # type: ignore[arg-type]
        for seed, gain in gains.items()
        for limit in (140.0, 90.0)
        for way in ("joint", "without velocity", "clear of stops", "compensated", "refitted")
    ]
    line = SimpleNamespace(line=SimpleNamespace(slope=1.0, r2=0.8))
    study = Study(
        672, tuple(gains), 0, {(s, limit): (line, line) for s in gains for limit in (140.0, 90.0)}, tuple(cases), ()
    )  # type: ignore[misc]

    found = [bar for bar in bars(study) if bar.claim.removeprefix("caregivers of 90 N: ") in CLAIMS]

    assert len(found) == 4
    assert {bar.claim.removeprefix("caregivers of 90 N: ") for bar in found if not bar.met} == set(missed)
