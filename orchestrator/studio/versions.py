"""Which steps of the diagnosis are in the model now; the ledger keeps all, undone ones too."""

from dataclasses import dataclass
from typing import Any

from orchestrator import ledger
from orchestrator.ledger import LedgerEntry
from orchestrator.report.sentences import effect_name
from orchestrator.studio.project import DIAGNOSIS, VERSION, Project
from orchestrator.verdicts.read_back import effects_of


@dataclass(frozen=True)
class Versions:
    """Ledger entries of the model as given and of the steps in it now; `next` names what Add puts in next."""

    shown: tuple[LedgerEntry, ...]
    next: str | None

    @property
    def number(self) -> int:
        """Steps in the model now."""
        return max(0, len(self.shown) - 1)


NONE = Versions((), None)


def versions(project: Project) -> Versions:
    """The state of a project's model."""
    diagnosis = project.result(DIAGNOSIS)
    if diagnosis is None or not (project.folder / "results" / ledger.FILE_NAME).exists():
        return NONE
    entries = ledger.read(project.results)
    shown = [entries[0]]
    for number in range(1, project.wanted + 1):
        built = project.result(VERSION.format(number))
        if built is None:
            break
        shown.append(entries[built["entry"]])
    return Versions(tuple(shown), _next(diagnosis, len(shown)))


def _next(diagnosis: dict[str, Any], number: int) -> str | None:
    """What a step adds to the one before."""
    steps = diagnosis["steps"]
    if number >= len(steps):
        return None
    before = [effect_name(effect) for effect in effects_of(steps[number - 1])]
    names = [effect_name(effect) for effect in effects_of(steps[number])]
    return " and ".join(name for name in names if name not in before) or "the same effects, fitted again"
