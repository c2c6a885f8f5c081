"""Postures held on the bus by stimulation alone: what the model lacks ends as activation, not as an error of the angle."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from fmus.errors import MisfitError
from hil.cli import hil
from hil.control.pilot import Pilot
from hil.emulation.planar import Placement
from hil.robots import proficio
from hil.session.loop import Loop, Wishes
from hil.settings import default_settings, settings_of_json
from hil.stimulation.controller import Stimulation, least_jerk
from hil.stimulation.plan import Plan, Rest
from hil.virtual.arm_plant import ArmPlant
from hil.virtual.caregiver import Caregiver
from tests.hil.bench import Bench, ExactTimer

# Passive tissue of the arm, which the controller's model has not, and
# weak shoulder and brachialis, a strong biceps: the controller knows nothing of it.
STRENGTH = (0.7, 0.8, 1.25, 1.0, 1.0, 0.7)
STIFF = {"Kp": 10000.0}


def stimulated(plan: Plan) -> Stimulation:
    """A session in virtual time."""
    settings = replace(default_settings(rate_hz=100.0), gravity=False, stimulation=plan)
    bench = Bench(settings=settings)
    plant = ArmPlant(proficio.HOME["right"], Placement(), "arm", STIFF, Caregiver())
    bench.plant = bench.robot.plant = plant  # type: ignore[assignment]
    controller = settings.make_controller()
    assert isinstance(controller, Stimulation)
    pilot = Pilot(bench.started(), settings.limits, controller, gravity=False)
    count = 0

    def wishes() -> Wishes:
        nonlocal count
        count += 1
        comes_to_rest = count < 300
        return Wishes(arm=not pilot.is_armed and not comes_to_rest, over=controller.is_done or count > 4000)

    summary = Loop(bench.wire, pilot, ExactTimer(bench)).run(wishes)
    assert not summary.faults or summary.faults[0].startswith("not_ended"), summary.faults
    return controller


def test_the_integrator_takes_the_error_that_a_wrong_model_leaves() -> None:
    plan = Plan(((0.3, 1.0),), reach_s=1.0, hold_s=3.0, strength=STRENGTH)
    [without] = stimulated(replace(plan, integral=0.0)).held
    [with_it] = stimulated(plan).held
    # An integrator of 1.5 1/s leaves exp(-1.5 * 3) = 1 % after the hold, if feedback alone sets the pace.
    assert without.error > 0.02
    assert with_it.error < 0.05 * without.error
    assert max(with_it.activations) <= 1.0


def test_an_arm_whose_tissue_pulls_it_from_the_stops_comes_to_rest_before_it_is_armed(tmp_path: Path) -> None:
    """The command let it fall into the test of its signs, which ended the session."""
    options = ["--virtual", "--posture", "0.5", "1.2", "--set", "Kp=10000", "--out", str(tmp_path / "held")]
    done = CliRunner().invoke(hil, ["stimulate", *options, "--json", str(tmp_path / "said.json"), "--quiet"])
    assert done.exit_code == 0, done.output
    [found] = json.loads((tmp_path / "said.json").read_text())["rounds"]
    assert found["error_rad"] < 2e-3


def test_what_a_round_has_shown_is_known_to_the_next_one() -> None:
    plan = Plan(((0.3, 1.0),), reach_s=1.0, hold_s=2.0, strength=STRENGTH, integral=0.0)
    [first] = stimulated(plan).held
    [second] = stimulated(plan.after((first.rest,))).held
    assert second.error < 0.7 * first.error


def test_a_plan_comes_back_from_its_recording_as_it_was() -> None:
    plan = Plan(((0.3, 1.0), (0.75, 1.9)), strength=STRENGTH, learned=(Rest((0.3, 1.0), (0.1,) * 6),))
    settings = replace(default_settings(), stimulation=plan)
    assert settings_of_json(json.dumps(settings.to_json())).stimulation == plan


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"postures": ()}, "one or more were expected"),
        ({"integral": -1.0}, "integral = -1 1/s"),
        ({"hold_s": 0.1}, "hold_s = 0.1"),
        ({"strength": (1.0,) * 5}, "6 numbers from 0 to 2"),
        ({"reach_s": float("nan")}, "a value that is no number"),
    ],
)
def test_a_plan_that_cannot_be_held_is_refused(wrong: dict, told: str) -> None:
    with pytest.raises(MisfitError, match=told):
        Plan(**{"postures": ((0.3, 1.0),), **wrong})


def test_the_way_to_a_posture_begins_and_ends_at_rest() -> None:
    assert least_jerk(0.0, 2.0) == (0.0, 0.0)
    assert least_jerk(5.0, 2.0) == (1.0, 0.0)
    assert least_jerk(1.0, 2.0) == (0.5, pytest.approx(1.875 / 2.0))


def test_stimulation_asks_which_robot_is_meant_and_takes_no_other_kind(tmp_path: Path) -> None:
    done = CliRunner().invoke(hil, ["stimulate", "--out", str(tmp_path / "out")])
    assert isinstance(done.exception, MisfitError) and "--virtual or --bench" in str(done.exception)
    (bench := tmp_path / "bench.toml").write_text('[bus]\ninterface = "virtual"\n[robot]\nkind = "cia402"\n')
    done = CliRunner().invoke(hil, ["stimulate", "--bench", str(bench), "--out", str(tmp_path / "out")])
    assert isinstance(done.exception, MisfitError) and "another robot" in str(done.exception)
