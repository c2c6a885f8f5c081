"""How the plot of curves is arranged: two panels over one axis of time; the browser fills in the points."""

from typing import Any

from orchestrator.report.palette import SURFACES, Colour
from orchestrator.studio.views.data import ViewData
from orchestrator.studio.views.window import BAND

MARKS = {"measured": Colour.MEASURED, "model": Colour.MODEL, "residual": Colour.RESIDUAL, "selected": Colour.IMPROVED}
FLOOR_NAME = f"±{BAND} noise floors"
LEGEND = {**MARKS, FLOOR_NAME: Colour.OTHER}
SHADE = 0.18
LEFT, RIGHT = 78, 16


def curve_options(data: ViewData, signal: str) -> dict[str, Any]:
    """Options of ECharts for one signal; `lines` are those of each kind of series, for `plot.js`."""
    unit, floor = data.units[signal], BAND * data.noise_floor[signal]
    panels = [
        {"left": LEFT, "right": RIGHT, "top": 34, "height": 210},
        {"left": LEFT, "right": RIGHT, "top": 278, "height": 90},
    ]
    return {
        "animation": False,
        "grid": panels,
        "xAxis": [_time_axis(data, panel) for panel in (0, 1)],
        "yAxis": [_value_axis(titled(signal, unit), 0), _value_axis(titled("residual", unit), 1)],
        "dataZoom": [
            {"type": "inside", "xAxisIndex": [0, 1], "filterMode": "none", "zoomOnMouseWheel": "ctrl",
             "moveOnMouseWheel": False, "preventDefaultMouseMove": False, "minSpan": 1e-5, "throttle": 16},
            {"type": "slider", "xAxisIndex": [0, 1], "filterMode": "none", "bottom": 4, "height": 26, "left": LEFT,
             "right": RIGHT, "minSpan": 1e-5, "throttle": 16, "showDetail": False, "brushSelect": False},
        ],
        "series": [
            {"id": "above", **_empty(0), "markArea": _area(Colour.IMPROVED)},
            {"id": "below", **_empty(1), "markArea": _area(Colour.IMPROVED)},
            {"id": "floor", **_empty(1), "markArea": {**_area(Colour.OTHER), "data": [[{"yAxis": -floor}, {"yAxis": floor}]]}},
        ],
        "lines": {
            "measured": _line(Colour.MEASURED, 2.6, 0.45),
            "modelled": _line(Colour.MODEL, 1.2, 0.9),
            "residual": _line(Colour.RESIDUAL, 1.0, 0.9),
            "chosen": _line(Colour.IMPROVED, 2.2, 1.0),
        },
    }  # fmt: skip


def titled(name: str, unit: str) -> str:
    """A quantity with its unit in brackets, or alone when it has none."""
    return name if unit in ("", "1") else f"{name} ({unit})"


def axis(name: str, **own: Any) -> dict[str, Any]:
    """An axis of numbers in the colours of the page; dictionaries among its `own` options add to those that all have."""
    ink = {"color": Colour.INK}
    rule = {"lineStyle": {"color": SURFACES["rule"]}}
    found: dict[str, Any] = {"type": "value", "name": name, "nameTextStyle": ink, "axisLabel": ink, "splitLine": rule}
    return found | {k: {**found.get(k, {}), **v} if isinstance(v, dict) else v for k, v in own.items()}


def _time_axis(data: ViewData, panel: int) -> dict[str, Any]:
    last = panel == 1
    return axis(
        "time (s)" if last else "",
        gridIndex=panel,
        min=data.time.low,
        max=data.time.high,
        axisLabel={"show": last, "hideOverlap": True, "showMinLabel": False, "showMaxLabel": False},
        axisTick={"show": last},
        axisLine={"onZero": False, "lineStyle": {"color": Colour.OTHER}},
        nameLocation="middle",
        nameGap=24,
    )


def _value_axis(title: str, panel: int) -> dict[str, Any]:
    pieces, left = (5, 2)[panel], {"align": "left"}
    return axis(title, gridIndex=panel, nameLocation="end", nameTextStyle=left, nameGap=8, splitNumber=pieces)


def _line(colour: str, width: float, opacity: float) -> dict[str, Any]:
    return {"color": colour, "width": width, "opacity": opacity}


def _empty(panel: int) -> dict[str, Any]:
    return {"type": "line", "xAxisIndex": panel, "yAxisIndex": panel, "data": [], "silent": True}


def _area(colour: str) -> dict[str, Any]:
    return {"silent": True, "animation": False, "itemStyle": {"color": colour, "opacity": SHADE}, "data": []}
