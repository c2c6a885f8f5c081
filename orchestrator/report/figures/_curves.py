"""A trial's measured and modelled curves, with the residual below them."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from orchestrator.compare.result import Comparison, TrialCurves
from orchestrator.report.figures._canvas import (
    MAX_SIGNALS,
    axis_label,
    canvas,
    image,
    label,
    thinned,
)
from orchestrator.report.numbers import digits, quantity
from orchestrator.report.palette import Colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAX_TRIALS = 4
# Two standard deviations hold 95 % of noise of this size.
BAND = 2


def shown_trials(comparison: Comparison, most: int = MAX_TRIALS) -> list[TrialCurves]:
    """Return the trials worth a figure: the held-out ones, and one learning trial, at most `most`."""
    held_out = [curves for curves in comparison.curves if curves.set == "held_out"]
    learning = [curves for curves in comparison.curves if curves.set != "held_out"]
    if not held_out:
        return learning[:most]
    return held_out[: most - 1] + learning[:1]


def shown_signals(comparison: Comparison) -> list[str]:
    """Return at most three signals, those that stand out most from their noise floor first."""
    rmse = (comparison.held_out or comparison.learning).rmse
    worst = sorted(comparison.signals, key=lambda name: -over(rmse[name], comparison.noise_floor[name]))
    return [name for name in comparison.signals if name in worst[:MAX_SIGNALS]]


def over(rmse: float, floor: float) -> float:
    """Return rmse / floor, infinite for a floor of zero."""
    return rmse / floor if floor else float("inf")


def trial_curves(comparison: Comparison, trial: TrialCurves, after: TrialCurves | None = None) -> str:
    """Return an image of one trial: curves above, residuals with the noise band below, one column for each signal.

    `after` is the same trial run by the model with the effects in it, drawn as a third curve.

    Args:
        comparison: with units and noise floors.
        trial: the trial.
        after: the same run by the model with the effects.
    """
    signals = shown_signals(comparison)
    figure, axes = canvas(2, len(signals), 4.4, sharex=True, height_ratios=[3, 2])
    for column, name in enumerate(signals):
        unit, floor = comparison.units[name], comparison.noise_floor[name]
        _draw_curves(axes[0, column], trial, after, name)
        axes[0, column].set_ylabel(axis_label(name, unit), fontsize=9)
        _draw_residuals(axes[1, column], trial, after, name, floor)
        axes[1, column].set_ylabel(axis_label("residual", unit), fontsize=9)
        axes[1, column].set_xlabel("time (s)", fontsize=9)
    handles, names = axes[0, 0].get_legend_handles_labels()
    band, band_name = axes[1, 0].get_legend_handles_labels()
    figure.suptitle(f"{label(trial.file)} ({trial.set.replace('_', ' ')})", fontsize=10, x=0.02, ha="left")
    figure.legend(handles + band[-1:], names + band_name[-1:], loc="upper right", ncols=4, fontsize=8, frameon=False)
    return image(figure, _alt(comparison, trial, after, signals))


def _draw_curves(ax: "Axes", trial: TrialCurves, after: TrialCurves | None, name: str) -> None:
    keep = thinned(trial.time.size)
    time = trial.time[keep]
    ax.plot(time, trial.measured[name][keep], color=Colour.MEASURED, linewidth=1.8, alpha=0.55, label="measured")
    model = "model" if after is None else "model as given"
    ax.plot(time, trial.modelled[name][keep], color=Colour.MODEL, linewidth=1.2, linestyle="--", label=model)
    if after is not None:
        keep = thinned(after.time.size)
        ax.plot(
            after.time[keep],
            after.modelled[name][keep],
            color=Colour.IMPROVED,
            linewidth=1.2,
            linestyle="-.",
            label="with effects",
        )


def _draw_residuals(ax: "Axes", trial: TrialCurves, after: TrialCurves | None, name: str, floor: float) -> None:
    ax.axhline(0.0, color=Colour.INK, linewidth=0.6)
    keep = thinned(trial.time.size)
    ax.plot(trial.time[keep], _residual(trial, name)[keep], color=Colour.MODEL, linewidth=0.9, linestyle="--")
    if after is not None:
        keep = thinned(after.time.size)
        ax.plot(after.time[keep], _residual(after, name)[keep], color=Colour.IMPROVED, linewidth=0.9)
    ax.axhspan(-BAND * floor, BAND * floor, color=Colour.FLOOR, alpha=0.35, linewidth=0, label=f"±{BAND} noise floors")


def _residual(trial: TrialCurves, name: str) -> np.ndarray:
    return np.asarray(trial.measured[name] - trial.modelled[name])


def _alt(comparison: Comparison, trial: TrialCurves, after: TrialCurves | None, signals: list[str]) -> str:
    errors = rms_residuals(trial)
    improved = {} if after is None else rms_residuals(after)
    parts = []
    for name in signals:
        unit, floor = comparison.units[name], comparison.noise_floor[name]
        text = (
            f"{name} is off by {quantity(errors[name], unit)} rms, {digits(over(errors[name], floor))} times the floor"
        )
        if improved:
            times = digits(over(improved[name], floor))
            text += f", with the effects added by {quantity(improved[name], unit)}, {times} times"
        parts.append(text)
    which = f"{trial.set.replace('_', '-')} trial {trial.file}"
    return f"Measured and modelled curves over time of {which}: {'; '.join(parts)}."


def rms_residuals(trial: TrialCurves) -> Mapping[str, float]:
    """Return the root mean square residual of each signal of a trial."""
    return {name: float(np.sqrt(np.mean(_residual(trial, name) ** 2))) for name in trial.measured}
