"""Coordinates of the state: what an error may depend on, computed when a view asks for it."""

from collections import OrderedDict
from dataclasses import dataclass, field
from threading import Lock

import numpy as np

from orchestrator.compare.maps import Coordinate, coordinates_of
from orchestrator.studio.views.chosen import Chosen
from orchestrator.studio.views.data import ViewData, ViewTrial
from orchestrator.studio.views.selection import Selection

# Beyond this number of samples, maps are made of every second, third ... one.
MOST_SAMPLES = 4_000_000
KEPT = 6


@dataclass(eq=False)
class Coordinates:
    """Coordinates of a comparison's trials; the last few are kept, in float32."""

    data: ViewData
    _lock: Lock = field(default_factory=Lock)
    _kept: "OrderedDict[str, tuple[np.ndarray, ...]]" = field(default_factory=OrderedDict)

    @property
    def stride(self) -> int:
        """Every how many samples maps are made of."""
        return -(-sum(len(t.time) for t in self.data.trials) // MOST_SAMPLES)

    def names(self) -> dict[str, str]:
        """All coordinates with their units, in the order in which people think of them."""
        found = coordinates_of(
            {name: () for name in self.data.signals},
            self.data.units,
            {name: () for name in self.data.trials[0].inputs},
            {},
            (),
        )
        return {c.name: c.unit for c in sorted(found, key=lambda c: _rank(c.name))}

    def values(self, name: str) -> tuple[np.ndarray, ...]:
        """A coordinate of each trial, every `stride`-th sample, float32."""
        # Views compute in threads of their own.
        with self._lock:
            if name not in self._kept:
                self._kept[name] = tuple(self._of(trial, name) for trial in self.data.trials)
                while len(self._kept) > KEPT:
                    self._kept.popitem(last=False)
            self._kept.move_to_end(name)
            return self._kept[name]

    def residual(self, signal: str) -> tuple[np.ndarray, ...]:
        """The residual of each trial at the same samples."""
        return tuple(trial.signals[signal].residual.series[:: self.stride] for trial in self.data.trials)

    def _of(self, trial: ViewTrial, name: str) -> np.ndarray:
        about = name.split(" of ")[-1]
        time = [np.asarray(trial.time)]
        signals = {about: [np.asarray(trial.signals[about].measured.series, float)]} if about in trial.signals else {}
        inputs = {about: [np.asarray(trial.inputs[about], float)]} if about in trial.inputs else {}
        found: list[Coordinate] = coordinates_of(signals, self.data.units, inputs, {}, time)
        values = next(c.values[0] for c in found if c.name == name)
        return values[:: self.stride].astype(np.float32)


def chosen_samples(coordinates: Coordinates, selection: Selection) -> dict[int, Chosen]:
    """The selected samples of the trials shown, by place."""
    data = coordinates.data
    found = {}
    for place in data.shown(selection.trials):
        start, stop = data.trials[place].samples(selection.time)
        found[place] = Chosen.between(start, stop)
        if selection.region is not None:
            found[place] = _in_region(coordinates, place, selection).within(start, stop)
    return found


def _in_region(coordinates: Coordinates, place: int, selection: Selection) -> Chosen:
    region = selection.region
    assert region is not None
    across, along = coordinates.values(region.across)[place], coordinates.values(region.along)[place]
    inside = (across >= np.float32(region.across_range.low)) & (across <= np.float32(region.across_range.high))
    inside &= (along >= np.float32(region.along_range.low)) & (along <= np.float32(region.along_range.high))
    return Chosen.where(inside, coordinates.stride, len(coordinates.data.trials[place].time))


def _rank(name: str) -> int:
    """Positions, speeds, inputs and time before amplitudes, histories and times from reversals."""
    derived = ("amplitude of ", "history of ", "time from ")
    return 1 if name.startswith(derived) else 0
