"""C functions that Modelica functions stand for: built-in ones, and the tables of the Standard Library, row by row."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from fmus.flat.evaluate import BUILT_IN, Number, Unknown

TABLES = "ModelicaStandardTables_"
LINEAR, CONSTANT = 1, 3
HOLD, GO_ON, PERIODIC = 1, 2, 3


def external(symbol: str, arguments: Sequence[Number], inputs: Mapping[str, Any]) -> Number:
    """The result of a C function.

    Args:
        symbol: its name.
        arguments: what it is called with.
        inputs: of the Modelica function, which are all that is kept of a table.

    Raises:
        Unknown: if it is not known here.
    """
    if symbol in BUILT_IN:
        return BUILT_IN[symbol](*arguments)
    kind, _, action = symbol.removeprefix(TABLES).partition("_")
    if not symbol.startswith(TABLES) or kind not in ("CombiTable1D", "CombiTimeTable"):
        raise Unknown(f"the external function {symbol}")
    if action.startswith("init"):
        return dict(inputs)
    table = arguments[0]
    rows = np.atleast_2d(np.asarray(table["table"], dtype=float))
    if np.any(np.diff(rows[:, 0]) < 0):
        return np.nan  # no table
    if action in ("minimumTime", "minimumAbscissa"):
        return rows[0, 0]
    if action in ("maximumTime", "maximumAbscissa"):
        return rows[-1, 0]
    if action != "getValue":
        raise Unknown(f"the external function {symbol}")
    smoothness, extrapolation = int(table["smoothness"]), int(table["extrapolation"])
    if smoothness not in (LINEAR, CONSTANT) or extrapolation not in (HOLD, GO_ON, PERIODIC):
        raise Unknown("a smooth table, or one that ends")
    at, waits = float(arguments[2]), False
    if kind == "CombiTimeTable":
        event = float(arguments[3])
        if event <= table["startTime"]:
            return 0.0
        waits = at >= event  # what comes then has not come yet
        at = min(at, event) - table["shiftTime"]
    x, y = rows[:, 0], rows[:, int(np.ravel(table["columns"])[int(arguments[1]) - 1]) - 1]
    if extrapolation == PERIODIC:
        period = x[-1] - x[0]
        at = x[-1] - (x[-1] - at) % period if waits else x[0] + (at - x[0]) % period
    elif extrapolation == HOLD:
        at = min(max(at, x[0]), x[-1])
    return _looked_up(x, y, at, smoothness, "left" if waits else "right")


def _looked_up(x: np.ndarray, y: np.ndarray, at: float, smoothness: int, side: Literal["left", "right"]) -> float:
    """A value between two rows, or beyond them; where it jumps, that of one side."""
    row = int(np.searchsorted(x, at, side=side)) - 1
    if smoothness == CONSTANT or len(x) == 1:
        return float(y[max(row, 0)])
    row = min(max(row, 0), len(x) - 2)
    if x[row] == x[row + 1]:
        return float(y[row + 1])
    return float(y[row] + (y[row + 1] - y[row]) / (x[row + 1] - x[row]) * (at - x[row]))
