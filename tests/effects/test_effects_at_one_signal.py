"""Two effects at one sensor or one input are written one behind the other, in their order."""

from pathlib import Path

import pytest

from fmus.catalogue import ModelicaModel, find_modelica_model
from orchestrator.greybox.effects import with_effects
from orchestrator.verdicts.result import Estimate, NamedEffect

OVEN = """model Oven
  parameter Real C(unit="J/K") = 500;
  parameter Real G(unit="W/K") = 2;
  input Real P(unit="W");
  output Real T(unit="K", start=300, fixed=true);
equation
  C*der(T) = P - G*(T - 300);
end Oven;
"""


@pytest.fixture
def oven(tmp_path: Path) -> ModelicaModel:
    (tmp_path / "Oven.mo").write_text(OVEN)
    return find_modelica_model(f"{tmp_path / 'Oven.mo'}:Oven")


def effect(name: str, site: str, **values: tuple[float, str]) -> NamedEffect:
    return NamedEffect(name, site, {k: Estimate(v, unit, (v, v)) for k, (v, unit) in values.items()})


def test_a_sensor_with_a_wrong_gain_and_a_wrong_zero_shows_both(oven: ModelicaModel) -> None:
    gain = effect("joint_scale", "sensor:T", k=(0.1, "1"))
    zero = effect("joint_offset", "sensor:T", offset=(5.0, "K"))
    for effects, expected in (((gain, zero), 1.1 * 320.0 + 5.0), ((zero, gain), 1.1 * (320.0 + 5.0))):
        system = with_effects(oven, effects, "Read").compile()
        z = system.rhs(0.0, [320.0], [0.0], [], [v.start for v in system.parameters])[1]
        shown = {v.name: float(z[k]) for k, v in enumerate(system.algebraics)}
        assert shown["T"] == pytest.approx(expected)


def test_a_late_sensor_with_a_wrong_zero_lets_the_zero_stand_behind_the_delay(oven: ModelicaModel) -> None:
    late = effect("sensor_lag", "sensor:T", share=(1.0, "1"), T=(20.0, "s"))
    zero = effect("joint_offset", "sensor:T", offset=(5.0, "K"))
    system = with_effects(oven, [late, zero], "Late").compile()
    p = [v.start for v in system.parameters]
    x = [{"sensor1_z": 310.0}.get(v.name, 320.0) for v in system.states]
    rates, z = system.rhs(0.0, x, [0.0], [], p)
    shown = {v.name: float(z[k]) for k, v in enumerate(system.algebraics)}
    assert shown["T"] == pytest.approx(310.0 + 5.0)
    assert float(rates[[v.name for v in system.states].index("sensor1_z")]) == pytest.approx((320.0 - 310.0) / 20.0)


def test_a_late_input_with_a_wrong_gain_is_written(oven: ModelicaModel) -> None:
    late = effect("input_lag", "P", share=(1.0, "1"), T=(20.0, "s"))
    gain = effect("input_gain", "P", k=(0.1, "1"))
    system = with_effects(oven, [late, gain], "Pushed").compile()
    p, names = [v.start for v in system.parameters], [v.name for v in system.states]
    x = [{"T": 300.0}.get(name, 100.0) for name in names]
    rate = float(system.rhs(0.0, x, [0.0], [], p)[0][names.index("T")])
    assert rate == pytest.approx(1.1 * 100.0 / 500.0)


def test_a_slow_response_goes_with_the_input_as_the_plant_gets_it(oven: ModelicaModel) -> None:
    gain = effect("input_gain", "P", k=(0.1, "1"))
    slow = effect("relaxation", "P->T", gain=(0.2, "K/W"), T=(50.0, "s"))
    for effects in ((gain, slow), (slow, gain)):
        system = with_effects(oven, effects, "Stored").compile()
        p, names = [v.start for v in system.parameters], [v.name for v in system.states]
        own = next(k for k, name in enumerate(names) if name.endswith("_z"))
        x = [30.0 if k == own else 320.0 for k in range(len(names))]
        rates, z = system.rhs(0.0, x, [100.0], [], p)
        shown = {v.name: float(z[k]) for k, v in enumerate(system.algebraics)}
        assert float(rates[own]) == pytest.approx((1.1 * 100.0 - 30.0) / 50.0)
        assert shown["T"] == pytest.approx(320.0 + 0.2 * 30.0)
