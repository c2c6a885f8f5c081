"""What is wrong with a record, by the figures, and how to mend it."""

from dataclasses import dataclass
from typing import Any, Literal

from orchestrator.datacheck.changes import Change

Kind = Literal[
    "unit", "time_unit", "offset", "sign", "swap", "delay", "stuck", "saturated", "held", "trial", "nan", "input"
]


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or may be, with a column or a trial.

    `evidence` says why in numbers, `proposal` what to do. A `strong` finding forbids to name physics. `change` is the
    mend of the columns, in the units of the model, `keep` one that leaves these seconds alone, and `trials` names those
    it concerns, none for all.
    """

    kind: Kind
    column: str
    trial: str
    evidence: str
    proposal: str
    strong: bool
    change: Change | None = None
    trials: tuple[str, ...] = ()
    keep: tuple[float, float] | None = None

    @property
    def can_be_mended(self) -> bool:
        """Whether `--mend` may accept the proposal: not where all trials show what the plant itself may do, such as a delay."""
        return (self.change is not None or self.keep is not None) and (self.strong or bool(self.trials))

    def to_json(self) -> dict[str, Any]:
        """The entry of `data_checks`."""
        where = {"column": self.column} if self.column else {}
        where |= {"trial": self.trial} if self.trial else {}
        return {
            "kind": self.kind,
            **where,
            "evidence": self.evidence,
            "proposal": self.proposal,
            "strong": self.strong,
        }

    def __str__(self) -> str:
        where = " in ".join(part for part in (self.column, self.trial) if part)
        return f"data check, {where}: {self.evidence}; {self.proposal}"
