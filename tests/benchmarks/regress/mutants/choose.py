"""Which mutants of a subject are built: as many of each row, spread over its sources, always the same for a seed."""

import hashlib
from dataclasses import dataclass

import numpy as np

from fmus.library import library_root
from tests.benchmarks.regress.mutants.operators import ALL_ROWS, Change, changes_of
from tests.benchmarks.regress.mutants.subjects import Subject

OWN = "its own class"


@dataclass(frozen=True)
class Mutant:
    """One change to one source of a subject; `file` is relative to the library, or OWN for the subject's own class."""

    subject: str
    file: str
    change: Change

    @property
    def name(self) -> str:
        """A short name that stays the same as long as the change does."""
        text = f"{self.file} {self.change}"
        return f"{self.change.row.replace(' ', '-')}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def source_of(subject: Subject, file: str) -> str:
    """Return the text of one of a subject's sources."""
    return subject.text if file == OWN else (library_root() / "FESArm" / file).read_text()


def all_mutants(subject: Subject) -> list[Mutant]:
    """Return every mutant that the operators find."""
    found = []
    for file in (OWN, *subject.files):
        for change in changes_of(source_of(subject, file), subject.outputs):
            found.append(Mutant(subject.name, file, change))
    return found


def chosen_mutants(subject: Subject, per_row: int, seed: int = 0) -> list[Mutant]:
    """Return up to `per_row` mutants of each row; where a row has several sources, they take turns."""
    random = np.random.default_rng([seed, len(subject.name)])
    everything = all_mutants(subject)
    chosen: list[Mutant] = []
    for row in ALL_ROWS:
        queues: dict[str, list[Mutant]] = {}
        for mutant in everything:
            if mutant.change.row == row:
                queues.setdefault(mutant.file, []).append(mutant)
        for queue in queues.values():
            random.shuffle(queue)
        taken: list[Mutant] = []
        while len(taken) < per_row and any(queues.values()):
            taken += [queue.pop() for queue in queues.values() if queue]
        chosen += taken[:per_row]
    return chosen
