"""All mutants of one subject: built, run, judged by `misfit regress`, measured by FMPy; goes on where it was stopped."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from fmus.files import write_atomically
from tests.benchmarks.regress.mutants.cases import regress, write_case, write_inputs
from tests.benchmarks.regress.mutants.choose import Mutant, source_of
from tests.benchmarks.regress.mutants.effect import effect, simulated
from tests.benchmarks.regress.mutants.subjects import Subject
from tests.benchmarks.regress.mutants.workshop import Invalid, Workshop

BATCH = 30


@dataclass(frozen=True)
class Fate:
    """What became of a mutant.

    `state` is "invalid" (no FMU, or one that does not start), "equivalent" (its effect is below the tolerance), "killed"
    or "survived"; `effect` is its largest difference over the tolerance, `verdict` and `reason` what misfit said.
    """

    name: str
    subject: str
    row: str
    file: str
    line: int
    what: str
    text: str
    state: str
    effect: float | None = None
    verdict: str = ""
    reason: str = ""

    @property
    def is_false_alarm(self) -> bool:
        """Whether misfit saw a difference where none exceeds the tolerance."""
        return self.state == "equivalent" and self.verdict != "passed"


class Campaign:
    """The mutants of one subject in a folder of its own: inputs.csv, reference.csv, base/, mutants/ and fates.json."""

    def __init__(self, subject: Subject, folder: Path, workshop: Workshop) -> None:
        self.subject, self.folder, self.workshop = subject, folder, workshop
        self._fates = folder / "fates.json"
        kept = json.loads(self._fates.read_text()) if self._fates.is_file() else {}
        self.fates = {name: Fate(**{**each, "effect": _number(each["effect"])}) for name, each in kept.items()}

    def prepare(self) -> None:
        """Build the original and record its reference."""
        (self.folder / "base").mkdir(parents=True, exist_ok=True)
        (self.folder / "mutants").mkdir(exist_ok=True)
        if (self.folder / "reference.csv").is_file():
            return
        self.workshop.build(self.subject, self.folder / "base/base.fmu")
        write_inputs(self.subject, self.folder / "inputs.csv")
        case = write_case(self.subject, self.folder / "base", "base")
        outcome = regress([case], self.folder / "report.json", "--update")["base"]
        if outcome["verdict"] != "passed":
            raise RuntimeError(f"the original of {self.subject.name} fails its own case: {outcome['reason']}")

    def run(self, mutants: Sequence[Mutant], until: float = math.inf, clock: object = None) -> None:
        """Find the fates of mutants, a batch at a time, until the clock says `until`, s."""
        left = [mutant for mutant in mutants if mutant.name not in self.fates]
        for begin in range(0, len(left), BATCH):
            if callable(clock) and clock() > until:
                return
            self._batch(left[begin : begin + BATCH])

    def _batch(self, mutants: Sequence[Mutant]) -> None:
        cases: dict[str, Path] = {}
        found: dict[str, Fate] = {}
        for mutant in mutants:
            fmu = self.folder / "mutants" / f"{mutant.name}.fmu"
            try:
                if not fmu.is_file():
                    self.workshop.build(self.subject, fmu, mutant)
                cases[mutant.name] = write_case(self.subject, fmu.parent, mutant.name)
            except Invalid as invalid:
                found[mutant.name] = replace(self._fate(mutant), state="invalid", reason=str(invalid)[:300])
        outcomes = regress(list(cases.values()), self.folder / "report.json") if cases else {}
        original = simulated(self.subject, self.folder / "base/base.fmu")
        for mutant in mutants:
            if mutant.name in cases:
                found[mutant.name] = self._judged(mutant, outcomes[mutant.name], original)
        self.fates.update(found)
        plain = {name: {**asdict(fate), "effect": _text(fate.effect)} for name, fate in self.fates.items()}
        write_atomically(self._fates, json.dumps(plain, indent=1).encode())

    def _judged(self, mutant: Mutant, outcome: dict, original: dict) -> Fate:
        fmu = self.folder / "mutants" / f"{mutant.name}.fmu"
        fate = replace(self._fate(mutant), verdict=outcome["verdict"], reason=outcome.get("reason", "")[:300])
        try:
            size = effect(self.subject, original, simulated(self.subject, fmu))
        except Exception as error:  # FMPy raises what it likes, and so do broken FMUs
            if not self._starts(fmu):
                return replace(fate, state="invalid", reason=f"does not start: {error}"[:300])
            size = math.inf
        if size <= 1.0:
            return replace(fate, state="equivalent", effect=size)
        return replace(fate, state="survived" if fate.verdict == "passed" else "killed", effect=size)

    def _starts(self, fmu: Path) -> bool:
        try:
            simulated(replace(self.subject, stop_s=self.subject.step_s), fmu)
        except Exception:
            return False
        return True

    def _fate(self, mutant: Mutant) -> Fate:
        change = mutant.change
        text = change.apply(source_of(self.subject, mutant.file)).splitlines()[change.line].strip()
        return Fate(
            mutant.name, self.subject.name, change.row, mutant.file, change.line + 1, change.what, text[:160], ""
        )


def _text(number: float | None) -> float | str | None:
    return str(number) if number is not None and not math.isfinite(number) else number


def _number(kept: float | str | None) -> float | None:
    return None if kept is None else float(kept)
