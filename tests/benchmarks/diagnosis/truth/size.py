"""The size at which an effect is as large against the noise as wanted."""

import numpy as np

from tests.benchmarks.diagnosis.truth.context import Sized
from tests.benchmarks.diagnosis.truth.native import TruthError
from tests.benchmarks.diagnosis.truth.run import Injection
from tests.benchmarks.diagnosis.truth.yardstick import Yardstick

SMALLEST, LARGEST = 1e-7, 1e4
ROUNDS = 10


def sized_to(effect: Sized, wanted: float, yardstick: Yardstick) -> tuple[Injection, float]:
    """The effect at the size at which its ENR is `wanted`, within 5 % or as near as its bounds allow, and its ENR.

    Raises:
        TruthError: if the machine leaves all bounds at any size.
    """
    size, power, flat = 1.0, 1.0, 0
    last: tuple[float, float] | None = None
    best: tuple[float, Injection, float] | None = None
    for _ in range(ROUNDS):
        injection = effect(size)
        try:
            found = max(yardstick.enr([injection]), 1e-12)
        except TruthError:
            size, last = 0.2 * size, None
            continue
        off = abs(np.log(found / wanted))
        if best is None or off < best[0]:
            best = (off, injection, found)
        if off < 0.05:
            break
        if last is not None and abs(np.log(size / last[0])) > 1e-9:
            slope = np.log(found / last[1]) / np.log(size / last[0])
            power = float(np.clip(slope, 0.3, 3.0))
            flat = flat + 1 if abs(slope) < 0.05 else 0
            if flat == 2:
                break  # a bound of the effect is reached
        last = (size, found)
        size = float(np.clip(size * np.clip((wanted / found) ** (1 / power), 0.02, 50.0), SMALLEST, LARGEST))
    if best is None:
        raise TruthError("the effect makes the machine leave all bounds at any size")
    return best[1], best[2]
