"""Where a model is solved for accelerations, a missing force acts through the forces that it sums up, or through an input."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel, find_modelica_model
from fmus.symbolic.system import SymbolicSystem
from orchestrator.greybox.effects import with_effects
from orchestrator.verdicts.result import Estimate, NamedEffect

HEAD = """
  parameter Real M(unit="kg") = 0.8;
  parameter Real m(unit="kg") = 0.2;
  parameter Real l(unit="m") = 0.3;
  parameter Real J(unit="kg.m2") = 0.024;
  input Real F(unit="N");
  output Real x(unit="m", start=0, fixed=true);
  output Real th(unit="rad", start=3, fixed=true);
  Real v(unit="m/s", start=0, fixed=true);
  Real w(unit="rad/s", start=0, fixed=true);
"""
IMPLICIT = """
equation
  der(x) = v;
  der(th) = w;
  (M + m)*der(v) + m*l*cos(th)*der(w) = F + m*l*w^2*sin(th);
  m*l*cos(th)*der(v) + J*der(w) = 9.81*m*l*sin(th);
"""
FORCES = """
  Real D(unit="kg2.m2");
  Real fx(unit="N");
  Real tau(unit="N.m");
equation
  der(x) = v;
  der(th) = w;
  D = (M + m)*J - (m*l*cos(th))^2;
  fx = F + m*l*w^2*sin(th);
  -tau = 9.81*m*l*sin(th);
  der(v) = (J*fx + m*l*cos(th)*tau)/D;
  der(w) = (-(M + m)*tau - m*l*cos(th)*fx)/D;
"""
SOLVED = """
  Real D(unit="kg2.m2");
equation
  der(x) = v;
  der(th) = w;
  D = (M + m)*J - (m*l*cos(th))^2;
  der(v) = (J*(F + m*l*w^2*sin(th)) - m*l*cos(th)*9.81*m*l*sin(th))/D;
  der(w) = ((M + m)*9.81*m*l*sin(th) - m*l*cos(th)*(F + m*l*w^2*sin(th)))/D;
"""


def model(folder: Path, equations: str, head: str = HEAD) -> ModelicaModel:
    file = folder / "Cart.mo"
    file.write_text(f'model Cart "Cart and pole"{head}{equations}end Cart;\n')
    return find_modelica_model(f"{file}:Cart")


def rates(system: SymbolicSystem, inputs: dict[str, float], states: dict[str, float]) -> dict[str, float]:
    x, u = [states[v.name] for v in system.states], [inputs.get(v.name, 0.0) for v in system.inputs]
    p = [v.start or 0.0 for v in system.parameters]
    dx = np.array(system.rhs(0.0, x, u, np.zeros(system.n_delays), p)[0]).ravel()
    return dict(zip((v.name for v in system.states), dx, strict=True))


AT = {"x": 0.1, "th": 0.7, "v": 0.4, "w": -1.5}


@pytest.mark.parametrize(("equations", "states"), [(FORCES, ("v", "w")), (SOLVED, ("v",))])
def test_a_force_at_a_balance_does_what_it_does_in_the_implicit_form(
    tmp_path: Path, equations: str, states: tuple[str, ...]
) -> None:
    (tmp_path / "implicit").mkdir()
    (tmp_path / "solved").mkdir()
    implicit, truth = model(tmp_path / "implicit", IMPLICIT).balanced()
    solved, balances = model(tmp_path / "solved", equations).balanced()
    for state in states:
        balance, right = (next(b for b in found if b.state == state) for found in (balances, truth))
        assert balance.unit == right.unit
        assert rates(solved, {balance.input: 0.3, "F": 1.0}, AT) == pytest.approx(
            rates(implicit, {right.input: 0.3, "F": 1.0}, AT)
        )


def test_a_force_between_two_bodies_is_no_force_on_one_of_them(tmp_path: Path) -> None:
    head = """
  parameter Real m(unit="kg") = 2;
  input Real F(unit="N");
  Real p(unit="N") = 3*(x - y);
  output Real x(unit="m", start=0, fixed=true);
  output Real y(unit="m", start=0, fixed=true);
  Real v(unit="m/s", start=0, fixed=true);
  Real w(unit="m/s", start=0, fixed=true);
"""
    equations = "equation\n  der(x) = v;\n  der(y) = w;\n  der(v) = (F - p)/m;\n  der(w) = (p - F)/(3*m);\n"

    system, balances = model(tmp_path, equations, head).balanced()

    assert {b.state: b.force for b in balances} == {"v": "", "w": ""}
    for balance in balances:
        moved, still = (rates(system, given, dict.fromkeys("xyvw", 0.2)) for given in ({balance.input: 1.0}, {}))
        assert {k for k in moved if moved[k] != still[k]} == {balance.state}


@pytest.mark.parametrize(("load", "place"), [("tau", "tau"), ("3*tau", "")])
def test_torques_on_either_side_of_a_gear_do_not_tell_which_of_them_is_the_shafts(
    tmp_path: Path, load: str, place: str
) -> None:
    head = """
  input Real u(unit="N.m");
  Real tau(unit="N.m") = u - 0.1*sin(phi);
  Real drag(unit="N.m") = 0.2*cos(phi);
  output Real phi(unit="rad", start=0, fixed=true);
  Real w(unit="rad/s", start=0, fixed=true);
  parameter Real J(unit="kg.m2") = 2;
"""

    _, balances = model(tmp_path, f"equation\n  der(phi) = w;\n  der(w) = ({load} - drag)/J;\n", head).balanced()

    assert [b.force for b in balances] == [place]


@pytest.mark.parametrize(
    ("equations", "site", "unit", "sum_of_forces"),
    [(FORCES, "x", "N", "fx"), (FORCES, "th", "N.m", "-tau"), (SOLVED, "x", "N", "Real FActual")],
)
def test_friction_is_written_where_the_forces_are_summed_up(
    tmp_path: Path, equations: str, site: str, unit: str, sum_of_forces: str
) -> None:
    base = model(tmp_path, equations)
    damping = Estimate(0.5, f"{unit}.s/{'m' if site == 'x' else 'rad'}", (0.5, 0.5))
    friction = NamedEffect("viscous_friction", site, {"b": damping})

    better = with_effects(base, [friction], "Better", tmp_path / "out")

    (tmp_path / "implicit").mkdir()
    implicit, balances = model(tmp_path / "implicit", IMPLICIT).balanced()
    speed = {"x": "v", "th": "w"}[site]
    force = {next(b.input for b in balances if b.state == speed): -0.5 * AT[speed]}
    assert rates(better.compile(), {"F": 1.0}, AT) == pytest.approx(rates(implicit, {"F": 1.0, **force}, AT))
    (line,) = (line for line in better.file.read_text().splitlines() if "viscous1_" in line and "*" in line)
    assert line.strip().startswith(sum_of_forces)
