"""How a state map is drawn: coloured boxes, a scale beside them, and the selected region."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from orchestrator.report.numbers import quantity
from orchestrator.report.palette import Colour
from orchestrator.studio.views.curve_options import axis, titled
from orchestrator.studio.views.selection import Region
from orchestrator.studio.views.state_map import STATISTICS, StateMap

# Mean: below zero blue, above it orange; size: the more, the darker. Both also work in grey and without green.
DIVERGING = (Colour.IMPROVED, "#F4F4F4", Colour.MODEL)
SEQUENTIAL = ("#EDF3F8", Colour.IMPROVED, "#06203C")


def map_options(
    found: StateMap, statistic: str, units: Mapping[str, str], unit: str, region: Region | None
) -> dict[str, Any]:
    """Options of ECharts; `units` are those of coordinates, `unit` that of the signal.

    Each entry of the data is [left, right, bottom, top, value, 1 if it is selected].
    """
    entries, reach = _entries(found, statistic)
    signed = np.any([entry[4] < 0 for entry in entries])
    return {
        "animation": False,
        "grid": {"left": 90, "right": 130, "top": 20, "bottom": 56},
        "xAxis": _axis(found.across, units[found.across], found.across_edges, 30),
        "yAxis": _axis(found.along, units[found.along], found.along_edges, 64),
        "visualMap": {
            "type": "continuous",
            "dimension": 4,
            "min": -reach if signed else 0.0,
            "max": reach,
            "inRange": {"color": list(DIVERGING if signed else SEQUENTIAL)},
            "right": 6,
            "top": "middle",
            "itemHeight": 200,
            "text": [quantity(reach, unit), quantity(-reach if signed else 0.0, unit)],
            "textStyle": {"color": Colour.INK},
            "calculable": False,
            "hoverLink": False,
            "seriesIndex": 0,
        },
        "series": [
            {"type": "custom", "data": entries, "encode": {"x": [0, 1], "y": [2, 3]}, "silent": True, "clip": True},
            _frame(region, found),
        ],
    }


def _entries(found: StateMap, statistic: str) -> tuple[list[list[float]], float]:
    """Boxes that hold samples, and the largest absolute value among them."""
    of = STATISTICS[statistic]
    partly = found.selected is not found.whole
    entries = []
    for row, column in np.argwhere(found.whole.count > 0):
        inside = bool(found.selected.count[row, column] > 0)
        boxes = found.selected if partly and inside else found.whole
        box = (found.across_edges[column : column + 2], found.along_edges[row : row + 2])
        value = float(of(boxes)[row, column])
        entries.append([*(float(edge) for edges in box for edge in edges), value, float(inside)])
    return entries, max((abs(entry[4]) for entry in entries), default=1.0) or 1.0


def _axis(name: str, unit: str, edges: np.ndarray, gap: int) -> dict[str, Any]:
    return axis(
        titled(name, unit),
        min=float(edges[0]),
        max=float(edges[-1]),
        nameLocation="middle",
        nameGap=gap,
        axisLabel={"showMinLabel": False, "showMaxLabel": False, "hideOverlap": True},
        axisLine={"show": True, "onZero": False, "lineStyle": {"color": Colour.OTHER}},
    )


def _frame(region: Region | None, found: StateMap) -> dict[str, Any]:
    """The outline of the region, where it is one of these two coordinates."""
    data: list[Any] = []
    if region is not None and (region.across, region.along) == (found.across, found.along):
        low = {"xAxis": region.across_range.low, "yAxis": region.along_range.low}
        data = [[low, {"xAxis": region.across_range.high, "yAxis": region.along_range.high}]]
    style = {"color": "transparent", "borderColor": Colour.INK, "borderWidth": 2.5}
    return {
        "type": "line",
        "data": [],
        "silent": True,
        "markArea": {"silent": True, "z": 5, "itemStyle": style, "data": data},
    }
