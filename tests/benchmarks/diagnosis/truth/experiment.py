"""The recommended experiment on the true machine: its record joins those that a diagnosis learns from."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.benchmarks.diagnosis.truth.excitation import Plan
from tests.benchmarks.diagnosis.truth.families import HELD_OUT, TRIALS, Drawn
from tests.benchmarks.diagnosis.truth.run import run_trial
from tests.benchmarks.diagnosis.truth.write import write_measurements


@dataclass(frozen=True)
class Advice:
    """A recommended experiment: a table of inputs, or a repetition of the first trial.

    A machine that nothing drives is let go `start_scale` times as far from its mean position as in the first trial, and
    `start_offset` (rad or m) further.
    """

    table: Path
    repeat: bool
    start_scale: float = 1.0
    start_offset: float = 0.0


def write_with_experiment(case: Drawn, folder: Path, advice: Advice) -> None:
    """Write the case as it was, with the record of the experiment as one more learning trial.

    Raises:
        TruthError: if the true machine leaves all bounds in the experiment.
    """
    plan = case.plans[0] if advice.repeat else experiment_plan(case, advice)
    write_measurements(case, folder, further=[plan])


def experiment_plan(case: Drawn, advice: Advice) -> Plan:
    """The experiment as a trial without a run-in: it starts at rest where the first trial did.

    Its inputs are straight between the rows of the table; an input that the table lacks is left at zero.
    """
    machine = case.machine
    with advice.table.open() as stream:
        rows = list(csv.DictReader(stream))
    at = np.array([float(row["time"]) for row in rows])
    time = np.arange(round((at[-1] - at[0]) / machine.step) + 1) * machine.step
    inputs = np.zeros((len(time), len(machine.inputs)))
    for k, name in enumerate(machine.inputs):
        if name in rows[0]:
            inputs[:, k] = np.interp(time, at - at[0], [float(row[name]) for row in rows])
    learning = [run_trial(machine, plan, case.injections, case.changed) for plan in _learned(case)]
    start = learning[0].q[0, : len(machine.order)]
    middle = np.concatenate([run.q[:, : len(start)] for run in learning]).mean(axis=0)
    q0 = middle + advice.start_scale * (start - middle) + advice.start_offset
    return Plan(len(case.plans), inputs, q0, np.zeros(len(start)), run_in_s=0.0)


def _learned(case: Drawn) -> list[Plan]:
    return [plan for number, plan in enumerate(case.plans, 1) if number <= TRIALS and number not in HELD_OUT]
