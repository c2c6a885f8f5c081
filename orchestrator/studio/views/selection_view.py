"""What is selected, entered as numbers, and its errors beside those of the whole."""

from nicegui import ui

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
                self.low = ui.number("from, s", format="%.6g").classes("view-number")
                self.high = ui.number("to, s", format="%.6g").classes("view-number")
                ui.button("Select this time", on_click=self._entered).props("no-caps")
                ui.button("Clear", on_click=link.clear).props("outline no-caps")
            self.words = Words("Errors of the selection")
        self._refresh = Latest(self._show)
        link.listen(self._heard)
        self._say()

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
        self._say()

    def _say(self) -> None:
        found = self.link.errors()
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
