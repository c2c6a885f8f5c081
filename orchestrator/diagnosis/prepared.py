"""What a diagnosis begins with: the model as given beside the trials, the candidates, and the trials in the metric."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fmus.errors import MisfitError
from orchestrator.blackbox.source import Source
from orchestrator.compare.comparison import compare
from orchestrator.compare.result import Comparison
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, fit_nominal, smoothed
from orchestrator.diagnosis.fit.extensible import extensible
from orchestrator.diagnosis.linear.noise_model import metrics_of
from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.noise.nuisances import Nuisances, nuisances
from orchestrator.diagnosis.noise.outliers import without_outliers
from orchestrator.diagnosis.search.search import Progress
from orchestrator.library.cards import Candidate, EffectCard
from orchestrator.measurements import BoundSet, BoundTrial, MeasurementSet, bind
from orchestrator.measurements.sensors import declared
from orchestrator.models.patch import free_slots
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel

# Clocks of inputs and outputs may differ by a sample: two standard deviations.
CLOCK_SAMPLES = 0.5


@dataclass(frozen=True, eq=False)
class Prepared:
    """A model beside trials: `nominal` is its comparison, `plain` the model with the signals that are measured.

    `impossible` says which effects of the library cannot be attached; `extra` are parameters with tolerances, and the clock.
    """

    source: Source
    nominal: Comparison
    plain: SymbolicModel
    data: BoundSet
    slots: tuple[str, ...]
    candidates: tuple[Candidate, ...]
    impossible: tuple[str, ...]
    extra: Nuisances

    @cached_property
    def learning(self) -> LearningData:
        """The learning trials in the metric."""
        return self.in_metric(self.data.learning)

    @property
    def noise_is_declared(self) -> bool:
        """Whether the noise of every output is."""
        return all(self.data.levels[name].declared is not None for name in self.data.output_names)

    def in_metric(self, trials: Sequence[BoundTrial]) -> LearningData:
        """Trials with the metric of the noise that is declared or shows in the record, carried through the model."""
        return in_metric(self.source, self.plain, self.data, trials, self.nominal.noise_floor, self.extra)

    def notes(self, shown: Sequence[SmoothedTrial]) -> list[str]:
        """Warnings of the record, and what was replaced in the trials as `shown` beside what a look at the record finds."""
        found = [note.removeprefix("warning: ") for note in self.data.notes if note.startswith("warning: ")]
        pairs = zip((*self.data.learning, *self.data.held_out), shown, strict=True)
        count = sum(int(np.count_nonzero(raw.outputs != clean.measured)) for raw, clean in pairs)
        if count:
            words = (
                "sample stands out of the errors around it and does"
                if count == 1
                else "samples stand out of the errors around them and do"
            )
            found.append(f"{count} further {words} not count")
        return found


def prepared(
    source: Source,
    measurements: MeasurementSet,
    whole: MeasurementSet,
    given: Comparison,
    cards: Sequence[EffectCard],
    workers: int,
    progress: Progress,
) -> Prepared:
    """Compare a model with trials, which may be stretches of `whole` ones, and compile it with each effect; `given` is the
    comparison with the whole ones.

    Args:
        source: the model.
        measurements: the trials to learn from and to judge by.
        whole: the trials as recorded, the same object as `measurements` unless that holds stretches of them.
        given: the comparison of the model with `whole`.
        cards: the effects to choose from.
        workers: processes that compile at a time.
        progress: called with one line at each stage.

    Raises:
        MisfitError: if there are no learning or no held-out trials.
        ComponentError: if the model itself cannot be simulated.
    """
    system = source.compile()
    ways = extensible(source)
    model = ways.model(system)
    nominal = given if measurements is whole else compare(model, measurements, workers=workers)
    if nominal.held_out is None or not any(trial.set == "learning" for trial in nominal.trials):
        raise MisfitError(
            f"{measurements.path} has no trials on one side; a diagnosis needs learning and held-out trials"
        )
    data = bind(measurements, model.inputs, model.outputs)
    if measurements is not whole:
        # Stretches show less of the noise: rattling counted as slow noise, with next to none that is white.
        data = data.with_noise_of(bind(whole, model.inputs, model.outputs))
    candidates, impossible = ways.candidates(system, cards)
    progress("compiling the model with each effect")
    ways.compile_ahead(candidates, workers)
    extra = nuisances(system, measurements.tolerances, _clock_std(data, measurements.sensors))
    plain = model.restricted(data.output_names)
    slots = tuple(free_slots(system))
    return Prepared(source, nominal, plain, data, slots, tuple(candidates), tuple(impossible), extra)


def _clock_std(data: BoundSet, sensors: Mapping[str, float]) -> float:
    """Standard deviation in s of a constant shift between inputs and outputs, as [sensors] states it; 0 if no input is measured."""
    stated = declared(sensors, "noise_std", "s", "clock")
    if stated is not None:
        return stated
    if len(data.unconnected_inputs) == len(data.input_names):
        return 0.0
    return CLOCK_SAMPLES * float(np.median(np.diff(data.trials[0].time)))


def in_metric(
    source: Source,
    plain: SymbolicModel,
    data: BoundSet,
    trials: Sequence[BoundTrial],
    floor: Mapping[str, float],
    extra: Nuisances,
) -> LearningData:
    """Trials with the metric of the noise that is declared or shows in the record, carried through the model.

    Args:
        source: the model.
        plain: its equations or runs, with the signals that are measured.
        data: all trials, with the noise of each signal.
        trials: those of them that are wanted.
        floor: noise floor of each output, in its unit.
        extra: parameters with tolerances, and the shift of the clocks.

    Returns:
        The trials without outliers, each with its metric, in which noise is white with power 1.
    """
    noise = np.array([data.noise_std[name] for name in data.output_names])
    outputs, inputs = ([data.noise_of(name) for name in names] for names in (data.output_names, data.input_names))
    fast = np.array([each.std for each in inputs])
    shown = tuple(replace(trial, input_noise=fast) for trial in smoothed(trials, noise))
    of_floor = np.array([floor[name] for name in data.output_names])
    found = LearningData(shown, noise, nuisances=Nuisances(shift_std=extra.shift_std))
    # Precise sensors see how a machine carries noise at its own parameters rather than at the nominal ones.
    for _ in range(2 if extra.names and fast.any() else 1):
        base = fit_nominal(EffectSet(source, (), data.output_names), plain, found)
        response = Response(base, [t.smoother for t in shown])
        metrics = metrics_of(response, outputs, inputs)
        found = LearningData(shown, of_floor, tuple(metrics), extra)
    errors = [y - t.measured for y, t in zip(response.outputs, shown, strict=True)]
    clean = tuple(map(without_outliers, shown, errors, metrics))
    return replace(found, trials=clean)
