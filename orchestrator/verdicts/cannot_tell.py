"""Diagnoses that name no physics: of a record that is wrong, which say what to mend first, and of a search that failed."""

import time
from collections.abc import Sequence
from dataclasses import replace

from fmus.errors import ComponentError, MisfitError
from orchestrator.compare.comparison import compare
from orchestrator.compare.result import Comparison
from orchestrator.datacheck.findings import Finding
from orchestrator.measurements import MeasurementSet
from orchestrator.models.contract import Model
from orchestrator.verdicts.result import Diagnosis, HeldOut, Step


def first_mend(model: Model, measurements: MeasurementSet, findings: Sequence[Finding], workers: int) -> Diagnosis:
    """Return a diagnosis that cannot tell, with the findings as its first warnings.

    Args:
        model: the model as given.
        measurements: the trials as recorded.
        findings: what is wrong with them, the first that which forbids a diagnosis.
        workers: runs at a time.

    Raises:
        MisfitError: if the model cannot follow the record at all.
    """
    began = time.monotonic()
    try:
        given = compare(model, measurements, workers=workers, checks=findings)
    except ComponentError as error:
        raise MisfitError(f"{findings[0]}; the model cannot follow the record as it is: {error}") from error
    warnings = [str(finding) for finding in findings]
    warnings[0] += "; no physical effect is named before that: mend the record"
    warnings[0] += ", or repeat the command with --mend" if any(each.can_be_mended for each in findings) else ""
    doubted = any(each.kind in ("unit", "time_unit") for each in findings)
    warnings[0] += "; if the units are right, say units_certain = true in case.toml" if doubted else ""
    found = cannot_tell(given, warnings)
    return replace(found, seconds=time.monotonic() - began, data_checks=tuple(findings))


def cannot_tell(given: Comparison, warnings: Sequence[str]) -> Diagnosis:
    """A diagnosis that names nothing: the comparison of the model as given, and why there is no more."""
    return Diagnosis(
        model=given.model,
        data=given.data,
        verdict="cannot_tell",
        effects=(),
        confusable=(),
        ranking=(),
        p_value=None,
        noise_floor=given.noise_floor,
        held_out=_held_out(given),
        warnings=tuple(warnings),
        next_experiment=None,
        patched_model=None,
        seconds=0.0,
        steps=(Step((), given),),
    )


def search_failed(given: Comparison, error: Exception) -> Diagnosis:
    """What is left to say if the search for effects breaks: the comparison, and that nothing is known of effects."""
    reason = str(error).strip().splitlines()[-1] if str(error).strip() else type(error).__name__
    found = cannot_tell(given, [f"the search for effects failed, so nothing is said of them: {reason}"])
    return replace(found, findings=given.findings)


def _held_out(given: Comparison) -> HeldOut:
    shown = given.held_out or given.learning
    return HeldOut(shown.rmse, shown.rmse, given.noise_floor, 0.0)
