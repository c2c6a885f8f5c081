"""An effect at a force that acts by a lever is found there, and moves all that the lever moves."""

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from fmus.symbolic.balances import Balance
from orchestrator.diagnose import diagnose
from orchestrator.greybox.effects import with_effects
from orchestrator.greybox.places import Seen, coordinate, lever_places, unscaled_places
from orchestrator.measurements import load_measurements

BEAM = """model Beam "Rigid beam on a spring and damper at either end, pushed at its middle and by a moment"
  parameter Real m(unit="kg") = 8;
  parameter Real J(unit="kg.m2") = 1.5;
  parameter Real a(unit="m") = 0.4 "Arm of the left spring";
  parameter Real b(unit="m") = 0.7 "Arm of the right spring";
  parameter Real k(unit="N/m") = 900;
  parameter Real c(unit="N.s/m") = 12;
  input Real f(unit="N");
  input Real tau(unit="N.m");
  output Real z(unit="m", start=0, fixed=true);
  output Real phi(unit="rad", start=0, fixed=true);
  Real v(unit="m/s", start=0, fixed=true);
  Real w(unit="rad/s", start=0, fixed=true);
  Real left(unit="N");
  Real right(unit="N");
equation
  der(z) = v;
  der(phi) = w;
  left = k*(z - a*phi) + c*(v - a*w);
  right = k*(z + b*phi) + c*(v + b*w);
  m*der(v) = f - left - right;
  J*der(w) = tau + a*left - b*right;
end Beam;
"""


def written(folder: Path) -> str:
    (folder / "Beam.mo").write_text(BEAM)
    return f"{folder / 'Beam.mo'}:Beam"


def record(folder: Path, friction: float) -> Path:
    """Dry friction at the right spring's end."""
    time = np.arange(0, 10, 0.02)
    for trial in (1, 2, 3):
        random = np.random.default_rng(trial)
        paces, phases = np.array([0.4, 0.9, 1.7, 2.6]), random.uniform(0, 2 * np.pi, (2, 4))
        f, tau = (
            s @ np.sin(2 * np.pi * paces[:, None] * time + p[:, None])
            for s, p in zip(([40, 40, 30, 20], [9, 9, 7, 5]), phases, strict=True)
        )

        def rates(t: float, x: np.ndarray, f: np.ndarray = f, tau: np.ndarray = tau) -> list[float]:
            z, phi, v, w = x
            push, turn = np.interp(t, time, f), np.interp(t, time, tau)
            left = 900 * (z - 0.4 * phi) + 12 * (v - 0.4 * w)
            right = 900 * (z + 0.7 * phi) + 12 * (v + 0.7 * w) + friction * np.tanh((v + 0.7 * w) / 0.002)
            return [v, w, (push - left - right) / 8, (turn + 0.4 * left - 0.7 * right) / 1.5]

        run = solve_ivp(rates, (0, time[-1]), np.zeros(4), t_eval=time, rtol=1e-8, atol=1e-10, max_step=0.01)
        noisy = run.y[:2].T + 2e-5 * random.standard_normal((len(time), 2))
        rows = np.column_stack([time, f, tau, noisy])
        np.savetxt(folder / f"trial_{trial}.csv", rows, "%.9g", ",", header="time,f,tau,z,phi", comments="")
    units = 'time = "s"\nf = "N"\ntau = "N.m"\nz = "m"\nphi = "rad"\n'
    files = 'files = ["trial_1.csv", "trial_2.csv", "trial_3.csv"]\nlearning = [1, 2]\nheld_out = [3]\n'
    (folder / "case.toml").write_text(files + "[columns]\n" + units)
    return folder


def test_a_force_at_a_lever_does_the_work_of_what_it_adds(tmp_path: Path) -> None:
    system, balances = find_modelica_model(written(tmp_path)).balanced()
    places = {p.site: p for p in unscaled_places(system, balances, ["f", "tau"])}
    states = {"v": 0.3, "w": -1.1, "z": 0.02, "phi": 0.05}
    for site, arm in (("left", -0.4), ("right", 0.7)):
        place = places[site]
        speed = coordinate(place.coordinates["v"], states)
        assert np.isclose(speed, 0.3 - 1.1 * arm) and place.unit == "N"
        assert np.isclose(coordinate(place.coordinates["q"], states), 0.02 + 0.05 * arm)
        power = sum(place.adds[b.input] * states[b.state] for b in balances if b.input in place.adds)
        assert np.isclose(power, speed)


def test_friction_at_the_end_of_a_beam_is_named_there_and_written_with_its_arm(tmp_path: Path) -> None:
    source = find_modelica_model(written(tmp_path))
    found = diagnose(source, load_measurements(str(record(tmp_path, friction=6.0))), workers=1)
    (effect,) = found.effects
    assert found.verdict == "named" and (effect.id, effect.site) == ("coulomb_friction", "right")
    friction, sharp = (effect.parameters[name].value for name in ("fC", "vSharp"))
    assert abs(friction - 6.0) < 0.05
    given, changed = source.compile(), with_effects(source, found.effects, "Beam1", tmp_path).compile()
    state = dict(z=0.02, phi=0.05, v=0.3, w=-1.1)
    x = [state[q.name] for q in given.states]
    rates = [
        dict(zip(state, np.array(s.rhs(0, x, [0, 0], [], [q.start for q in s.parameters])[0]).ravel(), strict=True))
        for s in (given, changed)
    ]
    force = friction * np.tanh((0.3 - 0.7 * 1.1) / sharp)
    assert [q.name for q in changed.states] == [q.name for q in given.states] == list(state)
    assert np.isclose(rates[1]["v"] - rates[0]["v"], -force / 8)
    assert np.isclose(rates[1]["w"] - rates[0]["w"], -0.7 * force / 1.5)


def test_a_lever_whose_first_balance_has_a_negative_arm_reads_as_it_is_written() -> None:
    moment = Balance("w", "N.m", "", "balance(w)", shares={"F": 1.5})
    force = Balance("v", "N", "", "balance(v)", shares={"F": -1.0})
    seen = Seen({name: np.array([-1.0, 1.0]) for name in ("time", "v", "w")}, {"balance(w)": 1.0, "balance(v)": 1.0})
    (place,) = lever_places([moment, force], {"w": "rad/s", "v": "m/s"}, seen)
    assert coordinate(place.coordinates["v"], {"w": 2.0, "v": 0.5}) == -1.5 * 2.0 + 0.5


GEAR = """model Gear
  parameter Real N = 5 "Turns of the motor for one of the load";
  parameter Real J1(unit="kg.m2") = 0.01;
  parameter Real J2(unit="kg.m2") = 0.4;
  parameter Real k(unit="N.m/rad") = 80;
  input Real u(unit="N.m");
  Real q1(unit="rad", start=0, fixed=true);
  Real q2(unit="rad", start=0, fixed=true);
  Real w1(unit="rad/s", start=0, fixed=true);
  output Real w2(unit="rad/s", start=0, fixed=true);
  Real shaft(unit="N.m");
equation
  der(q1) = w1;
  der(q2) = w2;
  shaft = k*(q1/N - q2);
  J1*der(w1) = u - shaft/N;
  J2*der(w2) = shaft;
end Gear;
"""


def test_a_torque_behind_a_gear_works_against_the_twist_of_its_shaft(tmp_path: Path) -> None:
    (tmp_path / "Gear.mo").write_text(GEAR)
    system, balances = find_modelica_model(f"{tmp_path / 'Gear.mo'}:Gear").balanced()
    place = {p.site: p for p in unscaled_places(system, balances, ["u"])}["shaft"]
    states = {"w1": 10.0, "w2": 1.5, "q1": 2.0, "q2": 0.1}
    assert np.isclose(coordinate(place.coordinates["v"], states), 10.0 / 5 - 1.5)
    assert np.isclose(coordinate(place.coordinates["q"], states), 2.0 / 5 - 0.1)
    assert place.adds == {"balance(w1)": 0.2, "balance(w2)": -1.0}
