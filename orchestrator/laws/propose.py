"""From a diagnosis that leaves something open to proposed laws, checked on held-out trials, with their files in a folder."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from fmus.errors import ComponentError, MisfitError
from orchestrator.compare.result import Comparison
from orchestrator.greybox.decide import Judge
from orchestrator.greybox.diagnose import Outcome, compared, worse_on_held_out
from orchestrator.laws.card import write_files
from orchestrator.laws.find import FoundLaw, Limits, find_laws
from orchestrator.laws.proposal import LawProposal, proposal_of
from orchestrator.laws.separate import with_rivals
from orchestrator.measurements import MeasurementSet
from orchestrator.verdicts.result import Diagnosis

FOLDER = "laws"
# A named answer that leaves more than this share of the missing force's power, or a held-out error of more than so many noise
# floors, is looked behind.
LEFT_OPEN, LEFT_OVER_FLOOR = 0.01, 1.5


def asks_for_laws(diagnosis: Diagnosis) -> bool:
    """Whether the library leaves something open: the answer is unknown, ambiguous, or what is named does not explain all."""
    if not isinstance(diagnosis.search, Outcome):
        return False
    if diagnosis.verdict in ("unknown", "ambiguous"):
        return True
    held_out, left = diagnosis.steps[-1].comparison.held_out, diagnosis.unexplained_share or 0.0
    return diagnosis.verdict == "named" and (
        left > LEFT_OPEN or held_out is None or held_out.over_floor > LEFT_OVER_FLOOR
    )


def propose_laws(
    diagnosis: Diagnosis,
    measurements: MeasurementSet,
    folder: Path | None,
    *,
    workers: int = 2,
    progress: Callable[[str], None] = lambda message: None,
    limits: Limits | None = None,
) -> tuple[LawProposal, ...]:
    """Laws that explain what the library leaves, written to `folder/laws` if a folder is given; none that held-out
    trials speak against.

    Raises:
        MisfitError: if the diagnosis did not search a model without slots.
    """
    outcome = diagnosis.search
    if not isinstance(outcome, Outcome):
        raise MisfitError("formulas are looked for in models without slots, whose balance equations are searched")
    given = diagnosis.steps[0].comparison
    found = []
    for law in find_laws(outcome, limits, progress, named=diagnosis.verdict in ("named", "ambiguous")):
        progress(f"opening the held-out trials for {law.candidate.law.expression}")
        with np.errstate(all="ignore"):
            try:
                after = compared(outcome, law.fitted, given, measurements, workers)
            except ComponentError:
                continue  # a law whose free runs fail is no answer
            if not _worse(outcome, law, given, after, diagnosis):
                found.append(_proposal(outcome, law, given, after))
    different = _without_twins(found)
    proposals = with_rivals(different)
    return proposals if folder is None else tuple(write_files(p, folder / FOLDER) for p in proposals)


def _worse(outcome: Outcome, law: FoundLaw, given: Comparison, after: Comparison, diagnosis: Diagnosis) -> bool:
    """Whether held-out trials are worse with a law than with the model as given, or with what the library names."""
    limits = outcome.setting.thresholds
    if worse_on_held_out(outcome, law.fitted, given, after, limits):
        return True
    assert after.held_out is not None
    named = diagnosis.held_out.rmse_after
    ratios = [after.held_out.rmse[s] / max(named[s], 1e-300) for s in outcome.case.signals]
    return bool(np.sqrt(np.mean(np.square(ratios))) > 1 + limits.worse)


def _proposal(outcome: Outcome, law: FoundLaw, given: Comparison, after: Comparison) -> LawProposal:
    assert given.held_out is not None and after.held_out is not None
    judge = Judge(outcome.nominal, outcome.setting.thresholds, outcome.scale, outcome.decision.windows)
    share = judge.explained(law.fitted)
    return proposal_of(outcome, law, _errors(given), _errors(after), share)


def _errors(comparison: Comparison) -> Mapping[str, float]:
    assert comparison.held_out is not None
    return dict(comparison.held_out.rmse)


def _without_twins(found: list[LawProposal]) -> list[LawProposal]:
    """Laws that are not one function in two forms: of those with the same errors in all digits that count, the first."""
    kept: list[LawProposal] = []
    for each in found:
        if not any(_same(each, other) for other in kept):
            kept.append(each)
    return [replace(p) for p in kept]


def _same(one: LawProposal, other: LawProposal) -> bool:
    return one.site == other.site and all(
        np.isclose(one.held_out_after[s], other.held_out_after[s], rtol=1e-4) for s in one.held_out_after
    )
