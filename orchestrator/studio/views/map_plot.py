"""The map of boxes as an element of a page; `map.js` is what runs in the browser."""

from typing import Any

from nicegui.elements.echart.echart import EChart

from orchestrator.studio.views.plot import SHARED


class MapPlot(EChart, component="map.js", esm=SHARED):
    """Emits `brush` with the region that was dragged (across and along, each from and to), or null."""

    def __init__(self, options: dict[str, Any]) -> None:
        super().__init__(options)
        self._update_method = None

    def change(self, options: dict[str, Any]) -> None:
        """Draw another map, as a property: a call of a method would be lost on a page that is not built up yet."""
        self._props["options"] = options
        self.update()
