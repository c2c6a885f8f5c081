"""The link between the views of one page: who changes the selection tells the others."""

from collections.abc import Callable
from dataclasses import replace

from orchestrator.studio.views.chosen import Chosen
from orchestrator.studio.views.coordinates import Coordinates, chosen_samples
from orchestrator.studio.views.data import ViewData
from orchestrator.studio.views.errors import SignalErrors, selection_errors
from orchestrator.studio.views.selection import Range, Region, Selection

Listener = Callable[[Selection], object]


class SelectionLink:
    """The selection in one comparison, and what is asked about it more than once.

    `before` is the link of another comparison that was shown in its place: if both have the same signals and trials, the
    same is selected again, so that one sees what a new version of the model does there.
    """

    def __init__(self, data: ViewData, before: "SelectionLink | None" = None) -> None:
        self.data = data
        self.coordinates = Coordinates(data)
        same = before is not None and _kind(before.data) == _kind(data)
        self.signal: str = before.signal if before is not None and same else data.signals[0]
        self.selection: Selection = before.selection if before is not None and same else Selection()
        self._listeners: list[Listener] = []
        self._chosen: tuple[Selection, dict[int, Chosen]] | None = None

    def listen(self, listener: Listener) -> None:
        """Call `listener` with the selection whenever it changes, or the signal that the views show."""
        self._listeners.append(listener)

    def choose_signal(self, signal: str) -> None:
        """Show another signal in all views."""
        if signal != self.signal:
            self.signal = signal
            self._tell()

    def choose_trials(self, trials: tuple[int, ...] | None) -> None:
        """Show these trials only; None for all."""
        self._set(replace(self.selection, trials=trials))

    def choose_time(self, time: Range | None) -> None:
        """Select a range of time, or all times."""
        self._set(replace(self.selection, time=time))

    def choose_region(self, region: Region | None) -> None:
        """Select a region of the state map, or all states."""
        self._set(replace(self.selection, region=region))

    def clear(self) -> None:
        """Select everything in the trials shown."""
        self._set(Selection(trials=self.selection.trials))

    def chosen(self) -> dict[int, Chosen]:
        """The selected samples of the trials shown, by place."""
        selection = self.selection
        if self._chosen is None or self._chosen[0] != selection:
            self._chosen = selection, chosen_samples(self.coordinates, selection)
        return self._chosen[1]

    def errors(self) -> tuple[SignalErrors, ...]:
        """Error numbers of the selection beside those of the whole."""
        return selection_errors(self.data, self.chosen())

    def _set(self, selection: Selection) -> None:
        if selection != self.selection:
            self.selection = selection
            self._tell()

    def _tell(self) -> None:
        for listener in self._listeners:
            listener(self.selection)


def _kind(data: ViewData) -> tuple[object, ...]:
    """What two comparisons must share for a selection in one to mean something in the other."""
    return data.signals, tuple((trial.name, len(trial.time), tuple(trial.inputs)) for trial in data.trials)
