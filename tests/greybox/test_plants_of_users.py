"""Plants that were in nobody's view when laws and limits were written: what they lack is named, by data of a second program."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import ModelicaModel
from fmus.library import libraries, standard_subset
from orchestrator.diagnose import diagnose
from orchestrator.greybox.effects import with_effects
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Diagnosis, Estimate, NamedEffect

FILTER = """model Filter "LC filter with the winding of its coil"
  parameter Real R(unit="Ohm") = 0.8, L(unit="H") = 1.2e-3, C(unit="F") = 47e-6;
  input Real vin(unit="V");
  Real q(unit="C", start=0) "charge";
  output Real il(unit="A", start=0);
  output Real vout(unit="V");
equation
  vin = R*il + L*der(il) + vout;
  der(q) = il;
  vout = q/C;
end Filter;
"""
OVEN = """model Oven "wall and air"
  parameter Real Cw(unit="J/K") = 9000, Ca(unit="J/K") = 1500;
  parameter Real hA(unit="W/K") = 12, G(unit="W/K") = 3.2, Troom(unit="K") = 294;
  input Real P(unit="W");
  Real Tw(unit="K", start=294);
  output Real T(unit="K", start=294);
equation
  Cw*der(Tw) = P - hA*(Tw - T) - G*(Tw - Troom);
  Ca*der(T) = hA*(Tw - T);
end Oven;
"""
CART = """model Cart "Delivery robot, whose position is of no interest"
  parameter Real m(unit="kg") = 95, roll(unit="N") = 11;
  input Real F(unit="N");
  output Real v(unit="m/s", start=4);
equation
  m*der(v) = F - roll;
end Cart;
"""
FAN = """package Drive
  connector Flange
    Real phi(unit="rad");
    flow Real tau(unit="N.m");
  end Flange;
  model Inertia
    parameter Real J(unit="kg.m2");
    Flange a, b;
    Real phi(unit="rad", start=0), w(unit="rad/s", start=0);
  equation
    phi = a.phi;
    phi = b.phi;
    w = der(phi);
    J*der(w) = a.tau + b.tau;
  end Inertia;
  model Gear
    parameter Real ratio;
    Flange a, b;
  equation
    a.phi = ratio*b.phi;
    0 = ratio*a.tau + b.tau;
  end Gear;
  model Source
    input Real tau(unit="N.m");
    Flange a;
  equation
    a.tau = -tau;
  end Source;
  model Fan
    Source source(tau=tau);
    Inertia motor(J=2e-3), wheel(J=0.15);
    Gear gear(ratio=4);
    input Real tau(unit="N.m");
    output Real w(unit="rad/s");
  equation
    connect(source.a, motor.a);
    connect(motor.b, gear.a);
    connect(gear.b, wheel.a);
    w = wheel.w;
  end Fan;
end Drive;
"""
WINCH = """model Winch "load on a rope"
  parameter Real J(unit="kg.m2") = 0.02, r(unit="m") = 0.09, ratio = 18;
  input Real tau(unit="N.m");
  output Real h(unit="m", start=0);
  Real w(unit="rad/s", start=0);
equation
  der(h) = r/ratio*w;
  J*der(w) = tau;
end Winch;
"""
TANKS = """package Water
  connector Port
    Real h(unit="m");
    flow Real q(unit="m3/s");
  end Port;
  partial model Element
    Port a, b;
    Real q(unit="m3/s"), dh(unit="m");
  equation
    q = a.q;
    a.q + b.q = 0;
    dh = a.h - b.h;
  end Element;
  model Laminar
    extends Element;
    parameter Real k(unit="m2/s") = 2e-4;
  equation
    q = k*dh;
  end Laminar;
  model Tank
    Port p;
    parameter Real S(unit="m2");
    Real h(unit="m", start=0.35);
  equation
    S*der(h) = p.q;
    p.h = h;
  end Tank;
  model Drain
    Port p;
  equation
    p.h = 0;
  end Drain;
  model Pair
    replaceable model Pipe = Laminar constrainedby Element;
    input Real pump(unit="m3/s");
    Pump feed(q=pump);
    Tank upper(S=0.06), lower(S=0.045);
    Pipe link;
    Laminar out;
    Drain sink;
    output Real h1(unit="m") = upper.h;
    output Real h2(unit="m") = lower.h;
  equation
    connect(feed.p, upper.p);
    connect(upper.p, link.a);
    connect(link.b, lower.p);
    connect(lower.p, out.a);
    connect(out.b, sink.p);
  end Pair;
  model Pump
    Port p;
    input Real q(unit="m3/s");
  equation
    p.q = -q;
  end Pump;
end Water;
"""
Rates = Callable[[np.ndarray, float], list[float]]


def written(folder: Path, text: str) -> ModelicaModel:
    """A model in a file of its own; the class is named as the file's last line ends it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "Plant.mo").write_text(text)
    inner = {"Drive": "Drive.Fan", "Water": "Water.Pair"}
    name = text.rstrip().rsplit(" ", 1)[1].rstrip(";")
    return ModelicaModel(name, inner.get(name, name), folder / "Plant.mo")


def record(
    folder: Path,
    rates: Rates,
    start: list[float],
    levels: tuple[float, float],
    step: float,
    samples: int,
    shown: dict[str, tuple[str, Callable[[np.ndarray], np.ndarray], float]],
    given: tuple[str, str],
) -> Path:
    """Three trials of a plant whose input jumps between held levels; `shown` has unit, reading and noise of each column."""
    random = np.random.default_rng(5)
    for trial in (1, 2, 3):
        u = np.repeat(random.uniform(*levels, samples // 30 + 1), 30)[:samples]
        states = [np.array(start)]
        for value in u[:-1]:
            done = solve_ivp(
                lambda _, x, value=value: rates(x, value), (0, step), states[-1], "LSODA", rtol=1e-9, atol=1e-10
            )
            states.append(done.y[:, -1])
        x = np.array(states).T
        columns = [read(x) + noise * random.standard_normal(samples) for _, read, noise in shown.values()]
        rows = np.column_stack([np.arange(samples) * step, u, *columns])
        header = ",".join(["time", given[0], *shown])
        np.savetxt(folder / f"trial_{trial}.csv", rows, delimiter=",", header=header, comments="", fmt="%.9g")
    units = {"time": "s", given[0]: given[1], **{name: unit for name, (unit, _, _) in shown.items()}}
    lines = [
        'files = ["trial_1.csv", "trial_2.csv", "trial_3.csv"]',
        "learning = [1, 2]",
        "held_out = [3]",
        "[columns]",
    ]
    (folder / "case.toml").write_text("\n".join([*lines, *(f'{k} = "{v}"' for k, v in units.items())]) + "\n")
    return folder


def the_one(found: Diagnosis) -> NamedEffect:
    """The only effect of a diagnosis that names one."""
    assert found.verdict == "named", found.warnings
    (effect,) = found.effects
    return effect


def test_a_leak_of_charge_is_named_although_the_charge_changes_with_a_state(tmp_path: Path) -> None:
    model = written(tmp_path, FILTER)
    shown = {"il": ("A", lambda x: x[0], 2e-3), "vout": ("V", lambda x: x[1], 5e-3)}

    def rates(x: np.ndarray, u: float) -> list[float]:
        return [(u - 0.8 * x[0] - x[1]) / 1.2e-3, (x[0] - x[1] / 60) / 47e-6]

    data = record(tmp_path, rates, [0, 0], (-12, 12), 4e-5, 400, shown, ("vin", "V"))
    effect = the_one(diagnose(model, load_measurements(str(data)), workers=1))
    assert (effect.id, effect.site) == ("leakage", "q")
    assert effect.parameters["G"].value == pytest.approx(1 / 60 / 47e-6, rel=0.02)
    file = with_effects(model, [effect], "Filter_1", tmp_path / "added").file
    assert file is not None and "der(q) = il - leakage1_G*q + leakage1_f0;" in file.read_text()


def test_a_slow_thermocouple_is_found_far_from_zero_kelvin(tmp_path: Path) -> None:
    """As a lag of the sensor or of the input: of a linear model with one of each, both are one model."""
    model = written(tmp_path, OVEN)
    shown = {"T": ("K", lambda x: x[2], 0.05)}

    def rates(x: np.ndarray, u: float) -> list[float]:
        return [(u - 12 * (x[0] - x[1]) - 3.2 * (x[0] - 294)) / 9000, 12 * (x[0] - x[1]) / 1500, (x[1] - x[2]) / 60]

    data = record(tmp_path, rates, [294, 294, 294], (0, 600), 6.0, 450, shown, ("P", "W"))
    found = diagnose(model, load_measurements(str(data)), workers=1)
    (effect,) = found.effects
    assert (effect.id, effect.site) in {("sensor_lag", "sensor:T"), ("input_lag", "P")}
    assert effect.parameters["T"].value == pytest.approx(60, rel=0.05)
    assert found.held_out.reducible_removed > 0.9


def test_drag_is_named_in_a_model_that_has_a_speed_and_no_position(tmp_path: Path) -> None:
    model = written(tmp_path, CART)
    shown = {"v": ("m/s", lambda x: x[0], 0.01)}
    data = record(
        tmp_path, lambda x, u: [(u - 11 - 1.1 * x[0] * abs(x[0])) / 95], [4], (0, 70), 0.4, 400, shown, ("F", "N")
    )
    effect = the_one(diagnose(model, load_measurements(str(data)), workers=1))
    assert (effect.id, effect.site) == ("quadratic_drag", "v")
    assert effect.parameters["c"].value == pytest.approx(1.1, rel=0.05)


def test_a_hole_in_a_tank_of_a_package_with_connectors_is_named_and_written_into_that_tank(tmp_path: Path) -> None:
    model = written(tmp_path, TANKS)
    shown = {"h1": ("m", lambda x: x[0], 5e-4), "h2": ("m", lambda x: x[1], 5e-4)}

    def rates(x: np.ndarray, u: float) -> list[float]:
        between, hole = 2e-4 * (x[0] - x[1]), 6.6e-5 * np.sqrt(max(x[0], 0.0))
        return [(u - between - hole) / 0.06, (between - 2e-4 * x[1]) / 0.045]

    data = record(tmp_path, rates, [0.35, 0.35], (2e-5, 1.4e-4), 4.0, 400, shown, ("pump", "m3/s"))
    effect = the_one(diagnose(model, load_measurements(str(data)), workers=1))
    assert (effect.id, effect.site) == ("orifice_leak", "upper.h")
    of_root = effect.parameters["k"].value / np.sqrt(effect.parameters["xRef"].value)
    assert of_root == pytest.approx(6.6e-5, rel=0.02)
    file = with_effects(model, [effect], "Water_1", tmp_path / "added").file
    assert file is not None and file.read_text().count("orifice1_k") > 1


def test_rigidly_coupled_inertias_have_one_balance(tmp_path: Path) -> None:
    system, balances = written(tmp_path, FAN).balanced()
    assert [(b.state, b.unit) for b in balances] == [("motor.w", "N.m")]
    assert {b.state for b in balances} <= {v.name for v in system.states}


@pytest.mark.skipif(
    libraries()["Modelica"] == standard_subset(), reason="needs the Modelica Standard Library in MODELICAPATH"
)
def test_the_speed_of_a_damper_stands_for_the_inertia_on_its_shaft(tmp_path: Path) -> None:
    """Dampers of the standard library prefer their angle as a state; it counts the other way than the shaft's."""
    text = """model Shaft
  import Modelica.Mechanics.Rotational.Components.{Inertia, Damper, Fixed};
  Modelica.Blocks.Interfaces.RealInput tau(unit="N.m");
  Modelica.Blocks.Interfaces.RealOutput w(unit="rad/s") = disk.w;
  Modelica.Mechanics.Rotational.Sources.Torque torque;
  Inertia disk(J=0.2, phi(start=0, fixed=true), w(start=0, fixed=true));
  Damper bearing(d=2e-3);
  Fixed frame;
equation
  connect(tau, torque.tau);
  connect(torque.flange, disk.flange_a);
  connect(disk.flange_b, bearing.flange_a);
  connect(bearing.flange_b, frame.flange);
end Shaft;
"""
    model = written(tmp_path, text)
    system, balances = model.balanced()
    assert [(b.state, b.unit, b.position) for b in balances] == [("bearing.w_rel", "N.m", "bearing.phi_rel")]
    drag = NamedEffect("quadratic_drag", "bearing.phi_rel", {"c": Estimate(0.3, "N.m.s2/rad2", (0.3, 0.3))})
    added = with_effects(model, [drag], "Shaft_1", tmp_path / "added").compile()
    states = [v.name for v in added.states]
    moving = [2.0 if name == "bearing.w_rel" else 0.0 for name in states]
    rates = np.array(added.rhs(0.0, moving, [0.0], [], [v.start for v in added.parameters])[0]).ravel()
    assert rates[states.index("bearing.w_rel")] == pytest.approx(-(2e-3 * 2 + 0.3 * 2**2) / 0.2)


def test_a_height_behind_a_gear_has_no_balance(tmp_path: Path) -> None:
    assert [b.state for b in written(tmp_path, WINCH).balanced()[1]] == ["w"]


def test_a_way_to_the_measured_outside_is_named_where_the_model_has_none(tmp_path: Path) -> None:
    """The model's air loses heat to the wall alone; in truth the window is open."""
    text = """model House
  parameter Real Ca(unit="J/K") = 8e4, Cw(unit="J/K") = 1.2e6, Gaw(unit="W/K") = 120, Gwe(unit="W/K") = 40;
  input Real P(unit="W"), Te(unit="K");
  output Real Ta(unit="K", start=290);
  output Real Tw(unit="K", start=289);
equation
  Ca*der(Ta) = P + Gaw*(Tw - Ta);
  Cw*der(Tw) = Gaw*(Ta - Tw) + Gwe*(Te - Tw);
end House;
"""
    model, window, random = written(tmp_path, text), 15.0, np.random.default_rng(8)
    time = np.arange(0.0, 36000.0, 120.0)
    for trial in (1, 2, 3):
        power = np.repeat(random.uniform(0, 2500, len(time) // 30 + 1), 30)[: len(time)]
        outside = 278 + 4 * np.sin(2 * np.pi * time / 86400 + trial)
        air = [np.array([290.0, 289.0])]
        for p, e, f in zip(power[:-1], outside[:-1], outside[1:], strict=True):
            done = solve_ivp(
                lambda t, x, p=p, e=e, f=f: [
                    (p + 120 * (x[1] - x[0]) + window * (e + (f - e) * t / 120 - x[0])) / 8e4,
                    (120 * (x[0] - x[1]) + 40 * (e + (f - e) * t / 120 - x[1])) / 1.2e6,
                ],
                (0, 120),
                air[-1],
                rtol=1e-9,
                atol=1e-9,
            )
            air.append(done.y[:, -1])
        rows = np.column_stack([time, power, outside, np.array(air) + 0.03 * random.standard_normal((len(time), 2))])
        np.savetxt(tmp_path / f"{trial}.csv", rows, delimiter=",", header="time,P,Te,Ta,Tw", comments="", fmt="%.9g")
    units = '[columns]\ntime = "s"\nP = "W"\nTe = "K"\nTa = "K"\nTw = "K"\n'
    (tmp_path / "case.toml").write_text(f'files = ["1.csv", "2.csv", "3.csv"]\nheld_out = [3]\n{units}')
    effect = the_one(diagnose(model, load_measurements(str(tmp_path)), workers=1))
    assert (effect.id, effect.site) == ("heat_path", "Ta-Te")
    assert effect.parameters["G"].value == pytest.approx(window, rel=0.02)
    file = with_effects(model, [effect], "House_1", tmp_path / "added").file
    assert file is not None and "Gaw*(Tw - Ta) - heat1_G*(Ta - Te);" in file.read_text()


OSCILLATOR = """model Oscillator
  parameter Real m(unit="kg") = 0.8, c(unit="N/m") = 40, d(unit="N.s/m") = 0.6;
  input Real F(unit="N");
  output Real x(unit="m", start=0);
  Real v(unit="m/s", start=0);
equation
  der(x) = v;
  m*der(v) = F - c*x - d*v;
end Oscillator;
"""


def test_an_input_that_was_held_is_found_out_once_the_missing_effect_is_known(tmp_path: Path) -> None:
    """Half a sample of a smooth force is nothing beside a missing spring, and eight times the noise once the spring is there."""
    model, random, time = written(tmp_path, OSCILLATOR), np.random.default_rng(12), np.arange(0.0, 5.0, 0.01)
    for trial in (1, 2, 3):
        waves = [(random.normal(), random.uniform(0.5, 12.0), random.uniform(0.0, 6.0)) for _ in range(6)]
        force = sum(3.0 * size * np.sin(speed * time + phase) for size, speed, phase in waves)
        states = [np.zeros(2)]
        for f in force[:-1]:
            done = solve_ivp(
                lambda _, x, f=f: [x[1], (f - 40 * x[0] - 2000 * x[0] ** 3 - 0.6 * x[1]) / 0.8],
                (0, 0.01),
                states[-1],
                rtol=1e-9,
                atol=1e-11,
            )
            states.append(done.y[:, -1])
        measured = np.array(states)[:, 0] + 3e-4 * random.standard_normal(len(time))
        rows = np.column_stack([time, force, measured])
        np.savetxt(tmp_path / f"{trial}.csv", rows, delimiter=",", header="time,F,x", comments="", fmt="%.9g")
    units = '[columns]\ntime = "s"\nF = "N"\nx = "m"\n'
    (tmp_path / "case.toml").write_text(f'files = ["1.csv", "2.csv", "3.csv"]\nheld_out = [3]\n{units}')
    found = diagnose(model, load_measurements(str(tmp_path)), workers=1)
    effect = the_one(found)
    assert effect.id == "cubic_stiffness"
    assert effect.parameters["k3"].value == pytest.approx(2000.0, rel=1e-3)
    assert any("F is held from sample to sample" in note for note in found.warnings)
    assert found.held_out.rmse_after["x"] < 1.2 * 3e-4


HOIST = """model Hoist
  constant Real g(unit="m/s2") = 9.81;
  parameter Real m1(unit="kg") = 300 "cabin", m2(unit="kg") = 250 "counterweight", mp(unit="kg") = 50 "pulley";
  input Real F(unit="N");
  output Real x(unit="m", start=0);
  Real v(unit="m/s", start=0);
equation
  der(x) = v;
  (m1 + m2 + mp)*der(v) = F + (m1 - m2)*g;
end Hoist;
"""


@pytest.mark.slow  # test_screen holds its algebra
def test_one_wrong_mass_is_named_and_no_constant_force_beside_another_wrong_mass(tmp_path: Path) -> None:
    """A cabin that is 3 % heavier is a weight and an inertia: the weight alone was found first, as a constant force."""
    folder = record(
        tmp_path,
        lambda x, F: [x[1], (F + 59 * 9.81 - 40 * np.tanh(x[1] / 2e-3)) / 609],
        [0.0, 0.0],
        (-1100.0, -60.0),
        0.05,
        240,
        {"x": ("m", lambda x: x[0], 2e-4)},
        ("F", "N"),
    )
    found = diagnose(written(tmp_path, HOIST), load_measurements(str(folder)), workers=1)
    named = {(effect.id, effect.site): effect.parameters for effect in found.effects}
    assert set(named) == {("coulomb_friction", "x"), ("parameter_error", "m1")}
    assert named["parameter_error", "m1"]["share"].value == pytest.approx(0.03, abs=1e-3)


def of_oscillator(folder: Path, acceleration: Callable[[np.ndarray, float], float]) -> Diagnosis:
    """The diagnosis of the oscillator along records of another one, by its acceleration (m/s2) at a state and a force."""
    outputs = {"x": ("m", lambda x: x[0], 1e-4)}
    record(folder, lambda x, F: [x[1], acceleration(x, F)], [0.0, 0.0], (-3.0, 3.0), 0.02, 240, outputs, ("F", "N"))
    return diagnose(written(folder, OSCILLATOR), load_measurements(str(folder)), workers=1)


def test_a_mass_that_is_three_times_the_models_is_named_beside_dry_friction(tmp_path: Path) -> None:
    """A forgotten rotor: with a normal prior of 5 % the mass was kept, and drag, a zero error and friction stood for it."""
    found = of_oscillator(tmp_path, lambda x, F: (F - 40 * x[0] - 0.6 * x[1] - 0.5 * np.tanh(x[1] / 1e-3)) / 2.4)
    named = {(effect.id, effect.site): effect.parameters for effect in found.effects}
    assert set(named) == {("coulomb_friction", "x"), ("parameter_error", "m")}
    assert named["parameter_error", "m"]["share"].value == pytest.approx(2.0, rel=0.02)
    assert named["coulomb_friction", "x"]["fC"].value == pytest.approx(0.5, rel=0.05)


def test_a_wrong_value_of_a_spring_is_named_and_the_spring_beside_it_is_no_rival(tmp_path: Path) -> None:
    found = of_oscillator(tmp_path, lambda x, F: (F - 42 * x[0] - 0.6 * x[1]) / 0.8)
    effect = the_one(found)
    assert (effect.id, effect.site) == ("parameter_error", "c")
    assert effect.parameters["share"].value == pytest.approx(0.05, rel=0.02)
    assert "passive stiffness at x would be the same change of the model in other parameters" in found.warnings
    assert all(entry.effects != ("passive_stiffness",) for entry in found.ranking)
