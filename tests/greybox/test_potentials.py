"""Flows out of stores that go with a pressure, which is no multiple of what is stored."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from orchestrator.diagnose import diagnose
from orchestrator.greybox.effects import with_effects
from orchestrator.greybox.places import potential_places
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Estimate, NamedEffect

ACCUMULATOR = """model Accumulator
  parameter Real V0(unit = "m3") = 0.004;
  parameter Real p0(unit = "Pa") = 60e5;
  parameter Real K = 9e-8;
  input Real q(unit = "m3/s");
  Real Vg(unit = "m3", start = 0.003, fixed = true) "gas behind the bladder";
  Real p(unit = "Pa");
  output Real p_bar(unit = "bar");
equation
  p*Vg = p0*V0;
  der(Vg) = K*sqrt(p) - q;
  p_bar = p/1e5;
end Accumulator;
"""
CYLINDER = """model Cylinder
  parameter Real RT(unit = "J/kg") = 84000;
  input Real mdot(unit = "kg/s");
  Real x(unit = "m", start = 0.05, fixed = true);
  Real v(unit = "m/s", start = 0, fixed = true);
  Real m(unit = "kg", start = 1e-4, fixed = true);
  output Real p(unit = "Pa");
equation
  p*(3e-5 + 8e-4*x) = m*RT;
  der(x) = v;
  1.5*der(v) = (p - 1e5)*8e-4 - 1500*x;
  der(m) = mdot;
end Cylinder;
"""
TANK = """model Tank
  input Real q(unit = "m3/s");
  Real V(unit = "m3", start = 0.1, fixed = true);
  output Real p(unit = "Pa");
equation
  der(V) = q;
  p = 9810*V/0.2;
end Tank;
"""
VALVE, OPENS = 4e-11, 85e5


def written(folder: Path, text: str) -> ModelicaModel:
    name = text.split()[1]
    (folder / f"{name}.mo").write_text(text)
    return ModelicaModel(name, name, folder / f"{name}.mo")


@pytest.mark.parametrize(
    ("text", "expected"),
    [(ACCUMULATOR, [("p", "balance(Vg)", -1.0)]), (CYLINDER, [("p", "balance(m)", 1.0)]), (TANK, [])],
)
def test_a_leak_empties_a_gas_chamber_and_fills_the_gas_behind_a_bladder_and_a_tank_has_its_volume_alone(
    text: str, expected: list[tuple[str, str, float]], tmp_path: Path
) -> None:
    found = potential_places(*written(tmp_path, text).balanced())
    assert [(place.site, *sign) for place in found for sign in place.adds.items()] == expected


def test_what_one_input_alone_fills_is_a_store_that_may_leak(tmp_path: Path) -> None:
    _, (balance,) = written(tmp_path, TANK).balanced()
    assert (balance.state, balance.unit) == ("V", "m3/s")


def rate(Vg: float, q: float) -> float:
    p = 60e5 * 0.004 / Vg
    return 9e-8 * np.sqrt(p) - q + VALVE * max(p - OPENS, 0.0)


def relief_record(folder: Path) -> Path:
    """Trials of an accumulator with a relief valve under held flows, by Runge and Kutta's steps."""
    random, step = np.random.default_rng(3), 0.05
    for number in (1, 2, 3):
        flow = np.repeat(random.uniform(1e-4, 5e-4, 20), 20)
        gas, shown = 0.003, []
        for q in flow:
            shown.append(60e5 * 0.004 / gas / 1e5)
            for _ in range(10):
                h = step / 10
                a = rate(gas, q)
                b = rate(gas + h / 2 * a, q)
                c = rate(gas + h / 2 * b, q)
                gas += h / 6 * (a + 2 * b + 2 * c + rate(gas + h * c, q))
        read = np.round(np.array(shown) + 0.15 * random.standard_normal(len(flow)), 1)
        rows = np.column_stack([step * np.arange(len(flow)), flow, read])
        np.savetxt(folder / f"run_{number}.csv", rows, delimiter=",", header="time,q,p_bar", comments="", fmt="%.6g")
    return folder


def test_a_relief_valve_is_an_overflow_above_a_pressure(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()

    found = diagnose(written(tmp_path, ACCUMULATOR), load_measurements(relief_record(tmp_path / "data")), workers=1)

    assert found.verdict == "named"
    assert [(effect.id, effect.site) for effect in found.effects] == [("overflow", "p")]
    assert found.effects[0].parameters["k"].value == pytest.approx(VALVE, rel=0.05)
    assert found.effects[0].parameters["xTop"].value == pytest.approx(OPENS, rel=0.01)


def test_the_model_with_a_relief_valve_speaks_of_the_pressure_and_moves_as_the_algebra_says(tmp_path: Path) -> None:
    values = {"k": Estimate(VALVE, "m3/(s.Pa)", (VALVE, VALVE)), "xTop": Estimate(OPENS, "Pa", (OPENS, OPENS))}

    added = with_effects(written(tmp_path, ACCUMULATOR), [NamedEffect("overflow", "p", values)], "WithValve", tmp_path)

    assert "max(p - overflow1_xTop, 0)" in (tmp_path / "WithValve.mo").read_text()
    system = added.compile()
    found, _ = system.rhs(0.0, [0.002], [3e-4], [], [v.start for v in system.parameters])
    assert float(found) == pytest.approx(rate(0.002, 3e-4), rel=1e-9)
