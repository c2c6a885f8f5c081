"""How noisy a measured column is: as declared by its sensor, else as estimated from the record."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.measurements.colour import MEMORIES, Noise, noise_of_records
from orchestrator.measurements.jitter import ORDER, Clock, clock_jitter
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
# A spectrum with this many times the noise that most differences show is filled by impacts or steps.
IMPACTS = 1.5
# Samples in the means that are looked at for that.
SIZES = (2, 4, 8)
# More noise than declared by this factor is no accident of the record.
CONTRADICTED = 1.25
# Neighbouring samples of white noise show at least this share of it, if what is stated of it is about right.
WHITE = 0.9
# Steps of a reading are worth a word if they make this share of its noise.
MOSTLY = 0.5
# Noise taken for a column that never changes, as a share of its value.
_CONSTANT_SHARE = 1e-3


@dataclass(frozen=True)
class NoiseLevel:
    """Noise of a column, and a sentence that says where the number comes from.

    `declared` and `record` are the standard deviations that the sensors state and that the record shows, None where
    they do not; `warning` says so if the record contradicts the sensors, else it is empty.
    """

    noise: Noise
    note: str
    declared: float | None = None
    record: float | None = None
    warning: str = ""

    @property
    def std(self) -> float:
        """Standard deviation."""
        return self.noise.std


def declared_noise(sensors: Mapping[str, float], unit: str, column: str = "") -> float | None:
    """Give the noise that [sensors] declares for columns in `unit`, quantisation included.

    `sqrt(std^2 + resolution^2 / 12)` with `<sensor>_noise_std_<unit>` and
    `<sensor>_resolution_<unit>`; either may be absent.

    Args:
        sensors: `[sensors]` of `case.toml`.
        unit: of the columns.
        column: name of the column; a key named after it goes before one named after a sensor.

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
    return max(_spread(values), rounding_error(values))


def rounding_error(*records: Array) -> float:
    """Standard deviation of what rounding to its resolution costs a column, in its unit: 1/sqrt(12) of a step (Widrow 1956).

    Args:
        records: (n,) each, the column in some trials, without gaps.

    Returns:
        0 where they show no resolution.
    """
    return _finest_step(*records) * _UNIFORM_STD if records else 0.0


def recorded_noise(records: Sequence[Array]) -> Noise:
    """Estimate noise and its colour from the same column of several trials, evenly sampled.

    The spectrum above the motion says what colour the noise has; where there is none, or impacts and steps fill it, noise
    counts as white and of the level that differences of neighbouring samples show, the median over the trials.
    """
    rounding = rounding_error(*records)
    levels = [max(_spread(values), rounding) for values in records if np.ptp(values) > 0.0]
    levels = [level for level in levels if level > 0.0]
    if not levels:
        return Noise(0.0)
    level = float(np.median(levels))
    found = noise_of_records(records)
    if found is None or found.fast > IMPACTS * level or _is_too_slow(found, records):
        return Noise(level)
    return found.scaled(max(found.std, rounding))


def measurement_noise(
    column: str, unit: str, records: Sequence[Array], sensors: Mapping[str, float], *, drives: bool = False
) -> NoiseLevel:
    """Decide on the noise of a column: declared by its sensor or seen in the record, whichever is larger.

    The record contradicts a declaration if it has more power above a quarter of the sampling rate, where nothing moves. What
    drives the model does, so that its declared noise counts.
    Else a declared level counts, with the colour that the record shows.

    Args:
        column: name of the column, which may have a key of its own in [sensors].
        unit: unit of the records and of the result, "" if unknown.
        records: the column in each learning trial.
        sensors: the table [sensors].
        drives: whether the column drives the model; a command that changes only in steps is exact then.

    Returns:
        A level above 0, but for exact commands. A declared resolution without a declared noise is a lower limit of the
        record's. An output that never changes, or only in steps of any size, is given 0.1 % of its value (or 0.001),
        and the note asks for a declaration.
    """
    stated = declared_noise(sensors, unit, column) or None
    if drives and stated is None and declared(sensors, "noise_std", unit, column) == 0.0:
        return NoiseLevel(Noise(0.0), _note(column, 0.0, unit, "declared in [sensors]"))
    record = recorded_noise([r for r in records if not (drives and _switches(r))])
    shown_std = record.std or None
    clock = clock_jitter(records)
    if stated is not None and clock is not None:
        at_rest = float(np.sqrt(max(record.fast**2 - clock.moved**2, 0.0)))
        if at_rest <= CONTRADICTED * stated or clock.moved > at_rest:
            return _jittering(column, unit, stated, record, records, clock)
    if stated is not None and record.fast > CONTRADICTED * stated:
        contradiction = (
            f"warning: noise of {shown(column)} is {record.std:.3g} {unit or '(unit unknown)'} as the record shows it above a"
            f" quarter of the sampling rate, but [sensors] declares {stated:.3g}"
        )
        if declared(sensors, "noise_std", unit, column):
            if drives:  # a controller answers noise and steps at once: what is fast in a command is a command
                warning = f"{contradiction}; it drives the model, so that the rest counts as its motion"
                note = _note(column, stated, unit, "declared in [sensors]")
                return NoiseLevel(Noise(stated), note, stated, record.std, warning)
            note = _note(column, record.std, unit, "estimated from the record")
            return NoiseLevel(record, note, stated, record.std, f"{contradiction}; the larger is used")
    elif stated is not None:
        noise = _coloured(records, record, stated)
        return NoiseLevel(noise, _note(column, stated, unit, "declared in [sensors]"), stated, shown_std)
    if shown_std is not None:
        origin = f"estimated from the record{_steps_in(records, record, unit)}"
        return NoiseLevel(record, _note(column, record.std, unit, origin), stated, shown_std)
    how = "changes only in steps" if any(np.ptp(values) > 0 for values in records) else "never changes"
    if drives:
        return NoiseLevel(Noise(0.0), f"noise of {shown(column)}: none, because the column {how}")
    std = _CONSTANT_SHARE * (max(float(np.max(np.abs(v))) for v in records) or 1.0)
    reason = f"assumed, because the column {how}; declare it in [sensors]"
    return NoiseLevel(Noise(std), _note(column, std, unit, reason))


def _coloured(records: Sequence[Array], record: Noise, stated: float) -> Noise:
    """Noise of the stated size with the colour that the records show together with that statement, or by themselves."""
    if not record.std:
        return Noise(stated)
    found = noise_of_records(records, stated)
    level = float(np.median([level for level in map(estimated_noise, records) if level > 0.0]))
    # Steps and bends of the signal fill the spectrum of each window, and few of the differences, which show no less
    # than noise.
    if (
        found is not None
        and not _is_too_slow(found, records)
        and level >= WHITE * _of_differences(found.scaled(stated))
    ):
        return found.scaled(stated)
    return _slower(stated, level, _ORDER) or record.scaled(stated)


def _of_differences(noise: Noise) -> float:
    """Standard deviation of what `estimated_noise` sees of noise: its own if it is white, less if it is slow."""
    weights = np.array([(-1) ** k * math.comb(_ORDER, k) for k in range(_ORDER + 1)])
    return float(np.sqrt(weights @ noise.covariance(_ORDER + 1, 1) @ weights / math.comb(2 * _ORDER, _ORDER)))


def _slower(stated: float, level: float, order: int) -> Noise | None:
    """Autoregressive noise of the stated size whose differences of an order scatter like those of white noise of a `level`.

    None if the two are alike: what neighbouring samples do not show of the stated noise, slower differences do.
    """
    if level >= WHITE * stated:
        return None
    weights = np.array([(-1) ** k * math.comb(order, k) for k in range(order + 1)])
    lags = np.abs(np.subtract.outer(range(order + 1), range(order + 1)))
    shares = np.sqrt([weights @ memory**lags @ weights / math.comb(2 * order, order) for memory in MEMORIES])
    return Noise(0.0, stated, float(MEMORIES[np.argmin(np.abs(shares - level / stated))]))


def _jittering(
    column: str, unit: str, stated: float, record: Noise, records: Sequence[Array], clock: Clock
) -> NoiseLevel:
    """The noise of a signal that is sampled by a clock that jitters."""
    jitter, moved = clock.jitter, clock.moved
    # What the clock adds is white and hides most of the rest, whose colour is the likeliest one.
    total = noise_of_records(records, float(np.hypot(stated, moved)), shown=0.0)
    steady = _slower(stated, clock.fast, ORDER) or Noise(stated)
    if total is not None and total.slow > 0.0 and not _is_too_slow(total, records):
        left = float(np.sqrt(max(total.white**2 - moved**2, 0.0)))
        steady = Noise(left, total.slow, total.memory).scaled(stated)
    noise = steady.with_jitter(jitter, moved)
    warning = (
        f"warning: the clock of {shown(column)} jitters by {jitter:.2g} of a sample, as its noise shows, which grows with"
        f" speed; that adds {moved:.3g} {unit or '(unit unknown)'} to the {stated:.3g} declared in [sensors]"
    )
    return NoiseLevel(
        noise, _note(column, noise.std, unit, "declared, and a clock that jitters"), stated, record.std, warning
    )


def _is_too_slow(noise: Noise, records: Sequence[Array]) -> bool:
    """Whether means over a few samples scatter less than this noise would let them: bends of the signal fill its spectrum."""
    weights = np.array([(-1) ** k * math.comb(_ORDER, k) for k in range(_ORDER + 1)])
    for size in SIZES:
        means = [r[: len(r) // size * size].reshape(-1, size).mean(axis=1) for r in records]
        left = np.concatenate([np.diff(m, n=_ORDER) for m in means if len(m) > _ORDER] or [np.zeros(0)])
        expected = float(np.sqrt(weights @ noise.covariance(_ORDER + 1, size) @ weights))
        if left.size and float(np.median(np.abs(left))) / _MEDIAN_OF_UNIT_NORMAL * IMPACTS < expected:
            return True
    return False


def _spread(values: Array) -> float:
    """Standard deviation of white noise with such differences of neighbouring samples as most of a record has."""
    order = min(_ORDER, len(values) - 1)
    gain = math.sqrt(math.comb(2 * order, order))
    residual = np.diff(values, n=order) / gain
    return float(np.median(np.abs(residual))) / _MEDIAN_OF_UNIT_NORMAL


def _switches(values: Array) -> bool:
    """Whether a record goes to and fro between two values, at each of which it stays: its steps say nothing of a resolution."""
    return len(np.unique(values)) == 2 and _spread(values) == 0.0


def _finest_step(*records: Array) -> float:
    """The resolution of records of one column, 0 if they show none: the smallest step, or difference of neighbouring
    steps, of which nearly all steps are multiples.

    Whatever moves almost evenly makes steps of three counts, say, and now and then one of four: the difference is one
    count. A square wave has steps of one size, of which those of another record are no multiples.
    """
    changes = np.concatenate([np.diff(values) for values in records])
    steps, both = np.abs(changes), np.abs(np.concatenate([changes, *(np.diff(values, n=2) for values in records)]))
    least = _ROUNDING * max(float(np.max(np.abs(values))) for values in records)
    real, both = steps[steps > least], both[both > least]
    if not real.size:
        return 0.0
    finest = float(np.min(both))
    counts = np.round(changes / finest)
    # Whatever moves at a constant speed makes steps of one size, which says nothing of a resolution.
    if np.ptp(counts) == 0:
        return 0.0
    # A resolution divides every step; the steps of an exact command are of any size.
    share = np.mean(np.abs(real / finest - np.round(real / finest)) < _GRID)
    return finest if share > _MOST else 0.0


def _steps_in(records: Sequence[Array], record: Noise, unit: str) -> str:
    """Words for a sensor that reads in steps, where these are most of its noise."""
    step = _finest_step(*records)
    if step * _UNIFORM_STD < MOSTLY * record.std:
        return ""
    return f", which reads in steps of {step:.3g} {unit}".rstrip()


def _note(column: str, std: float, unit: str, origin: str) -> str:
    return f"noise of {shown(column)}: {std:.3g} {unit or '(unit unknown)'} standard deviation, {origin}"
