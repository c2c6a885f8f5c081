"""The verdict and its figures, as pure functions of errors."""

from collections.abc import Sequence

import numpy as np
from scipy import stats

from orchestrator.compare.result import Comparison, TrialCurves
from orchestrator.diagnosis.result import Verdict

# A model this close to its noise floor leaves nothing to explain, given that the floor is itself an estimate.
ADEQUATE = 1.5
# A named set either removes most of the reducible error or ends near the floor.
MOST = 0.7
NEAR = 2.0
BLOCKS = 10


def reducible_removed(before: float, after: float) -> float:
    """Share of the error above the floor that is gone; errors are multiples of the floor.

    >>> reducible_removed(11.0, 2.0)
    0.9
    """
    return (before - after) / max(before - 1.0, 1e-9)


def decide(before: float, after: float, named: int) -> Verdict:
    """Decide from the held-out errors (multiples of the floor) before and after, and the number of effects accepted.

    >>> decide(1.1, 1.1, 0), decide(16.0, 1.1, 1), decide(25.0, 20.0, 1), decide(25.0, 25.0, 0)
    ('adequate', 'named', 'unknown', 'unknown')
    """
    if named == 0:
        return "adequate" if before <= ADEQUATE else "unknown"
    return "named" if after <= NEAR or reducible_removed(before, after) >= MOST else "unknown"


def improvement_p_value(before: Comparison, after: Comparison) -> float:
    """Probability of so large an improvement on held-out data if the added effects were useless.

    One-sided t test of the logarithm of the error ratio over blocks of the held-out trials (a tenth of a trial and
    signal each), which are longer than the residual's memory.
    """
    old, new = _block_errors(before), _block_errors(after)
    if len(old) < 3:
        return 1.0
    result = stats.ttest_1samp(np.log(old / new), 0.0, alternative="greater")
    return float(result.pvalue)


def _block_errors(comparison: Comparison) -> np.ndarray:
    held_out = [curve for curve in comparison.curves if curve.set == "held_out"]
    return np.array([error for curve in held_out for error in _blocks(curve)])


def _blocks(curve: TrialCurves) -> Sequence[float]:
    errors = []
    for name, measured in curve.measured.items():
        for part in np.array_split(measured - curve.modelled[name], BLOCKS):
            errors.append(float(np.sqrt(np.mean(part**2))) + 1e-300)
    return errors
