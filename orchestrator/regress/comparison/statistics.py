"""Chaotic and noisy signals: what they do on average over windows, not where they are at each moment."""

from dataclasses import dataclass, replace
from typing import ClassVar, Literal, get_args

import numpy as np

from fmus.errors import MisfitError
from orchestrator.regress.comparison.figures import at_least
from orchestrator.regress.comparison.one_number import judge_number
from orchestrator.regress.comparison.prepare import Pair, cut, prepare
from orchestrator.regress.comparison.result import SignalVerdict
from orchestrator.regress.comparison.signal import Signal
from orchestrator.regress.comparison.statistic import mean_and_spread
from orchestrator.regress.comparison.tolerance import Tolerance
from orchestrator.regress.comparison.wording import seconds

Quantity = Literal["mean", "spread", "lowest", "highest"]
USUAL: tuple[Quantity, ...] = ("mean", "spread")


@dataclass(frozen=True)
class Statistics:
    """In each window the mean over time, the standard deviation, the lowest and highest value are near the reference's.

    The tolerance is the tube's: `absolute` + `relative` x (range of the reference); a time shift does not count.

    Args:
        window_s: s, length of each window; 0 for one window over everything. A rest shorter than half a window belongs
            to the window before it.
        quantities: which of "mean", "spread", "lowest" and "highest".
    """

    window_s: float = 0.0
    quantities: tuple[Quantity, ...] = USUAL
    tolerance: Tolerance = Tolerance(relative=0.05)
    kind: ClassVar[str] = "statistics"
    needs_reference: ClassVar[bool] = True

    def __post_init__(self) -> None:
        at_least(0.0, window_s=self.window_s)
        wrong = [name for name in self.quantities if name not in get_args(Quantity)]
        if wrong or not self.quantities:
            raise MisfitError(f"quantities = {list(self.quantities)}, expected some of {', '.join(get_args(Quantity))}")

    def judge(self, signal: Signal, reference: Signal | None) -> SignalVerdict:
        """Return the verdict on the worst window and quantity; damaged data are a failed verdict with a reason."""
        pair = prepare(self.kind, signal, reference, self.tolerance)
        if isinstance(pair, SignalVerdict):
            return pair
        verdicts = [
            self._judge_window(pair, begin, end, quantity)
            for begin, end in self._windows(pair.reference)
            for quantity in self.quantities
        ]
        worst = max(verdicts, key=lambda each: each.amplitude_error or 0.0)
        failed = [each for each in verdicts if not each.passed]
        return replace(worst, points_outside=len(failed), share_outside=len(failed) / len(verdicts))

    def _windows(self, reference: Signal) -> list[tuple[float, float]]:
        begin, end = float(reference.time[0]), float(reference.time[-1])
        count = 1 if not self.window_s else max(1, round((end - begin) / self.window_s))
        edges = [*(begin + self.window_s * k for k in range(count)), end]
        return list(zip(edges[:-1], edges[1:], strict=True))

    def _judge_window(self, pair: Pair, begin: float, end: float, quantity: Quantity) -> SignalVerdict:
        window = Tolerance(from_s=begin, until_s=end)
        found = _figure(cut(pair.result, window, keep_edges=True), quantity)
        expected = _figure(cut(pair.reference, window, keep_edges=True), quantity)
        what = f"the {quantity} from {seconds(begin)} to {seconds(end)}"
        return judge_number(self.kind, pair.result, what, found, expected, pair.band.half_height, end)


def _figure(signal: Signal, quantity: Quantity) -> float:
    if quantity == "lowest":
        return float(np.min(signal.values))
    if quantity == "highest":
        return float(np.max(signal.values))
    return mean_and_spread(signal)[0 if quantity == "mean" else 1]
