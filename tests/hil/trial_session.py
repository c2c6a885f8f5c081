"""A session of trials without time: the emulated arm on a virtual robot that lies on a bus inside the process."""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hil.barrett.kind import Proficio
from hil.control.pilot import Decision, Pilot
from hil.emulation.planar import Placement
from hil.recording.recorder import Recorder
from hil.recording.signals import write_signals
from hil.robots import proficio
from hil.session.loop import Loop, Summary, Wishes
from hil.session.recorded import ROBOT, SETTINGS, recorded_pilot
from hil.settings import Settings, default_settings
from hil.trials.controller import Trials
from hil.trials.phases import Phase
from hil.trials.protocol import Protocol, read_protocol
from hil.virtual.arm_plant import ArmPlant
from hil.virtual.caregiver import Caregiver, Person
from hil.virtual.faults import Faults
from tests.hil import bench
from tests.hil.bench import Bench, ExactTimer

# An arm with friction at the elbow that no session is told of.
HIDDEN = """model HiddenFriction "The arm with friction that nobody is told of"
  extends FESArm.Arms.Arm(
    redeclare model JointTorque1 = FESArm.Effects.JointTorque.ViscousFriction, jointTorque1(b={0, 0.4}));
end HiddenFriction;
"""
FRICTION = 0.4


def some_trials(count: int) -> Protocol:
    """The study's trials from the second on; the first one hardly moves the arm."""
    study = read_protocol("study")
    return replace(study, trials=study.trials[1 : count + 1], confirm=False)


@dataclass
class Session:
    """What is left of one; `speeds` (3,) rad/s are those of the plant at each decision."""

    folder: Path
    summary: Summary
    controller: Trials
    decisions: list[Decision]
    speeds: list[np.ndarray]


def run_trials(
    folder: Path,
    protocol: Protocol,
    rate_hz: float = 500.0,
    share: float = 0.0,
    keep: bool = False,
    faults: Faults | None = None,
    body: str | None = None,
    person: Person | None = None,
) -> Session:
    """Run and record a session; `share` of what is learned is compensated; decisions are kept if asked for.

    The virtual arm is `body`, by default one with hidden friction, held by `person`.
    """
    if body is None:
        (model := folder.parent / "HiddenFriction.mo").write_text(HIDDEN)
        body = f"{model}:HiddenFriction"
    settings = _settings(protocol, rate_hz, share)
    there = Bench(settings=settings, faults=faults)
    plant = ArmPlant(proficio.HOME["right"], Placement(), body, caregiver=Caregiver(person))
    there.plant = there.robot.plant = plant  # type: ignore[assignment]
    robot = there.started()
    controller = settings.make_controller()
    assert isinstance(controller, Trials)
    pilot = Pilot(robot, settings.limits, controller, gravity=False)
    recorder = Recorder(folder)
    (folder / SETTINGS).write_text(json.dumps(settings.to_json()))
    (folder / ROBOT).write_text(json.dumps(robot.to_json()))
    there.wire.tap = recorder.frame
    decisions: list[Decision] = []
    speeds: list[np.ndarray] = []

    def watch(start_ns: int, decision: Decision) -> None:
        if keep:
            decisions.append(decision)
            speeds.append(plant.speeds.copy())
        gripped = controller.course.phase in (Phase.ANNOUNCE, Phase.STIMULATE)
        if gripped != plant.caregiver.wants:
            plant.caregiver.hold() if gripped else plant.caregiver.relax()

    loop = Loop(there.wire, pilot, ExactTimer(there), recorder, watch=watch)
    summary = loop.run(lambda: Wishes(arm=not pilot.is_armed, over=controller.is_done))
    recorder.finish()
    there.close()
    write_signals(folder, recorded_pilot(folder), {}, Proficio.frame)
    return Session(folder, summary, controller, decisions, speeds)


def _settings(protocol: Protocol, rate_hz: float, share: float) -> Settings:
    settings = replace(bench.SETTINGS, protocol=protocol, learning=replace(bench.SETTINGS.learning, share=share))
    return replace(settings, limits=default_settings(rate_hz=rate_hz).limits)
