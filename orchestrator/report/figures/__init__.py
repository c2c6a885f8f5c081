"""Figures as inline images: each function returns an `<img>` element with a PNG and a text that says what it shows."""

from orchestrator.report.figures._curves import shown_signals, shown_trials, trial_curves
from orchestrator.report.figures._diagnosis import Version, falling_error, ranking
from orchestrator.report.figures._maps import block_slices, error_maps, latent_curve
from orchestrator.report.figures._residuals import error_by_trial, residual_against_state, residual_spectrum

__all__ = [
    "Version",
    "block_slices",
    "error_by_trial",
    "error_maps",
    "falling_error",
    "latent_curve",
    "ranking",
    "residual_against_state",
    "residual_spectrum",
    "shown_signals",
    "shown_trials",
    "trial_curves",
]
