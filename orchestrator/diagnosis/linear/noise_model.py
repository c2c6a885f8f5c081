"""What noise alone does to the outputs of a free run: sensors, and measured inputs carried through the model."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import linalg

from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.linear.thresholds import COARSE, DRAWS, FEW_DRAWS, FEW_WAVES, LEAST_CARRIED
from orchestrator.diagnosis.noise.gaps import unknown_in_gaps
from orchestrator.diagnosis.noise.metric import Metric, NoisyInput, coloured_metric, stride_for, waves, white_metric
from orchestrator.diagnosis.noise.thresholds import MOST_BLOCKS, WAVES
from orchestrator.measurements import Noise


def metrics_of(response: Response, outputs: Sequence[Noise], inputs: Sequence[Noise], seed: int = 0) -> list[Metric]:
    """The metric of each trial of a response, for the noise of its outputs (ny of them) and inputs (nu).

    Slow noise of inputs is carried as waves of time, the rest counts as white: what no waves can follow, in the noise
    and in what it does. (The power of all that noise does, less that of the waves, would be no measure of it: where a
    model integrates its inputs, both are large and hardly differ, and by chance their difference is none.) Where the
    record of an input has gaps, what it did meanwhile is noise, too. A model that neither is a formula nor shows its
    Jacobians, such as an FMU that is stepped, takes a run for each of them, so they are few.

    Args:
        response: the model's response to small changes, along the trials.
        outputs: noise of each output.
        inputs: noise of each input.
        seed: of the draws that tell what is too fast for waves.
    """
    std = np.array([noise.steady.std for noise in outputs])
    random, found = np.random.default_rng(seed), []
    for k, record in enumerate(response.base.records):
        stride = stride_for(len(record.time), 1)
        carried, rest = list[tuple[int, np.ndarray, np.ndarray]](), np.zeros(len(outputs))
        for i, noise in enumerate(inputs):
            slow, fast = _carried(response, k, i, noise, std, random)
            rest += fast
            gaps = unknown_in_gaps(record.time, record.inputs[:, i])
            shapes = [*slow, *([gaps] if gaps.any() else [])]
            carried += [(i, shape, response.to_input(k, i, shape)) for shape in shapes]
        if carried or any(noise.slow > 0 or noise.jitter > 0 for noise in outputs):
            count = len(record.time) // stride
            own = [
                noise.steady.covariance(count, stride) + fast / stride * np.eye(count)
                for noise, fast in zip(outputs, rest, strict=True)
            ]
            answers = [answer for _, _, answer in carried]
            wide = np.concatenate(answers, axis=2) if carried else np.zeros((len(record.time), len(outputs), 0))
            early = _moved(record.measured, [noise.jitter for noise in outputs])
            metric = coloured_metric(own, stride, wide, early)
            noisy = tuple(NoisyInput(i, shape, metric(answer)) for i, shape, answer in carried)
            found.append(replace(metric, noisy_inputs=noisy))
        else:
            found.append(white_metric(std, stride))
    return found


def _carried(
    response: Response, trial: int, column: int, noise: Noise, std: np.ndarray, random: np.random.Generator
) -> tuple[list[np.ndarray], np.ndarray]:
    """Independent slow contributions (n, k) to the noise of an input, and the power (ny,) of what the rest of it does."""
    time = response.base.records[trial].time
    if noise.std == 0.0:
        return [], np.zeros(len(std))
    fine = (WAVES, MOST_BLOCKS)[len(time) <= MOST_BLOCKS :]  # the finer the waves, the longer it takes
    draws = noise.draw((len(time), DRAWS if response.answers_inputs else FEW_DRAWS), random)
    power = _power(response.to_input(trial, column, draws))
    rest = np.zeros(len(std))
    if np.all(power < (LEAST_CARRIED * std) ** 2):
        return [], rest
    for count in fine if response.answers_inputs else (FEW_WAVES,):
        shapes = waves(len(time), count)
        covariance = np.diag(noise.steady.density(0.5 * np.arange(shapes.shape[1]) / len(time)))
        if noise.jitter > 0:
            early = _moved(response.base.records[trial].inputs[:, [column]], [noise.jitter])
            covariance += shapes.T @ (early**2 * shapes)
        together = linalg.cholesky(covariance, lower=True)
        slow = shapes @ together
        answers = response.to_input(trial, column, _fast(draws, shapes))
        rest = _power(_fast(answers.reshape(len(shapes), -1), shapes).reshape(answers.shape))
        if np.all(rest < COARSE * std**2):
            break
    return [slow], rest


def _moved(series: np.ndarray, jitter: Sequence[float]) -> np.ndarray:
    """By how much samples (n, k) are off that are taken late by `jitter` samples."""
    return np.asarray(np.gradient(series, axis=0) * np.array(jitter))


def _fast(series: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """What is left of series (n, k) beside orthonormal shapes (n, h)."""
    return np.asarray(series - shapes @ (shapes.T @ series))


def _power(answers: np.ndarray) -> np.ndarray:
    """Mean square (ny,) of answers (n, ny, k)."""
    return np.asarray(np.mean(answers**2, axis=(0, 2)))
