"""A recorded trial as inputs and as reference."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fmus.errors import MisfitError
from orchestrator.cosim.load import load_system
from orchestrator.measurements.load import load_measurements
from orchestrator.measurements.noise import measurement_noise
from orchestrator.measurements.trial import MeasurementSet, Trial
from orchestrator.measurements.wording import listed
from orchestrator.regress.case import Case, Reference, Stimulus
from orchestrator.regress.comparison import Signal, Tolerance
from orchestrator.regress.prepare import as_table, model_path
from orchestrator.regress.reference import Expected


def with_measured_inputs(case: Case) -> Case:
    """The case with the recorded inputs and the time of its trial, where it names none itself."""
    assert case.reference is not None
    _, trial, names = _trial(case, case.reference)
    start, stop = float(trial.time[0]), float(trial.time[-1])
    case = replace(
        case,
        start=case.start if case.start is not None else start,
        stop=case.stop if case.stop is not None else stop,
        step=case.step or float(np.median(np.diff(trial.time))),
    )
    if case.stimulus.file is not None or case.stimulus.signals:
        return case
    inputs = _causality(case, "input")
    waves = {names[c]: as_table(trial.time, trial.columns[c]) for c in trial.columns if names[c] in inputs}
    return replace(case, stimulus=Stimulus(signals=waves))


def expected_from_measurement(case: Case, reference: Reference) -> Expected:
    """Outputs as they were measured; each may be off by so many standard deviations of its noise.

    Raises:
        MisfitError: if the measurement cannot be read or shares no output with the model.
    """
    measured, trial, names = _trial(case, reference)
    outputs = _causality(case, "output")
    signals, tolerances = {}, {}
    for column, values in trial.columns.items():
        name = names[column]
        if name not in outputs and name not in case.signals:
            continue
        unit = trial.units.get(column, "")
        noise = measurement_noise(column, unit, [np.asarray(values)], measured.sensors)
        signals[name] = Signal(name, trial.time, values, unit)
        tolerances[name] = Tolerance(absolute=reference.floors * noise.std, relative=0.0)
    if not signals:
        raise MisfitError(
            f"{reference.source}: none of the columns {listed(trial.columns)} is an output of {case.model}; name them in [variables]"
        )
    return Expected(signals, f"{reference.source}, {trial.name}, {reference.floors:g} x its noise", tolerances)


def _trial(case: Case, reference: Reference) -> tuple[MeasurementSet, Trial, Mapping[str, str]]:
    measured = load_measurements(case.folder / reference.source)
    numbered = list(enumerate(measured.trials, 1))
    found = [trial for place, trial in numbered if reference.trial in (place, trial.name)]
    if len(found) != 1:
        raise MisfitError(
            f"{case.file}: trial = {reference.trial!r}; {reference.source} has {len(numbered)} trials: "
            f"{listed(trial.name for trial in measured.trials)}"
        )
    renamed = {column: name for name, column in reference.columns.items()}
    names = {c: renamed.get(c, measured.variables.get(c, c)) for c in found[0].columns}
    return measured, found[0], names


def _causality(case: Case, causality: str) -> set[str]:
    system = load_system(model_path(case))
    return set(system.inputs if causality == "input" else system.outputs)
