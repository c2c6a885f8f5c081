"""What a delay holds back when a record begins: how the inputs were before it, which nobody has recorded.

A model with a delay holds the first sample instead (Modelica, `delay`). How far an input goes in as many samples shows soon after.
"""

import numpy as np

from fmus.errors import ComponentError
from orchestrator.models.compiled import CompiledModel

# A delay may hold back so many samples.
HELD_BACK = 6


def sizes_before(series: np.ndarray) -> np.ndarray:
    """By how much (k,) an input (n,) may have been off its first sample, k, k - 1, ... 1 samples before.

    As much as it changes in so many samples soon after (root mean square): an input that is held at first was held before.

    >>> sizes_before(np.arange(100.0))
    array([6., 5., 4., 3., 2., 1.])
    >>> sizes_before(np.r_[np.zeros(50), np.ones(50)])
    array([0., 0., 0., 0., 0., 0.])
    """
    soon = series[: 3 * HELD_BACK]
    count = min(HELD_BACK, len(soon) // 2)
    return np.array([np.sqrt(np.mean((soon[ahead:] - soon[:-ahead]) ** 2)) for ahead in range(count, 0, -1)])


def doubt_of_start(
    model: CompiledModel, time: np.ndarray, inputs: np.ndarray, parameters: np.ndarray, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """By how much positions and speeds (ny,) of the outputs may be off at the start for want of what was held back.

    What inputs did before a record shows as an impulse of the size of what they do when their first samples are off.
    """
    stop = min(3 * HELD_BACK, len(time))
    steps, total = np.gradient(time[:stop]), np.zeros((2, len(model.outputs)))
    try:
        plain = model.run(time[:stop], inputs[:stop], parameters, start, substeps=2).outputs
        for i, column in enumerate(inputs.T):
            if not np.ptp(column) > 0:
                continue
            off, sizes = inputs[:stop].copy(), sizes_before(column)[:stop]
            off[: len(sizes), i] += sizes
            change = model.run(time[:stop], off, parameters, start, substeps=2).outputs - plain
            total += [np.max(change**2, axis=0), np.max(np.gradient(change, axis=0) ** 2, axis=0) / steps[0] ** 2]
    except ComponentError:
        return np.zeros(len(model.outputs)), np.zeros(len(model.outputs))
    return np.sqrt(total[0]), np.sqrt(total[1])
