"""Quantities that a law keeps: constant, or only ever falling or rising."""

from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

import numpy as np

from fmus.errors import MisfitError
from orchestrator.regress.comparison.one_number import judge_number
from orchestrator.regress.comparison.prepare import alone
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.tolerance import Tolerance, limit_around

Law = Literal["constant", "never_rises", "never_falls"]


@dataclass(frozen=True)
class Conserved:
    """A signal keeps its first value ("constant"), or never rises above or falls below any value it had before.

    Meant for energy, mass or charge, also as an expression of other signals (see `expression.combine`). The tolerance
    is `absolute` + `relative` x (largest |value|); no reference is needed.
    """

    law: Law = "constant"
    tolerance: Tolerance = Tolerance()
    kind: ClassVar[str] = "conserved"
    needs_reference: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if self.law not in get_args(Law):
            raise MisfitError(f"law = {self.law!r}, expected one of {', '.join(get_args(Law))}")

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict; damaged data are a failed verdict with a reason."""
        result = alone(self.kind, signal, self.tolerance)
        if isinstance(result, SignalVerdict):
            return result
        before = self._expected(result.values)
        leaves = result.values - before
        worst = int(np.argmax(np.abs(leaves)))
        limit = limit_around(self.tolerance, float(np.abs(result.values).max()), result.nominal)
        what = (
            "the value, to stay as it began,"
            if self.law == "constant"
            else f"the value that {self.law.replace('_', ' ')}"
        )
        return judge_number(
            self.kind, result, what, float(result.values[worst]), float(before[worst]), limit, float(result.time[worst])
        )

    def _expected(self, values: np.ndarray) -> np.ndarray:
        """What the law allows nearest to each value, given all values before it, shape (n,)."""
        if self.law == "constant":
            return np.full(len(values), values[0])
        if self.law == "never_rises":
            return np.minimum(values, np.minimum.accumulate(values))
        return np.maximum(values, np.maximum.accumulate(values))
