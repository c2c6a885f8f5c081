"""What is selected, entered as numbers, and its errors beside those of the whole."""

from collections.abc import Sequence
from typing import Any

from nicegui import events, run, ui

from fmus.errors import MisfitError
from orchestrator.report.numbers import digits, quantity
from orchestrator.studio.views.errors import SignalErrors
from orchestrator.studio.views.link import SelectionLink
from orchestrator.studio.views.parts import Latest, Words, section
from orchestrator.studio.views.selection import Range, Selection

COLUMNS = (
    "signal",
    "rms, all",
    "times the floor, all",
    "rms, selected",
    "times the floor, selected",
    "mean, selected",
    "samples selected",
)


class SelectionView:
    """Two number fields for a range of time, and the errors of whatever is selected in any view."""

    def __init__(self, link: SelectionLink) -> None:
        self.link = link
        with section("Selection"):
            with ui.element("div").classes("view-row"):
                self._choices()
                self.low = ui.number("from, s", format="%.6g").classes("view-number")
                self.high = ui.number("to, s", format="%.6g").classes("view-number")
                for field in (self.low, self.high):
                    field.on("keydown.enter", self._entered)
                ui.button("Select this time", on_click=self._entered).props("no-caps")
                ui.button("Clear", on_click=link.clear).props("outline no-caps")
            self.words = Words("Errors of the selection")
        self._refresh = Latest(self._show)
        link.listen(self._heard)
        self._heard(link.selection)

    def _choices(self) -> None:
        data = self.link.data
        if len(data.signals) > 1:
            signals = {name: name for name in data.signals}
            ui.select(signals, value=self.link.signal, label="Signal", on_change=self._signal).classes("view-select")
        if len(data.trials) > 1:
            names = {-1: f"all {len(data.trials)} trials"}
            names |= {k: f"{trial.name} ({trial.subset.replace('_', ' ')})" for k, trial in enumerate(data.trials)}
            shown = self.link.selection.trials
            ui.select(names, value=-1 if shown is None else shown[0], label="Trials", on_change=self._trial).classes(
                "view-select"
            )

    def _signal(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self.link.choose_signal(event.value)

    def _trial(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self.link.choose_trials(None if event.value < 0 else (event.value,))

    def _entered(self) -> None:
        try:
            self.link.choose_time(Range.entered(self.low.value, self.high.value, "time", "s"))
        except MisfitError as error:
            ui.notify(str(error), type="negative")

    def _heard(self, selection: Selection) -> None:
        time = selection.time
        self.low.set_value(None if time is None else time.low)
        self.high.set_value(None if time is None else time.high)
        self._refresh()

    async def _show(self) -> None:
        self._say(await run.io_bound(self.link.errors) or ())

    def _say(self, found: Sequence[SignalErrors]) -> None:
        if self.link.selection.brushed:
            sentence = "; ".join(errors.sentence() for errors in found) + "."
        else:
            sentence = "Nothing is selected: brush a range of time or a region of the state map, or enter two numbers."
        self.words.say(sentence, COLUMNS, [_row(errors) for errors in found])


def _row(errors: SignalErrors) -> list[str]:
    whole, selected = errors.whole, errors.selected
    return [
        errors.signal,
        quantity(whole.rms, errors.unit),
        digits(errors.times_floor(whole)),
        quantity(selected.rms, errors.unit),
        digits(errors.times_floor(selected)),
        quantity(selected.mean, errors.unit),
        f"{selected.count} of {whole.count}",
    ]
