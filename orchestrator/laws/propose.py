"""From a diagnosis that leaves something open to proposed laws, checked on held-out trials."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from fmus.errors import ComponentError
from orchestrator.compare.comparison import error_left, over_floor
from orchestrator.compare.result import Comparison
from orchestrator.diagnosis.search.search import Progress
from orchestrator.greybox.decide import Judge
from orchestrator.greybox.diagnose import Outcome, compared, worse_on_held_out
from orchestrator.greybox.forces_apart import where_forces_differ
from orchestrator.greybox.interpolation import RunsOtherwise, held_otherwise
from orchestrator.laws.find import FoundLaw, find_laws
from orchestrator.laws.proposal import LawProposal, proposal_of
from orchestrator.measurements import MeasurementSet
from orchestrator.verdicts.gate import doubted
from orchestrator.verdicts.result import Diagnosis

# A named answer that leaves more than this share of the missing force's power, or a held-out error of more than so many noise
# floors, is looked behind.
LEFT_OPEN, LEFT_OVER_FLOOR = 0.01, 1.5
# A law has to take away this share of the held-out error that is left without it: by what the library names, if it names something.
BETTER = 0.1


def with_laws(
    diagnosis: Diagnosis,
    measurements: MeasurementSet,
    wanted: bool | None,
    asked: Sequence[str] = (),
    *,
    workers: int = 2,
    progress: Progress = lambda message: None,
) -> Diagnosis:
    """A diagnosis with the laws that explain what the library leaves; none that held-out trials speak against.

    Args:
        diagnosis: what the library says.
        measurements: what it says it of.
        wanted: whether laws are looked for; None for only where the library leaves something open.
        asked: names of inputs of which nobody has said how they run between samples.
        workers: runs at a time.
        progress: called with one line at each stage.

    Returns:
        The diagnosis with `laws`; with a warning where laws were wanted and cannot be looked for, their search failed, or found none.

    Raises:
        RunsOtherwise: if inputs run otherwise between samples, as the best law tells.
    """
    expected = wanted or diagnosis.verdict == "unknown"
    if not (_leaves_something_open(diagnosis) if wanted is None else wanted):
        return diagnosis
    measurements = replace(measurements, interpolation=diagnosis.interpolation)
    if not isinstance(diagnosis.search, Outcome):
        return _warned(
            diagnosis, "formulas are looked for in models without slots only, whose balance equations are searched"
        )
    try:
        found = _proposed(diagnosis, diagnosis.search, measurements, asked, workers, progress)
    except (RuntimeError, ArithmeticError, LookupError, ValueError, ComponentError) as error:
        # The diagnosis stands; as in its own search, CasADi reports what it cannot do as RuntimeError.
        return _warned(
            diagnosis, f"the search for a formula failed, so none is proposed: {type(error).__name__}: {error}"
        )
    if expected and not found:
        return _warned(diagnosis, "no formula explains the record beyond doubt and foretells held-out trials better")
    told = replace(diagnosis, laws=found)
    return doubted_for(found[0], told, diagnosis.search.setting.thresholds.complete_share) if found else told


def doubted_for(law: LawProposal, diagnosis: Diagnosis, share: float) -> Diagnosis:
    """A diagnosis that names nothing where a law in place of what is named leaves no more than a share of the held-out error, squared
    and beyond the noise, that this leaves: what is named only came near it.

    Args:
        law: the proposal that is shown first.
        diagnosis: what the library says.
        share: of squared errors, 0 to 1.
    """
    beside = {(effect.id, effect.site) for effect in law.beside}
    before, floor = diagnosis.held_out.rmse_after, diagnosis.noise_floor
    left = error_left(before, law.held_out_after, floor)
    if over_floor(before, floor) <= LEFT_OVER_FLOOR or left > share:
        return diagnosis
    if all((effect.id, effect.site) in beside for effect in diagnosis.effects):
        return diagnosis
    return doubted(diagnosis, f"a formula in its place leaves {left:.0%} of what it leaves of held-out errors, squared")


def _warned(diagnosis: Diagnosis, note: str) -> Diagnosis:
    return replace(diagnosis, warnings=(*diagnosis.warnings, note))


def _leaves_something_open(diagnosis: Diagnosis) -> bool:
    """Whether the answer is unknown, ambiguous, or what is named does not explain all."""
    if not isinstance(diagnosis.search, Outcome):
        return False
    held_out, left = diagnosis.steps[-1].comparison.held_out, diagnosis.unexplained_share or 0.0
    incomplete = left > LEFT_OPEN or held_out is None or held_out.over_floor > LEFT_OVER_FLOOR
    return diagnosis.verdict in ("unknown", "ambiguous") or (diagnosis.verdict == "named" and incomplete)


def _proposed(
    diagnosis: Diagnosis,
    outcome: Outcome,
    measurements: MeasurementSet,
    asked: Sequence[str],
    workers: int,
    progress: Progress,
) -> tuple[LawProposal, ...]:
    given = diagnosis.steps[0].comparison
    found: list[tuple[FoundLaw, LawProposal]] = []
    laws = find_laws(outcome, None, progress, named=diagnosis.verdict in ("named", "ambiguous"))
    if laws and asked:
        progress(f"asking how {', '.join(asked)} run between samples, with the formula")
        with threadpool_limits(limits=1, user_api="blas"):
            gains = held_otherwise(outcome.setting, laws[0].fitted, asked)
        if gains:
            raise RunsOtherwise(gains)
    for law in laws:
        progress(f"opening the held-out trials for {law.candidate.law.expression}")
        with np.errstate(all="ignore"):
            try:
                after = compared(outcome, law.fitted, given, measurements, workers)
            except ComponentError:
                continue  # a law whose free runs fail is no answer
            if not _worse(outcome, law, given, after, diagnosis):
                found.append((law, _proposal(outcome, law, given, after)))
    different = [each for k, each in enumerate(found) if not any(_same(each[1], other) for _, other in found[:k])]
    return tuple(_with_rivals(outcome, each, [o for o in different if o is not each]) for each in different)


def _with_rivals(
    outcome: Outcome, one: tuple[FoundLaw, LawProposal], others: list[tuple[FoundLaw, LawProposal]]
) -> LawProposal:
    """A proposal with the formulas of the others that explain the record alike, and what separates it from the first."""
    (law, proposal), words = one, ""
    for other, _ in others[:1]:
        where = where_forces_differ(outcome, (law.fitted, law.candidate), (other.fitted, other.candidate))
        words = f"record a trial that goes to {where}" if where else ""
        if law.candidate.law.states or other.candidate.law.states:
            words = "they differ in what they remember: record a longer trial, with pauses"
    return replace(proposal, alike=tuple(other.formula for _, other in others), separated_by=words)


def _worse(outcome: Outcome, law: FoundLaw, given: Comparison, after: Comparison, diagnosis: Diagnosis) -> bool:
    """Whether held-out trials are worse with a law than with the model as given, or not clearly better than with what the library
    names."""
    limits = outcome.setting.thresholds
    if worse_on_held_out(outcome, law.fitted, given, after, limits):
        return True
    assert after.held_out is not None
    named = diagnosis.held_out.rmse_after
    signals = outcome.case.signals
    left = over_floor({s: after.held_out.rmse[s] for s in signals}, {s: max(named[s], 1e-300) for s in signals})
    return left > 1 - BETTER


def _proposal(outcome: Outcome, law: FoundLaw, given: Comparison, after: Comparison) -> LawProposal:
    assert given.held_out is not None and after.held_out is not None
    judge = Judge(outcome.nominal, outcome.setting.thresholds, outcome.scale, outcome.decision.windows)
    share = judge.explained(law.fitted)
    return proposal_of(outcome, law, _errors(given), _errors(after), share)


def _errors(comparison: Comparison) -> Mapping[str, float]:
    assert comparison.held_out is not None
    return dict(comparison.held_out.rmse)


def _same(one: LawProposal, other: LawProposal) -> bool:
    """Whether two laws are one function in two forms: their errors are the same in all digits that count."""
    return one.site == other.site and all(
        np.isclose(one.held_out_after[s], other.held_out_after[s], rtol=1e-4) for s in one.held_out_after
    )
