"""The residual over two coordinates of the state: brush a region, and the other views follow."""

from typing import Any

from nicegui import events, run, ui
from nicegui.elements.echart.echart import EChart

from fmus.errors import MisfitError
from orchestrator.studio.views.against import offered
from orchestrator.studio.views.link import SelectionLink
from orchestrator.studio.views.map_options import map_options
from orchestrator.studio.views.parts import Latest, Words, picture_frame, section
from orchestrator.studio.views.plot import SHARED
from orchestrator.studio.views.selection import Range, Region, Selection
from orchestrator.studio.views.state_map import STATISTICS, StateMap, map_rows, map_sentence, state_map


class MapPlot(EChart, component="map.js", esm=SHARED):
    """Emits `brush` with the region that was dragged (across and along, each from and to), or null."""

    def __init__(self, options: dict[str, Any]) -> None:
        super().__init__(options)
        self._update_method = None

    def change(self, options: dict[str, Any]) -> None:
        """Draw another map, as a property: a call of a method would be lost on a page that is not built up yet."""
        self._props["options"] = options
        self.update()


NAME = "State map: the residual over two coordinates. Drag to select a region, Escape clears it."
COLUMNS = ("where", "rms", "mean", "samples")


class MapView:
    """A map of the signal that the link shows, over two coordinates to choose."""

    def __init__(self, link: SelectionLink) -> None:
        self.link = link
        self._units = link.coordinates.names()
        region = link.selection.region
        first = _first_choice(link, tuple(self._units)) if region is None else (region.across, region.along)
        self._across, self._along = first
        self._statistic = next(iter(STATISTICS))
        with section("State map"):
            self._controls()
            with picture_frame("view-map"):
                self.plot = MapPlot({"series": []})
            self.plot.on("brush", self._brushed)
            self._entry()
            self.words = Words("Boxes with the largest errors")
            self.words.describe(self.plot, NAME, role="group")
        self._refresh = Latest(self._show)
        link.listen(self._heard)
        self._heard(link.selection)

    def _controls(self) -> None:
        names = list(self._units)
        with ui.element("div").classes("view-row"):
            self._select("Across", names, self._across, "_across")
            self._select("Upwards", names, self._along, "_along")
            self._select("Colour", list(STATISTICS), self._statistic, "_statistic")

    def _select(self, label: str, names: list[str], value: str, attribute: str) -> None:
        def choose(event: events.ValueChangeEventArguments[Any]) -> None:
            setattr(self, attribute, event.value)
            self._refresh()

        ui.select({name: name for name in names}, value=value, label=label, on_change=choose).classes("view-select")

    def _entry(self) -> None:
        labels = ("across, from", "across, to", "upwards, from", "upwards, to")
        with ui.element("div").classes("view-row"):
            self._fields = [ui.number(label, format="%.5g").classes("view-number") for label in labels]
            for field in self._fields:
                field.on("keydown.enter", self._entered)
            ui.button("Select this region", on_click=self._entered).props("no-caps")

    def _entered(self) -> None:
        left, right, bottom, top = (field.value for field in self._fields)
        try:
            across = Range.entered(left, right, self._across, self._units[self._across])
            along = Range.entered(bottom, top, self._along, self._units[self._along])
        except MisfitError as error:
            ui.notify(str(error), type="negative")
            return
        self.link.choose_region(Region(self._across, across, self._along, along))

    def _brushed(self, event: events.GenericEventArguments) -> None:
        if event.args is None:
            self.link.choose_region(None)
            return
        across, along = (Range.of(*event.args[key]) for key in ("across", "along"))
        self.link.choose_region(Region(self._across, across, self._along, along))

    def _heard(self, selection: Selection) -> None:
        region = selection.region
        ends: list[float | None] = [None] * 4
        if region is not None and (region.across, region.along) == (self._across, self._along):
            ends = [end for part in (region.across_range, region.along_range) for end in (part.low, part.high)]
        for field, end in zip(self._fields, ends, strict=True):
            field.set_value(end)
        self._refresh()

    async def _show(self) -> None:
        link, signal = self.link, self.link.signal
        found: StateMap | None = await run.io_bound(
            state_map, link.coordinates, signal, self._across, self._along, link.selection
        )
        if found is None:
            self.words.say(
                "This map cannot be drawn: one of the coordinates does not vary. Choose another.", COLUMNS, []
            )
            return
        unit, floor = link.data.units[signal], link.data.noise_floor[signal]
        units = (self._units[found.across], self._units[found.along])
        self.plot.change(map_options(found, self._statistic, self._units, unit, link.selection.region))
        self.words.say(map_sentence(found, units, unit, floor), COLUMNS, map_rows(found, units, unit))


def _first_choice(link: SelectionLink, names: tuple[str, ...]) -> tuple[str, str]:
    """The coordinate on which the error depends most, and one to go with it: a speed with its position."""
    strongest = next((name for name in offered(link.data, link.signal) if name in names), names[0])
    about = strongest.split(" of ")[-1]
    partner = f"speed of {about}" if strongest != f"speed of {about}" else about
    other = partner if partner in names else next(name for name in names if name != strongest)
    return (strongest, other) if strongest == about else (other, strongest)
