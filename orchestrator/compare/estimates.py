"""Where the noise floor comes from: what sensors declare, what the record shows, what repeats differ by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from orchestrator.measurements import BoundSet, BoundTrial

# Inputs are the same if they differ by their noise and this share of their range.
SAME = 0.01
# Clocks of two trials may begin this many samples apart.
LATEST = 5


def noise_of_repeats(data: BoundSet, trials: Sequence[BoundTrial]) -> dict[str, float]:
    """Root of half the mean square difference of repeated trials, by output, in its unit.

    Repeats are trials along which the same inputs move; they are aligned to the sample at which their inputs agree best.
    A straight line is taken out of each difference, since trials never begin at quite the same place and speed.

    Returns:
        Nothing if no two trials are repeats.
    """
    squares = []
    for one, other in combinations(trials, 2):
        lag = _lag(data, one, other)
        if lag is not None:
            first, second = _overlap(one.outputs, other.outputs, lag)
            time = np.linspace(-1.0, 1.0, len(first))
            line = np.column_stack([np.ones_like(time), time])
            change = first - second
            left = change - line @ np.linalg.lstsq(line, change, rcond=None)[0]
            squares.append(0.5 * np.sum(left**2, axis=0) / max(len(left) - 2, 1))
    if not squares:
        return {}
    return dict(zip(data.output_names, np.sqrt(np.mean(squares, axis=0)).tolist(), strict=True))


def _lag(data: BoundSet, one: BoundTrial, other: BoundTrial) -> int | None:
    """By how many samples the other trial is late; None if it is no repeat."""
    steps = [float(np.median(np.diff(t.time))) for t in (one, other)]
    moving = np.ptp(one.inputs, axis=0) > 0
    if not moving.any() or abs(steps[0] / steps[1] - 1) > 1e-3 or min(len(one.time), len(other.time)) < 4 * LATEST:
        return None
    noise = np.array([data.noise_std.get(name, 0.0) for name in data.input_names])
    allowed = 2.0 * noise + SAME * np.ptp(one.inputs, axis=0)
    found: list[tuple[float, int]] = []
    for lag in range(-LATEST, LATEST + 1):
        first, second = _overlap(one.inputs, other.inputs, lag)
        off = np.sqrt(np.mean((first - second) ** 2, axis=0))
        if len(first) > 0.8 * max(len(one.time), len(other.time)) and np.all(off <= allowed):
            found.append((float(np.max(off[moving] / allowed[moving])), lag))
    return min(found, key=lambda entry: (entry[0], abs(entry[1])))[1] if found else None


def _overlap(first: np.ndarray, second: np.ndarray, lag: int) -> tuple[np.ndarray, np.ndarray]:
    """The rows that two series have in common if the second is `lag` samples late."""
    first, second = first[max(-lag, 0) :], second[max(lag, 0) :]
    count = min(len(first), len(second))
    return first[:count], second[:count]


# Trials that differ by more than this many times the other estimates are no repeats of each other.
CONSISTENT = 10.0
# An error of up to so many noise floors is what noise alone leaves.
WITHIN_NOISE = 1.5
# Free runs of a right model leave less than this share of the floor by chance hardly ever, although carried noise is slow.
REFUTED = 1 / 3


@dataclass(frozen=True)
class FloorEstimate:
    """Estimates of the noise floor of a signal, in its unit; None where there is none.

    `declared` and `record` are of the sensor alone, `carried` is what noise of the inputs adds; `repeats` holds both.
    `used` is the floor, from the estimate named by `source`, for the `reason` given.
    """

    used: float
    source: str
    reason: str
    declared: float | None
    record: float | None
    repeats: float | None
    carried: float


def estimate_floor(data: BoundSet, floor: Mapping[str, float]) -> dict[str, FloorEstimate]:
    """Choose the largest consistent estimate for each output.

    Args:
        floor: noise of the sensors together with that of inputs carried through the model, by output.
    """
    repeats = noise_of_repeats(data, data.learning or data.trials)
    found = {}
    for name in data.output_names:
        level, total, again = data.levels.get(name), floor[name], repeats.get(name)
        declared, record = (level.declared, level.record) if level else (None, None)
        carried = max(total**2 - data.noise_std[name] ** 2, 0.0) ** 0.5
        if level is not None and level.warning:
            source, reason = "record", "the record has more fast noise than declared"
        elif declared is not None:
            source, reason = "declared", "the record does not contradict it"
        else:
            source, reason = ("record", "nothing is declared") if record else ("assumed", "nothing shows it")
        if again is not None and total < again < CONSISTENT * total:
            total, source, reason = again, "repeats", "it is the largest"
        elif again is not None and again >= CONSISTENT * total:
            reason += "; repeats differ by far more, so something else changed between them"
        found[name] = FloorEstimate(total, source, reason, declared, record, again, carried)
    return found


def not_refuted(
    estimates: Mapping[str, FloorEstimate], sensor: Mapping[str, float], left: Mapping[str, float]
) -> dict[str, FloorEstimate]:
    """Estimates of which free runs leave much less are lowered to what they leave, at least to the noise of the sensor.

    Fast changes of an input count as noise of its sensor where nothing is declared. The command of a controller has as many, and
    all of them act.

    Args:
        sensor: standard deviation of each output's noise, in its unit.
        left: rms that free runs along learning trials leave of each output, in its unit.
    """
    reason = "free runs leave far less than noise of the inputs would"
    return {
        name: each
        if left[name] >= REFUTED * each.used
        else replace(each, used=max(left[name], sensor[name]), source="free runs", reason=reason)
        for name, each in estimates.items()
    }


def floor_sentence(name: str, unit: str, estimate: FloorEstimate) -> str:
    """All estimates in a sentence.

    Args:
        name: the output.
        unit: its unit.
        estimate: the estimates of its noise floor, and which of them counts.
    """
    parts = [
        f"{label} {value:.3g}"
        for label, value in (
            ("declared", estimate.declared),
            ("record", estimate.record),
            ("repeats", estimate.repeats),
            ("carried from inputs", estimate.carried or None),
        )
        if value is not None
    ]
    return f"noise floor of {name}: {estimate.used:.3g} {unit} from {estimate.source}, because {estimate.reason} ({', '.join(parts)})"
