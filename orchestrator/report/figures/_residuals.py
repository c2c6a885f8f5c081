"""What the residual depends on: trial, measured state, frequency."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from orchestrator.compare.result import Comparison, TrialCurves, TrialErrors
from orchestrator.report.figures._canvas import (
    axis_label,
    canvas,
    image,
    label,
    plain_log_axis,
    thinned,
)
from orchestrator.report.figures._curves import over, shown_signals
from orchestrator.report.numbers import digits, quantity
from orchestrator.report.palette import Colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BINS = 24
FAINT_POINTS = 1500
MAX_BARS = 24


def error_by_trial(comparison: Comparison) -> str:
    """Return an image of each trial's error as bars beside the noise floor, one panel for each signal."""
    signals, trials = shown_signals(comparison), comparison.trials[:MAX_BARS]
    figure, axes = canvas(1, len(signals), 2.8)
    parts = []
    for ax, name in zip(axes[0], signals, strict=True):
        unit, floor, errors = comparison.units[name], comparison.noise_floor[name], [t.rmse[name] for t in trials]
        _draw_bars(ax, trials, errors, floor)
        ax.set_ylabel(axis_label(f"{name} error, rms", unit), fontsize=9)
        low, high = quantity(min(errors), unit), quantity(max(errors), unit)
        parts.append(f"{name} from {low} to {high}, floor {quantity(floor, unit)}")
    return image(figure, f"Error of {len(trials)} trials by signal: {'; '.join(parts)}.")


def _draw_bars(ax: "Axes", trials: Sequence[TrialErrors], errors: Sequence[float], floor: float) -> None:
    held_out = [trial.set == "held_out" for trial in trials]
    numbers = range(1, len(trials) + 1)
    ax.bar(
        numbers,
        [error if math.isfinite(error) else 0.0 for error in errors],
        color=["white" if out else Colour.MODEL for out in held_out],
        edgecolor=Colour.MODEL,
        hatch=["///" if out else "" for out in held_out],
        width=0.7,
    )
    ax.axhline(floor, color=Colour.FLOOR, linestyle="--", linewidth=1.2)
    ax.set_xticks(numbers)
    ax.set_xlabel("trial (hatched: held out; dashed: noise floor)", fontsize=9)


def residual_against_state(comparison: Comparison, name: str) -> str:
    """Return an image of one signal's residual against each measured signal (above) and its speed (below)."""
    others = shown_signals(comparison)
    residual = np.concatenate([curves.measured[name] - curves.modelled[name] for curves in comparison.curves])
    figure, axes = canvas(2, len(others), 4.8, sharey=True)
    unit, floor = comparison.units[name], comparison.noise_floor[name]
    for column, other in enumerate(others):
        value = np.concatenate([curves.measured[other] for curves in comparison.curves])
        speed = np.concatenate([_speed(curves, other) for curves in comparison.curves])
        _draw_dependence(axes[0, column], value, residual, floor)
        axes[0, column].set_xlabel(axis_label(other, comparison.units[other]), fontsize=9)
        _draw_dependence(axes[1, column], speed, residual, floor)
        axes[1, column].set_xlabel(axis_label(f"speed of {other}", speed_unit(comparison.units[other])), fontsize=9)
    for ax in axes[:, 0]:
        ax.set_ylabel(axis_label(f"residual of {name}", unit), fontsize=9)
    figure.suptitle(
        f"{label(name)}: line and shade = mean ±1 standard deviation in each bin; grey = ±1 noise floor", fontsize=9
    )
    return image(figure, _state_alt(comparison, name, residual))


def residual_spectrum(comparison: Comparison) -> str:
    """Return an image of the residual's amplitude density over frequency, averaged over trials, beside the floor if it were white."""
    signals = shown_signals(comparison)
    figure, axes = canvas(1, len(signals), 2.8)
    parts = []
    for ax, name in zip(axes[0], signals, strict=True):
        frequency, density = spectrum(comparison.curves, name)
        unit = comparison.units[name]
        peak = frequency[np.argmax(density)] if density.size else float("nan")
        parts.append(f"{name} is strongest at {digits(float(peak))} Hz")
        positive = density > 0
        if positive.any():
            ax.plot(
                frequency[positive], density[positive], color=Colour.RESIDUAL, linewidth=1.2, marker=".", markersize=3
            )
            white = comparison.noise_floor[name] * np.sqrt(2 * _step(comparison.curves[0]))
            ax.axhline(white, color=Colour.FLOOR, linestyle="--", linewidth=1.2)
            plain_log_axis(ax, "x")
            plain_log_axis(ax, "y")
        ax.set_xlabel("frequency (Hz; dashed: floor, if white)", fontsize=9)
        ax.set_ylabel(axis_label(f"{name} residual", f"{unit}/√Hz" if unit not in ("", "1") else "1/√Hz"), fontsize=9)
    return image(figure, f"Amplitude density of the residual over frequency: {'; '.join(parts)}.")


def speed_unit(unit: str) -> str:
    """Return the unit of a signal's time derivative."""
    return "1/s" if unit in ("", "1") else f"{unit}/s"


def spectrum(trials: Sequence[TrialCurves], name: str, bins: int = 80) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies (Hz) and one-sided amplitude densities (unit/sqrt(Hz)) of a residual, in log-spaced bins.

    Hann-windowed periodograms of the trials, averaged in power; white noise of standard deviation s, sampled every
    h seconds, lies at s sqrt(2 h). Samples are taken as evenly spaced.

    Args:
        trials: curves of each trial.
        name: the signal.
        bins: number of bins.
    """
    parts = [_periodogram(curves, name) for curves in trials]
    frequency = np.concatenate([part[0] for part in parts])
    power = np.concatenate([part[1] for part in parts])
    if frequency.size == 0:
        return frequency, power
    edges = np.geomspace(frequency.min(), frequency.max() * (1 + 1e-9), bins + 1)
    place = np.digitize(frequency, edges) - 1
    used = np.unique(place)
    centre = np.array([frequency[place == k].mean() for k in used])
    return centre, np.sqrt([power[place == k].mean() for k in used])


def _periodogram(trial: TrialCurves, name: str) -> tuple[np.ndarray, np.ndarray]:
    residual = trial.measured[name] - trial.modelled[name]
    window = np.hanning(residual.size)
    # A run that diverged has no spectrum; a handful of samples has none worth drawing.
    if residual.size < 8 or not np.all(np.isfinite(residual)):
        return np.empty(0), np.empty(0)
    transform = np.fft.rfft((residual - residual.mean()) * window)
    power = 2 * _step(trial) * np.abs(transform) ** 2 / np.sum(window**2)
    return np.fft.rfftfreq(residual.size, _step(trial))[1:], power[1:]


def _step(trial: TrialCurves) -> float:
    return float(np.median(np.diff(trial.time))) if trial.time.size > 1 else 1.0


def _speed(trial: TrialCurves, name: str) -> np.ndarray:
    if trial.time.size < 2:
        return np.zeros(trial.time.size)
    return np.asarray(np.gradient(trial.measured[name], trial.time))


def binned(against: np.ndarray, residual: np.ndarray, bins: int = BINS) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return centre, mean and standard deviation of a residual in bins of equal population of another quantity.

    Args:
        against: (n,), the other quantity.
        residual: (n,).
        bins: number of bins, at most.
    """
    edges = np.unique(np.quantile(against, np.linspace(0, 1, bins + 1)))
    place = np.clip(np.digitize(against, edges) - 1, 0, max(0, edges.size - 2))
    used = np.unique(place)
    statistics = [(against[place == k].mean(), residual[place == k].mean(), residual[place == k].std()) for k in used]
    centre, mean, spread = np.array(statistics).T
    return centre, mean, spread


def _draw_dependence(ax: "Axes", against: np.ndarray, residual: np.ndarray, floor: float) -> None:
    ax.axhspan(-floor, floor, color=Colour.FLOOR, alpha=0.3, linewidth=0)
    finite = np.isfinite(residual) & np.isfinite(against)
    against, residual = against[finite], residual[finite]
    if residual.size == 0:
        return
    keep = thinned(residual.size, FAINT_POINTS)
    ax.plot(against[keep], residual[keep], linestyle="", marker=".", markersize=2, color=Colour.RESIDUAL, alpha=0.25)
    centre, mean, spread = binned(against, residual)
    ax.fill_between(centre, mean - spread, mean + spread, color=Colour.IMPROVED, alpha=0.2, linewidth=0)
    ax.plot(centre, mean, color=Colour.IMPROVED, linewidth=1.3, marker="o", markersize=3)


def _state_alt(comparison: Comparison, name: str, residual: np.ndarray) -> str:
    unit, floor = comparison.units[name], comparison.noise_floor[name]
    residual = residual[np.isfinite(residual)]
    if residual.size == 0:
        return f"Residual of {name}: the runs diverged, 0 samples can be drawn."
    error = float(np.sqrt(np.mean(residual**2)))
    mean, rms = quantity(float(residual.mean()), unit), quantity(error, unit)
    what = f"Residual of {name} against each measured signal and its speed, over all trials"
    return f"{what}: mean {mean}, rms {rms}, {digits(over(error, floor))} times the floor."
