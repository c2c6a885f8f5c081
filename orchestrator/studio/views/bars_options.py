"""How the error in bins of a coordinate is drawn: bars, and dots for the selected samples."""

from typing import Any

from orchestrator.report.numbers import digits
from orchestrator.report.palette import SURFACES, Colour
from orchestrator.studio.views.against import Bars
from orchestrator.studio.views.curve_options import titled

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
        "yAxis": {
            "type": "value",
            "name": titled(f"residual of {found.signal}, rms", unit),
            "nameTextStyle": {**text, "align": "left"},
            "axisLabel": text,
            "splitLine": {"lineStyle": {"color": SURFACES["rule"]}},
        },
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
