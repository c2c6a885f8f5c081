"""Tables of the Modelica Standard Library, CombiTimeTable and CombiTable1D, as formulas in place of its C functions.

Between two rows a table is a straight line or constant; outside it goes on along its first or last two rows, or holds its value, as
`ModelicaStandardTables.c` of the library does. Rows with the same abscissa are a jump, to the right of which the later row counts. A time
table jumps at its events only: `nextTimeEvent`, which changes there, tells what has passed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca

from fmus.errors import ModelicaError
from fmus.symbolic.arena import Arena
from fmus.symbolic.values import Value, number, shape_of

PREFIX = "ModelicaStandardTables_"
LINEAR, CONSTANT = 1, 3
HOLD, GO_ON, PERIODIC = 1, 2, 3
ALWAYS = 1
# Longer tables would be formulas without end.
MOST_ROWS = 2000
# Of the length of a table: times closer to each other are the same.
ROUNDING = 1e-9
# Modelica.Constants.inf of all versions is at most this.
NEVER = 1.0e60


# Parameters of a table's block by their last name; None if it has no such parameter.
Look = Callable[[str], Value | None]


@dataclass(frozen=True)
class Table:
    """`rows` of numbers, and the same as `cells` that depend on parameters; `columns` count from one."""

    name: str
    rows: Sequence[Sequence[float]]
    cells: Sequence[Sequence[Value]]
    columns: Sequence[int]
    smoothness: int
    extrapolation: int


def call(arena: Arena, symbol: str, arguments: Sequence[Value], parameter: Callable[[int], Value]) -> Value:
    """The value of a C function of the library's tables.

    Args:
        arena: the model, with the data of its tables.
        symbol: the name of the C function.
        arguments: what it is called with; the first is the table.
        parameter: gives the value of a parameter by its number.

    Raises:
        ModelicaError: for a table or a function that is not supported.
    """
    handle = int(number(arguments[0]))
    name = next(iter(arena.table_names.get(handle, ())), "a table")
    numbers = {v["name"]: k for k, v in enumerate(arena.variables)}

    def look(last: str) -> Value | None:
        wanted = arena.table_source(name) if last == "table" else name.removesuffix("tableID") + last
        index = numbers.get(wanted)
        return None if index is None else parameter(index)

    table = _table(arena, handle, name, look)
    kind, _, action = symbol.removeprefix(PREFIX).partition("_")
    x = [row[0] for row in table.cells]
    if action in ("minimumTime", "minimumAbscissa"):
        return x[0]
    if action in ("maximumTime", "maximumAbscissa"):
        return x[-1]
    if kind == "CombiTable1D" and action == "getValue":
        u = ca.SX(arguments[2])
        if table.extrapolation == PERIODIC:
            u = u - _period(table) * ca.floor((u - x[0]) / _period(table))
        return _value(table, int(number(arguments[1])), u, [u >= each for each in x])
    if kind == "CombiTimeTable" and action in ("getValue", "nextTimeEvent"):
        start, shift = _times(table, look)
        if action == "nextTimeEvent":
            return _next(table, ca.SX(arguments[1]), start, shift)
        event = ca.SX(arguments[3]) - shift
        time = ca.fmin(ca.SX(arguments[2]) - shift, event)  # what comes then has not come yet
        begun = event > start - shift
        if table.extrapolation == PERIODIC:
            # The next event lies in the present cycle, or ends it.
            past = _period(table) * (ca.ceil((event - x[0]) / _period(table) - ROUNDING) - 1)
            time, event = time - past, event - past
        within = ROUNDING * _period(table)
        value = _value(table, int(number(arguments[1])), time, [event > each + within for each in x])
        return ca.if_else(begun, value, 0)
    raise ModelicaError(f"{name}: the table function {symbol} is not supported; use CombiTable1Ds or CombiTimeTable")


def _table(arena: Arena, handle: int, name: str, look: Look) -> Table:
    entry = next((entry for entry in arena.tables if entry["id"] == handle), None)
    if entry is None:
        raise ModelicaError(f"the front end gives no data of {name}")
    rows = entry["data"]
    if len(rows) > MOST_ROWS:
        raise ModelicaError(f"{name}: {len(rows)} rows are too many for a formula; at most {MOST_ROWS} are supported")
    if entry["smoothness"] not in (LINEAR, CONSTANT):
        raise ModelicaError(f"{name}: smooth tables are not supported; take Smoothness.LinearSegments")
    if entry["extrapolation"] not in (HOLD, GO_ON, PERIODIC):
        raise ModelicaError(f"{name}: take Extrapolation.HoldLastPoint, LastTwoPoints or Periodic")
    written = look("table")
    # A table that was read from a file is no parameter.
    cells = written.tolist() if written is not None and shape_of(written) == (len(rows), len(rows[0])) else rows
    return Table(name, rows, cells, entry["columns"], entry["smoothness"], entry["extrapolation"])


def _times(table: Table, look: Look) -> tuple[Value, Value]:
    """When a time table begins, and by how much it is shifted, in its own time."""
    if look("timeEvents") not in (None, ALWAYS):
        raise ModelicaError(f"{table.name}: take TimeEvents.Always; others are not supported")
    scale, start, shift = look("timeScale"), look("startTime"), look("shiftTime")
    if scale is None or start is None or shift is None:
        raise ModelicaError(f"{table.name} belongs to no CombiTimeTable, so its start is not known; use that block")
    return start / scale, shift / scale


def _period(table: Table) -> Value:
    return table.cells[-1][0] - table.cells[0][0]


def _value(table: Table, output: int, u: ca.SX, passed: Sequence[ca.SX]) -> ca.SX:
    """A column at `u`; `passed` tells of each row whether its jump, if it is one, lies behind."""
    column = int(table.columns[output - 1]) - 1
    x, y = [row[0] for row in table.cells], [row[column] for row in table.cells]
    jumps = [table.rows[k + 1][0] <= table.rows[k][0] for k in range(len(x) - 1)]
    found = ca.SX(y[0])
    for k, jump in enumerate(jumps):
        if jump or table.smoothness == CONSTANT:
            found += ca.if_else(passed[k + 1], y[k + 1] - y[k], 0)
        else:
            found += (y[k + 1] - y[k]) / (x[k + 1] - x[k]) * (ca.fmin(ca.fmax(u, x[k]), x[k + 1]) - x[k])
    if table.extrapolation == GO_ON and jumps:
        for k, beyond in ((0, ca.fmin(u - x[0], 0)), (len(x) - 2, ca.fmax(u - x[-1], 0))):
            found += 0 if jumps[k] else (y[k + 1] - y[k]) / (x[k + 1] - x[k]) * beyond
    return found


def _next(table: Table, time: ca.SX, start: Value, shift: Value) -> ca.SX:
    """The next row after a time, or the start before it."""
    past: Value = 0
    if table.extrapolation == PERIODIC:
        past = _period(table) * ca.floor((time - shift - table.cells[0][0]) / _period(table) + ROUNDING)
    found = ca.SX(NEVER)
    for row in reversed(table.cells):
        instant = row[0] + shift + past
        found = ca.if_else(time + ROUNDING * _period(table) < instant, instant, found)
    return ca.if_else(time < start, start, found)
