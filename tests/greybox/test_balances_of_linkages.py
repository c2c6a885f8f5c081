"""Each joint of a linkage has the balance equation that it drives, whatever its mass matrix couples."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import built_in_models, find_modelica_model
from fmus.symbolic.system import SymbolicSystem

TORQUES = {"linkage.w[1]": "correction_q1", "linkage.w[2]": "correction_q2"}


def rates(system: SymbolicSystem, forces: dict[str, float], state: list[float]) -> np.ndarray:
    u = [forces.get(v.name, 0.0) for v in system.inputs]
    parameters = [v.start or 0.0 for v in system.parameters]
    return np.array(system.rhs(0.0, state, u, np.zeros(system.n_delays), parameters)[0]).ravel()


@pytest.mark.parametrize("angle", [0.0, 2.0])
def test_a_force_at_the_balance_of_a_joint_is_a_torque_at_that_joint(angle: float) -> None:
    # Near the stretched pose the first equation holds more of the second acceleration than the second equation does.
    system, balances = built_in_models()["double-pendulum"].balanced()
    assert {b.state for b in balances} == set(TORQUES)
    state = [0.1, angle, 0.0, 0.0]
    for balance in balances:
        added = rates(system, {balance.input: 1.0}, state)
        np.testing.assert_allclose(added, rates(system, {TORQUES[balance.state]: 1.0}, state), rtol=1e-9)


def test_a_model_without_states_has_no_balance(tmp_path: Path) -> None:
    file = tmp_path / "Gain.mo"
    file.write_text(
        'model Gain\n  input Real u(unit="V");\n  output Real y(unit="V");\nequation\n  y = 2*u;\nend Gain;\n'
    )
    assert find_modelica_model(f"{file}:Gain").balanced()[1] == ()


def test_a_drum_is_driven_by_torques_although_its_ropes_force_holds_more_of_its_acceleration(tmp_path: Path) -> None:
    file = tmp_path / "Winch.mo"
    file.write_text(
        "model Winch\n"
        '  parameter Real J(unit = "kg.m2") = 0.8;\n  parameter Real r(unit = "m") = 0.15;\n'
        '  parameter Real m(unit = "kg") = 60;\n  input Real tau(unit = "N.m");\n'
        '  Real w(unit = "rad/s", start = 0, fixed = true);\n  output Real S(unit = "N");\n'
        "equation\n  J*der(w) = tau - r*S;\n  S = m*(9.81 + r*der(w));\nend Winch;\n"
    )

    system, (balance,) = find_modelica_model(f"{file}:Winch").balanced()

    assert (balance.state, balance.unit) == ("w", "N.m")
    added = rates(system, {balance.input: 1.0}, [0.0]) - rates(system, {}, [0.0])
    assert added == pytest.approx([1 / (0.8 + 60 * 0.15**2)])
