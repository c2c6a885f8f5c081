"""Tables of the Modelica Standard Library against NumPy's interpolation, by a library with the same functions as its own."""

import numpy as np
import pytest

from fmus.errors import ModelicaError
from fmus.symbolic.arena import Arena
from fmus.symbolic.tables import call

ROWS = [[0.0, 0.0], [0.5, 1.0], [0.5, 3.0], [1.0, 2.0]]
NAMES = ("table", "timeScale", "startTime", "shiftTime")


def arena(extrapolation: int, smoothness: int = 1) -> Arena:
    """A model that is nothing but one table, named `a.tableID`, and the parameters of its block."""
    variables = [{"name": f"a.{name}", "attributes": {}} for name in NAMES]
    variables.append({"name": "a.tableID", "attributes": {"binding": 0}})
    nothing = {"nodes": [{"literal": {"integer": 1}}], "operands": [], "subscripts": [], "provenance": []}
    table = {"id": 1, "data": ROWS, "columns": [2], "smoothness": smoothness, "extrapolation": extrapolation}
    storage = {"variables": variables, "functions": [], "expressions": nothing}
    return Arena({"schema_version": 43, "storage": storage, "source_map": {"files": []}, "external_tables": [table]})


def parameter(start: float) -> object:
    cells = np.empty((4, 2), dtype=object)
    cells[:] = ROWS
    return lambda index: (cells, 1.0, start, start)[index]


@pytest.mark.parametrize(
    ("extrapolation", "u", "value"), [(1, -1, 0), (1, 2, 2), (2, -1, -2), (2, 2, 0), (3, 1.75, 2.5), (3, -0.75, 0.5)]
)
def test_outside_a_table_holds_goes_on_or_repeats(extrapolation: int, u: float, value: float) -> None:
    found = call(arena(extrapolation), "ModelicaStandardTables_CombiTable1D_getValue", [1, 1, u], parameter(0.0))  # type: ignore[arg-type]
    assert float(found) == pytest.approx(value)


@pytest.mark.parametrize("u", [0.0, 0.2, 0.499, 0.501, 0.8, 1.0])
def test_between_rows_a_table_is_a_line(u: float) -> None:
    expected = np.interp(u, [0, 0.5], [0, 1]) if u < 0.5 else np.interp(u, [0.5, 1], [3, 2])
    found = call(arena(1), "ModelicaStandardTables_CombiTable1D_getValue", [1, 1, u], parameter(0.0))  # type: ignore[arg-type]
    assert float(found) == pytest.approx(float(expected))


def test_constant_segments_hold_the_row_before() -> None:
    values = [
        float(call(arena(1, 3), "ModelicaStandardTables_CombiTable1D_getValue", [1, 1, u], parameter(0.0)))  # type: ignore[arg-type]
        for u in (0.2, 0.7, 1.0)
    ]
    assert values == [0.0, 3.0, 2.0]


@pytest.mark.parametrize(
    ("extrapolation", "steps"), [(1, [0.25, 0.5, 1.0, 1e60]), (3, [0.25, 0.5, 1.0, 1.5, 2.0, 2.5])]
)
def test_a_time_table_jumps_at_its_events_and_nowhere_else(extrapolation: int, steps: list[float]) -> None:
    """Between events the side of a jump is that of the next event, wherever an integrator tries."""
    model, look, begin = arena(extrapolation), parameter(0.0), 0.25
    for event in steps[1:]:
        found = call(model, "ModelicaStandardTables_CombiTimeTable_nextTimeEvent", [1, begin], look)  # type: ignore[arg-type]
        assert float(found) == pytest.approx(event)
        begin = event
    # Where an integrator has gone too far it meets the value of the event, as in the library's C code.
    for time, event, value in ((0.5, 0.5, 1.0), (0.7, 0.5, 1.0), (0.5, 1.0, 3.0), (0.6, 1.0, 2.8)):
        found = call(model, "ModelicaStandardTables_CombiTimeTable_getValue", [1, 1, time, event, event], look)  # type: ignore[arg-type]
        assert float(found) == pytest.approx(value)


def test_a_time_table_is_zero_before_its_start() -> None:
    model, look = arena(1), parameter(2.0)
    assert float(call(model, "ModelicaStandardTables_CombiTimeTable_nextTimeEvent", [1, 0.0], look)) == 2.0  # type: ignore[arg-type]
    for time, event, value in ((1.0, 2.0, 0.0), (2.25, 2.5, 0.5)):
        found = call(model, "ModelicaStandardTables_CombiTimeTable_getValue", [1, 1, time, event, event], look)  # type: ignore[arg-type]
        assert float(found) == pytest.approx(value)


def test_smooth_tables_are_refused_with_the_rewrite() -> None:
    with pytest.raises(
        ModelicaError, match=r"^a\.tableID: smooth tables are not supported; take Smoothness\.LinearSegments$"
    ):
        call(arena(1, 2), "ModelicaStandardTables_CombiTable1D_getValue", [1, 1, 0.0], parameter(0.0))  # type: ignore[arg-type]


def test_the_rows_of_a_table_are_the_parameter_that_its_block_hands_over() -> None:
    """A clutch calls its table mu_pos; one that follows from an expression is what it was when the model was built."""
    model, cells = arena(1), np.empty((4, 2), dtype=object)
    cells[:] = np.array(ROWS) * [1, 2]
    model.variables.append({"name": "a.mu_pos", "attributes": {}})
    parameter = {"VarRef": {"name": {"name": "a.mu_pos"}, "subscripts": []}}
    for rows, value in ((parameter, 1.6), ({"Binary": {"op": "Mul"}}, 0.8)):
        model._flat = {"a.tableID": {"binding": {"FunctionCall": {"args": [None, None, rows]}}}}
        found = call(model, "ModelicaStandardTables_CombiTable1D_getValue", [1, 1, 0.4], {5: cells}.__getitem__)
        assert float(found) == pytest.approx(value)
