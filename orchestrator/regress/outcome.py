"""What became of a case."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np

from orchestrator.regress.comparison import Signal, SignalVerdict
from orchestrator.report.thinning import extremes

SCHEMA = "misfit.regress/1"
Verdict = Literal["passed", "failed", "error"]
# Points of a curve that a picture shows; each keeps the extremes of its stretch.
_SHOWN = 1200


@dataclass(frozen=True)
class WholeVerdict:
    """What a check of the whole model found: one line for people, and its figures."""

    check: str
    passed: bool
    reason: str
    figures: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Curve:
    """A signal and its reference, thinned for a picture; `reference` is None where there is none."""

    name: str
    unit: str
    time: np.ndarray
    values: np.ndarray
    reference_time: np.ndarray | None = None
    reference: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of a case.

    `reason` is one line for people, "" for a case that passed; `problem` is "component" where a component failed and
    "input" where the case cannot be run as it is written. `seconds` are CPU seconds of the run, `took_s` s of the clock
    for all. `attempts` counts runs; a case that passed only on a later one is `flaky`, which is a failure.
    `signals_kept` is what ran, for who asked for it.
    """

    name: str
    file: str
    verdict: Verdict
    reason: str = ""
    problem: Literal["", "component", "input"] = ""
    signals: tuple[SignalVerdict, ...] = ()
    wholes: tuple[WholeVerdict, ...] = ()
    curves: tuple[Curve, ...] = ()
    where: str = ""
    notes: tuple[str, ...] = ()
    seconds: float = 0.0
    took_s: float = 0.0
    attempts: int = 1
    flaky: bool = False
    model_sha256: str = ""
    coverage: Mapping[str, Any] = field(default_factory=dict)
    signals_kept: Mapping[str, Signal] = field(default_factory=dict)

    def after(self, earlier: Sequence["Outcome"]) -> "Outcome":
        """This outcome after earlier attempts: one that passes at last is flaky, and so failed."""
        if not earlier:
            return self
        attempts = len(earlier) + 1
        if self.verdict != "passed":
            return replace(self, attempts=attempts)
        reason = f"flaky: attempt 1 of {attempts} did not pass ({earlier[0].reason}), the last one did"
        first = earlier[0]
        return replace(
            self,
            verdict="failed",
            reason=reason,
            attempts=attempts,
            flaky=True,
            signals=first.signals,
            curves=first.curves,
        )

    def to_json(self) -> dict[str, Any]:
        """The outcome as plain data."""
        found: dict[str, Any] = {
            name: getattr(self, name)
            for name in ("name", "file", "verdict", "reason", "problem", "where", "attempts", "flaky", "model_sha256")
        }
        found["signals"] = signals_json(self.signals)
        found["checks"] = [plain(asdict(each)) for each in self.wholes]
        found["notes"] = list(self.notes)
        found["cpu_seconds"], found["seconds"] = round(self.seconds, 6), round(self.took_s, 6)
        if self.coverage:
            found["coverage"] = plain(self.coverage)
        return found


def signals_json(verdicts: Sequence[SignalVerdict]) -> dict[str, Any]:
    """Verdicts by signal; the first failed check of a signal (or its first) speaks for it, `checks` has them all."""
    grouped: dict[str, list[SignalVerdict]] = {}
    for verdict in verdicts:
        grouped.setdefault(verdict.name, []).append(verdict)
    found = {}
    for name, several in grouped.items():
        speaker = next((each for each in several if not each.passed), several[0])
        found[name] = speaker.to_json()
        if len(several) > 1:
            found[name]["checks"] = [each.to_json() for each in several]
    return found


def document(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """All outcomes as JSON."""
    return {
        "schema": SCHEMA,
        "passed": sum(each.verdict == "passed" for each in outcomes),
        "failed": sum(each.verdict == "failed" for each in outcomes),
        "errors": sum(each.verdict == "error" for each in outcomes),
        "cases": [each.to_json() for each in outcomes],
    }


def plain(value: Any) -> Any:
    """Data fit for JSON: numbers that JSON cannot hold become words, as in `SignalVerdict.to_json`.

    Example:
        >>> plain({"order": float("nan"), "shares": (0.5, float("inf"))})
        {'order': 'nan', 'shares': [0.5, 'inf']}
    """
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    return value


def exit_code(outcomes: Sequence[Outcome]) -> int:
    """0 all passed, 1 a difference, 3 a component failed, 2 a case that cannot be run; differences go first."""
    verdicts = {each.verdict for each in outcomes}
    if "failed" in verdicts:
        return 1
    if "error" in verdicts:
        return 3 if any(each.problem == "component" for each in outcomes) else 2
    return 0


def curve_of(result: Signal, reference: Signal | None) -> Curve:
    """The curves of a signal for a picture."""
    time, values = thinned(result.time, result.values)
    if reference is None:
        return Curve(result.name, result.unit, time, values)
    return Curve(result.name, result.unit, time, values, *thinned(reference.time, reference.values))


def thinned(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """About 1200 points with the smallest and largest value of each stretch; what is not finite is left out."""
    count = min(len(time), len(values))
    time, values = time[:count], values[:count]
    keep = np.isfinite(time) & np.isfinite(values)
    time, values = time[keep], values[keep]
    places = extremes(values, _SHOWN)
    return time[places], values[places]
