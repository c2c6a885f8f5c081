"""Held-out trials as referee: an effect that learning trials chose stays if they are followed better with it.

They confirm or refuse; between sets of effects they choose nothing.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from fmus.errors import MisfitError
from orchestrator.blackbox.source import Source
from orchestrator.compare.comparison import compare
from orchestrator.compare.result import Comparison
from orchestrator.diagnosis.fit.evidence import LearningData, Refit
from orchestrator.diagnosis.referee.adjusted import adjusted_parameters
from orchestrator.diagnosis.referee.thresholds import SILENT
from orchestrator.diagnosis.search.stretches import follow_closely
from orchestrator.diagnosis.search.trace import Accepted
from orchestrator.measurements import MeasurementSet
from orchestrator.models.estimation import Fit
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.verdicts.result import NamedEffect, Step

# Twice the log odds that held-out trials must give for an effect: 20 to 1.
CONFIRMED = 2 * math.log(20.0)


@dataclass(frozen=True)
class Refereed:
    """The accepted path: the fits that held-out trials confirmed, and the comparison after each.

    `held_out` are the mean squares of the held-out errors in the metric, in which noise has 1, of the model without
    effects and after each; `rows` the number of those errors. `refused` are the effects of sets not confirmed. `was_cut`: the
    search took all the work that it may, and left sets untried.
    """

    accepted: tuple[Accepted, ...]
    steps: tuple[Step, ...]
    held_out: tuple[float, ...]
    rows: int
    refused: tuple[frozenset[str], ...] = ()
    was_cut: bool = False


class Referee:
    """Compares models with effects in them with the held-out trials of one measurement."""

    def __init__(
        self,
        source: Source,
        measurements: MeasurementSet,
        nominal: Comparison,
        held_out: LearningData,
        workers: int,
    ) -> None:
        self.source, self.measurements, self.nominal = source, measurements, nominal
        self.held_out, self.workers = held_out, workers
        self._followed: dict[tuple[frozenset[str], bytes], Fit] = {}

    def judge(
        self,
        base: Refit,
        path: Sequence[Accepted],
        scale: float,
        effects_of: Callable[[Refit], tuple[NamedEffect, ...]],
        progress: Callable[[str], None],
    ) -> Refereed:
        """Build each model of the path as Modelica and keep those that make held-out errors fall.

        Errors count in the metric, where noise is white, and as evidence in units of `scale`, the power of what noise
        is left. An effect that held-out trials do not show, and the learning trials do, stays. `base` is the model
        without effects.

        Args:
            base: the model without effects, fitted to the learning trials.
            path: sets that grow by one effect each, from the search.
            scale: power of the noise in the metric.
            effects_of: the effects of a fitted set, with their values.
            progress: called with one line for each set.
        """
        begun = Refereed((), (Step((), self.nominal),), (self._follow(base).cost,), self._follow(base).rows)
        for entry in path:
            begun = self._asked(begun, base, entry, scale, effects_of, progress)
        return begun

    def _asked(
        self,
        before: Refereed,
        base: Refit,
        entry: Accepted,
        scale: float,
        effects_of: Callable[[Refit], tuple[NamedEffect, ...]],
        progress: Callable[[str], None],
    ) -> Refereed:
        """The path with a further set on it if held-out trials confirm that, else with the set among the refused ones."""
        found, last = entry.refit, before.accepted[-1].refit if before.accepted else base
        refused = replace(before, refused=(*before.refused, found.labels))
        progress(f"checking {' + '.join(found.ids)} on held-out trials")
        try:
            model = found.effects.fixed(found.values, version_name(self.source, len(found.ids)))
            after, now = self.compared(found, model), self._follow(found)
        except MisfitError:
            return refused  # what cannot even be simulated on held-out trials explains nothing
        if not confirmed(last.fit, found.fit, self._follow(last), now, scale):
            return refused
        step = Step(effects_of(found), after, adjusted_parameters(found))
        return replace(
            before,
            accepted=(*before.accepted, entry),
            steps=(*before.steps, step),
            held_out=(*before.held_out, now.cost),
        )

    def _follow(self, found: Refit) -> Fit:
        key = (found.labels, found.values.tobytes())
        if key not in self._followed:
            self._followed[key] = follow_closely(found, self.held_out).fit
        return self._followed[key]

    def compared(self, found: Refit, model: SymbolicModel) -> Comparison:
        """Compare a model, at the fitted values of its tolerances, with all trials.

        Args:
            found: the fit.
            model: the model with the effects of the fit.
        """
        model = model.restricted(self.nominal.signals)
        names = [v.name for v in model.system.parameters]
        for name, value in zip(self.held_out.nuisances.names, found.fit.values[found.size :], strict=True):
            model.compiled.parameters[names.index(name)] = value
        return compare(model, self.measurements, workers=self.workers, floor=self.nominal.noise_floor)


def confirmed(learned: Fit, found: Fit, held_out: Fit, now: Fit, scale: float) -> bool:
    """Whether held-out trials follow a set better than the one before it, or at least have nothing to say of it.

    Args:
        learned, found: fits of the learning trials, before and after.
        held_out, now: the same for the held-out trials.
        scale: power of the noise in the metric.
    """
    gain, enough = held_out.misfit - now.misfit, CONFIRMED
    if gain / scale >= enough:
        return True
    expected = (learned.cost - found.cost) * now.rows
    return expected / scale >= enough / SILENT and abs(gain) < SILENT * expected


def version_name(source: Source, number: int) -> str:
    """Name of the class that extends a model with `number` effects: `Arm_1`, `Arm_2`, ..."""
    return f"{source.class_name.rsplit('.', 1)[-1]}_{number}"
