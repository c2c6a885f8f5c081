"""Which relations of a Modelica model make events, and that its FMU passes them where the closed form says."""

import math
from pathlib import Path

import fmpy  # type: ignore[import-untyped]
import numpy as np
import pytest
from helpers_slave import Slave

from fmus.catalogue import ModelicaModel
from fmus.package import build_fmu
from fmus.symbolic.store import from_bytes, to_bytes
from fmus.symbolic.system import SymbolicSystem


def compiled(text: str, folder: Path) -> SymbolicSystem:
    file = folder / "Probe.mo"
    file.write_text(text)
    return ModelicaModel("Probe", "Probe", file).compile()


KINDS = """model Probe
  parameter Real k = 2;
  parameter Real late = 0.5;
  input Real u;
  Real x(start=0, fixed=true);
  Real y;
  Real z;
protected
  function f input Real a; output Real b; algorithm b := if a > 0 then a else 0; end f;
equation
  der(x) = f(x) + noEvent(if u > 4 then u else 0) + smooth(0, if u > 3 then u - 3 else 0) + (if k > 1 then 1 else 0);
  y = if x < 1 and time >= late then 1 else (if 2*time > 1 then u else abs(u));
  z = if y <= u*time then 1 else max(x, 0);
end Probe;
"""


def test_relations_of_equations_make_events_and_no_others(tmp_path: Path) -> None:
    relations = compiled(KINDS, tmp_path).relations
    assert relations is not None
    assert relations.names == (
        "'x < 1' (Probe.mo:12)",
        "'y <= u*time' (Probe.mo:13)",
        "'time >= late' (Probe.mo:12)",
        "'2*time > 1' (Probe.mo:12)",
    )
    assert relations.holds_at_zero == (False, True)
    times, rising = relations.times([2.0, 0.75])
    assert times.full().ravel().tolist() == [0.75, 0.5]
    assert rising.full().ravel().tolist() == [1.0, 1.0]


def test_with_its_relations_as_they_stand_the_frozen_model_is_the_plain_one(tmp_path: Path) -> None:
    system = compiled(KINDS, tmp_path)
    assert system.relations is not None
    rng = np.random.default_rng(7)
    for t, x, u in rng.uniform(-1.0, 2.0, (50, 3)).tolist():
        plain = system.rhs(t, x, u, [], [2.0, 0.5])
        y = float(plain[1][0])
        sides = [float(side) for side in (x < 1, y <= u * t, t >= 0.5, 2 * t > 1)]
        frozen = system.relations.rhs(t, x, u, [], [2.0, 0.5], sides)
        assert [v.full().tolist() for v in frozen] == [v.full().tolist() for v in plain]
        g, size = system.relations.indicators(t, x, u, [], [2.0, 0.5], sides)
        assert [bool(value) for value in g.full().ravel() > 0] == [bool(side) for side in sides[:2]]
        assert np.all(size.full() >= np.abs(g.full()))


def test_a_stored_system_keeps_its_relations(tmp_path: Path) -> None:
    system = compiled(KINDS, tmp_path)
    again = from_bytes(to_bytes(system))
    assert again.relations is not None
    assert system.relations is not None
    assert again.relations.names == system.relations.names
    assert again.relations.holds_at_zero == system.relations.holds_at_zero
    assert str(again.relations.rhs) == str(system.relations.rhs)


def test_a_model_without_such_relations_has_none(tmp_path: Path) -> None:
    smooth = "model Probe Real x(start=1, fixed=true); equation der(x) = -noEvent(if x > 0 then x else 0); end Probe;"
    assert compiled(smooth, tmp_path).relations is None


THERMOSTAT = """model Probe "A room that is heated below 20 degC in the first half of each test, with a threshold in a loop"
  parameter Real power = 3 "K/s";
  parameter Real off = 2 "s";
  Real T(start=18, fixed=true);
  Real heat;
  output Real y;
equation
  heat = if T < 20 and time < off then power else 0;
  der(T) = heat - (if T > 19 then 1 else 0);
  y = T;
end Probe;
"""


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_state_and_time_events_come_together(tmp_path: Path, kind: str, version: str) -> None:
    """Up by 3 K/s to 19 at 1/3 s, then by 2 K/s until the heating ends at 0.75 s, then down by 1 K/s to 19, where it
    stays: there it does not slide, for at 19 and below the slope is zero."""
    fmu = build_fmu(compiled(THERMOSTAT, tmp_path), tmp_path / "probe.fmu", fmi_version=version, tolerance=1e-10)
    result = fmpy.simulate_fmu(
        str(fmu),
        fmi_type=kind,
        stop_time=3.0,
        output_interval=0.05,
        start_values={"off": 0.75},
        relative_tolerance=1e-10,
        record_events=False,
    )
    t = result["time"]
    top = 19 + 2 * (0.75 - 1 / 3)
    exact = np.select(
        [t <= 1 / 3, t <= 0.75, t <= 0.75 + (top - 19)], [18 + 3 * t, 19 + 2 * (t - 1 / 3), top - (t - 0.75)], 19.0
    )
    assert np.abs(result["y"] - exact).max() < 1e-9


def test_a_relay_switches_at_the_time_of_the_closed_form(tmp_path: Path) -> None:
    """`der(x) = -x` from 2 and, at x = 1, `der(x) = -3`: the switch is at ln 2, the zero a third of a second later."""
    text = (
        "model Probe Real x(start=2, fixed=true); output Real s(start=0, fixed=true); equation "
        "der(x) = if x > 1 then -x else -3; der(s) = if x > 0 then 1 else 0; end Probe;"
    )
    fmu = build_fmu(compiled(text, tmp_path), tmp_path / "probe.fmu", tolerance=1e-10)
    result = fmpy.simulate_fmu(str(fmu), stop_time=2.0, output_interval=0.5, record_events=False)
    assert result["s"][-1] == pytest.approx(math.log(2) + 1 / 3, abs=1e-9)


DELAYED = (
    "model Probe parameter Real T = 0.1; input Real u; output Real x(start=0, fixed=true); "
    "equation der(x) = if delay(u, T) > 0.5 then 1 else 0; end Probe;"
)


def test_in_co_simulation_a_relation_of_a_delayed_input_switches_as_much_later(tmp_path: Path) -> None:
    """A ramp u = t passes 0.5 at 0.5 s, its delayed copy at 0.6 s; a jump at 1.25 s counts at 1.35 s."""
    fmu = build_fmu(compiled(DELAYED, tmp_path), tmp_path / "probe.fmu", tolerance=1e-10)
    with Slave(fmu, tmp_path / "fmu").start() as slave:
        for _ in range(5):
            slave.slope(u=1.0)
            slave.step(0.25)
        slave.set(u=0.0)
        slave.step(0.5)
        assert slave.get("x") == pytest.approx(1.35 - 0.6, abs=1e-9)


def test_in_model_exchange_a_relation_of_a_delayed_input_switches_as_much_later(tmp_path: Path) -> None:
    fmu = build_fmu(compiled(DELAYED, tmp_path), tmp_path / "probe.fmu", tolerance=1e-10)
    ramp = np.array([(0.0, 0.0), (1.25, 1.25), (1.25, 0.0), (2.0, 0.0)], dtype=[("time", float), ("u", float)])
    result = fmpy.simulate_fmu(
        str(fmu),
        fmi_type="ModelExchange",
        stop_time=2.0,
        output_interval=0.125,
        input=ramp,
        relative_tolerance=1e-10,
        record_events=False,
    )
    assert result["x"][-1] == pytest.approx(1.35 - 0.6, abs=1e-9)


def test_relations_beside_equations_that_need_iteration(tmp_path: Path) -> None:
    """`y + y^3 = k` with k = 10 (y = 2) until x = y x passes 1 at t = 0.5, then k = 2 (y = 1)."""
    text = (
        "model Probe Real x(start=0, fixed=true); output Real y(start=1); Real k; "
        "equation k = if x < 1 then 10 else 2; y + y^3 = k; der(x) = y; end Probe;"
    )
    fmu = build_fmu(compiled(text, tmp_path), tmp_path / "probe.fmu", tolerance=1e-10)
    result = fmpy.simulate_fmu(str(fmu), stop_time=1.0, output_interval=0.25, output=["x", "y"], record_events=False)
    assert result["x"] == pytest.approx([0.0, 0.5, 1.0, 1.25, 1.5], abs=1e-9)
    assert result["y"][[0, 1, 3, 4]] == pytest.approx([2.0, 2.0, 1.0, 1.0], abs=1e-9)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_directional_derivatives_are_those_of_the_side_taken(tmp_path: Path, version: str) -> None:
    """`der(x) = if u > 1 then u^2 x else -x`: by x and u it has 4 and 12 at x = 3, u = 2, and -1 and 0 at u = 0."""
    text = (
        "model Probe input Real u; output Real x(start=3, fixed=true); "
        "equation der(x) = if u > 1 then u^2*x else -x; end Probe;"
    )
    fmu = build_fmu(compiled(text, tmp_path), tmp_path / "probe.fmu", fmi_version=version)
    description = fmpy.read_model_description(str(fmu))
    reference = {v.name: v.valueReference for v in description.modelVariables}
    slave = fmpy.instantiate_fmu(fmpy.extract(str(fmu), str(tmp_path / "fmu")), description, "CoSimulation")
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    unknowns, knowns = [reference["der(x)"]], [reference["x"], reference["u"]]
    try:
        for u, by_x, by_u in ((2.0, 4.0, 12.0), (0.0, -1.0, 0.0)):
            (slave.setReal if version == "2.0" else slave.setFloat64)([reference["u"]], [u])
            for seed, expected in (([1.0, 0.0], by_x), ([0.0, 1.0], by_u)):
                assert list(slave.getDirectionalDerivative(unknowns, knowns, seed)) == [expected]
            if version == "3.0":
                assert list(slave.getAdjointDerivative(unknowns, knowns, [1.0], 2)) == [by_x, by_u]
    finally:
        slave.freeInstance()


@pytest.mark.parametrize(
    ("number", "relation", "before"),
    [
        ("if x > 1 then 2 else 1", "n >= 2", False),
        ("if x > 1 then 2 else 3", "n <= 2", False),
        ("if x > 1 then 2 else 3", "n > 2", True),
        ("integer(2*x)", "n >= 2", False),
        ("(if x > 1 then 1 else 0) + (if x > 0.9 then 1 else 0)", "n >= 2", False),
    ],
)
def test_a_relation_of_whole_numbers_turns_where_they_jump_onto_its_limit(
    number: str, relation: str, before: bool, tmp_path: Path
) -> None:
    """What is compared is exactly zero from there on, without ever having crossed it."""
    text = "model M Real x(start=0.7, fixed=true); Integer n; output Real y; equation der(x) = 1; n = {}; y = if {} then 1 else 0; end M;"
    (tmp_path / "M.mo").write_text(text.format(number, relation))
    relations = ModelicaModel("M", "M", tmp_path / "M.mo").compile().relations
    assert relations is not None

    def holds(x: float) -> float:
        sides = np.zeros(relations.n_indicators)
        for _ in range(4):
            sides = (np.array(relations.indicators(0.0, [x], [], [], [], sides)[0]).ravel() > 0).astype(float)
        return float(relations.rhs(0.0, [x], [], [], [], sides)[1][-1])

    assert [holds(0.7), holds(1.001), holds(1.3)] == [float(before), float(not before), float(not before)]
