"""Held-out trials as referee: an effect stays if they are followed better with it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fmus.catalogue import ModelicaModel
from fmus.errors import MisfitError
from orchestrator.compare.comparison import compare
from orchestrator.compare.result import Comparison
from orchestrator.diagnosis.adjusted import adjusted_parameters
from orchestrator.diagnosis.calibration import PRACTICAL
from orchestrator.diagnosis.candidates import model_of
from orchestrator.diagnosis.evidence import LearningData, Refit, follow
from orchestrator.diagnosis.result import NamedEffect, Step
from orchestrator.diagnosis.trace import Accepted
from orchestrator.measurements import MeasurementSet
from orchestrator.models.symbolic import SymbolicModel


@dataclass(frozen=True)
class Refereed:
    """The accepted path: the fits that held-out trials confirmed, and the comparison after each."""

    accepted: tuple[Accepted, ...]
    steps: tuple[Step, ...]


class Referee:
    """Compares models with effects in them with the held-out trials of one measurement."""

    def __init__(
        self,
        source: ModelicaModel,
        measurements: MeasurementSet,
        nominal: Comparison,
        held_out: LearningData,
        workers: int,
    ) -> None:
        self.source, self.measurements, self.nominal = source, measurements, nominal
        self.held_out, self.workers = held_out, workers

    def judge(
        self,
        base: Refit,
        path: Sequence[Accepted],
        effects_of: Callable[[Refit], tuple[NamedEffect, ...]],
        progress: Callable[[str], None],
    ) -> Refereed:
        """Build each model of the path as Modelica and keep the path as long as held-out errors fall.

        Errors count in the metric, where noise is white; and as root mean squares, unless the effect is of meaningful
        size. `base` is the model without effects; its tolerances are fitted, so that they are not mistaken for one.
        """
        steps, kept = [Step((), self.nominal)], list[Accepted]()
        plain = model_of(self.source, self.source.compile())
        previous = self._compared(base, plain) if self.held_out.nuisances.names else self.nominal
        misfit = follow(base, self.held_out).fit.misfit
        for entry in path:
            found = entry.refit
            progress(f"checking {' + '.join(found.ids)} on held-out trials")
            try:
                model = found.effects.fixed(found.values, version_name(self.source, len(found.ids)))
                after, now = self._compared(found, model), follow(found, self.held_out).fit.misfit
            except MisfitError:
                break  # what cannot even be simulated on held-out trials explains nothing
            assert after.held_out is not None and previous.held_out is not None
            falls = after.held_out.over_floor < (1 - PRACTICAL) * previous.held_out.over_floor
            if not (now < misfit and (falls or found.is_meaningful())):
                break
            steps.append(Step(effects_of(found), after, adjusted_parameters(found)))
            kept.append(entry)
            previous, misfit = after, now
        return Refereed(tuple(kept), tuple(steps))

    def _compared(self, found: Refit, model: SymbolicModel) -> Comparison:
        """Compare a model, at the fitted values of its tolerances, with all trials."""
        model = model.restricted(self.nominal.signals)
        names = [v.name for v in model.system.parameters]
        for name, value in zip(self.held_out.nuisances.names, found.fit.values[found.size :], strict=True):
            model.compiled.parameters[names.index(name)] = value
        return compare(model, self.measurements, workers=self.workers, floor=self.nominal.noise_floor)


def version_name(source: ModelicaModel, number: int) -> str:
    """Name of the class that extends a model with `number` effects: `Arm_1`, `Arm_2`, ..."""
    return f"{source.class_name.rsplit('.', 1)[-1]}_{number}"
