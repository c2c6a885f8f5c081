"""Effect cards of a user's own, through the command line: they take part at once, and mistakes name file and key."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from fmus.errors import MisfitError
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
from tests.in_process import misfit_here

CARD = """\
id = "eddy_brake"
title = "Eddy-current brake, strongest where the magnet passes the pole"
class = "EddyBrake"
slots = ["jointTorque1", "jointTorque2", "jointTorque3"]
site = "joint"
elements = "together"
confusable = ["viscous_friction"]
experiment = "swing with small amplitude about several angles"

[parameters.b]
start = 0.001
absent = 0.0
meaningful = 1e-5
"""
CLASS = """\
model EddyBrake "Eddy-current brake between poles"
  import SI = FESArm.Units;
  extends FESArm.Effects.JointTorque.PartialJointTorque;
  parameter SI.RotationalDamping b[n](each min=0, each max=0.1) = fill(0.001, n) "Damping at the pole";
equation
  for i in 1:n loop
    tau[i] = -b[i]*w[i]*sin(2*q[i])^2;
  end for;
end EddyBrake;
"""
TRUE_B = 2e-3


def write_card(folder: Path, card: str = CARD, text: str = CLASS) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "eddy_brake.toml").write_text(card)
    (folder / "EddyBrake.mo").write_text(text)
    return folder


def swings(folder: Path) -> Path:
    """Three swings of the catalogue's pendulum with the brake, from equations written out here, 50 Hz, 1 mrad noise."""
    folder.mkdir()
    m, a, inertia, g = 0.147585, 0.147755, 1.0912e-4, 9.81001
    random, time = np.random.default_rng(4), np.arange(0, 5, 0.02)

    def slope(t: float, x: np.ndarray) -> list[float]:
        torque = m * g * a * np.sin(x[0]) - TRUE_B * x[1] * np.sin(2 * x[0]) ** 2
        return [x[1], torque / (inertia + m * a**2)]

    for k, start in enumerate((1.0, 1.6, 2.0), start=1):
        run = solve_ivp(slope, (0, 5), [start, 0], t_eval=time, rtol=1e-9, atol=1e-10)
        rows = np.column_stack([time, run.y[0] + 1e-3 * random.standard_normal(len(time))])
        np.savetxt(folder / f"swing_{k}.csv", rows, delimiter=",", header="time,theta", comments="", fmt="%.9g")
    (folder / "case.toml").write_text(
        'files = ["swing_1.csv", "swing_2.csv", "swing_3.csv"]\nlearning = [1, 2]\nheld_out = [3]\n'
        '[columns]\ntime = "s"\ntheta = "rad"\n[sensors]\nencoder_noise_std_rad = 1e-3\n'
    )
    return folder


def test_card_of_the_users_own_is_named_and_added_through_the_command_line(tmp_path: Path) -> None:
    cards, data, result = write_card(tmp_path / "cards"), swings(tmp_path / "data"), tmp_path / "diagnosis.json"

    options = ("--json", result, "--experiment", tmp_path / "next.csv")

    done = misfit_here("diagnose", "pendulum", data, "--cards", cards, *options)
    added = misfit_here("add", result, "--cards", cards, "--out", tmp_path)

    assert done.returncode == 0, done.stderr
    # Nothing is left open, so there is no experiment to write down, and that is said.
    assert "next.csv is not written: nothing is left open" in " ".join(done.stdout.split())
    assert not (tmp_path / "next.csv").exists()
    effects = json.loads(result.read_text())["effects"]
    assert [effect["id"] for effect in effects] == ["eddy_brake"]
    assert effects[0]["parameters"]["b[1]"]["value"] == pytest.approx(TRUE_B, rel=0.05)
    assert added.returncode == 0, added.stderr
    # The written class stands alone: it compiles from its own file, with the user's class inside.
    written = find_modelica_model(f"{tmp_path / 'Pendulum_1.mo'}:Pendulum_1").compile()
    b = next(v for v in written.parameters if v.name.endswith(".b[1]"))
    assert b.start == pytest.approx(effects[0]["parameters"]["b[1]"]["value"])


def change(old: str, new: str) -> Callable[[str], str]:
    return lambda text: text.replace(old, new)


NEED = '[[needs]]\nvariable = "w"\nwhat = "speed"\nbeyond = 0.1\nsamples = 50\n'


def with_need(old: str = "", new: str = "") -> Callable[[str], str]:
    return lambda card: card + NEED.replace(old, new)


CARD_MISTAKES = {
    "need of a variable that is not there": (
        with_need('"w"', '"speed"'),
        "[[needs]] 1: class EddyBrake has no variable 'speed'; it has q, w, a, tau",
    ),
    "need without a number": (with_need("beyond = 0.1\nsamples = 50\n"), "[[needs]] 1: has variable, what; expected one of"),
    "need of unknown parameter": (
        with_need("beyond = 0.1", 'beyond = "c"'),
        "[[needs]] 1: 'beyond' = 'c', expected a number, or a parameter of the card: b",
    ),
    "need of no samples": (with_need("samples = 50", "samples = 0"), "'samples' = 0, expected a number above 0"),
    "not TOML": (change('id = "eddy_brake"', "id = eddy_brake"), "not valid TOML"),
    "missing key": (change('title = "Eddy-current brake, strongest where the magnet passes the pole"\n', ""), "lacks 'title'"),
    "misspelt key": (change("elements =", "element ="), "'element' is no key of an effect card; did you mean 'elements'?"),
    "text for a list": (
        change('slots = ["jointTorque1", "jointTorque2", "jointTorque3"]', 'slots = "jointTorque1"'),
        "'slots' = 'jointTorque1', expected a list of strings",
    ),
    "unknown choice": (change('"together"', '"all"'), "'elements' = 'all', expected one of together, each, pairs"),
    "taken id": (change('id = "eddy_brake"', 'id = "payload"'), "id = 'payload' is taken by the shipped library"),
    "class that is not there": (change('class = "EddyBrake"', 'class = "EddyBreak"'), "there is EddyBrake.mo"),
    "misspelt slot": (
        change('slots = ["jointTorque1", "jointTorque2", "jointTorque3"]', 'slots = ["jointTorqe1"]'),
        "pendulum has no slot 'jointTorqe1'; did you mean 'jointTorque1'?",
    ),
    "parameter that the class lacks": (change("[parameters.b]", "[parameters.d]"), "has no parameter 'd'; it has"),
    "start beyond the bounds": (change("start = 0.001", "start = 7"), "start = 7 N.m.s/rad is outside the class's bounds [0, 0.1]"),
    "text for a number": (change("start = 0.001", 'start = "small"'), "[parameters.b]: 'start' = 'small', expected a number"),
    "nothing fitted": (lambda text: text.split("[parameters.b]")[0] + "[parameters]\n", "such as [parameters.b]"),
    "a default that is not absence": (
        change('"together"', '"each"'),
        "class EddyBrake has the default b = 0.001 N.m.s/rad, but the effect is absent at 0",
    ),
    "size without a sense": (change("meaningful = 1e-5", "meaningful = 0"), "'meaningful' = 0, expected a number above 0"),
}  # fmt: skip
CLASS_MISTAKES = {
    "no bounds": (change("(each min=0, each max=0.1)", ""), "[parameters.b]: give the parameter both bounds"),
    "another contract": (change("JointTorque.PartialJointTorque", "WristLoad.PartialWristLoad"), "does not fit slot"),
    "broken Modelica": (
        change("for i in 1:n loop", "for i in 1:n do"),
        "class EddyBrake does not fit slot jointTorque1",
    ),
    "something left where it is absent": (
        change("tau[i] = -b[i]", "tau[i] = -0.5 - b[i]"),
        "class EddyBrake still changes der(w) where the card says that the effect is absent (b = 0)",
    ),
    "part of a package": (lambda text: "within Mine;\n" + text, "EddyBrake.mo is part of a package"),
}


@pytest.mark.parametrize("mistake", [*CARD_MISTAKES, *CLASS_MISTAKES])
def test_typical_mistake_gives_one_line_that_names_the_file_and_what_to_do(mistake: str, tmp_path: Path) -> None:
    changed, words = (CARD_MISTAKES | CLASS_MISTAKES)[mistake]
    card, text = (changed(CARD), CLASS) if mistake in CARD_MISTAKES else (CARD, changed(CLASS))
    folder = write_card(tmp_path / "cards", card, text)
    pendulum = find_modelica_model("pendulum")

    with pytest.raises(MisfitError) as caught:
        find_candidates(pendulum, pendulum.compile(), effect_library([folder]))

    message = str(caught.value)
    assert words in message
    assert "eddy_brake.toml" in message
    assert "\n" not in message


def test_a_sensor_that_reads_falsely_where_its_error_is_absent_is_refused(tmp_path: Path) -> None:
    """It changes no rate, but what is read."""
    card = CARD.replace("jointTorque1", "jointSensor1").replace(', "jointTorque2", "jointTorque3"', "")
    text = (
        CLASS.replace("JointTorque.PartialJointTorque", "JointSensor.PartialJointSensor")
        .replace("SI.RotationalDamping", "Real")
        .replace("tau[i] = -b[i]*w[i]*sin(2*q[i])^2", "y[i] = q[i] + 0.02 + b[i]*q[i]^2")
    )
    pendulum = find_modelica_model("pendulum")

    with pytest.raises(MisfitError, match="still changes theta where the card says that the effect is absent"):
        find_candidates(pendulum, pendulum.compile(), effect_library([write_card(tmp_path / "wrong", card, text)]))
    right = write_card(tmp_path / "right", card, text.replace(" + 0.02", ""))
    assert find_candidates(pendulum, pendulum.compile(), effect_library([right]))[0]


def test_folder_without_cards_ends_with_code_2_and_says_so(tmp_path: Path) -> None:
    done = misfit_here("diagnose", "pendulum", "nowhere", "--cards", tmp_path)

    assert done.returncode == 2
    assert "no effect card there" in done.stderr


def test_effect_of_a_diagnosis_whose_cards_are_not_named_is_refused_with_a_hint(tmp_path: Path) -> None:
    cards = write_card(tmp_path / "cards")
    found = misfit_here("add", "eddy_brake", "--to", "pendulum", "--cards", cards, "--out", tmp_path)
    lost = misfit_here("add", "eddy_brake", "--to", "pendulum", "--out", tmp_path)

    assert found.returncode == 0, found.stderr
    assert lost.returncode == 2
    assert "there is no effect 'eddy_brake'" in lost.stderr


def test_a_card_of_ones_own_is_said_not_to_be_tried_on_an_fmu(tmp_path: Path) -> None:
    """Its class needs equations; what is attached to an FMU from outside is named by that FMU alone."""
    from orchestrator.blackbox.source import FmuSource

    class Closed(FmuSource):
        def candidates(self) -> list:
            return []

        def refusals(self) -> tuple[str, ...]:
            return ()

    cards = effect_library([write_card(tmp_path / "cards")])
    drive = find_modelica_model("drive")
    closed = Closed("drive.fmu", drive.class_name, drive.file, None, None)

    _, reasons = find_candidates(closed, drive.compile(), cards)

    (reason,) = reasons
    assert reason.startswith("eddy_brake is not tried: ")
    assert reason.endswith("eddy_brake.toml needs equations, and an FMU's are closed")
