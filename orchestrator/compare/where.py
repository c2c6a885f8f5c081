"""Where a model fails: by signal, in time, against the measured state, and in frequency."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy import signal

from orchestrator.compare.result import TrialCurves

WINDOWS = 10
BINS = 8


def where_it_fails(
    curves: Sequence[TrialCurves], units: Mapping[str, str], floor: Mapping[str, float]
) -> dict[str, list[dict[str, Any]]]:
    """Return the error of each signal by signal, time window, bin of the measured state, and frequency band.

    Residuals are measured minus modelled. Speeds are central differences of the measured signals.
    """
    return {
        "signal": [_by_signal(curves, name, units, floor) for name in units],
        "time": [row for name in units for row in _by_time(curves, name)],
        "state": [row for name in units for row in _by_state(curves, name, units)],
        "frequency": [row for name in units for row in _by_frequency(curves, name)],
    }


def findings(where: Mapping[str, list[dict[str, Any]]], floor: Mapping[str, float]) -> tuple[str, ...]:
    """Say in sentences where the error stands out, worst signal first."""
    sentences = []
    for row in sorted(where["signal"], key=lambda r: -r["over_floor"]):
        name = row["signal"]
        if row["over_floor"] < 1.5:
            sentences.append(f"{name} agrees within the noise ({row['over_floor']:.2g} times the floor)")
            continue
        text = f"{name} is off by {row['rmse']:.3g} {row['unit']} rms, {row['over_floor']:.2g} times the floor"
        bands = [r for r in where["frequency"] if r["signal"] == name]
        if bands:
            worst = max(bands, key=lambda r: r["rmse"])
            text += f"; mostly between {worst['from_hz']:.2g} and {worst['to_hz']:.2g} Hz"
        biased = [r for r in where["state"] if r["signal"] == name and abs(r["bias"]) > 2 * floor[name]]
        if biased:
            most = max(biased, key=lambda r: abs(r["bias"]))
            text += f"; biased by {most['bias']:.2g} {row['unit']} where {most['against']} is "
            text += f"{most['from']:.3g} to {most['to']:.3g} {most['unit']}"
        sentences.append(text)
    return tuple(sentences)


def _residual(curve: TrialCurves, name: str) -> np.ndarray:
    return curve.measured[name] - curve.modelled[name]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else 0.0


def _by_signal(
    curves: Sequence[TrialCurves], name: str, units: Mapping[str, str], floor: Mapping[str, float]
) -> dict[str, Any]:
    rmse = _rms(np.concatenate([_residual(c, name) for c in curves]))
    return {
        "signal": name,
        "unit": units[name],
        "rmse": rmse,
        "floor": floor[name],
        "over_floor": rmse / floor[name],
    }


def _by_time(curves: Sequence[TrialCurves], name: str) -> list[dict[str, Any]]:
    first, last = min(c.time[0] for c in curves), max(c.time[-1] for c in curves)
    edges = np.linspace(first, last, WINDOWS + 1)
    rows = []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        parts = [_residual(c, name)[(c.time >= low) & (c.time <= high)] for c in curves]
        rows.append({"signal": name, "from_s": float(low), "to_s": float(high), "rmse": _rms(np.concatenate(parts))})
    return rows


def _by_state(curves: Sequence[TrialCurves], name: str, units: Mapping[str, str]) -> list[dict[str, Any]]:
    residual = np.concatenate([_residual(c, name) for c in curves])
    rows = []
    for other, unit in units.items():
        value = np.concatenate([c.measured[other] for c in curves])
        speed = np.concatenate([np.gradient(c.measured[other], c.time) for c in curves])
        rows += _binned(residual, name, value, other, unit)
        rows += _binned(residual, name, speed, f"speed of {other}", f"{unit}/s")
    return rows


def _binned(residual: np.ndarray, name: str, against: np.ndarray, label: str, unit: str) -> list[dict[str, Any]]:
    """Bias and rmse of a residual in bins of equal population of another quantity."""
    edges = np.unique(np.quantile(against, np.linspace(0, 1, BINS + 1)))
    rows = []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        inside = residual[(against >= low) & (against <= high)]
        rows.append(
            {
                "signal": name,
                "against": label,
                "unit": unit,
                "from": float(low),
                "to": float(high),
                "bias": float(np.mean(inside)),
                "rmse": _rms(inside),
                "count": int(inside.size),
            }
        )
    return rows


def _by_frequency(curves: Sequence[TrialCurves], name: str) -> list[dict[str, Any]]:
    """Root mean square of the residual in octave bands, from Welch spectra averaged over trials."""
    step = float(np.median(np.diff(curves[0].time)))
    length = min(min(len(c.time) for c in curves), 1024)
    spectra = [signal.welch(_residual(c, name), 1 / step, nperseg=length, detrend="constant") for c in curves]
    frequency, power = spectra[0][0], np.mean([s[1] for s in spectra], axis=0)
    width = frequency[1] - frequency[0]
    edges = [0.0, *(frequency[1] * 2.0 ** np.arange(1, 12))]
    rows = []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        inside = power[(frequency >= low) & (frequency < high)]
        if inside.size:
            top = float(min(high, frequency[-1]))
            rows.append(
                {"signal": name, "from_hz": float(low), "to_hz": top, "rmse": float(np.sqrt(inside.sum() * width))}
            )
    return rows
