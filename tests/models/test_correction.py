"""Correction residuals: the force that was added in secret is the force that is found."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.model_argument import with_forces
from orchestrator.models.correction import residual_system
from orchestrator.models.patch import Attachment, patched_model
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel

STEP = 0.004
TIME = np.arange(2000) * STEP
NOISE = np.array([1e-9, 1e-9])


def arm_inputs(torque: np.ndarray) -> np.ndarray:
    """Co-contracted muscles with slow changes, and a hidden torque (n, 2) in the correction inputs."""
    alpha = 0.3 + 0.15 * np.sin(2 * np.pi * 0.4 * TIME[:, None] + np.arange(6))
    return np.column_stack([alpha, np.zeros((len(TIME), 2)), torque])


def test_residual_of_the_arm_is_the_torque_that_was_hidden_in_its_motion() -> None:
    model = SymbolicModel("arm", find_modelica_model("arm").compile())
    hidden = np.column_stack([0.3 * np.sin(3 * TIME), 0.2 * np.cos(2 * TIME)])
    start = {"linkage.q[1]": 0.8, "linkage.q[2]": 1.2, "linkage.w[1]": 0.0, "linkage.w[2]": 0.0}
    motion = model.simulate(TIME, arm_inputs(hidden), ["q1", "q2"], start)

    plain = arm_inputs(np.zeros_like(hidden))
    trial = SmoothedTrial(TIME, plain, motion, NOISE)
    inputs = model.residual_inputs(trial)
    compiled = model.compiled_residual
    found = compiled.run(TIME, inputs, compiled.parameters, np.zeros(0)).outputs

    # Central differences of the motion at 250 Hz err by about step^2/12 of the fourth derivative.
    assert np.abs(trial.smoother(found) - hidden)[200:-200].max() < 0.01


def test_right_model_has_no_residual_force_at_all() -> None:
    system = find_modelica_model("rat-muscle").compile()
    model = SymbolicModel("rat-muscle", system)
    inputs = np.column_stack([(TIME > 1) * 0.8, 0.043 + 0.001 * np.sin(TIME), np.zeros(len(TIME))])
    force = model.simulate(TIME, inputs, ["force"], {})

    compiled = model.compiled_residual
    trial = SmoothedTrial(TIME, inputs, force, NOISE[:1])
    found = compiled.run(TIME, model.residual_inputs(trial), compiled.parameters, np.zeros(0))

    assert np.abs(found.outputs).max() < 1e-12


def test_hidden_states_stay_states_of_the_residual_and_measured_ones_become_inputs() -> None:
    system = find_modelica_model("arm").compile()
    residual = residual_system(system, ["q1", "q2"])
    assert residual is not None
    assert {name: (p.state, p.speed) for name, p in residual.positions.items()} == {
        "q1": ("linkage.q[1]", "linkage.w[1]"),
        "q2": ("linkage.q[2]", "linkage.w[2]"),
    }
    assert residual.system.states == ()
    names = [v.name for v in residual.system.inputs]
    assert not any(name.startswith("correction_") for name in names)
    assert names[-2:] == ["target:q1", "target:q2"]


def test_encoder_with_a_zero_and_a_scale_error_still_shows_the_true_position() -> None:
    arm = find_modelica_model("arm")
    attachments = [
        Attachment(
            "jointSensor1",
            "FESArm.Effects.JointSensor.JointOffset",
            {"offset": {"offset[1]": 0.01, "offset[2]": -0.02}},
        ),
        Attachment(
            "jointSensor2", "FESArm.Effects.JointSensor.JointScale", {"scale": {"scale[1]": 1.1, "scale[2]": 0.9}}
        ),
    ]
    system = patched_model(arm, "BadEncoders", attachments).compile()

    residual = residual_system(system, ["q1", "q2"])

    assert residual is not None
    p = [parameter.start for parameter in system.parameters]
    found = {name: (float(m.scale(p)), float(m.offset(p))) for name, m in residual.positions.items()}
    # reading = scale (angle + offset)
    np.testing.assert_allclose(found["q1"], (1.1, 1.1 * 0.01))
    np.testing.assert_allclose(found["q2"], (0.9, -0.9 * 0.02))


def test_residual_of_the_tanks_is_the_flow_that_was_hidden_in_their_levels() -> None:
    model = SymbolicModel("tanks", find_modelica_model("tanks").compile(), ["h1", "h2"])
    assert model.residual is not None
    assert {name: (p.state, p.speed) for name, p in model.residual.positions.items()} == {
        "h1": ("level1", None),
        "h2": ("level2", None),
    }
    time = np.arange(600.0)
    hidden = 1e-5 * np.column_stack([np.sin(0.05 * time), np.cos(0.03 * time)])
    inflow = 1e-4 * np.ones(len(time))
    zero = np.zeros(len(time))
    driven = np.column_stack([inflow, hidden, zero])
    levels = model.simulate(time, driven, ["h1", "h2"], {"level1": 0.3, "level2": 0.1})

    trial = SmoothedTrial(time, np.column_stack([inflow, zero, zero, zero]), levels, NOISE)
    compiled = model.compiled_residual
    found = compiled.run(time, model.residual_inputs(trial), compiled.parameters, np.zeros(0)).outputs

    # Central differences at 1 Hz err by w^2/6, 4e-4 of the flow; the smoother's own ends are left out.
    assert np.abs(found - hidden)[60:-60].max() < 1e-3 * 1e-5


def test_residual_of_a_first_order_state_is_its_rate_less_the_models_over_the_gain_of_the_correction() -> None:
    model = SymbolicModel("tanks", find_modelica_model("tanks").compile(), ["h1", "h2"])
    assert model.residual is not None
    system = model.residual.system
    names = [v.name for v in system.inputs]
    given = {"inflow": 1e-4, "measured:h1": 0.2, "measured:h2": 0.05, "target:h1": 2e-3, "target:h2": -1e-3}

    found = system.rhs(0, [], [given[name] for name in names], [], [v.start for v in system.parameters])[1]

    assert not any(name.startswith("speed:") for name in names)
    # Torricelli, which the model rounds off by (1e-4/h)^2/4 of itself.
    upper, lower = (5e-5 * np.sqrt(2 * 9.81 * level) for level in (0.2, 0.05))
    expected = [0.015 * 2e-3 - 1e-4 + upper, -0.015 * 1e-3 - upper + lower]
    np.testing.assert_allclose(found.full().ravel(), expected, rtol=1e-5)


def test_lag_of_a_sensor_is_no_first_order_state_that_a_correction_moves() -> None:
    lag = Attachment("levelSensor1", "FESArm.Effects.LengthSensor.LengthLag", {"tau": 2.0})

    system = patched_model(find_modelica_model("tanks"), "SlowLevels", [lag]).compile()

    assert residual_system(system, ["h1", "h2"]) is None


OWN = """model Own "A heated wheel, without an input for what it lacks"
  parameter Real J(unit="kg.m2") = 0.5;
  parameter Real C(unit="J/K") = 20.0;
  parameter Real b(unit="N.m.s/rad") = 0.1;
  parameter Real G(unit="W/K") = 2.0;
  input Real u(unit="N.m");
  output Real speed(unit="rad/s");
  output Real angle(unit="rad");
  output Real T(unit="K", start=300, fixed=true);
  output Real twice(unit="rad2/s");
  Real phi(unit="rad", start=0, fixed=true);
  Real w(unit="rad/s", start=0, fixed=true);
equation
  der(phi) = w;
  J*der(w) = u - b*w;
  C*der(T) = b*w^2 - G*(T - 300);
  speed = w;
  angle = 2*phi;
  twice = w*phi;
end Own;
"""


def test_a_model_of_ones_own_gets_a_force_at_the_balance_behind_each_output_that_shows_one(tmp_path: Path) -> None:
    (tmp_path / "Own.mo").write_text(OWN)
    model = with_forces(find_modelica_model(f"{tmp_path / 'Own.mo'}:Own"), "own")

    assert model.signals == ("angle", "T")  # the position goes before its speed; a product shows no state
    units = {v.name: v.unit for v in model.inputs if v.name != "u"}
    assert units == {"correction_angle": "N.m", "correction_T": "W"}
    names, states = [v.name for v in model.inputs], [v.name for v in model.system.states]
    for signal, state, storage in (("angle", "w", 0.5), ("T", "T", 20.0)):
        rates = []
        for force in (0.0, 3.0):
            given = [force if name == f"correction_{signal}" else 0.0 for name in names]
            rates.append(
                np.array(
                    model.system.rhs(0.0, [310.0, 0.0, 1.0], given, [], [v.start for v in model.system.parameters])[0]
                ).ravel()
            )
        expected = [3.0 / storage if name == state else 0.0 for name in states]
        assert rates[1] - rates[0] == pytest.approx(expected)


def test_two_outputs_that_read_one_state_leave_no_residual_but_a_model_that_follows_trials(tmp_path: Path) -> None:
    file = tmp_path / "Float.mo"
    file.write_text(
        "model Float\n  input Real f;\n  output Real x(start=0, fixed=true);\n  Real v(start=0, fixed=true);\n"
        "  output Real line = 5*x;\nequation\n  der(x) = v;\n  der(v) = f - x;\nend Float;\n"
    )
    model = SymbolicModel("Float", find_modelica_model(f"{file}:Float").compile())
    assert model.residual is None
    truth = np.column_stack([1 - np.cos(TIME), 5 * (1 - np.cos(TIME))])  # to a unit step
    followed = model.follow(TIME, np.ones((len(TIME), 1)), truth, ("x", "line"), np.array([1e-3, 5e-3]))
    np.testing.assert_allclose(followed.outputs, truth, atol=1e-4)
