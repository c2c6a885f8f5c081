"""FMUs in model exchange: their rates along a record stand for their equations, and effects act at their states."""

from pathlib import Path

import fmpy
import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.package import build_fmu
from orchestrator.blackbox.source import FmuSource
from orchestrator.cosim.load import load_system
from orchestrator.diagnose import diagnose
from orchestrator.greybox.diagnose import diagnose_greybox
from orchestrator.greybox.fmu_system import version_model, write_fmu_system
from orchestrator.greybox.tape import outline, taped_case
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Estimate, NamedEffect

SWING = """model Swing "A motor that swings a load"
  parameter Real J(unit="kg.m2") = 0.05;
  parameter Real b(unit="N.m.s/rad") = {b};
  parameter Real mgl(unit="N.m") = 0.6;
  parameter Real k(unit="N.m/({unit})") = 1;
  input Real tau(unit="{unit}");
  output Real phi(unit="rad", start=0, fixed=true);
  Real w(unit="rad/s", start=0, fixed=true);
equation
  der(phi) = w;
  J*der(w) = k*tau - b*w - mgl*sin(phi);
end Swing;
"""


def _swing(folder: Path, b: float = 0.02, unit: str = "N.m", fmi: str = "2.0") -> Path:
    folder.mkdir(exist_ok=True, parents=True)
    (folder / "Swing.mo").write_text(SWING.format(b=b, unit=unit))
    system = ModelicaModel("Swing", "Swing", folder / "Swing.mo").compile()
    return build_fmu(system, folder / "Swing.fmu", fmi_version=fmi)


def _record(folder: Path, *, dry: float = 0.0, mgl: float = 0.6, unit: str = "N.m", samples: int = 300) -> Path:
    """Three records; friction stops the load by impulses (Moreau's time stepping, 0.1 ms), sticking included."""
    folder.mkdir(exist_ok=True, parents=True)
    random, step, parts = np.random.default_rng(0), 0.01, 100
    h = step / parts
    for number in (1, 2, 3):
        t = np.arange(samples) * step
        waves = zip(random.uniform(0.1, 0.35, 5), random.uniform(0.1, 1.5, 5), random.uniform(0, 6, 5), strict=True)
        tau = sum(a * np.sin(2 * np.pi * f * t + p) for a, f, p in waves)
        angle, speed, rows = random.uniform(-0.3, 0.3), 0.0, []
        for i in range(samples):
            rows.append((t[i], tau[i], angle + 1e-4 * random.standard_normal()))
            rise = tau[min(i + 1, samples - 1)] - tau[i]
            for j in range(parts):
                torque = tau[i] + rise * (j + 0.5) / parts - 0.02 * speed - mgl * np.sin(angle)
                free = speed + h / 0.05 * torque
                speed = free - np.clip(free, -dry * h / 0.05, dry * h / 0.05)
                angle += h * speed
        np.savetxt(folder / f"trial_{number}.csv", rows, "%.9g", ",", header="time,tau,phi", comments="")
    (folder / "case.toml").write_text(
        'files = ["trial_1.csv", "trial_2.csv", "trial_3.csv"]\nlearning = [1, 2]\nheld_out = [3]\n'
        f'[columns]\ntime = "s"\ntau = "{unit}"\nphi = "rad"\n'
    )
    return folder


def _effect(effect_id: str, site: str, **values: float) -> NamedEffect:
    return NamedEffect(effect_id, site, {k: Estimate(v, "", (v, v)) for k, v in values.items()})


@pytest.fixture(scope="module")
def friction(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("friction")
    return _swing(folder), _record(folder / "data", dry=0.12, samples=700)


def test_dry_friction_that_an_fmu_lacks_is_named_and_sized(friction: tuple[Path, Path]) -> None:
    measurements = load_measurements(friction[1])
    source = FmuSource.prepare(friction[0], measurements)
    found = diagnose_greybox(source, measurements, workers=1)
    source.fmu.close()
    assert (found.verdict, [e.id for e in found.effects]) == ("named", ["coulomb_friction"])
    assert found.effects[0].site == "phi"
    assert found.effects[0].parameters["tauC"].value == pytest.approx(0.12, rel=0.05)
    assert found.effects[0].parameters["tauC"].unit == "N.m"
    assert found.held_out.reducible_removed > 0.9


def test_a_wrong_parameter_of_an_fmu_is_named(tmp_path: Path) -> None:
    measurements = load_measurements(_record(tmp_path / "data", mgl=0.63))
    source = FmuSource.prepare(_swing(tmp_path, fmi="3.0"), measurements)
    found = diagnose_greybox(source, measurements, workers=1)
    source.fmu.close()
    assert [(e.id, e.site) for e in found.effects] == [("parameter_error", "mgl")]
    assert found.effects[0].parameters["share"].value == pytest.approx(0.05, rel=0.1)


def test_the_lines_along_a_record_have_the_rates_of_the_fmu(friction: tuple[Path, Path]) -> None:
    measurements = load_measurements(friction[1])
    source = FmuSource.prepare(friction[0], measurements)
    case = taped_case(source, measurements)
    source.fmu.close()
    trial = case.data.trials[0]
    inputs = {v.name: k for k, v in enumerate([v for v in case.base.inputs if not v.name.startswith("balance")])}
    row = trial.inputs[100]
    phi, w = (row[inputs[f"tape[{k}]"]] for k in (0, 1))
    tau, force = row[inputs["tau"]], 0.07
    given = [force if v.name == "balance(w)" else row[inputs[v.name]] for v in case.base.inputs]
    for shift in (0.0, 0.01):
        p = [v.start for v in case.base.parameters]
        rates = np.array(case.base.rhs(1.0, [phi + shift, w], given, [], p)[0]).ravel()
        weight = 0.6 * (np.sin(phi) + np.cos(phi) * shift)
        np.testing.assert_allclose(rates, [w, (tau + force - 0.02 * w - weight) / 0.05], rtol=1e-5)
    assert [(b.state, b.unit, b.position) for b in case.balances] == [("w", "N.m", "phi")]


@pytest.mark.parametrize(("unit", "law_unit"), [("N.m", "N.m"), ("V", "rad/s2")])
def test_an_fmu_with_damping_around_it_moves_as_one_with_damping_inside(
    unit: str, law_unit: str, tmp_path: Path
) -> None:
    """Through its force input, or on the rate of its state where no input is a force."""
    measurements = load_measurements(_record(tmp_path / "data", unit=unit, samples=60))
    outside = FmuSource.prepare(_swing(tmp_path / "one", unit=unit), measurements)
    inside = FmuSource.prepare(_swing(tmp_path / "two", b=0.07, unit=unit), measurements)
    assert outline(outside).balances[0].unit == law_unit
    size = 0.05 if unit == "N.m" else 0.05 / 0.05
    around = version_model(outside, [_effect("viscous_friction", "phi", b=size)], ["phi"])
    time = np.linspace(0, 2, 201)
    torque = 0.3 * np.sin(3 * time)[:, None]
    runs = [
        model.compiled.run(time, torque, model.compiled.parameters, np.array([0.4, 0.0]), substeps=4).outputs
        for model in (around, inside.model(inside.compile(), ["phi"]))
    ]
    for source in (outside, inside):
        source.fmu.close()
    np.testing.assert_allclose(runs[0], runs[1], atol=1e-9)


def test_a_force_input_against_the_direction_of_a_state_is_no_force_on_it(tmp_path: Path) -> None:
    """Friction through it would push: a Dymola FMU counts the speed of a damper from the other side."""
    (tmp_path / "Swing.mo").write_text(SWING.format(b=0.02, unit="N.m").replace("= k*tau", "= -k*tau"))
    fmu = build_fmu(ModelicaModel("Swing", "Swing", tmp_path / "Swing.mo").compile(), tmp_path / "Swing.fmu")
    source = FmuSource.prepare(fmu, load_measurements(_record(tmp_path / "data", samples=60)))
    seen = outline(source)
    assert [(b.state, b.unit) for b in seen.balances] == [("w", "rad/s2")]
    assert list(seen.acting.values()) == [""]
    assert source.fmu is not None
    source.fmu.close()


def test_a_version_of_an_fmu_is_a_system_of_fmus_with_its_new_parameters(
    friction: tuple[Path, Path], tmp_path: Path
) -> None:
    source = FmuSource.prepare(friction[0], load_measurements(friction[1]))
    effects = [
        _effect("coulomb_friction", "phi", tauC=0.12, wSharp=0.04),
        _effect("parameter_error", "mgl", share=0.05),
    ]
    system = load_system(write_fmu_system(source, effects, tmp_path, "Swing_3"))
    source.fmu.close()
    assert system.components["plant"].values["mgl"].value == pytest.approx(0.63)
    pairs = {(c.source, c.target) for c in system.connections}
    assert {("coulomb_friction.y", "sum.b"), ("sum.y", "plant.tau"), ("plant.phi", "rate.u")} <= pairs
    assert system.outputs == {"phi": "plant.phi"} and set(system.inputs["tau"]) == {"sum.a"}


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_friction_at_a_rate_is_written_into_the_fmu(fmi: str, tmp_path: Path) -> None:
    """Read by FMPy, which knows nothing of it: rates and their values are those of the FMU that has the damping itself."""
    measurements = load_measurements(_record(tmp_path / "data", unit="V", samples=60))
    source = FmuSource.prepare(_swing(tmp_path / "one", unit="V", fmi=fmi), measurements)
    effect = _effect("viscous_friction", "phi", b=1.0)
    made = write_fmu_system(source, [effect], tmp_path / "new", "Swing_1")
    source.fmu.close()
    own = _swing(tmp_path / "two", b=0.07, unit="V", fmi=fmi)
    assert fmpy.read_model_description(str(made), validate=True).coSimulation is None
    runs = [
        fmpy.simulate_fmu(
            str(file),
            fmi_type="ModelExchange",
            stop_time=2.0,
            relative_tolerance=1e-8,
            start_values={"phi": 0.4},
            output=["phi", "der(w)"],
            output_interval=0.1,
        )
        for file in (made, own)
    ]
    for name in ("phi", "der(w)"):
        np.testing.assert_allclose(runs[0][name], runs[1][name], atol=1e-6)
    constant = fmpy.read_model_description(str(made)).modelVariables[-1]
    assert (constant.name, float(constant.start)) == ("viscous_friction1.b", 1.0)


def test_dry_friction_is_named_though_an_effect_at_the_sensor_explains_a_part(tmp_path: Path) -> None:
    """Without a force input the search at inputs and outputs has sensors and commands only."""
    measurements = load_measurements(_record(tmp_path / "data", dry=0.12, unit="V", samples=700))
    source = FmuSource.prepare(_swing(tmp_path, unit="V"), measurements)
    found = diagnose(source, measurements, workers=1)
    source.fmu.close()
    assert (found.verdict, [(e.id, e.site) for e in found.effects]) == ("named", [("coulomb_friction", "phi")])
    size = found.effects[0].parameters["fC"]
    assert (size.value, size.unit) == (pytest.approx(0.12 / 0.05, rel=0.05), "rad/s2")


def test_an_accelerometer_feels_a_force_at_the_balance_as_it_feels_the_force_input(tmp_path: Path) -> None:
    (tmp_path / "Sled.mo").write_text(
        'model Sled\n  input Real F(unit="N");\n  Real s(unit="m", start=0, fixed=true);\n'
        '  output Real v(unit="m/s", start=0, fixed=true);\n  output Real a(unit="m/s2");\nequation\n'
        "  der(s) = v;\n  der(v) = a;\n  2*a = F - 10*s;\nend Sled;\n"
    )
    box = build_fmu(ModelicaModel("Sled", "Sled", tmp_path / "Sled.mo").compile(), tmp_path / "Sled.fmu")
    time = np.arange(50) * 0.02
    for number in (1, 2):
        rows = np.column_stack([time, np.sin(3 * time + number), 0.1 * time, 0.1 + 0 * time])
        np.savetxt(tmp_path / f"run_{number}.csv", rows, "%.9g", ",", header="time,F,v,a", comments="")
    measurements = load_measurements(tmp_path)
    source = FmuSource.prepare(box, measurements)

    case = taped_case(source, measurements)

    source.fmu.close()
    (balance,) = case.balances
    names = [v.name for v in case.base.inputs]
    given = np.zeros(len(names))

    def shown(name: str) -> np.ndarray:
        pushed = given.copy()
        pushed[names.index(name)] = 1.0
        parameters = [v.start or 0.0 for v in case.base.parameters]
        rest, moved = (np.array(case.base.rhs(0.0, [0, 0], u, [], parameters)[1]) for u in (given, pushed))
        return (moved - rest).ravel()

    assert shown(balance.input) == pytest.approx([0.0, 0.5])  # v, and a = F/m
    assert shown("F") == pytest.approx(shown(balance.input))
