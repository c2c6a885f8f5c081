"""All checks of a record before physics is looked for in it, and the mends that they propose."""

from collections.abc import Sequence
from dataclasses import dataclass

from orchestrator.datacheck.columns import wrong_columns
from orchestrator.datacheck.findings import Finding
from orchestrator.datacheck.mending import mended
from orchestrator.datacheck.prediction import Predictor
from orchestrator.measurements import MeasurementSet, bind
from orchestrator.models.contract import Model

# One mend may bring the next mistake to light.
MOST_ROUNDS = 4


@dataclass(frozen=True)
class Mended:
    """A measurement set with the proposals of the data checks accepted, which these were, and what is still wrong."""

    measurements: MeasurementSet
    done: tuple[Finding, ...]
    open: tuple[Finding, ...]


def check_data(model: Model, measurements: MeasurementSet) -> tuple[Finding, ...]:
    """Look for what is wrong with columns and trials, by learning trials alone; strong findings first.

    Raises:
        MisfitError: if columns and variables do not fit each other.
    """
    data = bind(measurements, model.inputs, model.outputs)
    if not data.learning:
        return ()
    units = {variable.name: variable.unit or "" for variable in (*model.inputs, *model.outputs)}
    predictor = Predictor(model, data, data.learning)
    found = list(wrong_columns(predictor, units))
    return tuple(sorted(found, key=lambda finding: not finding.strong))


def mend(model: Model, measurements: MeasurementSet) -> Mended:
    """Accept the proposals of the checks, again and again until there are none left to accept.

    Raises:
        MisfitError: as for `check_data`.
    """
    done: list[Finding] = []
    for _ in range(MOST_ROUNDS):
        found = check_data(model, measurements)
        accepted = [finding for finding in found if finding.change is not None]
        if not accepted:
            return Mended(measurements, tuple(done), found)
        measurements = mended(model, measurements, accepted)
        done += accepted
    return Mended(measurements, tuple(done), check_data(model, measurements))


def forbids_physics(findings: Sequence[Finding]) -> bool:
    """Whether a finding is such that no physical effect may be named."""
    return any(finding.strong for finding in findings)
