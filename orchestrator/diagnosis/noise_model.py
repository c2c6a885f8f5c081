"""What noise alone does to the outputs of a free run: sensors, and measured inputs carried through the model."""

from collections.abc import Sequence

import numpy as np
from scipy import linalg

from orchestrator.diagnosis.gaps import unknown_in_gaps
from orchestrator.diagnosis.metric import HATS, MOST_BLOCKS, Metric, coloured_metric, hats, stride_for, white_metric
from orchestrator.diagnosis.response import Response
from orchestrator.measurements import Noise

# Noise of an input that moves the outputs by less than this share of the sensors' noise is left out.
NOTICED = 0.01
# If what no hats can follow has more than this share of the sensors' power, the hats are too coarse.
COARSE = 0.05
DRAWS = 8


def metrics_of(response: Response, outputs: Sequence[Noise], inputs: Sequence[Noise], seed: int = 0) -> list[Metric]:
    """The metric of each trial of a response, for the noise of its outputs (ny of them) and inputs (nu).

    Slow noise of inputs is carried as hat functions of time, the rest counts as white: what no hats can follow, in the
    noise and in what it does, or the power of all that noise does less that of the hats, whichever is smaller. (The latter
    alone would not do: where a model integrates its inputs, both powers are large and hardly differ.) Where the record of an
    input has gaps, what it did meanwhile is noise, too. Inputs of a model that neither is a formula nor shows its Jacobians,
    such as an FMU that is stepped, would take a run for each of them: they count as exact.
    """
    std = np.array([noise.std for noise in outputs])
    random, found = np.random.default_rng(seed), []
    for k, record in enumerate(response.base.records):
        stride = stride_for(len(record.time), 1)
        carried, rest = list[np.ndarray](), np.zeros(len(outputs))
        for i, noise in enumerate(inputs if response.answers_inputs else ()):
            slow, fast = _carried(response, k, i, noise, std, random)
            rest += fast
            gaps = unknown_in_gaps(record.time, record.inputs[:, i])
            carried += [*slow, *([response.to_input(k, i, gaps)] if gaps.any() else [])]
        if carried or any(noise.slow > 0 for noise in outputs):
            count = len(record.time) // stride
            own = [
                noise.covariance(count, stride) + fast / stride * np.eye(count)
                for noise, fast in zip(outputs, rest, strict=True)
            ]
            wide = np.concatenate(carried, axis=2) if carried else np.zeros((len(record.time), len(outputs), 0))
            found.append(coloured_metric(own, stride, wide))
        else:
            found.append(white_metric(std, stride))
    return found


def _carried(
    response: Response, trial: int, column: int, noise: Noise, std: np.ndarray, random: np.random.Generator
) -> tuple[list[np.ndarray], np.ndarray]:
    """What noise of an input does to the outputs: independent slow contributions (n, ny, k), and the power of the rest."""
    time = response.base.records[trial].time
    draws = noise.draw((len(time), DRAWS), random)
    power = _power(response.to_input(trial, column, draws))
    rest = np.zeros(len(std))
    if np.all(power < (NOTICED * std) ** 2):
        return [], rest
    for count in (HATS, MOST_BLOCKS):  # the finer the hats, the longer it takes
        shapes = hats(time, count)
        spacing = max(1, round(len(time) / shapes.shape[1]))
        together = linalg.cholesky(noise.covariance(shapes.shape[1], spacing) * spacing, lower=True)
        slow = response.to_input(trial, column, shapes) @ together
        answers = response.to_input(trial, column, _fast(draws, shapes))
        fast = _power(_fast(answers.reshape(len(shapes), -1), shapes).reshape(answers.shape))
        rest = np.minimum(fast, np.clip(power - np.mean(np.sum(slow**2, axis=2), axis=0), 0.0, None))
        if np.all(rest < COARSE * std**2):
            break
    return [slow], rest


def _fast(series: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """What is left of series (n, k) when hat functions (n, h) are fitted to them; only neighbours among them overlap."""
    neighbours = np.einsum("ij,ij->j", shapes[:, 1:], shapes[:, :-1])
    bands = np.stack([np.r_[0.0, neighbours], np.einsum("ij,ij->j", shapes, shapes)])
    return np.asarray(series - shapes @ linalg.solveh_banded(bands, shapes.T @ series))


def _power(answers: np.ndarray) -> np.ndarray:
    """Mean square (ny,) of answers (n, ny, k)."""
    return np.asarray(np.mean(answers**2, axis=(0, 2)))
