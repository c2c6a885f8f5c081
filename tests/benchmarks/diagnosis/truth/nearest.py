"""How much of what effects do others could imitate, to first order: library effects one outside it, fewer effects a set."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import nnls

from tests.benchmarks.diagnosis.truth.context import Context, Sized
from tests.benchmarks.diagnosis.truth.library import Draw
from tests.benchmarks.diagnosis.truth.native import TruthError
from tests.benchmarks.diagnosis.truth.run import Injection
from tests.benchmarks.diagnosis.truth.yardstick import Yardstick

# Places and shapes that are tried of each effect.
DRAWS = 3
TRIALS = 2
# A law is one shape: draws of these stand alone, while the others differ in where they act, and act there side by side.
SHAPED = {"end_stop", "hysteresis", "cogging", "tremor", "stribeck_friction", "saturation", "recruitment_curve"}
# First order holds where an effect is about as large as the one that it shall imitate.
ROUNDS = 4


def left_by_library(context: Context, library: Mapping[str, Draw], true: Injection, yardstick: Yardstick) -> float:
    """ENR of what is left of `true` beside the library effect that comes nearest: an effect that none imitates keeps its own."""
    few = yardstick.where_most([true], TRIALS)
    wanted = few.change([true])
    left = [_rms(wanted)]
    for name, draw in library.items():
        columns = [c for c in (_column(draw(context), few, left[0]) for _ in range(DRAWS)) if c is not None]
        for together in [[c] for c in columns] if name in SHAPED else [columns] if columns else []:
            # None of an effect is less than none: friction that drives is no friction.
            _, norm = nnls(np.column_stack(together), wanted)
            left.append(norm / len(wanted) ** 0.5)
    return min(left)


def beyond_smaller_sets(effects: Sequence[Injection], yardstick: Yardstick) -> float:
    """ENR of what is left of a set's change beside that set without one effect, the others in any size; the least of these.

    A leak at an outlet that is too narrow makes the record of one that is less so: nothing tells the pair from either.
    """
    wanted = yardstick.change(effects)
    alone = [yardstick.change([effect]) for effect in effects]
    left = []
    for k in range(len(effects)):
        beside = np.column_stack([*alone[:k], *alone[k + 1 :]])
        amounts, *_ = np.linalg.lstsq(beside, wanted, rcond=1e-6)
        left.append(_rms(wanted - beside @ amounts))
    return min(left)


def _column(effect: Sized, yardstick: Yardstick, enr: float) -> np.ndarray | None:
    """What an effect does at about the wanted ENR, scaled; None if it does nothing or drives the machine out of bounds."""
    size, change = 1.0, None
    for _ in range(ROUNDS):
        try:
            change = yardstick.change([effect(size)])
        except TruthError:
            size *= 0.05
            continue
        if _rms(change) <= 2 * enr:
            break
        size *= enr / _rms(change)
    return change / np.linalg.norm(change) if change is not None and change.any() else None


def _rms(series: np.ndarray) -> float:
    return float(np.sqrt(np.mean(series**2)))
