"""Error numbers of the selected samples beside those of the whole."""

from collections.abc import Mapping
from dataclasses import dataclass

from orchestrator.report.numbers import digits, quantity
from orchestrator.studio.views.chosen import Chosen
from orchestrator.studio.views.data import ViewData
from orchestrator.studio.views.sums import NOTHING, Moments


@dataclass(frozen=True)
class SignalErrors:
    """Residual of one signal over the trials shown: all samples, and the selected ones; `floor` in the same unit."""

    signal: str
    unit: str
    floor: float
    whole: Moments
    selected: Moments

    def times_floor(self, part: Moments) -> float:
        """Root mean square residual over the noise floor; infinite for a floor of zero."""
        return part.rms / self.floor if self.floor else float("inf")

    def sentence(self) -> str:
        """Both errors in words, such as `q1: 4.1 mrad rms where selected (4.1 times the floor), 2.0 mrad in all`."""
        if not self.selected.count:
            return f"{self.signal}: no sample is selected"
        return (
            f"{self.signal}: {quantity(self.selected.rms, self.unit)} rms where selected"
            f" ({digits(self.times_floor(self.selected))} times the floor),"
            f" {quantity(self.whole.rms, self.unit)} in all ({digits(self.times_floor(self.whole))} times)"
        )


def selection_errors(data: ViewData, chosen: Mapping[int, Chosen]) -> tuple[SignalErrors, ...]:
    """Errors of each signal over whole trials and over their `chosen` samples, by place of the trial."""
    return tuple(_errors(data, chosen, name) for name in data.signals)


def trial_errors(data: ViewData, signal: str, chosen: Mapping[int, Chosen]) -> dict[int, SignalErrors]:
    """Errors of one signal in each trial of `chosen`, by its place."""
    return {place: _errors(data, {place: samples}, signal) for place, samples in chosen.items()}


def _errors(data: ViewData, chosen: Mapping[int, Chosen], name: str) -> SignalErrors:
    whole, selected = NOTHING, NOTHING
    for place, samples in chosen.items():
        sums = data.trials[place].signals[name].sums
        whole += sums.between(0, len(sums.series))
        selected += samples.moments(sums)
    return SignalErrors(name, data.units[name], data.noise_floor[name], whole, selected)
