"""Bring a model and its measurements together for the grey box: setting, nominal fit, candidates."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from fmus.catalogue import ModelicaModel
from fmus.errors import ComponentError
from fmus.symbolic.balances import Balance
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.blackbox.source import FmuSource, Source
from orchestrator.greybox.candidates import Candidate, candidates_at, numbered
from orchestrator.greybox.extended import extend, own_inputs
from orchestrator.greybox.filtering import GreyBox, Trial
from orchestrator.greybox.fit import Fitter, Noise, Priors
from orchestrator.greybox.kept import Runs, driven, event_inputs, event_parameters, with_events, with_kept, with_value
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
from orchestrator.verdicts.result import NamedEffect

# A step that asks for the sign of a response, as a share of what the input moves over.
STEP = 0.05


@dataclass(frozen=True, eq=False)
class Case:
    """A model with balance inputs, the measurements in its terms, and its own inputs.

    `recorded` are the measurements without the rows and columns of events, of a model that keeps values from event to event, and
    `changed` the values that only events show and that are others than in the model as given.
    """

    source: Source
    base: SymbolicSystem
    balances: tuple[Balance, ...]
    inputs: tuple[Variable, ...]
    data: BoundSet
    signals: tuple[str, ...]
    recorded: BoundSet | None = None
    changed: tuple[NamedEffect, ...] = ()


def case_of(source: ModelicaModel, measurements: MeasurementSet) -> Case:
    """Compile a model with an input at each balance, and bind the measurements to it.

    Raises:
        MisfitError: if the data do not fit the model.
    """
    base, balances = source.balanced()
    names = driven(base, balances)
    inputs = tuple(v for v in own_inputs(base, balances) if v.name in names)
    variables = {v.name: v for v in (*base.states, *base.algebraics)}
    data = bind(measurements, inputs, [variables[name] for name in base.outputs])
    case = Case(source, base, balances, inputs, data, data.output_names)
    return case if base.kept is None else _with_events(replace(case, recorded=data))


def case_with_value(case: Case, effect: NamedEffect) -> Case:
    """A case whose model has another value of a parameter that only events show."""
    assert case.recorded is not None
    base = with_value(case.base, effect.site, effect.parameters["share"].value)
    return _with_events(replace(case, base=base, changed=(*case.changed, effect)))


def _with_events(case: Case) -> Case:
    assert case.recorded is not None

    def filtered(trials: BoundSet) -> list[np.ndarray]:
        return filtered_states(replace(case, data=trials))

    return replace(case, data=with_kept(case.base, [b.input for b in case.balances], case.recorded, filtered))


def case_with_events_of(case: Case, box: GreyBox, theta: np.ndarray) -> Case:
    """A case with the events that the states of a model with effects show, `box` with values `theta`."""
    assert case.recorded is not None
    states, balances = states_with(case, box, theta), [b.input for b in case.balances]
    runs = Runs(box.system, box.compiled.with_values([*np.zeros(len(balances)), *theta]))
    return replace(case, data=with_events(case.base, balances, case.recorded, case.data, states, runs))


def filtered_states(case: Case) -> list[np.ndarray]:
    """States along each trial as a filter of the model as given shows them, (n, nx)."""
    extended = extend(case.base, case.balances, case.signals, ())
    box = GreyBox(extended.system, extended.outputs, extended.balances, (), case.data.trials[0].held)
    return states_with(case, box, np.zeros(0))


def states_with(case: Case, box: GreyBox, theta: np.ndarray) -> list[np.ndarray]:
    """The same with values `theta` of a model with effects, whose states stand behind."""
    found = []
    for trial in trials_of(case.data.trials, case.base, case.signals, case.balances):
        noise = first_noise(box, [trial], case.balances, theta)
        found.append(_run(box, trial, theta, noise))
    return found


def _run(box: GreyBox, trial: Trial, theta: np.ndarray, noise: Noise) -> np.ndarray:
    for steps in (1, 4, 16):
        with suppress(ComponentError):
            return box.run(trial.in_steps(steps), theta, noise.intensity, noise.sensors).mean
    raise ComponentError(f"{box.system.name} cannot follow {trial.name}, whatever disturbs it")


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
    unseen = event_inputs(case.base)
    given = input_places([v for v in case.inputs if v.name not in unseen], seen, noise)
    closed = isinstance(case.source, FmuSource)
    silent = event_parameters(case.base)
    found = [
        *with_loads(balance_places(case.base, case.balances, seen), given),
        *([] if closed else potential_places(case.base, case.balances, seen)),
        *given,
        *crosstalk_places(given),
        *output_places(measured, seen),
        *response_places(case.inputs, measured, seen, response_signs(case, nominal)),
        *(p for p in parameter_places(case.base, duration) if p.site not in silent),
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
