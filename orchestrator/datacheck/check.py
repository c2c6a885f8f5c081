"""All checks of a record before physics is looked for in it, and the mends that they propose."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmus.symbolic.system import Variable
from orchestrator.datacheck.columns import wrong_columns
from orchestrator.datacheck.findings import Finding, mended
from orchestrator.datacheck.prediction import Predictor
from orchestrator.datacheck.sensors import sensor_findings
from orchestrator.datacheck.trials import clock_lags, odd_trials
from orchestrator.measurements import BoundSet, MeasurementSet, bind
from orchestrator.measurements.matching import match_columns
from orchestrator.measurements.wording import listed
from orchestrator.models.contract import Model, with_held_inputs
from orchestrator.models.correction import PREFIX


def undriven(inputs: Sequence[Variable], data: BoundSet, measurements: MeasurementSet) -> tuple[Finding, ...]:
    """Inputs that stay at 0 because no column is theirs, beside columns that change and are not used.

    A start value other than 0 is a statement on an input that was not recorded, such as an ambient temperature. The finding
    is strong where no input of the model is driven at all.

    Args:
        inputs: inputs of the model.
        data: the trials in the model's units.
        measurements: the same as recorded, with columns that no variable is.
    """
    inputs = [v for v in inputs if not v.name.startswith(PREFIX)]  # a force that misfit adds is no input of a user's
    idle = [v.name for v in inputs if v.name in data.unconnected_inputs and not v.start]
    moving = [name for name in data.unused_columns if any(np.ptp(t.columns[name]) > 0 for t in measurements.trials)]
    if not idle or not moving:
        return ()
    nothing = all(v.name in data.unconnected_inputs for v in inputs)
    evidence = f"no column is {'the input' if len(idle) == 1 else 'an input of'} {listed(idle)}"
    evidence += ", so nothing drives the model" if nothing else ", which stays at 0"
    proposal = (
        f"say in [variables] of case.toml which column it is, such as {listed(moving[:3])}, which no variable is now; or repeat"
        f" misfit import with --map {moving[0]!r}={idle[0]}"
    )
    return (Finding("input", idle[0], "", evidence, proposal, strong=nothing),)


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
    model = with_held_inputs(model, data.trials[0].held)
    if not data.learning:
        return ()
    not_driven = undriven(model.inputs, data, measurements)
    if forbids_physics(not_driven):
        return not_driven
    found = [*not_driven, *_once(_of_sensors(model, measurements))]
    units = {variable.name: variable.unit or "" for variable in (*model.inputs, *model.outputs)}
    of_columns = wrong_columns(Predictor(model, data, data.learning), units)
    found += of_columns
    if not of_columns:  # else trials are looked at once that is mended
        odd = tuple(odd_trials(model, data, units))
        found += odd
        found += () if odd else clock_lags(model, data)
    return tuple(sorted(found, key=lambda finding: not finding.strong))


def _once(found: Iterable[Finding]) -> list[Finding]:
    """One finding of a kind for a column, unless each has a mend of its own; the others are counted."""
    groups: dict[tuple[str, str], list[Finding]] = {}
    for finding in found:
        groups.setdefault((finding.kind, finding.column), []).append(finding)
    kept = []
    for group in groups.values():
        group.sort(key=lambda finding: not finding.strong)
        if len(group) == 1 or group[0].keep is not None:
            kept += group
            continue
        trials = tuple(dict.fromkeys(finding.trial for finding in group))
        evidence = f"{group[0].evidence} (the same in {len(trials)} trials: {', '.join(trials)})"
        kept.append(replace(group[0], evidence=evidence, trials=trials))
    return kept


def _of_sensors(model: Model, measurements: MeasurementSet) -> Iterator[Finding]:
    names = [variable.name for variable in (*model.inputs, *model.outputs)]
    columns = tuple(measurements.trials[0].columns)
    column_of = match_columns(columns, measurements.variables, names).column_of
    for trial in measurements.trials:
        for variable in model.outputs:
            column = column_of.get(variable.name, "")
            if column in trial.columns:
                others = [trial.columns[c] for c in column_of.values() if c != column and c in trial.columns]
                yield from sensor_findings(trial, column, variable.name, others)


def mend(model: Model, measurements: MeasurementSet) -> Mended:
    """Accept the proposals of the checks, again and again until there are none left to accept.

    Raises:
        MisfitError: as for `check_data`.
    """
    done: list[Finding] = []
    for _ in range(MOST_ROUNDS):
        found = check_data(model, measurements)
        accepted = [finding for finding in found if finding.can_be_mended]
        if not accepted:
            return Mended(measurements, tuple(done), found)
        measurements = mended(model, measurements, accepted)
        done += accepted
    return Mended(measurements, tuple(done), check_data(model, measurements))


def forbids_physics(findings: Sequence[Finding]) -> bool:
    """Whether a finding is such that no physical effect may be named."""
    return any(finding.strong for finding in findings)
