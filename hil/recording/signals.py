"""A recording as other tools want it: signals in Parquet, a measurement set. Made by replaying it."""

import json
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from fmus.files import write_atomically
from hil.control.abilities import Showing
from hil.control.pilot import Decision, Pilot
from hil.recording.replay import RecordedCycle, replay
from hil.trials.controller import Trials
from hil.trials.files import TrialFiles
from orchestrator.results import Column, recorder_for

SIGNALS, CASE = "signals.parquet", "case.toml"


def columns_of(joints: int) -> tuple[Column, ...]:
    """Columns of a session with a robot of so many joints."""
    each = range(1, joints + 1)
    passed = "what of that the safety core let pass at joint {}, without its weight"
    return (
        *(Column(f"q{k}", "rad", description=f"angle of joint {k}") for k in each),
        *(Column(f"w{k}", "rad/s", description=f"speed of joint {k}, low-pass filtered") for k in each),
        *(Column(f"tau{k}", "N.m", description=f"torque sent to joint {k}") for k in each),
        *(Column(f"asked{k}", "N.m", description=f"torque that the controller asked for at joint {k}") for k in each),
        *(Column(f"passed{k}", "N.m", description=passed.format(k)) for k in each),
        Column("took", "s", description="time from the beginning of the cycle until its torques were sent"),
        Column("fresh", "1", "Int32", "1 where all angles were measured in this cycle, 0 where one is as it was"),
        *(Column(f"f{axis}", "N", description=f"force at the wrist along {axis}") for axis in "xyz"),
        Column(
            "reaction",
            "1",
            "Int32",
            "what the safety core did: 0 pass, 1 reduce, 2 comply, 3 support, 4 release, 5 silence",
        ),
    )


# Rows that are handed on at a time.
_BLOCK = 4096
# Share of a session that is learnt from; the rest is held out.
_LEARNING = 2 / 3


def write_signals(folder: Path, pilot: Pilot, provenance: dict[str, Any], frame: str) -> None:
    """Write `signals.parquet` and the `case.toml` that makes the folder a measurement set.

    A session of trials becomes one of its trials, a file each; any other one is a single record.

    Args:
        pilot: set up as that of the session.
        frame: whose joints `q1` and so on are, so that nobody takes them for an arm's.
    """
    shown = pilot.controller.signals if isinstance(pilot.controller, Showing) else ()
    columns = (
        *columns_of(len(pilot.limits.joints)),
        *(Column(signal.name, signal.unit, description=signal.description) for signal in shown),
    )
    recorder = recorder_for(folder / SIGNALS)
    recorder.begin(columns, {**provenance, "frame": frame})
    controller = pilot.controller
    trials = None
    if isinstance(controller, Trials):
        trials = TrialFiles(folder, columns, controller.course.protocol, controller.placement)
    cycles = replay(folder, pilot)
    began: int | None = None
    last = 0.0
    while block := list(islice(cycles, _BLOCK)):
        began = block[0][1].given.start_ns if began is None else began
        times = np.array([(cycle.given.start_ns - began) * 1e-9 for _, cycle, _ in block])
        rows = np.array([_row(cycle, decision) for _, cycle, decision in block])
        recorder.rows(times, rows)
        if trials is not None:
            trials.rows(times, rows)
        last = float(times[-1])
    recorder.finish()
    case = trials.finish() if trials is not None else ""
    write_atomically(folder / CASE, (case or _case(last, frame, columns_of(len(pilot.limits.joints)))).encode())


def _row(cycle: RecordedCycle, decision: Decision) -> list[float]:
    outcome, observed = decision.outcome, decision.observed
    torques = outcome.torques if outcome.torques is not None else (0.0,) * len(observed.q)
    asked, fresh = decision.asked, float(observed.fresh)
    row = [*observed.q, *observed.w, *torques, *asked, *decision.passed, cycle.took, fresh, *observed.f]
    return [*row, float(outcome.reaction), *decision.shown]


def _case(seconds: float, frame: str, columns: tuple[Column, ...]) -> str:
    units = "\n".join(f"{json.dumps(column.name)} = {json.dumps(column.unit)}" for column in columns)
    cut = round(_LEARNING * seconds, 3)
    return (
        f"files = [{json.dumps(SIGNALS)}]\nframe = {json.dumps(frame)}\nunits_certain = true\n"
        f"learning_window_s = [0.0, {cut}]\nheld_out_window_s = [{cut}, {seconds:.3f}]\n\n"
        f'[columns]\ntime = "s"\n{units}\n'
    )
