"""Diagnose a model: compare it, search for the missing effects, let held-out trials referee, give a verdict."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from threadpoolctl import threadpool_limits

from fmus.catalogue import ModelicaModel
from fmus.errors import ComponentError, MisfitError
from orchestrator.compare.comparison import compare
from orchestrator.compare.result import Comparison
from orchestrator.diagnosis.candidates import find_candidates, model_of
from orchestrator.diagnosis.cards import EffectCard, effect_library
from orchestrator.diagnosis.evidence import LearningData, Refit
from orchestrator.diagnosis.next_experiment import plan
from orchestrator.diagnosis.ranking import confusable_with, rank
from orchestrator.diagnosis.remaining import remaining
from orchestrator.diagnosis.result import Diagnosis, Estimate, HeldOut, NamedEffect, Step
from orchestrator.diagnosis.search import Progress, Searcher, Trace
from orchestrator.diagnosis.unexplained import unexplained_forces, where_forces_lack
from orchestrator.diagnosis.verdict import decide, improvement_p_value, reducible_removed
from orchestrator.diagnosis.work import Work
from orchestrator.measurements import MeasurementSet, bind
from orchestrator.models.estimation import Z90
from orchestrator.models.patch import free_slots

# Held-out error must fall by this share with each effect that is kept.
HELD_OUT_GAIN = 0.05


@dataclass(frozen=True)
class _Refereed:
    """The accepted path: the fits that held-out trials confirmed, and the comparison after each."""

    refits: tuple[Refit, ...]
    steps: tuple[Step, ...]


def diagnose(
    source: ModelicaModel,
    measurements: MeasurementSet,
    *,
    cards: Sequence[EffectCard] | None = None,
    workers: int = 2,
    progress: Progress = lambda message: None,
    work: Work | None = None,
) -> Diagnosis:
    """Find which effects of the library a model lacks, judged by learning trials and confirmed by held-out ones.

    `work` says who screens and refits, by default this process; the result does not depend on it, nor on `workers`.

    Raises:
        MisfitError: if the data do not fit the model or hold no held-out trials.
        ComponentError: if the model itself cannot be simulated.
    """
    began = time.monotonic()
    system = source.compile()
    model = model_of(source, system)
    progress("comparing the model with the measurement")
    nominal = compare(model, measurements, workers=workers)
    if nominal.held_out is None or not any(trial.set == "learning" for trial in nominal.trials):
        raise MisfitError(
            f"{measurements.path} has no trials on one side; a diagnosis needs learning and held-out trials"
        )
    data = bind(measurements, model.inputs, model.outputs)
    candidates, impossible = find_candidates(source, system, effect_library() if cards is None else cards)
    searcher = Searcher(
        base=source,
        nominal=model.restricted(data.output_names),
        slots=free_slots(system),
        candidates=tuple(candidates),
        learning=LearningData.of(data, nominal.noise_floor),
        workers=workers,
        progress=progress,
        work=work,
    )
    nominal_cost = nominal.learning.over_floor**2
    # Two BLAS threads make the small factorisations of the fits about 100 times slower.
    with threadpool_limits(limits=1, user_api="blas"):
        path = searcher.run(nominal_cost)
    accepted = _referee(source, measurements, nominal, path, workers, progress)
    found = _conclude(source, nominal, accepted, searcher.trace, searcher, impossible, time.monotonic() - began)
    where, findings = where_forces_lack(searcher.nominal, searcher.learning)
    found = replace(found, where=tuple(where), findings=findings)
    if found.verdict == "unknown":
        progress("looking at what is left")
        best = accepted.refits[-1] if accepted.refits else None
        found = replace(found, latent_forces=unexplained_forces(searcher.nominal, best, searcher.learning))
    if found.confusable or found.verdict == "cannot_tell":
        progress("choosing the next experiment")
        best = accepted.refits[-1] if accepted.refits else None
        left = remaining(best, searcher.trace.refitted, found.confusable, searcher.nominal, searcher.learning)
        chosen = plan(left, searcher.learning)
        if chosen is not None:
            card_says = {"card_says": found.next_experiment["do"]} if found.next_experiment else {}
            found = replace(found, next_experiment={**chosen.to_json(), **card_says}, experiment_csv=chosen.csv())
    return replace(found, seconds=time.monotonic() - began)


def _referee(
    source: ModelicaModel,
    measurements: MeasurementSet,
    nominal: Comparison,
    path: Sequence[Refit],
    workers: int,
    progress: Progress,
) -> _Refereed:
    """Build each model of the path as Modelica and keep the path as long as held-out errors fall."""
    steps, refits = [Step((), nominal)], list[Refit]()
    for found in path:
        progress(f"checking {' + '.join(found.ids)} on held-out trials")
        model = found.effects.fixed(found.fit.values, version_name(source, len(found.ids)))
        try:
            after = compare(model, measurements, workers=workers, floor=nominal.noise_floor)
        except ComponentError:
            break  # what cannot even be simulated on held-out trials explains nothing
        before = steps[-1].comparison
        assert after.held_out is not None and before.held_out is not None
        if after.held_out.over_floor > (1 - HELD_OUT_GAIN) * before.held_out.over_floor:
            break
        steps.append(Step(named_effects(found), after))
        refits.append(found)
    return _Refereed(tuple(refits), tuple(steps))


def named_effects(found: Refit) -> tuple[NamedEffect, ...]:
    """Effects of a fitted set with their parameters (named as in the effect's class) and 90 % intervals."""
    estimates: list[dict[str, Estimate]] = [{} for _ in found.effects.candidates]
    rows = zip(found.effects.owners(), found.effects.variables, found.fit.values, found.fit.std, strict=True)
    for owner, variable, value, std in rows:
        slot = found.effects.candidates[owner].slot
        interval = (float(value - Z90 * std), float(value + Z90 * std))
        estimates[owner][variable.name.removeprefix(f"{slot}.")] = Estimate(float(value), variable.unit, interval)
    return tuple(
        NamedEffect(c.card.id, c.site, own) for c, own in zip(found.effects.candidates, estimates, strict=True)
    )


def version_name(source: ModelicaModel, number: int) -> str:
    """Name of the class that extends a model with `number` effects: `Arm_1`, `Arm_2`, ..."""
    return f"{source.class_name.rsplit('.', 1)[-1]}_{number}"


def _conclude(
    source: ModelicaModel,
    nominal: Comparison,
    accepted: _Refereed,
    trace: Trace,
    searcher: Searcher,
    impossible: Sequence[str],
    seconds: float,
) -> Diagnosis:
    last = accepted.steps[-1].comparison
    assert nominal.held_out is not None and last.held_out is not None
    before, after = nominal.held_out.over_floor, last.held_out.over_floor
    verdict = decide(before, after, len(accepted.refits))
    named = verdict == "named"
    best = accepted.refits[-1] if accepted.refits else None
    groups = confusable_with(best, trace) if named and best is not None else ()
    experiments = {c.card.id: c.card.experiment for c in searcher.candidates}
    return Diagnosis(
        model=source.name,
        data=nominal.data,
        verdict=verdict,
        effects=accepted.steps[-1].effects if named else (),
        confusable=groups,
        ranking=rank(trace, nominal.learning.over_floor**2, searcher.candidates, searcher.learning.samples),
        p_value=improvement_p_value(nominal, last) if accepted.refits else None,
        noise_floor=nominal.noise_floor,
        held_out=HeldOut(
            nominal.held_out.rmse,
            last.held_out.rmse if named else nominal.held_out.rmse,
            nominal.noise_floor,
            reducible_removed(before, after) if named else 0.0,
        ),
        warnings=tuple(_warnings(accepted, verdict, after, impossible)),
        next_experiment={"effects": list(groups[0]), "do": experiments[groups[0][0]]} if groups else None,
        patched_model=None,
        seconds=seconds,
        steps=accepted.steps if named else accepted.steps[:1],
    )


def _warnings(accepted: _Refereed, verdict: str, after: float, impossible: Sequence[str]) -> list[str]:
    found = [reason for reason in impossible if " " in reason]  # an FMU tells why; a Modelica class lacks a slot
    without_slot = [card_id for card_id in impossible if " " not in card_id]
    if without_slot:
        found.append(f"not tried, the model has no free slot for them: {', '.join(without_slot)}")
    if verdict == "unknown" and accepted.refits:
        ids = " + ".join(accepted.refits[-1].ids)
        found.append(
            f"{ids} explains part of the error, but {after:.3g} times the floor is left that no effect explains"
        )
    if verdict == "named" and after > 1.5:
        found.append(f"a structured error of {after:.3g} times the noise floor is left on held-out trials")
    if verdict == "named":
        last = accepted.refits[-1]
        for variable, value, std, bound in zip(
            last.effects.variables, last.fit.values, last.fit.std, last.fit.at_bound, strict=True
        ):
            if bound:
                found.append(
                    f"{variable.name} = {value:.4g} {variable.unit} is at its bound; the data may not determine it"
                )
            elif std > 0.3 * abs(value):
                found.append(f"{variable.name} = {value:.3g} {variable.unit} is uncertain by {std / abs(value):.0%}")
    return found
