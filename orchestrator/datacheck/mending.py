"""Change the columns of a measurement set as findings propose."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fmus.errors import MisfitError
from fmus.units import conversion
from orchestrator.datacheck.changes import Change
from orchestrator.datacheck.findings import Finding
from orchestrator.measurements import MeasurementSet, Trial
from orchestrator.measurements.matching import match_columns
from orchestrator.measurements.trial import MENDED
from orchestrator.models.contract import Model


def mended(model: Model, measurements: MeasurementSet, findings: Sequence[Finding]) -> MeasurementSet:
    """Return the set with the changes of the findings; its content hash tells it from the one as recorded."""
    variables = {v.name: v.unit for v in (*model.inputs, *model.outputs)}
    columns = tuple(measurements.trials[0].columns)
    column_of = match_columns(columns, measurements.variables, list(variables)).column_of
    for finding in findings:
        if finding.change is not None or finding.keep is not None:
            chosen = finding.trials
            trials = [
                _mended(trial, finding, column_of, variables) if not chosen or trial.name in chosen else trial
                for trial in measurements.trials
            ]
            note = f"{MENDED}{finding.proposal} ({finding.evidence})"
            digest = hashlib.sha256(f"{measurements.content_hash} {note} {chosen}".encode()).hexdigest()
            notes = (*measurements.notes, note)
            measurements = replace(measurements, trials=tuple(trials), notes=notes, content_hash=digest)
    return measurements


def _mended(trial: Trial, finding: Finding, column_of: Mapping[str, str], units: Mapping[str, str]) -> Trial:
    if finding.change is not None:
        trial = _changed(trial, finding.change, column_of, units)
    if finding.keep is not None:
        first, last = finding.keep
        rows = (trial.time >= first) & (trial.time <= last)
        trial = replace(trial, time=trial.time[rows], columns={k: v[rows] for k, v in trial.columns.items()})
    return trial


def _changed(trial: Trial, change: Change, column_of: Mapping[str, str], units: Mapping[str, str]) -> Trial:
    names = [name for name in change.columns if name in column_of]
    factors = np.array([_factor(trial.units.get(column_of[name], ""), units[name]) for name in names])
    values = np.column_stack([trial.columns[column_of[name]] for name in names]) if names else np.zeros((0, 0))
    time, changed = change.applied(trial.time, values * factors, names)
    columns = {key: value.copy() for key, value in trial.columns.items()}
    for place, name in enumerate(names):
        columns[column_of[name]] = changed[:, place] / factors[place]
    return replace(trial, time=time.copy(), columns=columns)


def _factor(unit: str, wanted: str) -> float:
    """Factor from the unit of a column to that of its variable."""
    try:
        return conversion(unit, wanted) if unit and wanted else 1.0
    except MisfitError:
        return 1.0
