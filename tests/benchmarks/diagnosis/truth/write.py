"""A drawn case as a measurement set on disk, and its entry among the answers."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.diagnosis.truth.excitation import Plan
from tests.benchmarks.diagnosis.truth.families import HELD_OUT, TOLERANCE, TRIALS, Drawn
from tests.benchmarks.diagnosis.truth.run import Run, nominal_run, run_trial


def write_case(case: Drawn, folder: Path) -> dict[str, Any]:
    """Write the measurement set of a case, and return its answer; the nominal error is that of free runs from the true start."""
    machine = case.machine
    records = write_measurements(case, folder)
    nominal, true = [], []
    for number in HELD_OUT:
        run, columns = records[number - 1]
        inputs = _on_grid(case, run, columns)
        measured = np.column_stack([columns[name] for name in machine.outputs])
        true.append(_true_error(case, case.plans[number - 1], inputs, columns["time"], measured))
        left = at_samples(run.time, nominal_run(machine, run, inputs), columns["time"]) - measured
        nominal.append(np.mean(left**2, axis=0))
    return _answer(case, np.sqrt(np.mean(nominal, axis=0)), np.sqrt(np.mean(true, axis=0)))


def write_measurements(
    case: Drawn, folder: Path, further: Sequence[Plan] = ()
) -> list[tuple[Run, dict[str, np.ndarray]]]:
    """Write the trials and case.toml of a case; `further` trials are learned from, too. Returns runs and their records.

    The noise of the case's own trials does not depend on further ones.
    """
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng([case.wish.seed, case.wish.index, 7])
    records = []
    for number, plan in enumerate([*case.plans, *further], 1):
        run = run_trial(case.machine, plan, case.injections, case.changed, mujoco=True)
        columns = case.recorder.record(run, random)
        _write_trial(folder / f"trial_{number:02d}.csv", columns)
        records.append((run, columns))
    (folder / "case.toml").write_text(_case_toml(case, TRIALS + len(further)))
    return records


def _on_grid(case: Drawn, run: Run, columns: dict[str, np.ndarray]) -> np.ndarray:
    names = list(case.machine.inputs)
    if not names:
        return np.zeros((len(run.time), 0))
    return np.column_stack([np.interp(run.time, columns["time"], columns[name]) for name in names])


def _true_error(case: Drawn, plan: Plan, inputs: np.ndarray, at: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Mean square errors (ny,) of the true model driven by the recorded inputs, its start values fitted (linearly).

    First positions may move from the true ones by as much as an encoder errs, speeds freely. What noise of the inputs
    leaves is slow, so an encoder's error at the start weighs as much as the whole record.
    """

    def outputs(q0: np.ndarray, v0: np.ndarray) -> np.ndarray:
        moved = replace(plan, q0=q0, v0=v0)
        again = run_trial(case.machine, moved, case.injections, case.changed, as_recorded=inputs)
        return at_samples(again.time, again.outputs, at) / case.noise

    here = outputs(plan.q0, plan.v0)
    steps = 1e-6 * np.eye(len(plan.q0))
    moves = [outputs(plan.q0 + step, plan.v0) - here for step in steps]
    moves += [outputs(plan.q0, plan.v0 + step) - here for step in steps]
    columns = np.column_stack([move.ravel() for move in moves])
    weight = case.noise / case.recorder.output_noise * np.sqrt(len(at))
    first = np.column_stack([move[0] * weight for move in moves])
    left = (here - measured / case.noise).ravel()
    wanted = np.concatenate([-left, np.zeros(len(first))])
    change, *_ = np.linalg.lstsq(np.vstack([columns, first]), wanted, rcond=1e-8)
    left = left + columns @ change
    return np.mean((left.reshape(measured.shape) * case.noise) ** 2, axis=0)


def at_samples(time: np.ndarray, series: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Columns of a series (n, k) at other times, straight between samples."""
    return np.column_stack([np.interp(at, time, column) for column in series.T])


def _write_trial(path: Path, columns: dict[str, np.ndarray]) -> None:
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")


def _case_toml(case: Drawn, trials: int) -> str:
    machine, recorder = case.machine, case.recorder
    files = ", ".join(f'"trial_{k:02d}.csv"' for k in range(1, trials + 1))
    learning = [k for k in range(1, trials + 1) if k not in HELD_OUT]
    lines = [
        "# Made by tests/benchmarks/diagnosis; every column is a sample of a continuous signal at the time in column 1",
        f"files = [{files}]",
        f"learning = {learning}",
        f"held_out = {list(HELD_OUT)}",
        "",
        "[sampling]",
        f"rate_hz = {machine.rate_hz}",
        "",
        "[columns]",
        'time = "s"',
        *(f'{name} = "{unit}"' for name, unit in {**machine.inputs, **machine.outputs}.items()),
        "",
        "[sensors]",
    ]
    for name, unit in machine.outputs.items():
        key = unit.replace("/", "_per_")
        lines += [
            f"{name}_resolution_{key} = {recorder.resolution:.6e}",
            f"{name}_noise_std_{key} = {recorder.std:.3e}",
        ]
    for (name, unit), std in zip(machine.inputs.items(), recorder.input_std, strict=True):
        if name not in machine.commands:
            lines.append(f'"{name}_noise_std_{unit.replace("/", "_per_")}" = {std:.3e}')
    lines += ["", "[initial_conditions]", "given = false", ""]
    if case.changed:
        lines += ["[tolerances]  # relative, of the model's own values"]
        lines += [f'"{parameter}" = {TOLERANCE}' for parameter in machine.tolerances.values()]
        lines += [""]
    return "\n".join(lines)


def _answer(case: Drawn, nominal: np.ndarray, true: np.ndarray) -> dict[str, Any]:
    machine, wish = case.machine, case.wish
    names = list(machine.outputs)
    return {
        "family": wish.family,
        "model": machine.name,
        "effects": [i.id for i in case.injections] or ["none"],
        "sites": [i.site for i in case.injections],
        "kind": case.kind,
        "parameters": [{"effect": i.id, "site": i.site, **i.parameters} for i in case.injections],
        "noise_level": case.recorder.level,
        "seconds_per_trial": wish.seconds * machine.slow,
        "record_seconds": wish.seconds,
        "wanted_enr": wish.enr,
        "enr": case.enr,
        "enr_each": list(case.enr_each),
        "enr_left": case.enr_left,
        "noise": dict(zip(names, case.noise.tolist(), strict=True)),
        "nominal_rmse_heldout": dict(zip(names, nominal.tolist(), strict=True)),
        "true_model_rmse_heldout": dict(zip(names, true.tolist(), strict=True)),
        "nominal_freerun_rmse_heldout_rad": float(np.sqrt(np.mean(nominal**2))),
        "true_model_rmse_heldout_rad": float(np.sqrt(np.mean(true**2))),
        "changed": {machine.tolerances[k]: v for k, v in case.changed.items()},
        "seed": wish.seed,
    }
