"""FMUs whose equations are closed: the right effect is named from outside, and written as a system of FMUs."""

import json
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import misfit
from fmus.catalogue import ModelicaModel, find_modelica_model
from fmus.package import build_fmu
from orchestrator.blackbox.fmu_file import FmuFile
from orchestrator.blackbox.library import Scales, laws
from orchestrator.blackbox.source import FmuSource
from orchestrator.cosim import load_system
from orchestrator.cosim.simulation import Simulation
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements

TIME = np.arange(0, 4, 0.008)
INERTIA = 0.02
TRUTH = {
    "viscous_friction": ("b[1]", 0.03),
    "coulomb_friction": ("fC[1]", 0.02),
    "input_delay": ("T", 0.04),
    "input_gain": ("k[1]", 0.8),
}


def drive_data(folder: Path, effect: str) -> Path:
    """Four trials of an inertia under a multi-sine torque, integrated here by SciPy, with one effect in it."""
    folder.mkdir()
    random, true = np.random.default_rng(1), TRUTH[effect][1]
    for k in range(1, 5):
        f, phase, a = random.uniform(0.2, 1.5, 4), random.uniform(0, 6, 4), random.uniform(0.02, 0.06, 4)
        torque = (a[:, None] * np.sin(2 * np.pi * f[:, None] * TIME + phase[:, None])).sum(axis=0)
        acting = np.interp(TIME - true, TIME, torque) if effect == "input_delay" else torque
        acting = true * acting if effect == "input_gain" else acting

        def slope(t: float, x: np.ndarray, acting: np.ndarray = acting) -> list[float]:
            force = np.interp(t, TIME, acting)
            force -= true * x[1] if effect == "viscous_friction" else 0.0
            force -= true * np.tanh(x[1] / 0.003) if effect == "coulomb_friction" else 0.0
            return [x[1], force / INERTIA]

        run = solve_ivp(slope, (0, TIME[-1]), [0.3, 0.0], t_eval=TIME, rtol=1e-8, atol=1e-9, max_step=0.01)
        phi = run.y[0] + 5e-4 * random.standard_normal(len(TIME))
        rows = np.column_stack([TIME, torque, phi])
        np.savetxt(folder / f"trial_{k}.csv", rows, delimiter=",", header="time,torque,phi", comments="", fmt="%.10g")
    (folder / "case.toml").write_text(
        'files = ["trial_1.csv", "trial_2.csv", "trial_3.csv", "trial_4.csv"]\nlearning = [1, 2, 3]\nheld_out = [4]\n'
        '[columns]\ntime = "s"\ntorque = "N.m"\nphi = "rad"\n[sensors]\nencoder_noise_std_rad = 5e-4\n'
    )
    return folder


def black_box(folder: Path, fmi_version: str = "2.0") -> Path:
    return build_fmu(find_modelica_model("drive").compile(), folder / "box.fmu", fmi_version=fmi_version)


@pytest.mark.parametrize(
    ("effect", "fmi_version", "stepped"),
    [
        ("viscous_friction", "3.0", True),
        ("coulomb_friction", "3.0", False),
        ("input_delay", "2.0", True),
    ],
)
def test_effect_in_the_data_is_named_from_outside_the_fmu(
    effect: str, fmi_version: str, stepped: bool, tmp_path: Path
) -> None:
    measurements = load_measurements(drive_data(tmp_path / "data", effect))
    source = FmuSource.prepare(black_box(tmp_path, fmi_version), measurements, stepped=stepped)

    found = diagnose(source, measurements, workers=1)

    source.fmu.close()
    name, value = TRUTH[effect]
    assert [e.id for e in found.effects] == [effect]
    assert found.effects[0].parameters[name].value == pytest.approx(value, rel=0.03)
    assert found.held_out.reducible_removed > 0.9


def test_command_line_names_the_effect_and_writes_a_system_of_fmus(tmp_path: Path) -> None:
    data, box = drive_data(tmp_path / "data", "viscous_friction"), black_box(tmp_path)
    command = [
        str(Path(sys.executable).with_name("misfit")),
        "discover",
        str(box),
        str(data),
        "--out",
        str(tmp_path / "out"),
    ]

    done = subprocess.run([*command, "--json", "-", "--quiet"], capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    system = tomllib.loads(Path(document["patched_model"]).read_text())
    ends = [end for pair in system["connections"] for end in (pair["from"], pair["to"])]
    ends += [*(end for ends in system["inputs"].values() for end in ends), *system["outputs"].values()]
    described = {
        name: fmpy.read_model_description(str(tmp_path / "out" / component["fmu"]))
        for name, component in system["components"].items()
    }
    for end in ends:
        component, variable = end.split(".", 1)
        assert variable in {v.name for v in described[component].modelVariables}
    friction = next(d for name, d in described.items() if name.startswith("viscous_friction"))
    b = next(float(v.start) for v in friction.modelVariables if v.name == "b")
    assert b == pytest.approx(document["effects"][0]["parameters"]["b[1]"]["value"])
    # The system of FMUs, stepped as anybody would step it, does what the diagnosis promised.
    again = misfit.compare(document["patched_model"], data)
    assert again.held_out is not None
    assert again.held_out.rmse["phi"] == pytest.approx(document["held_out"]["rmse_after"]["phi"], rel=0.02)
    with Simulation(load_system(Path(document["patched_model"]))) as run:
        run.initialise()
        assert run.report.loops == ()  # the speed is a state, which no torque changes at once
    # What cannot be attached is said, one line for each reason.
    (line,) = [w for w in document["warnings"] if w.startswith("payload")]
    assert line.startswith("payload is not tried: the FMU would have to expose its mass as a tunable parameter")


def test_fmu_without_a_force_input_says_what_it_would_have_to_expose(tmp_path: Path) -> None:
    text = """
model Closed "A drive under a voltage"
  input Real torque(unit="V") "Voltage";
  output Real phi(unit="rad", start=0, fixed=true) "Angle";
  Real w(unit="rad/s", start=0, fixed=true) "Speed";
  parameter Real k(unit="rad/(V.s2)") = 50 "Acceleration for a volt";
equation
  der(phi) = w;
  der(w) = k*torque;
end Closed;
"""
    (tmp_path / "Closed.mo").write_text(text)
    data = drive_data(tmp_path / "data", "input_gain")
    case = data / "case.toml"
    case.write_text(case.read_text().replace('torque = "N.m"', 'torque = "V"'))
    box = build_fmu(ModelicaModel("Closed", "Closed", tmp_path / "Closed.mo").compile(), tmp_path / "closed.fmu")

    source = FmuSource.prepare(box, load_measurements(data))

    source.fmu.close()
    line = next(line for line in source.refusals() if "viscous_friction" in line)
    assert "coulomb_friction" in line
    assert line.endswith("the FMU would have to expose an input that acts as a force (N or N.m) on phi")
    assert {c.card.id for c in source.candidates()} >= {"input_gain", "input_delay", "sensor_lag"}


def test_an_fmu_of_a_room_is_told_of_no_friction_and_no_muscles(tmp_path: Path) -> None:
    text = """model Room
  input Real heating(unit = "W");
  output Real T(unit = "K", start = 290, fixed = true);
equation
  5e4*der(T) = heating - 20*(T - 280);
end Room;
"""
    (tmp_path / "Room.mo").write_text(text)
    (tmp_path / "trial.csv").write_text("time,heating,T\n" + "".join(f"{t},{t % 3},{290 - t}\n" for t in range(20)))
    box = build_fmu(ModelicaModel("Room", "Room", tmp_path / "Room.mo").compile(), tmp_path / "room.fmu")

    source = FmuSource.prepare(box, load_measurements(tmp_path / "trial.csv"))

    source.fmu.close()
    assert source.refusals() == ()
    assert {c.card.id for c in source.candidates()} >= {"input_delay", "input_lag", "dead_zone", "sensor_lag"}


def test_an_attribute_that_the_schema_does_not_know_keeps_no_fmu_from_being_used(tmp_path: Path) -> None:
    """Tools write attributes of drafts of the standard, and `misfit validate` is there to tell."""
    with zipfile.ZipFile(black_box(tmp_path, "3.0")) as box, zipfile.ZipFile(tmp_path / "draft.fmu", "w") as draft:
        for name in box.namelist():
            content = box.read(name)
            if name == "modelDescription.xml":
                assert content.count(b"<fmiModelDescription ") == 1
                content = content.replace(b"<fmiModelDescription ", b'<fmiModelDescription order="1" ')
            draft.writestr(name, content)

    opened = FmuFile(tmp_path / "draft.fmu")

    assert [port.name for port in opened.description.outputs] == ["phi"]
    opened.close()


def test_units_and_sizes_of_parameters_follow_from_those_of_the_plant() -> None:
    scales = Scales(
        {"force": 10.0, "speed": 2.0, "position": 0.5}, {"force": "N", "speed": "m/s", "position": "m"}, (1.0, 0.5)
    )

    assert scales.factor("force/speed") == 5.0
    assert scales.unit("force/speed") == "N.s/m"
    assert scales.unit("force/speed2") == "N.s2/m2"
    assert (scales.offset("place"), scales.factor("place"), scales.unit("place")) == (1.0, 0.5, "m")


@pytest.mark.parametrize("law", laws(), ids=lambda law: law.card.id)
def test_law_vanishes_at_its_absent_values_or_in_a_limit(law: object) -> None:
    system, entries = law.system, law.entries  # type: ignore[attr-defined]
    values = [float(entries[v.name]["absent"]) for v in system.parameters]
    if any(entries[v.name]["low"] > entries[v.name]["absent"] for v in system.parameters) or system.n_delays:
        pytest.skip("the effect vanishes only in a limit")
    inputs = {"u": 0.7, "q": 0.3, "w": -0.4}
    x = [0.2] * len(system.states)

    z = system.rhs(0, x, [inputs[v.name] for v in system.inputs], [], values)[1]

    assert float(z[0]) == (0.7 if system.outputs == ("y",) else 0.0)
