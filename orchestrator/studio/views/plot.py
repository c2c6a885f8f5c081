"""The plot of curves as an element of a page; `plot.js` is what runs in the browser.

Points go to the browser over a route of their own, as bytes: messages of NiceGUI would be text, and are kept for a while
in case a connection breaks.
"""

import secrets
import time
from collections.abc import Callable
from typing import Annotated, Any
from weakref import WeakValueDictionary

from fastapi import HTTPException, Query, Response
from nicegui import app
from nicegui.elements.echart.echart import EChart

from orchestrator.studio.views.selection import Range

ROUTE = "/views/curves"
MOST_COLUMNS = 4000
# What a plot shows of a range of time, in so many columns of pixels.
View = Callable[[Range, int], bytes]

SHARED = {"misfit-views": "browser"}

_plots: "WeakValueDictionary[str, CurvePlot]" = WeakValueDictionary()


class CurvePlot(EChart, component="plot.js", esm=SHARED):
    """Asks `view` for what is in sight, and emits `brush` with what was selected (from, to), or null."""

    def __init__(self, options: dict[str, Any], view: View) -> None:
        super().__init__(options)
        self._update_method = None
        self.view = view
        key = secrets.token_urlsafe()
        _plots[key] = self
        self._props["source"] = f"{ROUTE}/{key}"
        self._props["selecting"] = False
        self._props["selected"] = None

    def change(self, options: dict[str, Any]) -> None:
        """Arrange the plot anew and ask for its points; what is in sight stays."""
        self.run_method("change", options)

    def refresh(self) -> None:
        """Ask for the points again."""
        self.run_method("ask")


@app.get(ROUTE + "/{key}")
def _window(
    key: str,
    low: Annotated[float, Query(allow_inf_nan=False)],
    high: Annotated[float, Query(allow_inf_nan=False)],
    columns: Annotated[int, Query(ge=1, le=MOST_COLUMNS)],
) -> Response:
    """Points of a plot within low to high (s); only the page that has the plot knows its key."""
    plot = _plots.get(key)
    if plot is None:
        raise HTTPException(404, "this plot is no longer open; reload the page")
    begun = time.perf_counter()
    content = plot.view(Range.of(low, high), columns)
    spent = 1000 * (time.perf_counter() - begun)
    headers = {"Server-Timing": f"view;dur={spent:.2f}", "Cache-Control": "no-store"}
    return Response(content, media_type="application/octet-stream", headers=headers)
