"""Where a model fails: by signal, in time, against the measured state, and in frequency."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
import scipy

from fmus.units import after_number
from orchestrator.compare.maps import (
    Coordinate,
    ErrorMap,
    coordinates_of,
    error_map,
    error_maps,
    sentence,
    three_digits,
)
from orchestrator.compare.result import TrialCurves

NO_UNITS: Mapping[str, str] = MappingProxyType({})
WINDOWS = 10
SHUFFLES = 39


def where_it_fails(
    curves: Sequence[TrialCurves],
    units: Mapping[str, str],
    floor: Mapping[str, float],
    input_units: Mapping[str, str] = NO_UNITS,
) -> dict[str, list[dict[str, Any]]]:
    """Return the error of each signal by signal, time window, bin of the measured state, and frequency band.

    Residuals are measured minus modelled. Speeds are central differences of the measured signals.

    Args:
        curves: trials with measured and modelled signals.
        units: of the signals.
        floor: rms of each signal that a right model would leave.
        input_units: of the inputs, for the labels.

    Returns:
        Rows by `signal`, `time`, `state` and `frequency`, as in the JSON.
    """
    maps = {name: state_maps(curves, units, name, input_units) for name in units}
    return {
        "signal": [
            {**_by_signal(curves, name, units, floor), "depends": sentence(f"Error of {name}", maps[name])}
            for name in units
        ],
        "time": [row for name in units for row in _by_time(curves, name)],
        "state": [row for name in units for row in map_rows(maps[name], name)],
        "frequency": [row for name in units for row in _by_frequency(curves, name)],
    }


def findings(where: Mapping[str, list[dict[str, Any]]], floor: Mapping[str, float]) -> tuple[str, ...]:
    """Say in sentences where the error stands out, worst signal first."""
    sentences = []
    for row in sorted(where["signal"], key=lambda r: -r["over_floor"]):
        name = row["signal"]
        if row["over_floor"] < 1.5:
            sentences.append(f"{name} agrees within the noise ({_times(row['over_floor'])} times the floor)")
            continue
        parts = []
        biased = [r for r in where["state"] if r["signal"] == name and abs(r["bias"]) > 2 * floor[name]]
        if biased:
            most = max(biased, key=lambda r: abs(r["bias"]))
            way = "low" if most["bias"] > 0 else "high"
            parts.append(
                f"the model is {abs(most['bias']):.2g}{after_number(row['unit'])} too {way} where {most['against']} is "
                f"{three_digits(most['from'])} to {three_digits(most['to'])}{after_number(most['unit'])}"
            )
        bands = [r for r in where["frequency"] if r["signal"] == name]
        if bands:
            worst = max(bands, key=lambda r: r["rmse"])
            above = f"from {worst['from_hz']:.2g} " if worst["from_hz"] > 0 else ""
            parts.append(f"most of the error is of frequencies {above}up to {worst['to_hz']:.2g} Hz")
        if parts:
            sentences.append(f"{name}: {'; '.join(parts)}")
        if "depends" in row:
            sentences.append(row["depends"])
    return tuple(sentences)


def _times(over_floor: float) -> str:
    """Two digits, and whole numbers above.

    >>> _times(1.04), _times(327.4)
    ('1', '327')
    """
    return f"{over_floor:.2g}" if over_floor < 100 else f"{over_floor:.0f}"


def _residual(curve: TrialCurves, name: str) -> np.ndarray:
    return curve.measured[name] - curve.modelled[name]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else 0.0


def _by_signal(
    curves: Sequence[TrialCurves], name: str, units: Mapping[str, str], floor: Mapping[str, float]
) -> dict[str, Any]:
    rmse = _rms(np.concatenate([_residual(c, name) for c in curves]))
    return {"signal": name, "unit": units[name], "rmse": rmse, "floor": floor[name], "over_floor": rmse / floor[name]}


def _by_time(curves: Sequence[TrialCurves], name: str) -> list[dict[str, Any]]:
    """Root mean square in windows of time, with the band of chance; a short record has no band."""
    time = Coordinate("time", "s", tuple(c.time for c in curves))
    found = error_map([_residual(c, name) for c in curves], time, _step(curves), bins=WINDOWS)
    if found is None:
        every = np.concatenate(time.values)
        rms = _rms(np.concatenate([_residual(c, name) for c in curves]))
        return [{"signal": name, "from_s": float(every.min()), "to_s": float(every.max()), "rmse": rms}]
    return [
        {
            "signal": name,
            "from_s": float(found.edges[k]),
            "to_s": float(found.edges[k + 1]),
            "rmse": float(found.rms[k]),
            "low": float(found.low[k]),
            "high": float(found.high[k]),
        }
        for k in range(len(found.rms))
    ]


def _step(curves: Sequence[TrialCurves]) -> float:
    return float(np.median(np.diff(curves[0].time))) if len(curves[0].time) > 1 else 1.0


def state_maps(
    curves: Sequence[TrialCurves], units: Mapping[str, str], name: str, input_units: Mapping[str, str]
) -> list[ErrorMap]:
    """The residual of a signal over everything that was recorded, each with its permutation band.

    Args:
        curves: trials with measured and modelled signals.
        units: of the signals.
        name: the signal whose residual is mapped.
        input_units: of the inputs.
    """
    times = [c.time for c in curves]
    signals = {other: [c.measured[other] for c in curves] for other in units}
    inputs = {other: [c.inputs[other] for c in curves] for other in curves[0].inputs}
    residual = [_residual(c, name) for c in curves]
    found = coordinates_of(signals, units, inputs, input_units, times)
    return [m for m in error_maps(residual, found, _step(curves)) if m is not None]


def map_rows(maps: Sequence[ErrorMap], name: str) -> list[dict[str, Any]]:
    """Bias and rmse of a residual in bins of equal population of other quantities, with the band of chance."""
    return [
        {
            "signal": name,
            "against": m.against,
            "unit": m.unit,
            "from": float(m.edges[k]),
            "to": float(m.edges[k + 1]),
            "bias": float(m.bias[k]),
            "rmse": float(m.rms[k]),
            "count": int(m.count[k]),
            "low": float(m.low[k]),
            "high": float(m.high[k]),
            "p_value": m.p_value,
            "strength": m.strength,
        }
        for m in maps
        for k in range(len(m.rms))
    ]


def _by_frequency(curves: Sequence[TrialCurves], name: str) -> list[dict[str, Any]]:
    """Root mean square of the residual in octave bands, from Welch spectra averaged over trials.

    `low` and `high` hold 95 % of what the same samples give in random order, that is without any memory.
    """
    step = _step(curves)
    length = min(min(len(c.time) for c in curves), 1024)
    series = [_residual(c, name) for c in curves]
    frequency, power = _spectrum(series, step, length)
    width = frequency[1] - frequency[0]
    edges = [0.0, *(frequency[1] * 2.0 ** np.arange(1, 12))]
    random = np.random.default_rng(0)
    orders = [[random.permutation(len(part)) for part in series] for _ in range(SHUFFLES)]
    mixed = [part[np.array([order[k] for order in orders])] for k, part in enumerate(series)]
    shuffled = _spectrum(mixed, step, length)[1]
    rows = []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        inside = (frequency >= low) & (frequency < high)
        if inside.any():
            chance = [float(np.sqrt(other[inside].sum() * width)) for other in shuffled]
            rows.append(
                {
                    "signal": name,
                    "from_hz": float(low),
                    "to_hz": float(min(high, frequency[-1])),
                    "rmse": float(np.sqrt(power[inside].sum() * width)),
                    "low": float(np.quantile(chance, 0.025)),
                    "high": float(np.quantile(chance, 0.975)),
                }
            )
    return rows


def _spectrum(series: Sequence[np.ndarray], step: float, length: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies, and power (..., f) of series (..., n), averaged over them."""
    spectra = [scipy.signal.welch(part, 1 / step, nperseg=length, detrend="constant") for part in series]
    return spectra[0][0], np.mean([s[1] for s in spectra], axis=0)
