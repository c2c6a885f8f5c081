"""A session as a measurement set of one joint, with a nominal model beside it: what `misfit discover` needs, and nothing else.

The model has inertia and nothing more, so friction, a spring, a weak motor or a delay is what it lacks. Its input is
the torque that acted: what the safety core let pass, without the part that holds the arm's weight.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fmus.errors import MisfitError
from fmus.files import write_atomically
from hil.control.pilot import Decision, Pilot
from hil.recording.replay import RecordedCycle, replay
from hil.trials.files import acted
from orchestrator.results import Column, recorder_for

JOINT_FILE, CASE, MODEL, CLASS, BLOCK = "joint.parquet", "case.toml", "Nominal.mo", "Nominal", "block.json"
DIAGNOSIS, FOUND = "diagnosis.json", "found"
# Names of the model's own variables.
COLUMNS = (
    Column("torque", "N.m", description="mean torque that acted until the next row"),
    Column("phi", "rad", description="angle of the joint"),
)
# kg.m2: that of a joint of the virtual robot without an arm on it.
INERTIA = 0.05
# The rest is held out.
_LEARNING = 2 / 3
# A recording with fewer cycles under torque says nothing.
_LEAST = 50


@dataclass(frozen=True)
class Identification:
    """What was written: the joint, how many rows, how far it moved (rad)."""

    joint: int
    rows: int
    moved: float


def write_identification(
    recording: Path, pilot: Pilot, out: Path, joint: int | None = None, inertia: float = INERTIA
) -> Identification:
    """Write the measurement set and the nominal model of a joint of a session into a folder.

    Args:
        recording: its folder.
        pilot: set up as that of the session.
        joint: its number; the one that moved most without it.
        inertia: kg.m2 of the nominal model.

    Raises:
        MisfitError: if the arm was armed for too few cycles, the joint stood still, or the inertia is none.
    """
    if not (np.isfinite(inertia) and inertia > 0):
        raise MisfitError(f"inertia = {inertia:g} kg.m2; a positive number was expected")
    times, torques, angles = _armed_rows(recording, pilot)
    moved = np.ptp(angles, axis=0)
    k = int(np.argmax(moved)) if joint is None else joint - 1
    step = float(pilot.robot.steps[k])
    if moved[k] < 2 * step:
        raise MisfitError(
            f"{recording}: joint {k + 1} moved by {moved[k]:.3g} rad, within its encoder's steps of {step:.2g} rad; record a motion"
        )
    rows = np.column_stack([torques[:, k], angles[:, k]])
    out.mkdir(parents=True, exist_ok=True)
    recorder = recorder_for(out / JOINT_FILE)
    recorder.begin(COLUMNS, {"recording": str(recording), "joint": k + 1})
    recorder.rows(times, rows)
    recorder.finish()
    write_atomically(out / CASE, _case(float(times[-1]), step, k + 1, pilot.robot.about).encode())
    write_atomically(out / MODEL, nominal_model(k + 1, inertia).encode())
    return Identification(k + 1, len(rows), float(moved[k]))


def _armed_rows(recording: Path, pilot: Pilot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (n,) s from 0 at which angles were measured, mean torques (n, joints) N.m from each to the next, angles (n, joints) rad."""
    starts, passed, took, angles, fresh = [], [], [], [], []
    for _, cycle, decision in replay(recording, pilot):
        if decision.observed.seconds < 0:
            continue
        starts.append(cycle.given.start_ns)
        passed.append(_acted(cycle, decision, pilot))
        took.append(cycle.took)
        angles.append(decision.observed.q)
        fresh.append(decision.observed.fresh)
    if sum(fresh) < _LEAST:
        raise MisfitError(
            f"{recording}: {sum(fresh)} cycles of an armed arm; {_LEAST} or more were expected, so that a model can be compared with them"
        )
    times = (np.array(starts) - starts[0]) * 1e-9
    seen = times[fresh]
    edges = np.append(seen, seen[-1] + np.median(np.diff(seen)))
    return seen, acted(edges, times, np.array(passed), np.array(took)), np.array(angles)[fresh]


def _acted(cycle: RecordedCycle, decision: Decision, pilot: Pilot) -> np.ndarray:
    """Torques (3,) in N.m that the motors heard, in their own whole units, without the part that holds the weight."""
    outcome = decision.outcome
    if outcome.torques is None or outcome.to_idle:
        return np.zeros(len(pilot.limits.joints))
    commanded = pilot.robot.commanded([timed.frame for timed in cycle.decided])
    if commanded is None:
        return np.zeros(len(pilot.limits.joints))
    return commanded - (np.array(outcome.torques) - np.array(decision.passed))


def _case(seconds: float, step: float, joint: int, about: str) -> str:
    cut = round(_LEARNING * seconds, 3)
    units = "\n".join(f"{json.dumps(column.name)} = {json.dumps(column.unit)}" for column in COLUMNS)
    return (
        f'title = {json.dumps(f"joint {joint}: {about}")}\nfiles = ["{JOINT_FILE}"]\nunits_certain = true\n'
        f"learning_window_s = [0.0, {cut}]\nheld_out_window_s = [{cut}, {seconds:.3f}]\n\n"
        f'[columns]\ntime = "s"\n{units}\n\n'
        f'[interpolation]\n{COLUMNS[0].name} = "hold"\n\n'
        # An encoder's error is its step by the root of 12; all times are of one clock.
        f"[sensors]\nencoder_noise_std_rad = {step / np.sqrt(12):.3g}\nclock_noise_std_s = 0\n"
    )


def nominal_model(joint: int, inertia: float) -> str:
    """Modelica text of a joint that has inertia and nothing else, and places for what it lacks."""
    return (
        f'model {CLASS} "Joint {joint} with inertia alone; what it lacks is to be found"\n'
        f"  extends FESArm.Plants.Drive(J = {inertia:g});\nend {CLASS};\n"
    )
