"""What noise alone does to the outputs of a free run: sensors, and measured inputs carried through the model."""

import numpy as np

from orchestrator.diagnosis.metric import Metric, coloured_metric, hats, stride_for, white_metric
from orchestrator.diagnosis.response import Response

# Noise of an input that moves the outputs by less than this share of the sensors' noise is left out.
NOTICED = 0.01
DRAWS = 8


def metrics_of(response: Response, output_std: np.ndarray, input_std: np.ndarray, seed: int = 0) -> list[Metric]:
    """The metric of each trial of a response, for noise `output_std` (ny,) and `input_std` (nu,) in each sample.

    Slow noise of inputs is carried as hat functions of time, the rest counts as white: what no hats can follow, in the
    noise and in what it does, or the power of all that noise does less that of the hats, whichever is smaller. (The latter
    alone would not do: where a model integrates its inputs, both powers are large and hardly differ.) A model that is no
    formula, such as an FMU, would take a run for each of them: its inputs count as exact.
    """
    if not response.is_formula:
        return [white_metric(output_std, stride_for(len(r.time), 1)) for r in response.base.records]
    random = np.random.default_rng(seed)
    found = []
    for k, record in enumerate(response.base.records):
        stride, shapes = stride_for(len(record.time), 1), hats(record.time)
        carried, rest = list[np.ndarray](), np.zeros(len(output_std))
        for i in map(int, np.flatnonzero(input_std)):
            draws = input_std[i] * random.standard_normal((len(record.time), DRAWS))
            power = _power(response.to_input(k, i, draws))
            if np.all(power < (NOTICED * output_std) ** 2):
                continue
            slow = response.to_input(k, i, input_std[i] * shapes)
            answers = response.to_input(k, i, _fast(draws, shapes))
            fast = _power(_fast(answers.reshape(len(shapes), -1), shapes).reshape(answers.shape))
            rest += np.minimum(fast, np.clip(power - np.mean(np.sum(slow**2, axis=2), axis=0), 0.0, None))
            carried.append(slow)
        if carried:
            std = np.sqrt(output_std**2 + rest)
            found.append(coloured_metric(std, stride, np.concatenate(carried, axis=2)))
        else:
            found.append(white_metric(output_std, stride))
    return found


def _fast(series: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """What is left of series (n, k) when shapes (n, h) are fitted to them."""
    fitted, *_ = np.linalg.lstsq(shapes, series, rcond=None)
    return np.asarray(series - shapes @ fitted)


def _power(answers: np.ndarray) -> np.ndarray:
    """Mean square (ny,) of answers (n, ny, k)."""
    return np.asarray(np.mean(answers**2, axis=(0, 2)))
