"""Bring a model and its measurements together for the grey box: setting, nominal fit, candidates."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmus.catalogue import ModelicaModel
from fmus.errors import ComponentError
from fmus.symbolic.balances import Balance
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.blackbox.source import FmuSource, Source
from orchestrator.greybox.candidates import Candidate, candidates_at, numbered
from orchestrator.greybox.extended import extend, own_inputs
from orchestrator.greybox.filtering import GreyBox, Trial
from orchestrator.greybox.fit import Fitter, Priors
from orchestrator.greybox.laws import Law, laws
from orchestrator.greybox.places import (
    Place,
    balance_places,
    crosstalk_places,
    input_places,
    output_places,
    parameter_places,
    potential_places,
    response_places,
    with_loads,
    with_others,
)
from orchestrator.greybox.prepare import first_noise, least_noise, seen_by, trials_of
from orchestrator.greybox.search import FittedSet, Setting
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.measurements import BoundSet, MeasurementSet, bind

# A step that asks for the sign of a response, as a share of what the input moves over.
STEP = 0.05


@dataclass(frozen=True, eq=False)
class Case:
    """A model with balance inputs, the measurements in its terms, and its own inputs."""

    source: Source
    base: SymbolicSystem
    balances: tuple[Balance, ...]
    inputs: tuple[Variable, ...]
    data: BoundSet
    signals: tuple[str, ...]


def case_of(source: ModelicaModel, measurements: MeasurementSet) -> Case:
    """Compile a model with an input at each balance, and bind the measurements to it.

    Raises:
        MisfitError: if the data do not fit the model.
    """
    base, balances = source.balanced()
    inputs = own_inputs(base, balances)
    variables = {v.name: v for v in (*base.states, *base.algebraics)}
    data = bind(measurements, inputs, [variables[name] for name in base.outputs])
    return Case(source, base, balances, inputs, data, data.output_names)


def nominal_set(case: Case, thresholds: Thresholds) -> tuple[Setting, FittedSet]:
    """The model as given, with the noise that makes the learning trials most probable."""
    trials = trials_of(case.data.learning, case.base, case.signals, case.balances)
    extended = extend(case.base, case.balances, case.signals, ())
    box = GreyBox(extended.system, extended.outputs, extended.balances, (), case.data.trials[0].held)
    none = np.zeros(0)
    start = [first_noise(box, [trial], case.balances, none) for trial in trials]
    fitter = Fitter(trials, start, least_noise(trials))
    setting = Setting(
        case.base, case.balances, case.signals, tuple(trials), fitter, thresholds, case.data.trials[0].held
    )
    return setting, FittedSet((), fitter.fit(box, none, Priors(none, none, none, none)))


def places_of(case: Case, nominal: FittedSet) -> list[Place]:
    """Every place of a model where an effect can act, in the scale of the record."""
    fit = nominal.fit
    seen = seen_by(fit.box, fit.runs, fit.trials, case.balances, case.signals)
    outputs = {v.name: v for v in (*case.base.states, *case.base.algebraics)}
    measured = [outputs[name] for name in case.signals]
    duration = float(np.ptp(seen.values["time"])) or 1.0
    noise = {v.name: case.data.noise_of(v.name).steady.std for v in case.inputs}
    given = input_places(case.inputs, seen, noise)
    closed = isinstance(case.source, FmuSource)
    found = [
        *with_loads(balance_places(case.base, case.balances, seen), given),
        *([] if closed else potential_places(case.base, case.balances, seen)),
        *given,
        *crosstalk_places(given),
        *output_places(measured, seen),
        *response_places(case.inputs, measured, seen, response_signs(case, nominal)),
        *parameter_places(case.base, duration),
    ]
    return with_others(found, (*case.base.states, *case.inputs), seen)


def response_signs(case: Case, nominal: FittedSet) -> dict[tuple[str, str], float]:
    """The sign with which each output of the model as given answers a step of each input on the whole, 0 without an answer.

    A further path to an output, a second RC element, a part of the plant that warms up by itself, stores and loses what the
    input brings as the model's own path does; with the other sign it would be a source.
    """
    fit = nominal.fit
    trial, run, box = fit.trials[0], fit.runs[0], fit.box
    values = box.compiled.with_values(np.zeros(len(box.balances)))
    names = [v.name for v in box.system.inputs]

    def outputs(inputs: np.ndarray) -> np.ndarray:
        free = box.compiled.run(trial.time, inputs, values, run.mean[0], substeps=int(trial.parts.max()))
        return np.asarray(free.outputs)

    found: dict[tuple[str, str], float] = {}
    for variable in case.inputs:
        stepped = trial.inputs.copy()
        column = names.index(variable.name)
        stepped[:, column] += STEP * (float(np.ptp(trial.inputs[:, column])) or 1.0)
        try:
            answer = np.mean(outputs(stepped) - outputs(trial.inputs), axis=0)
        except ComponentError:  # a free run that fails says nothing
            answer = np.zeros(len(case.signals))
        found |= {(variable.name, name): float(np.sign(a)) for name, a in zip(case.signals, answer, strict=True)}
    return found


def all_candidates(case: Case, nominal: FittedSet, library: Sequence[Law] | None = None) -> tuple[Candidate, ...]:
    """Every law at every place that it fits.

    Args:
        case: the model beside its trials.
        nominal: the model as given, fitted, which shows the scales of its variables.
        library: the laws, the shipped ones by default.
    """
    library = laws() if library is None else library
    if isinstance(case.source, FmuSource):  # its equations are closed, and its parameters hold still
        closed = [law for law in library if not law.asks_for & {"net", "load"} and law.place != "between_inputs"]
        library = [law for law in closed if law.place != "parameter" or not law.slow]
    return numbered(candidates_at(places_of(case, nominal), library))


def held_out_trials(case: Case) -> list[Trial]:
    """Trials that only the final score may use."""
    return trials_of(case.data.held_out, case.base, case.signals, case.balances)
