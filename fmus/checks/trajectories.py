"""Trajectories: of the reference results in the FMU, and of its two interfaces against each other."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fmus.checks.instance import running
from fmus.checks.subject import Numbers, Subject
from fmus.reference_files import Replay, Table, read_replay

# Steps for comparing the interfaces; the difference allowed is a share of each signal's range.
MOST_STEPS = 500
# An FMU that declares a tolerance keeps it; one that does not may have a crude solver, such as Euler's method.
SHARE_WITH_TOLERANCE, SHARE = 1e-3, 0.1


def check_reference(subject: Subject) -> Iterator[str]:
    """The FMU's own reference results come out again, within the tolerances that it states."""
    replay = read_replay(subject.folder)
    if replay is None or subject.interface("CoSimulation") is None:
        return
    places = _places(subject)
    for name in (*replay.inputs.names, *replay.results.names):
        if name not in places:
            yield f"the reference results name {name!r}, which is no variable of the FMU"
            return
    results = _replayed(subject, replay, places)
    for column, name in enumerate(replay.results.names):
        excess = np.abs(results[:, column] - replay.results.values[:, column])
        limit = replay.tolerances[name]
        if not (excess <= limit).all():
            row = int(np.argmax(~(excess <= limit)))
            yield (
                f"{name!r} is {results[row, column]:.9g} at t = {replay.results.times[row]:.6g} s; the reference "
                f"says {replay.results.values[row, column]:.9g}, at most {limit:.3g} apart"
            )


def check_interfaces(subject: Subject) -> Iterator[str]:
    """Co-simulation and model exchange, integrated by CVODE, give the same outputs over the default experiment."""
    from fmpy import simulate_fmu  # type: ignore[import-untyped]

    outputs = subject.numbers_of("output")
    declared = getattr(subject.description.defaultExperiment, "tolerance", None)
    steps = min(MOST_STEPS, round((subject.stop - subject.start) / subject.step))
    if not outputs or not subject.description.numberOfContinuousStates or steps < 1:
        return
    exchanged = simulate_fmu(
        str(subject.folder),
        validate=False,
        fmi_type="ModelExchange",
        start_time=subject.start,
        stop_time=subject.start + steps * subject.step,
        output_interval=subject.step,
        relative_tolerance=min(float(declared or 1e-6), 1e-6),
        output=[n.variable.name for n in outputs],
        record_events=False,
    )
    with running(subject, "CoSimulation") as instance:
        rows = [instance.get(outputs)]
        for k in range(steps):
            instance.step(subject.start + k * subject.step, subject.step)
            rows.append(instance.get(outputs))
    stepped = np.array(rows)[: len(exchanged)]
    share, window = (SHARE_WITH_TOLERANCE, 1) if declared else (SHARE, 1 + steps // 50)
    position = 0
    for number in outputs:
        recorded = np.asarray(exchanged[number.variable.name]).reshape(len(exchanged), number.size)[: len(stepped)]
        for name, other in zip(number.names, recorded.T, strict=True):
            size = max(float(np.ptp(other)), abs(float(number.variable.nominal or 0.0)), 1e-9)
            worst = _worst_distance(stepped[: len(other), position], other, window)
            if not worst <= share * size:
                yield f"{name!r} of co-simulation and of model exchange differ by {worst:.3g}; its range is {size:.3g}"
            position += 1


def _worst_distance(values: NDArray[np.float64], other: NDArray[np.float64], window: int) -> float:
    """Largest distance from the range that the other signal has within `window` steps: an event may come a bit later."""
    padded = np.pad(other, window, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * window + 1)
    return float(np.max(np.maximum(around.min(axis=1) - values, values - around.max(axis=1)).clip(min=0.0)))


def _places(subject: Subject) -> dict[str, tuple[Numbers, int]]:
    return {name: (number, k) for number in subject.numbers for k, name in enumerate(number.names)}


def _replayed(subject: Subject, replay: Replay, places: dict[str, tuple[Numbers, int]]) -> NDArray[np.float64]:
    """The signals at the times of the results, (n_rows, n_signals)."""
    wanted = [places[name] for name in replay.results.names]
    inputs = {number.variable.valueReference: number for number in (places[name][0] for name in replay.inputs.names)}
    columns = {name: k for k, name in enumerate(replay.inputs.names)}
    rows, row, count = [], 0, 0
    times = replay.results.times
    with running(subject, "CoSimulation") as instance:
        while True:
            time = subject.start + count * replay.step
            if row < len(times) and time >= times[row] - 1e-6 * replay.step:
                rows.append([instance.get([number])[k] for number, k in wanted])
                row += 1
                if row == len(times):
                    break
            now = _at(replay.inputs, time + 1e-6 * replay.step)
            for number in inputs.values():
                instance.set(number, [now[columns[name]] for name in number.names])
            instance.step(time, replay.step)
            count += 1
    return np.array(rows)


def _at(table: Table, time: float) -> NDArray[np.float64]:
    """All columns at a time, straight between rows; after a jump where there is one."""
    after = min(int(np.searchsorted(table.times, time, side="right")), len(table.times) - 1)
    before = max(after - 1, 0)
    width = float(table.times[after] - table.times[before])
    share = min(max((time - float(table.times[before])) / width, 0.0), 1.0) if width > 0.0 else 1.0
    return np.asarray(table.values[before] + share * (table.values[after] - table.values[before]))
