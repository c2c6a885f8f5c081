"""How noisy a measured column is: as declared by its sensor, else as estimated from the record."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.measurements.sensors import declared
from orchestrator.measurements.trial import Array
from orchestrator.measurements.wording import shown

# Order 4 removes any cubic stretch of signal; higher orders gain little and need longer records.
_ORDER = 4
# Median of |x| for x ~ N(0, 1): the 75 % quantile of the normal distribution.
_MEDIAN_OF_UNIT_NORMAL = 0.6744897501960817
# Standard deviation of a uniform error of width 1.
_UNIFORM_STD = 1.0 / math.sqrt(12.0)
# Steps below this share of the signal are rounding of the arithmetic, not of the sensor.
_ROUNDING = 1e-12
# Steps are multiples of a resolution if most are to within this share of it.
_GRID = 0.1
_MOST = 0.9
# Noise taken for a column that never changes, as a share of its value.
_CONSTANT_SHARE = 1e-3


@dataclass(frozen=True)
class NoiseLevel:
    """Standard deviation of the noise, and a sentence that says where the number comes from."""

    std: float
    note: str


def declared_noise(sensors: Mapping[str, float], unit: str, column: str = "") -> float | None:
    """Give the noise that [sensors] declares for columns in `unit`, quantisation included.

    `sqrt(std^2 + resolution^2 / 12)` with `<sensor>_noise_std_<unit>` and
    `<sensor>_resolution_<unit>`; either may be absent.

    Returns:
        Standard deviation in `unit`; None if neither is declared.

    Example:
        >>> declared_noise({"force_noise_std_N": 0.25}, "mN")
        250.0
    """
    std = declared(sensors, "noise_std", unit, column)
    resolution = declared(sensors, "resolution", unit, column)
    if std is None and resolution is None:
        return None
    return math.hypot(std or 0.0, (resolution or 0.0) * _UNIFORM_STD)


def estimated_noise(values: Array) -> float:
    """Estimate the noise of a sampled smooth signal from the record alone.

    Fourth-order differences `e_i = sum_k d_k y_(i+k)`, `d = (1, -4, 6, -4, 1) / sqrt(70)`, remove the
    signal and keep the noise variance since `sum_k d_k^2 = 1` (Hall, Kay & Titterington, Biometrika
    77, 1990; Gasser, Sroka & Jennen-Steinmetz, Biometrika 73, 1986). The spread of `e` is taken as
    `median|e| / 0.6745`, so that jumps and impacts do not count as noise. The result is at least the
    error of the finest step seen in the record, `step / sqrt(12)`.

    Args:
        values: shape (n,), n >= 2, evenly sampled. Fewer than five samples lower the order.

    Returns:
        Standard deviation in the unit of `values`, too high where the signal is not smooth from
        sample to sample; 0 only for a record that never changes and so says nothing.
    """
    order = min(_ORDER, len(values) - 1)
    gain = math.sqrt(math.comb(2 * order, order))
    residual = np.diff(values, n=order) / gain
    spread = float(np.median(np.abs(residual))) / _MEDIAN_OF_UNIT_NORMAL
    return max(spread, _finest_step(values) * _UNIFORM_STD)


def measurement_noise(column: str, unit: str, records: Sequence[Array], sensors: Mapping[str, float]) -> NoiseLevel:
    """Decide on the noise of a column: declared by its sensor, else estimated.

    Args:
        column: name of the column, which may have a key of its own in [sensors].
        unit: unit of the records and of the result, "" if unknown.
        records: the column in each learning trial; the median of their estimates counts.
        sensors: the table [sensors].

    Returns:
        A level above 0. A declared resolution without a declared noise is a lower limit of the
        estimate. A column that never changes, or only in steps of any size, is given 0.1 % of its value
        (or 0.001), and the note asks for a declaration.
    """
    stated = declared_noise(sensors, unit, column)
    if stated and declared(sensors, "noise_std", unit, column) is not None:
        return NoiseLevel(stated, _note(column, stated, unit, "declared in [sensors]"))
    estimates = [estimated_noise(values) for values in records]
    changing = [estimate for estimate in estimates if estimate > 0.0]
    if changing or stated:
        std = max(float(np.median(changing)) if changing else 0.0, stated or 0.0)
        return NoiseLevel(std, _note(column, std, unit, "estimated from the record"))
    std = _CONSTANT_SHARE * (max(float(np.max(np.abs(v))) for v in records) or 1.0)
    how = "changes only in steps" if any(np.ptp(values) > 0 for values in records) else "never changes"
    reason = f"assumed, because the column {how}; declare it in [sensors]"
    return NoiseLevel(std, _note(column, std, unit, reason))


def _finest_step(values: Array) -> float:
    steps = np.abs(np.diff(values))
    real = steps[steps > _ROUNDING * np.max(np.abs(values))]
    if not real.size:
        return 0.0
    finest = float(np.min(real))
    # A resolution divides every step; the steps of an exact command are of any size.
    share = np.mean(np.abs(real / finest - np.round(real / finest)) < _GRID)
    return finest if share > _MOST else 0.0


def _note(column: str, std: float, unit: str, origin: str) -> str:
    return f"noise of {shown(column)}: {std:.3g} {unit or '(unit unknown)'} standard deviation, {origin}"
