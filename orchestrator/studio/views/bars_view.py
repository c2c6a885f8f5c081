"""The error over frequency and over any one coordinate, as the comparison found it, with the selected samples beside."""

from typing import Any

from nicegui import events, run, ui

from orchestrator.report.numbers import digits, quantity
from orchestrator.report.palette import Colour
from orchestrator.studio.views.against import FREQUENCY, Bars, bars_against, bars_of_frequency, offered
from orchestrator.studio.views.curve_options import axis, titled
from orchestrator.studio.views.link import SelectionLink
from orchestrator.studio.views.parts import Latest, Words, legend, picture_frame, section

LEGEND = {"learning trials": Colour.RESIDUAL, "selected": Colour.IMPROVED}


def bars_options(found: Bars, unit: str) -> dict[str, Any]:
    """Options of ECharts for bins of equal width on the picture, whatever their width is."""
    places = [f"{digits(bar.low)} to\n{digits(bar.high)}" for bar in found.bars]
    text = {"color": Colour.INK}
    return {
        "animation": False,
        "grid": {"left": 78, "right": 16, "top": 34, "bottom": 66},
        "xAxis": {
            "type": "category",
            "data": places,
            "name": titled(found.against, found.unit),
            "nameLocation": "middle",
            "nameGap": 42,
            "nameTextStyle": text,
            "axisLabel": {**text, "interval": 0, "fontSize": 11, "lineHeight": 14},
        },
        "yAxis": axis(titled(f"residual of {found.signal}, rms", unit), nameTextStyle={"align": "left"}),
        "series": [
            {
                "type": "bar",
                "data": [bar.rms for bar in found.bars],
                "barWidth": "60%",
                "itemStyle": {"color": "transparent", "borderColor": Colour.RESIDUAL, "borderWidth": 2},
                "silent": True,
            },
            {
                "type": "scatter",
                "data": [[k, bar.selected] for k, bar in enumerate(found.bars) if bar.selected is not None],
                "symbolSize": 11,
                "itemStyle": {"color": Colour.IMPROVED},
                "silent": True,
            },
        ],
    }


COLUMNS = ("where", "rms, learning trials", "rms, selected")


class BarsView:
    """Bars over one coordinate: at first the amplitude of the signal, where the comparison offers it."""

    def __init__(self, link: SelectionLink, against: str | None = None) -> None:
        self.link = link
        self._names = {FREQUENCY: FREQUENCY} if against == FREQUENCY else _all_offered(link)
        self._against = against or _amplitude(link)
        title = "Error over frequency" if against == FREQUENCY else "Error over one coordinate"
        with section(title):
            if len(self._names) > 1:
                ui.select(self._names, value=self._against, label="Over", on_change=self._choose).classes("view-select")
            with picture_frame("view-bars"):
                self.plot = ui.echart({"series": []}).classes("view-plot")
            ui.html(legend(LEGEND), sanitize=False)
            self.words = Words(title)
            self.words.describe(self.plot, title)
        self._refresh = Latest(self._show)
        link.listen(lambda _: self._refresh())
        self._refresh()

    def _choose(self, event: events.ValueChangeEventArguments[Any]) -> None:
        self._against = event.value
        self._refresh()

    async def _show(self) -> None:
        found: Bars | None = await run.io_bound(self._bars)
        if found is None:
            return
        unit, floor = self.link.data.units[found.signal], self.link.data.noise_floor[found.signal]
        self.plot.options.clear()
        self.plot.options.update(bars_options(found, unit))
        self.plot.update()
        self.words.say(found.sentence(unit, floor), COLUMNS, _rows(found, unit))

    def _bars(self) -> Bars:
        link = self.link
        chosen = link.chosen() if link.selection.brushed else None
        if self._against == FREQUENCY:
            return bars_of_frequency(link.data, link.signal, chosen)
        return bars_against(link.coordinates, link.signal, self._against, chosen)


def _all_offered(link: SelectionLink) -> dict[str, str]:
    return {name: name for signal in link.data.signals for name in offered(link.data, signal)}


def _amplitude(link: SelectionLink) -> str:
    names = offered(link.data, link.signal)
    return next((name for name in names if name == f"amplitude of {link.signal}"), names[0] if names else FREQUENCY)


def _rows(found: Bars, unit: str) -> list[list[str]]:
    return [
        [
            found.place(bar),
            quantity(bar.rms, unit),
            "none selected" if bar.selected is None else quantity(bar.selected, unit),
        ]
        for bar in found.bars
    ]
