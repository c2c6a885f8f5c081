"""Where the noise floor comes from: what sensors declare, what the record shows, what repeats differ by."""

from collections.abc import Mapping
from dataclasses import dataclass

from orchestrator.compare.repeats import noise_of_repeats
from orchestrator.measurements import BoundSet

# Trials that differ by more than this many times the other estimates are no repeats of each other.
CONSISTENT = 10.0


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


def floor_sentence(name: str, unit: str, estimate: FloorEstimate) -> str:
    """All estimates in a sentence."""
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
