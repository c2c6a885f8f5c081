"""Diagnose a model as it is: a stochastic grey box finds which effects it lacks at its balance equations.

The model as given is fitted with white forces on its balances, whose size says how much it leaves unexplained. Candidates are
screened by regression on the whitened innovations, likely sets are fitted by likelihood, and the decision names what makes the
record more probable beyond doubt and predictions better. Held-out trials are opened once, at the end, and choose nothing.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.special import ndtr
from threadpoolctl import threadpool_limits

from fmus.catalogue import ModelicaModel
from fmus.errors import ComponentError, MisfitError
from fmus.symbolic.system import SymbolicSystem
from orchestrator.blackbox.of_class import class_model
from orchestrator.blackbox.source import FmuSource, Source
from orchestrator.compare.comparison import compare, error_left, is_refuted, with_floor_of, within_noise
from orchestrator.compare.result import Comparison
from orchestrator.greybox.around import fmu_with, placed
from orchestrator.greybox.decide import Decision, Judge, decide, scatter_between, surprise
from orchestrator.greybox.effects import named_effects, with_effects
from orchestrator.greybox.event_values import event_value, refined
from orchestrator.greybox.evidence import (
    Case,
    all_candidates,
    case_of,
    case_with_events_of,
    case_with_value,
    held_out_trials,
    nominal_set,
)
from orchestrator.greybox.explained import leaves_nothing
from orchestrator.greybox.extended import OUTPUT, extend
from orchestrator.greybox.fit import Fitter, Noise
from orchestrator.greybox.interpolation import RunsOtherwise, held_otherwise
from orchestrator.greybox.kept import event_parameters
from orchestrator.greybox.laws import Law
from orchestrator.greybox.mirrored import is_one_delay, mirrored
from orchestrator.greybox.prediction import foretold, squared_errors
from orchestrator.greybox.prepare import first_noise, least_noise, white_noise
from orchestrator.greybox.same_model import is_same_model
from orchestrator.greybox.search import FittedSet, Search, Setting, refitted
from orchestrator.greybox.tape import force_input, retaped_case, taped_case
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.greybox.unnamed import unnamed_force
from orchestrator.greybox.witness import witnesses
from orchestrator.measurements import MeasurementSet
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.models.threads import threads
from orchestrator.verdicts.cannot_tell import search_failed
from orchestrator.verdicts.result import (
    LEFT_UNTRIED,
    Diagnosis,
    HeldOut,
    NamedEffect,
    RankedSet,
    Step,
    Tried,
    Verdict,
    reducible_removed,
)

VERDICTS: dict[str, Verdict] = {
    "named": "named",
    "ambiguous": "ambiguous",
    "improves": "unknown",
    "unknown": "unknown",
    "adequate": "adequate",
    "cannot_tell": "cannot_tell",
}
Progress = Callable[[str], None]
# So many times the rates of an FMU, and what a model keeps from event to event, are looked at again about the states that an
# answer shows.
RENEWED = 2
# A signal counts half where its noise is one over this of its spread.
NOISY = 5.0


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a search came to: the case with its setting, the model as given, and the decision; `was_cut`: it took all the work that
    a search may take, and left sets untried."""

    case: Case
    setting: Setting
    nominal: FittedSet
    decision: Decision
    was_cut: bool = False

    @property
    def scale(self) -> np.ndarray:
        """Spread of each signal over the learning trials, (ny,)."""
        return _scale(self.setting)


def diagnose_greybox(
    source: Source,
    measurements: MeasurementSet,
    *,
    given: Comparison | None = None,
    workers: int = 2,
    progress: Progress = lambda message: None,
    limits: Thresholds | None = None,
    library: Sequence[Law] | None = None,
    asked: Sequence[str] = (),
) -> Diagnosis:
    """Find which effects a model lacks at its balance equations, inputs and outputs.

    Args:
        source: the model: a Modelica class, or an FMU that can be asked for its rates.
        measurements: learning and held-out trials.
        given: the comparison of the model as it is, which is made if it is left out.
        workers: fits that run at a time.
        progress: called with one line at each stage.
        limits: thresholds of search and decision, the shipped ones by default.
        library: the laws to choose from, the shipped ones by default.
        asked: inputs whose course between samples nobody has said.

    Returns:
        The verdict with effects, values in SI units and evidence; the search itself is in `search`.

    Raises:
        RunsOtherwise: if the record says of some of them that they run otherwise than assumed, as soon as a set shows it.
        MisfitError: if the data do not fit the model or hold no trials of one kind.
        ComponentError: if the model cannot be simulated.
    """
    began = time.monotonic()
    limits = limits or Thresholds()
    # Trial values of parameters may drive a model out of the range of numbers; such runs count as impossible.
    with threadpool_limits(limits=1, user_api="blas"), np.errstate(all="ignore"), threads(workers):
        progress("reading the model")
        case = taped_case(source, measurements) if isinstance(source, FmuSource) else case_of(source, measurements)
        if not case.data.learning or not case.data.held_out:
            raise MisfitError(
                f"{measurements.path} has no trials on one side; a diagnosis needs learning and held-out trials"
            )
        if given is None:
            progress("comparing the model with the measurement")
            given = compare(_as_given(case), measurements, workers=workers)

        def agrees(signals: Sequence[str]) -> bool:
            return not signals or within_noise(given, limits.agrees, signals)

        def is_within(signals: Sequence[str]) -> bool:
            return bool(signals) and within_noise(given, limits.within, signals)

        try:
            late = bool(event_parameters(case.base))
            outcome = decided(case, limits, progress, library, asked, agrees=agrees, is_within=is_within, rare=not late)
            for _ in range(RENEWED if isinstance(source, FmuSource) or case.base.kept else 0):
                again = _about_its_answer(outcome, limits)
                if again is None:
                    break
                progress("looking at the model along the record once more, with what was found")
                outcome = decided(
                    again, limits, progress, library, asked, agrees=agrees, is_within=is_within, rare=not late
                )
            if late and not _is_done(outcome, limits):
                progress("asking for values that only events show")
                other = _with_event_value(outcome, given, measurements, limits, workers, progress, library, asked)
                if other is None:
                    other = decided(outcome.case, limits, progress, library, asked, agrees=agrees, is_within=is_within)
                outcome = other
            found = _answer(outcome, given, measurements, limits, workers, progress)
        except (RuntimeError, ArithmeticError, LookupError, ValueError, ComponentError) as error:
            # CasADi reports what it cannot do as RuntimeError; a search that fails says so, and the comparison stands.
            found = search_failed(given, error)
    return replace(found, seconds=time.monotonic() - began)


def _about_its_answer(outcome: Outcome, limits: Thresholds) -> Case | None:
    """The case with the FMU's rates as lines about what the chosen set shows, or with the events that it shows; None if that
    changes no likelihood."""
    chosen = outcome.decision.chosen
    if not chosen.candidates:
        return None
    renewed = retaped_case if isinstance(outcome.case.source, FmuSource) else case_with_events_of
    case = renewed(outcome.case, chosen.fit.box, chosen.fit.theta)
    setting, _ = nominal_set(case, limits)
    again = refitted(setting, chosen, setting.held)
    changed = chosen.loss - again.loss  # other lines of an FMU may cost some; events that are read better cost nothing
    return case if changed > limits.nats or (isinstance(case.source, FmuSource) and -changed > limits.nats) else None


def _is_done(outcome: Outcome, limits: Thresholds) -> bool:
    """Whether a search explains the record, or finds nothing to explain."""
    decision = outcome.decision
    explained = decision.grade in ("named", "ambiguous") and decision.explained >= 1 - limits.complete_share
    return explained or decision.grade == "adequate"


def _with_event_value(
    outcome: Outcome,
    given: Comparison,
    measurements: MeasurementSet,
    limits: Thresholds,
    workers: int,
    progress: Progress,
    library: Sequence[Law] | None,
    asked: Sequence[str],
) -> Outcome | None:
    """The search about a model with another value of a parameter that only events show, if that explains the record better."""
    wrong = event_value(outcome.case, outcome.nominal, limits.nats)
    if wrong is None:
        return None
    for _ in range(RENEWED):
        case = case_with_value(outcome.case, wrong)
        wrong = refined(outcome.case, case, nominal_set(case, limits)[1])
    case = case_with_value(outcome.case, wrong)
    runs = compared(replace(outcome, case=case), outcome.nominal, given, measurements, workers)
    found = decided(
        case,
        limits,
        progress,
        library,
        asked,
        agrees=lambda signals: not signals or within_noise(runs, limits.agrees, signals),
        is_within=lambda signals: bool(signals) and within_noise(runs, limits.within, signals),
    )
    one, other = found.decision.chosen, outcome.decision.chosen
    better = found.decision.grade == "adequate" or one.loss + one.price + limits.nats < other.loss
    return found if better else None


def _as_given(case: Case) -> SymbolicModel:
    """The model without effects, as it is run."""
    if isinstance(case.source, FmuSource):
        return case.source.model(case.source.compile(), case.signals)
    return class_model(case.source, signals=case.signals)


def _fmu_with(case: Case, chosen: FittedSet) -> SymbolicModel:
    assert isinstance(case.source, FmuSource)
    acting = {b.input: force_input(case.base, case.inputs, b) for b in case.balances}
    states = {b.input: b.state for b in case.balances}
    return fmu_with(case.source, placed(chosen), acting, states, case.signals)


def decided(
    case: Case,
    limits: Thresholds,
    progress: Progress,
    library: Sequence[Law] | None = None,
    asked: Sequence[str] = (),
    *,
    agrees: Callable[[Sequence[str]], bool] = lambda signals: True,
    is_within: Callable[[Sequence[str]], bool] = lambda signals: False,
    rare: bool = True,
) -> Outcome:
    """The search for effects and its decision, without held-out trials.

    Args:
        case: the model beside its trials.
        limits: thresholds of search and decision.
        progress: called with one line at each stage.
        library: the laws to choose from, the shipped ones by default.
        asked: inputs that may run otherwise between samples, which stops the search.
        agrees: whether free runs of the model as given stay within the noise of some signals; without that no model is
            adequate; `is_within`: the same, so close that it is no unknown model. Of a plant that falls over without its controller no free run can tell, and only the likelihood counts.
        rare: whether rare effects are tried where common ones leave much.
    """
    progress("estimating how much the model leaves unexplained")
    setting, nominal = nominal_set(case, limits)
    silent, louder = setting.fitter.without_disturbance(nominal.fit.box, nominal.fit)
    lost = nominal.fit.log_likelihood - silent
    needless = lost < limits.quiet * max(len(case.balances), 1)
    # A loop holds the outputs of a wrong model where they should be, sample by sample, and its free runs go astray.
    told = foretold(nominal.fit, _scale(setting), case.signals)
    adequate = (needless or (louder < limits.louder and len(told) == len(case.signals))) and agrees(told)
    # Events that are read off a record come a moment early or late, which a filter takes for a disturbance and a run does not.
    adequate |= case.base.kept is not None and is_within(told)
    candidates = () if adequate else all_candidates(case, nominal, library)
    common = [c for c in candidates if not c.rare]
    progress(f"{len(common)} candidates at {len({c.place.site for c in common})} places")

    def seen(best: FittedSet) -> None:
        if gains := held_otherwise(setting, best, asked):
            raise RunsOtherwise(gains)

    search, judged = Search(setting, common, nominal, progress, seen), _judged(setting)

    def complete(found: FittedSet) -> bool:
        return leaves_nothing(setting.fitter, found.fit, limits.quiet)

    def decided_among(sets: Sequence[FittedSet]) -> Decision:
        return decide(
            sets,
            nominal,
            limits,
            judged,
            search.fit,
            search.simpler,
            adequate,
            unnamed,
            same,
            lambda one, other: is_same_model(one, other, nominal, limits),
            complete,
        )

    def unnamed(chosen: FittedSet, judge: Judge) -> str:
        if complete(chosen):
            return ""
        return unnamed_force(chosen, [c.place for c in candidates], setting, judge)

    def same(chosen: FittedSet) -> FittedSet | None:
        other = mirrored(chosen, candidates, case.base)
        twin = search.fit(other) if other else None
        judge = Judge(nominal, limits, judged)
        return twin if twin and (is_one_delay(chosen) or not judge.beyond_doubt(chosen, twin)) else None

    decision = decided_among(search.run() if common else [nominal])
    if decision.chosen.candidates and search.fit_larger(decision.chosen):
        decision = decided_among(search.sets)
    # What no common effect is named for, and what is within the noise along whole trials, is no matter of rare ones.
    quiet = decision.grade not in ("named", "ambiguous") and is_within(told)
    if rare and len(candidates) > len(common) and not quiet and not _is_complete(decision, complete, limits):
        seen(decision.chosen)
        progress(f"{len(candidates) - len(common)} rare candidates beside them")
        sets = search.widen(candidates, decision.chosen)
        if other := mirrored(sets[0], candidates, case.base):  # the two differ in the first samples
            search.fit(other)
        wider = decided_among(search.sets)
        decision = _better(decision, wider, Judge(nominal, limits, judged))
    return Outcome(case, setting, nominal, decision, search.was_cut)


def _is_complete(decision: Decision, complete: Callable[[FittedSet], bool], limits: Thresholds) -> bool:
    """Whether no rare effect is asked for: all is explained, by no surprising value, and by no output that answers several inputs
    late, which is what one late sensor does.

    What disturbs one balance may be explained, and that of another one not: whole runs leave that of some signal then.
    """
    most, chosen = limits.rare_share, decision.chosen
    nearly = decision.explained >= 1 - most and decision.judge.left_by_runs(chosen) <= most
    explained = decision.grade == "named" and (nearly or complete(chosen))
    late = [c.place.coordinates["y"] for c in chosen.candidates if c.place.kind == "response"]
    return explained and surprise(chosen) < limits.surprising and len(late) == len(set(late))


def _better(common: Decision, wider: Decision, judge: Judge) -> Decision:
    """The decision among all candidates where common ones named nothing, or where its set predicts clearly better, or is more
    probable beyond doubt with no more parameters; else that among common ones."""
    if common.grade not in ("named", "ambiguous"):
        return wider
    judge.windows = common.windows
    one, other = wider.chosen, common.chosen
    far = judge.ratio(one, other) < 1 - judge.limits.least_improvement
    simpler = one.counted <= other.counted and judge.beyond_doubt(one, other)
    return wider if (far or simpler) and wider.grade in ("named", "ambiguous") else common


def _scale(setting: Setting) -> np.ndarray:
    """Spread of each signal over the learning trials, (ny,)."""
    rows = np.concatenate([trial.measured for trial in setting.trials])
    return np.maximum(np.nanstd(rows, axis=0), 1e-300)


def _judged(setting: Setting) -> np.ndarray:
    """The scales (ny,) in which errors of all signals are taken together: a signal that is a third noise says little of a model,
    and would hide what the others say.

    Their squares are those of the spreads over weights that are one on average.
    """
    spread = _scale(setting)
    noise = white_noise([trial.measured for trial in setting.trials])
    weights = 1.0 / (1.0 + (NOISY * noise / spread) ** 2)
    return np.asarray(spread * np.sqrt(np.mean(weights) / weights))


def _answer(
    outcome: Outcome,
    given: Comparison,
    measurements: MeasurementSet,
    limits: Thresholds,
    workers: int,
    progress: Progress,
) -> Diagnosis:
    case, decision, nominal = outcome.case, outcome.decision, outcome.nominal
    chosen = decision.chosen
    effects = (*case.changed, *named_effects(chosen))
    steps, reasons = [Step((), given)], list(decision.reasons)
    verdict = VERDICTS[decision.grade]
    if case.changed and verdict == "adequate":
        verdict = "named"
    after = given
    if effects:
        progress("opening the held-out trials")
        try:
            after = compared(outcome, chosen, given, measurements, workers)
            if given.noise_estimates and is_refuted(after):
                better = with_set(outcome, chosen, given.model)
                given = with_floor_of(better, _as_given(case), given, measurements, workers)
                after, steps = compared(outcome, chosen, given, measurements, workers), [Step((), given)]
            worse = worse_on_held_out(outcome, chosen, given, after, limits)
        except MisfitError as error:  # also a class that cannot be written
            worse = f"a free run with it fails: {error}"
        if worse and verdict in ("named", "ambiguous"):
            verdict = "unknown"
            reasons.append(worse)
    if verdict == "unknown" and within_noise(given, limits.within):
        verdict = "adequate"
    named = verdict in ("named", "ambiguous")
    if named:
        steps.append(Step(effects, after))
    shown = after if named else given
    assert given.held_out is not None and shown.held_out is not None
    unexplained = 0.0 if decision.grade == "adequate" else 1.0 - decision.explained
    incomplete = verdict == "named" and max(unexplained, _left(outcome, given, after)) > limits.complete_share
    return Diagnosis(
        model=given.model,
        data=given.data,
        verdict=verdict,
        effects=effects if named else (),
        confusable=_confusable(decision) if verdict == "ambiguous" else (),
        ranking=_ranking(decision, nominal, case.changed),
        p_value=None,
        noise_floor=given.noise_floor,
        held_out=HeldOut(
            given.held_out.rmse,
            shown.held_out.rmse,
            given.noise_floor,
            reducible_removed(given.held_out.over_floor, shown.held_out.over_floor) if named else 0.0,
        ),
        warnings=tuple(_warnings(outcome, verdict, reasons)),
        next_experiment=None,
        patched_model=None,
        seconds=0.0,
        steps=tuple(steps),
        findings=given.findings,
        tried=_tried(decision, nominal, named, case.changed),
        incomplete=incomplete,
        unexplained_share=unexplained if chosen.candidates else None,
        best=effects if verdict == "unknown" else (),
        witness=tuple(asdict(w) for w in witnesses(case, nominal, chosen)),
        data_checks=given.data_checks,
        search=outcome,
    )


def _left(outcome: Outcome, given: Comparison, after: Comparison) -> float:
    """Largest share of a signal's squared error along held-out trials that is left with the chosen set, of signals that runs foretell.

    What disturbs one balance may be explained, and that of another one not.
    """
    assert given.held_out is not None and after.held_out is not None
    told = foretold(outcome.decision.chosen.fit, outcome.scale, outcome.case.signals)
    return error_left(given.held_out.rmse, {s: after.held_out.rmse[s] for s in told}, given.noise_floor)


def compared(
    outcome: Outcome, chosen: FittedSet, given: Comparison, measurements: MeasurementSet, workers: int
) -> Comparison:
    """Free runs of the model with a set in it along all trials.

    Args:
        outcome: the search.
        chosen: a fitted set.
        given: the comparison of the model as it is, whose noise floor counts.
        measurements: all trials.
        workers: runs at a time.

    Raises:
        ComponentError: if the model with the set cannot be simulated.
    """
    return compare(with_set(outcome, chosen, given.model), measurements, workers=workers, floor=given.noise_floor)


def with_set(outcome: Outcome, chosen: FittedSet, name: str) -> SymbolicModel:
    """The model with a set in it, as it is run.

    Args:
        outcome: the search.
        chosen: a fitted set.
        name: what the model is called.
    """
    if isinstance(outcome.case.source, FmuSource):
        return _fmu_with(outcome.case, chosen)
    if outcome.case.base.kept is not None:
        return class_model(_class_with(outcome.case, outcome.case.source, chosen), name, outcome.case.signals)
    return SymbolicModel(name, fixed_system(outcome, chosen), outcome.case.signals)


def _class_with(case: Case, source: ModelicaModel, chosen: FittedSet) -> ModelicaModel:
    """The class with a set in it, as a text: what it keeps from event to event runs in its FMU only."""
    effects = (*case.changed, *named_effects(chosen))
    name = f"{source.class_name.rsplit('.', 1)[-1]}_with_{len(effects)}"
    written = with_effects(source, effects, name, more=[c.law for c in chosen.candidates])
    return replace(written, held=source.held)


def fixed_system(outcome: Outcome, chosen: FittedSet) -> SymbolicSystem:
    """The model with a set in it as a system with the model's own outputs, parameters at their fitted values.

    An output that is a state is the sensor's reading; the state itself has another name then.
    """
    case = outcome.case
    extended = extend(case.base, case.balances, case.signals, chosen.candidates)
    values = chosen.fit.values
    system = extended.system
    plain = {OUTPUT.format(name): name for name in case.signals}
    # Of a state that is measured there are two: itself, and its reading, which an effect at the sensor changes.
    changed = {c.place.coordinates["y"] for c in chosen.candidates if c.place.kind in ("output", "response")}
    hidden = {v.name for v in case.base.states if v.name not in changed}
    return replace(
        system,
        states=tuple(replace(v, name=f"{v.name} ") if v.name in changed else v for v in system.states),
        parameters=tuple(replace(v, start=values.get(v.name, v.start)) for v in system.parameters),
        algebraics=tuple(
            replace(v, name=f"{plain[v.name]} " if plain[v.name] in hidden else plain[v.name])
            for v in system.algebraics
        ),
        outputs=case.signals,
    )


def worse_on_held_out(
    outcome: Outcome, chosen: FittedSet, given: Comparison, after: Comparison, limits: Thresholds
) -> str:
    """Why a set may not be named: it makes predictions or free runs of held-out trials worse; empty if it does not.

    Args:
        outcome: the search.
        chosen: a fitted set.
        given: free runs of the model as it is.
        after: free runs with the set in it.
        limits: thresholds of the decision.
    """
    scale = _judged(outcome.setting)
    one, other = (_held_out_error(outcome, found, scale) for found in (chosen, outcome.nominal))
    assert given.held_out is not None and after.held_out is not None
    runs = [
        np.sqrt(np.mean([(c.held_out.rmse[s] / k) ** 2 for s, k in zip(outcome.case.signals, scale, strict=True)]))
        for c in (after, given)
        if c.held_out is not None
    ]
    if one > (1 + limits.worse) * other:
        return f"predictions of held-out trials become {one / other - 1:.0%} worse"
    if runs[0] > (1 + limits.worse) * runs[1] and runs[1] < 1:  # beyond the signals' own spread, errors say nothing
        return f"free runs along held-out trials become {runs[0] / runs[1] - 1:.0%} worse"
    return ""


def _held_out_error(outcome: Outcome, found: FittedSet, scale: np.ndarray) -> float:
    """Error of predictions over windows of each held-out trial, whose noise is its own."""
    fit = found.fit
    trials = held_out_trials(outcome.case)
    try:
        start: list[Noise] = [first_noise(fit.box, [trial], outcome.case.balances, fit.theta) for trial in trials]
        again = Fitter(trials, start, least_noise(trials)).noise_with(fit.box, fit.theta, fit.priors)
    except ComponentError:
        return np.inf
    windows = outcome.decision.windows
    squares = squared_errors(fit.box, fit.theta, again.trials, again.runs, windows)
    return float(np.sqrt(np.mean(np.mean(squares, axis=0) / scale**2)))


def _ranking(decision: Decision, nominal: FittedSet, changed: Sequence[NamedEffect]) -> tuple[RankedSet, ...]:
    """All fitted sets, the chosen one first; `score` is the share of what the model as given leaves unexplained that is gone.

    Probabilities take the scatter of the difference over the record for its standard deviation.
    """
    order = [decision.chosen, *(s for s in decision.ranked if s is not decision.chosen)]
    order = [s for s in order if s.candidates] or [nominal]
    weights = np.array([_weight(s, decision) for s in order])
    return tuple(
        RankedSet(
            *_ids_and_sites(s, changed),
            decision.judge.explained(s),
            float(w / weights.sum()),
        )
        for s, w in zip(order, weights, strict=True)
        if s.candidates or changed
    )


def _weight(other: FittedSet, decision: Decision) -> float:
    """How likely a set is beside the chosen one, 0 to 1; one with more parameters had its chance, and lost it, unless it is a rival."""
    chosen = decision.chosen
    larger = other.key > chosen.key or other.counted > chosen.counted
    if other is chosen or (larger and other not in decision.rivals):
        return float(other is chosen)
    return float(2 * ndtr(-max(other.loss - chosen.loss, 0.0) / max(scatter_between(chosen, other), 1.0)))


def _confusable(decision: Decision) -> tuple[tuple[str, ...], ...]:
    """Effects that the data cannot tell apart: those in which rivals differ from the chosen set."""
    groups = []
    for rival in decision.rivals:
        mine = {c.family: c.id for c in decision.chosen.candidates}
        theirs = {c.family: c.id for c in rival.candidates}
        group = [v for k, v in mine.items() if k not in theirs] + [v for k, v in theirs.items() if k not in mine]
        if len(group) > 1:
            groups.append(tuple(dict.fromkeys(group)))
    return tuple(dict.fromkeys(groups))


def _ids_and_sites(found: FittedSet, changed: Sequence[NamedEffect]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Effects of a set and where they are, behind values that were `changed` before it was looked for."""
    ids = (*(e.id for e in changed), *(c.id for c in found.candidates))
    return ids, (*(e.site for e in changed), *(c.place.site for c in found.candidates))


def _tried(decision: Decision, nominal: FittedSet, named: bool, changed: Sequence[NamedEffect]) -> tuple[Tried, ...]:
    outcomes = []
    for found in decision.ranked:
        if not found.candidates and not changed:
            continue
        ids, sites = _ids_and_sites(found, changed)
        if found is decision.chosen:
            text = "named" if named else "the best set, not proven"
        elif found in decision.rivals:
            text = "explains the record as well"
        else:
            text = _beside_the_chosen(found, decision.chosen)
        outcomes.append(Tried(ids, sites, text))
    return tuple(outcomes)


def _beside_the_chosen(found: FittedSet, chosen: FittedSet) -> str:
    """Why a set is not the answer, in words."""
    behind, more = found.loss - chosen.loss, found.counted - chosen.counted
    if behind >= 0:
        return f"makes the record less probable than the chosen set does, by {behind:.3g} nats"
    numbers = f"{more} more parameter{'s' if more > 1 else ''}" if more > 0 else "as many parameters"
    return f"fits closer by {-behind:.3g} nats with {numbers}, but not all of its effects stand the checks"


def _warnings(outcome: Outcome, verdict: Verdict, reasons: Sequence[str]) -> list[str]:
    found: list[str] = []
    names = " and ".join(c.label for c in outcome.decision.chosen.candidates)
    if verdict == "unknown" and names:
        found.append(f"the best set is {names}, not proven: {'; '.join(reasons) or 'rivals explain as much'}")
    elif verdict == "unknown":
        found.append(f"nothing is named: {'; '.join(reasons)}")
    for alias in outcome.decision.aliases if verdict in ("named", "ambiguous") else ():
        others = (c for c in alias.candidates if c.family not in outcome.decision.chosen.key)
        words = " and ".join(f"{c.id.replace('_', ' ')} at {c.place.site}" for c in others)
        found.append(f"{words} would be the same change of the model in other parameters")
    if not outcome.case.balances:
        found.append("the model has no balance equation, so effects were looked for at inputs and outputs only")
    if outcome.was_cut:
        found.append(LEFT_UNTRIED)
    return found


__all__ = ["diagnose_greybox"]
