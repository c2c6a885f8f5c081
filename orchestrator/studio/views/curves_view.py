"""Measured and modelled curves of the trials shown over time, with the residual below: pan, zoom and brush."""

from typing import Any

from nicegui import events, run, ui

from orchestrator.report.numbers import digits, quantity
from orchestrator.studio.views.curve_options import LEGEND, curve_options
from orchestrator.studio.views.errors import SignalErrors, trial_errors
from orchestrator.studio.views.link import SelectionLink
from orchestrator.studio.views.parts import Latest, Words, legend, picture_frame, section
from orchestrator.studio.views.plot import CurvePlot
from orchestrator.studio.views.selection import Range, Selection
from orchestrator.studio.views.window import curve_window, packed

NAME = (
    "Curves over time: measured and modelled above, residual below. "
    "Arrow keys pan, plus and minus zoom, Home shows all, Escape clears the selected time."
)
HINT = "Drag to move, Ctrl and wheel to zoom, Shift and drag to select."
COLUMNS = ("trial", "set", "residual, rms", "times the floor", "where selected, rms")


class CurvesView:
    """The curves of one signal at a time; `link` tells and hears what is selected."""

    def __init__(self, link: SelectionLink) -> None:
        self.link, self.data = link, link.data
        self._signal = link.signal
        with section("Curves"):
            with ui.element("div").classes("view-row"):
                ui.switch("drag selects", on_change=self._choose_mode)
                ui.button("Show all", on_click=self._whole).props("outline no-caps")
                ui.html(HINT, sanitize=False, tag="span").classes("view-hint")
            with picture_frame("view-curves"):
                self.plot = CurvePlot(curve_options(self.data, self._signal), self._view)
            self.plot.on("brush", self._brushed)
            ui.html(legend(LEGEND), sanitize=False)
            self.words = Words("Curves by trial")
            self.words.describe(self.plot, NAME, role="group")
        self._describe = Latest(self._say)
        link.listen(self._heard)
        self._mark(link.selection)
        self._describe()

    def _whole(self) -> None:
        self.plot.run_method("whole")

    def _choose_mode(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self.plot.props["selecting"] = event.value

    def _view(self, time: Range, columns: int) -> bytes:
        trials = self.data.shown(self.link.selection.trials)
        chosen = self.link.chosen() if self.link.selection.brushed else None
        return packed(curve_window(self.data, self._signal, trials, time, columns, chosen))

    def _brushed(self, event: events.GenericEventArguments) -> None:
        brushed = event.args
        self.link.choose_time(None if brushed is None else Range.of(brushed["from"], brushed["to"]))

    def _heard(self, selection: Selection) -> None:
        self._mark(selection)
        if self._signal != self.link.signal:
            self._signal = self.link.signal
            self.plot.change(curve_options(self.data, self._signal))
        else:
            self.plot.refresh()
        self._describe()

    def _mark(self, selection: Selection) -> None:
        time = selection.time
        self.plot.props["selected"] = None if time is None else [time.low, time.high]

    async def _say(self) -> None:
        self._show(await run.io_bound(lambda: trial_errors(self.data, self._signal, self.link.chosen())))

    def _show(self, found: dict[int, SignalErrors] | None) -> None:
        if not found:
            return
        worst = max(found, key=lambda place: found[place].whole.rms)
        errors, count = found[worst], len(found)
        times = digits(errors.times_floor(errors.whole))
        sentence = (
            f"{self._signal} in {count} {'trial' if count == 1 else 'trials'}: the residual is largest in"
            f" {self.data.trials[worst].name}, {quantity(errors.whole.rms, errors.unit)} rms, {times} times the noise floor."
        )
        self.words.say(sentence, COLUMNS, [self._row(place, errors) for place, errors in found.items()])

    def _row(self, place: int, errors: SignalErrors) -> list[str]:
        trial = self.data.trials[place]
        return [
            trial.name,
            trial.subset.replace("_", " "),
            quantity(errors.whole.rms, errors.unit),
            digits(errors.times_floor(errors.whole)),
            quantity(errors.selected.rms, errors.unit) if errors.selected.count else "none selected",
        ]
