"""The first of several versions of an FMU that behaves differently, and in which signal."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from orchestrator.regress.case import Case, Reference
from orchestrator.regress.outcome import Outcome, signals_json

SCHEMA = "misfit.regress.bisect/1"


@dataclass(frozen=True)
class Bisection:
    """What was found: `first` is the first version that differs, None if the last one does not; `before` the one before it.

    `outcomes` are those of the versions that were run, in their order.
    """

    case: str
    versions: tuple[Path, ...]
    first: Path | None
    before: Path | None
    outcomes: tuple[tuple[Path, Outcome], ...]

    @property
    def outcome(self) -> Outcome | None:
        """What became of the case with the first version that differs."""
        return next((outcome for path, outcome in self.outcomes if path == self.first), None)

    @property
    def words(self) -> str:
        """One line for people."""
        ran = f"{len(self.outcomes)} of {len(self.versions)} versions were run"
        if self.first is None:
            return f"{self.case}: {self.versions[-1].name} behaves as the reference says; {ran}"
        assert self.outcome is not None
        where = f"after {self.before.name}, which does not" if self.before else "and is the oldest"
        return f"{self.case}: {self.first.name} is the first that differs, {where}; {self.outcome.reason}; {ran}"

    def to_json(self) -> dict[str, Any]:
        """The result as plain data."""
        outcome = self.outcome
        return {
            "schema": SCHEMA,
            "case": self.case,
            "versions": [path.name for path in self.versions],
            "first": self.first.name if self.first else None,
            "before": self.before.name if self.before else None,
            "signals": [] if outcome is None else sorted({each.name for each in outcome.signals if not each.passed}),
            "reason": "" if outcome is None else outcome.reason,
            "verdicts": {path.name: each.verdict for path, each in self.outcomes},
            "details": {} if outcome is None else signals_json(outcome.signals),
        }


def versions_in(folder: Path) -> list[Path]:
    """FMUs of a folder, the oldest first: by the numbers in their names, 1.9 before 1.10.

    Raises:
        MisfitError: if there are fewer than two.
    """
    found = sorted(folder.glob("*.fmu"), key=lambda path: numbered(path.stem))
    if len(found) < 2:
        raise MisfitError(f"{folder} holds {len(found)} FMUs; expected versions of one, at least two")
    return found


def numbered(name: str) -> tuple[tuple[int, int, str], ...]:
    """A key that sorts names by the numbers in them.

    Example:
        >>> sorted(["ball-1.10", "ball-1.9", "ball-1.9.1"], key=numbered)
        ['ball-1.9', 'ball-1.9.1', 'ball-1.10']
    """
    parts = re.split(r"(\d+)", name)
    return tuple((1, int(part), "") if part.isdigit() else (0, 0, part) for part in parts if part)


def bisect(case: Case, versions: Sequence[Path], run: Callable[[Case], Outcome]) -> Bisection:
    """Look for the first version that differs, halving the distance each time.

    Where it differs on and off, the one that is found differs and the one before it does not. A case without a
    reference that all versions share is compared with the oldest version.

    Args:
        case: what to run.
        versions: FMUs, the oldest first.
        run: runs a case.
    """
    if case.reference is None or case.reference.kind == "own":
        case = replace(case, reference=Reference("model", str(versions[0].resolve())), checks={})
    outcomes: dict[int, Outcome] = {}

    def differs(place: int) -> bool:
        if place not in outcomes:
            outcomes[place] = run(replace(case, model=str(versions[place].resolve())))
        return outcomes[place].verdict != "passed"

    last = len(versions) - 1
    first: int | None = None
    if differs(0):
        first = 0
    elif differs(last):
        low, first = 0, last
        while first - low > 1:
            middle = (low + first) // 2
            low, first = (low, middle) if differs(middle) else (middle, first)
    before = versions[first - 1] if first else None
    found = tuple((versions[k], outcomes[k]) for k in sorted(outcomes))
    return Bisection(case.name, tuple(versions), None if first is None else versions[first], before, found)
