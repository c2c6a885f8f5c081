"""What every kind of check can do."""

from typing import Protocol

from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Signal


class Check(Protocol):
    """One demand on one signal; a frozen dataclass for each kind."""

    @property
    def needs_reference(self) -> bool:
        """Whether `judge` fails without a reference."""
        ...

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged or missing data are a failed verdict with a reason, never an exception."""
        ...
