"""Measured and modelled curves of all trials over time, with the residual below: pan, zoom and brush."""

from typing import Any

from nicegui import events, ui

from orchestrator.report.numbers import digits, quantity
from orchestrator.studio.views.curve_options import LEGEND, curve_options
from orchestrator.studio.views.link import SelectionLink
from orchestrator.studio.views.parts import Words, section
from orchestrator.studio.views.plot import CurvePlot
from orchestrator.studio.views.selection import Range
from orchestrator.studio.views.window import curve_window, packed

NAME = (
    "Curves over time: measured and modelled above, residual below. "
    "Arrow keys pan, plus and minus zoom, Home shows all, Escape clears the selected time."
)
HINT = "Drag to move, Ctrl and wheel to zoom, Shift and drag to select."


class CurvesView:
    """The curves of one signal at a time; `link` tells and hears what is selected."""

    def __init__(self, link: SelectionLink) -> None:
        self.link, self.data = link, link.data
        self.signal = self.data.signals[0]
        with section("Curves"):
            self._controls()
            self.plot = CurvePlot(curve_options(self.data, self.signal), self._view)
            self.plot.on("brush", self._brushed)
            ui.html(_legend(), sanitize=False)
            self.words = Words("Curves by trial")
            self.words.describe(self.plot, NAME, role="group")
        link.listen(lambda _: self._selected())
        self._describe()

    def _controls(self) -> None:
        with ui.element("div").classes("view-row"):
            if len(self.data.signals) > 1:
                signals = {name: name for name in self.data.signals}
                ui.select(signals, value=self.signal, label="Signal", on_change=self._choose_signal).classes(
                    "view-select"
                )
            if len(self.data.trials) > 1:
                names = {-1: f"all {len(self.data.trials)} trials"}
                names |= {k: f"{t.name} ({t.subset.replace('_', ' ')})" for k, t in enumerate(self.data.trials)}
                ui.select(names, value=-1, label="Trials", on_change=self._choose_trial).classes("view-select")
            ui.switch("drag selects", on_change=self._choose_mode)
            ui.button("Show all", on_click=lambda: self.plot.run_method("whole")).props("outline no-caps")
            ui.html(HINT, sanitize=False, tag="span").classes("view-hint")

    def _choose_signal(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self.signal = event.value
        self.plot.change(curve_options(self.data, self.signal))
        self._describe()

    def _choose_trial(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self.link.choose_trials(None if event.value < 0 else (event.value,))

    def _choose_mode(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self.plot.props["selecting"] = event.value

    def _view(self, time: Range, columns: int) -> bytes:
        trials = self.data.shown(self.link.selection.trials)
        chosen = self.link.chosen() if self.link.selection.brushed else None
        return packed(curve_window(self.data, self.signal, trials, time, columns, chosen))

    def _brushed(self, event: events.GenericEventArguments) -> None:
        brushed = event.args
        self.link.choose_time(None if brushed is None else Range.of(brushed["from"], brushed["to"]))

    def _selected(self) -> None:
        time = self.link.selection.time
        self.plot.props["selected"] = None if time is None else [time.low, time.high]
        self.plot.refresh()
        self._describe()

    def _describe(self) -> None:
        unit, floor, chosen = self.data.units[self.signal], self.data.noise_floor[self.signal], self.link.chosen()
        rows = []
        for place in self.data.shown(self.link.selection.trials):
            trial = self.data.trials[place]
            sums = trial.signals[self.signal].sums
            whole, selected = sums.between(0, len(trial.time)), chosen[place].moments(sums)
            times = digits(whole.rms / floor) if floor else "unknown"
            rows.append(
                [
                    trial.name,
                    trial.subset.replace("_", " "),
                    quantity(whole.rms, unit),
                    times,
                    quantity(selected.rms, unit),
                ]
            )
        worst = max(rows, key=lambda row: float(row[3]) if row[3] != "unknown" else 0.0)
        columns = ["trial", "set", f"residual of {self.signal}, rms", "times the floor", "where selected"]
        sentence = f"{self.signal} in {len(rows)} trial{'s' if len(rows) > 1 else ''}: the residual is largest in {worst[0]}, {worst[2]} rms, {worst[3]} times the noise floor."
        self.words.say(sentence, columns, rows)


def _legend() -> str:
    marks = "".join(f'<li><span style="background: {colour}"></span>{name}</li>' for name, colour in LEGEND.items())
    return f'<ul class="view-legend">{marks}</ul>'
