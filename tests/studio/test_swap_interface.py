"""Rows of the swap view: every property that differs, once, and weighed as a caller would weigh it."""

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.cosim.component import Port
from orchestrator.cosim.swap import Side, compare_interfaces
from orchestrator.studio.swap_interface import Row, interface_rows
from orchestrator.studio.swap_result import interface_table, signals_table, speed_table, verdict

PORT = Port("x", "parameter", unit="m", start=1.0, variability="tunable")


def rows(old: list[Port], new: list[Port]) -> list[Row]:
    used = {port.name: "used" for port in old}
    return interface_rows(old, new, compare_interfaces("c", Side("old", old), Side("new", new), used).matches)


@given(st.lists(st.sampled_from("abcdef"), unique=True, max_size=6))
def test_an_interface_does_not_differ_from_itself(names: list[str]) -> None:
    ports = [replace(PORT, name=name) for name in names]

    assert rows(ports, ports) == []


@pytest.mark.parametrize(
    ("changed", "what", "old", "new", "breaking"),
    [
        ({"unit": "mm"}, "unit", "m", "mm", True),
        ({"start": 2.5}, "start", "1", "2.5", False),
        ({"variability": "fixed"}, "variability", "tunable", "fixed", True),
        ({"variability": "discrete"}, "variability", "tunable", "discrete", False),
        ({"type": "Float32"}, "type", "Float64", "Float32", True),
        ({"shape": (3,), "start": None}, "size", "1", "3", True),
    ],
)
def test_a_changed_property_is_one_row(changed: dict[str, Any], what: str, old: str, new: str, breaking: bool) -> None:
    found = rows([PORT], [replace(PORT, **changed)])

    assert Row("x", what, old, new, breaking) in found
    assert {row.what for row in found} <= {what, *changed}


def test_what_is_gone_breaks_and_comes_first_and_what_is_new_breaks_only_as_an_input_without_a_value() -> None:
    added = [Port("q", "output"), Port("u", "input", start=0.0), Port("v", "input")]
    found = rows([PORT], added)

    assert [(row.variable, row.old, row.new) for row in found if row.breaking] == [
        ("x", "parameter", "missing"),
        ("v", "missing", "input"),
    ]
    assert [row.breaking for row in found] == sorted((row.breaking for row in found), reverse=True)


def document(**changed: Any) -> dict[str, Any]:
    signal = {"name": "x", "unit": "m", "largest": 0.5, "largest_at": 2.0, "rms": 0.1, "spread": 2.0, "parted_at": 1.25}
    run = {"error": "", "seconds": 0.5, "preparing_s": 0.1, "times_real_time": 20.0}
    found = {"files": ["a.fmu", "b.fmu"], "rows": [], "signals": [signal], "stop": 10.0, "tolerance": 1e-3}
    return found | {"runs": [run, run | {"seconds": 0.25, "times_real_time": 40.0}]} | changed


def test_tables_say_when_by_how_much_and_how_fast() -> None:
    assert "outputs part first at 1.25 s, in x, which gets 500 mm apart." in verdict(document())
    assert signals_table(document()).rows == (("x", "1.25 s", "500 mm at 2 s", "100 mm", "25 %"),)
    assert [row[-1] for row in speed_table(document()).rows] == ["1.00 times", "0.500 times"]


def test_a_run_that_failed_and_values_that_are_no_numbers_are_told_in_words() -> None:
    signal = document()["signals"][0] | {"largest": "inf", "rms": "inf", "parted_at": 0.0}
    lost = document(signals=[signal], runs=[{"error": "it broke"}, document()["runs"][1]])

    assert speed_table(lost).rows[0] == ("a.fmu", "did not run", "", "", "")
    assert signals_table(lost).rows[0][1:3] == ("0 s", "∞ m at 2 s")


def test_differences_that_break_no_system_are_told_beside_those_that_do() -> None:
    port = {"variable": "x", "what": "start", "old": "1", "new": "none", "breaking": False}

    assert "fits where the old one is; 1 difference would break no system. They" in verdict(document(rows=[port]))
    both = verdict(document(rows=[port | {"breaking": True}, port]))
    assert "1 difference of the interfaces would break a system, 1 would not. They" in both


def test_long_tables_say_how_much_they_leave_out() -> None:
    row = {"variable": "x", "what": "unit", "old": "m", "new": "mm", "breaking": True}

    assert interface_table(document(rows=[row] * 250)).caption == "Differences of the interfaces; 50 more are not shown"
    assert "250 differences of the interfaces would break a system" in verdict(document(rows=[row] * 250))
