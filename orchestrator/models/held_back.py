"""What a delay holds back when a record begins: how the inputs were before it, which nobody has recorded.

A model with a delay holds the first sample instead (Modelica, `delay`). How far an input goes in as long a time shows
in its record.
"""

import numpy as np

from orchestrator.models.compiled import CompiledModel

# Times before a record at which a delayed quantity may have been off.
NODES = 4
# Samples that an input at rest does not change when a record begins, or three delays.
AT_REST = 18


def ways_before(model: CompiledModel, time: np.ndarray, inputs: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """Ways (q, nd, NODES) in which delayed quantities may have been off their first samples, in the form that runs take.

    Each is off at one of the times before, by as much as it changes in so long (root mean square): one standard
    deviation. What is at rest when the record begins was at rest before.

    Args:
        model: the compiled model.
        time: (n,) in s.
        inputs: (n, nu).
        parameters: values of all parameters.
    """
    sources, delays = model.delayed(time, inputs, parameters)
    ways = []
    for j, delay in enumerate(delays):
        for k in range(NODES):
            size = _change_in(sources[:, j], (k + 1) / NODES * delay / (time[1] - time[0]))
            if size > 0:
                ways.append(np.zeros((len(delays), NODES)))
                ways[-1][j, k] = size
    return np.array(ways) if ways else np.zeros((0, len(delays), NODES))


def _change_in(series: np.ndarray, samples: float) -> float:
    """By how much a series changes in so many samples (not whole ones); 0 if it is at rest when it begins.

    >>> round(_change_in(np.arange(100.0), 2.5), 3), _change_in(np.r_[np.zeros(50), np.ones(50)], 2.5)
    (3.0, 0.0)
    """
    lag = min(max(int(np.ceil(samples)), 1), len(series) // 2)
    if not np.ptp(series[: max(3 * lag, AT_REST)]) > 0:
        return 0.0
    return float(np.sqrt(np.mean((series[lag:] - series[:-lag]) ** 2)))


def answers_to(
    ways: np.ndarray,
    model: CompiledModel,
    time: np.ndarray,
    inputs: np.ndarray,
    parameters: np.ndarray,
    start: np.ndarray,
    plain: np.ndarray,
    substeps: int,
) -> np.ndarray:
    """What a run (n, ny) would differ by, (n, ny, q), had delayed quantities been off in each of q ways.

    Args:
        ways: (q, nd, NODES), from `ways_before`.
        model: the compiled model.
        time: (n,) in s.
        inputs: (n, nu).
        parameters: values of all parameters.
        start: (nx,), first values of the states.
        plain: outputs (n, ny) of the run with none of the ways.
        substeps: integration steps in a sample interval.

    Raises:
        ComponentError: if a run fails.
    """
    runs = [model.run(time, inputs, parameters, start, substeps=substeps, before=way).outputs for way in ways]
    return np.stack([run - plain for run in runs], axis=2) if runs else np.zeros((*plain.shape, 0))


def whitened(series: np.ndarray, disturbances: np.ndarray) -> np.ndarray:
    """White noise with disturbances, made white: (1 + C C')^(-1/2) times series (n, k), C (n, q) being what one of unit
    normal size does.

    Least squares of the result are those in which the sizes of disturbances are fitted, too.
    """
    if not disturbances.any():
        return series
    directions, sizes, _ = np.linalg.svd(disturbances, full_matrices=False)
    shrunk = 1 - 1 / np.sqrt(1 + sizes**2)
    return np.asarray(series - directions @ (shrunk[:, None] * (directions.T @ series)))


def likeliest(errors: np.ndarray, disturbances: np.ndarray) -> np.ndarray:
    """Sizes (q,) of the disturbances (n, q) that errors (n,), in units of white noise, are likeliest to hold."""
    q = disturbances.shape[1]
    columns = np.vstack([disturbances, np.eye(q)])
    return np.asarray(np.linalg.lstsq(columns, np.r_[errors, np.zeros(q)], rcond=None)[0])
