"""Which columns of a file hold time, in which unit, and when the clock began."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date

import numpy as np

from fmus.errors import MisfitError
from fmus.units import conversion
from orchestrator.measurements.dirty.header_units import split_header
from orchestrator.measurements.dirty.reading import Reading
from orchestrator.measurements.trial import Array
from orchestrator.measurements.wording import listed

DAY = 86400.0
_MONTHS = {
    name: n
    for n, name in enumerate(["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"], 1)
}
_DATE = re.compile(r"(\d{1,4})[-./ ]([A-Za-z]{3}|\d{1,2})[-./ ](\d{1,4})|(\d{4})(\d{2})(\d{2})")
_CLOCK = re.compile(r"(?:(\d{1,3}):)?(\d{1,2}):(\d{2}(?:[.,]\d+|:\d{3})?)\s*([AaPp][Mm])?")
_PACKED = re.compile(r"[T ]?(\d{2})(\d{2})(\d{2}(?:[.,]\d+)?)(?![\d:])")
_ZONE = re.compile(r":\d{2}(?:[.,]\d+)?\s*([+-])(\d{2}):?(\d{2})$")


def seconds_of(stamps: Sequence[str]) -> tuple[Array, str]:
    """Read dates, times of the day, or both, as seconds from the first one that is readable.

    Days may stand first or months (`3/4/2024`): a number above 12 decides, else the day. A time of the day without a
    date that falls back by half a day has passed midnight. Where stamps state their zone, clocks may be put forward or back.

    Returns:
        Seconds (n,), NaN where a stamp is not readable, and what had to be assumed ("" if nothing).

    Example:
        >>> seconds_of(["23:59:59.5", "00:00:00.5"])[0].tolist()
        [0.0, 1.0]
        >>> seconds_of(["01.02.2024 12:00:00,0", "01.02.2024 12:00:00,25"])[0].tolist()
        [0.0, 0.25]
        >>> seconds_of(["2024-03-31T01:59:59+01:00", "2024-03-31T03:00:00+02:00"])[0].tolist()
        [0.0, 1.0]
    """
    dates = [_DATE.match(stamp) for stamp in stamps]
    clocks = [_clock(stamp, match.end() if match else 0) for stamp, match in zip(stamps, dates, strict=True)]
    days, note = _days([match.groups() if match else None for match in dates])
    time = np.array(clocks, dtype=float)
    time = np.where(np.isnan(time), 0.0, time) + DAY * days if any(dates) else _past_midnight(time)
    known = np.flatnonzero(~np.isnan(time))
    return (time - time[known[0]] if known.size else time), note


def _clock(stamp: str, start: int) -> float:
    packed = _PACKED.match(stamp, start)
    match = packed or _CLOCK.search(stamp, start)
    if match is None:
        return float("nan")
    hours, minutes, seconds = (float(re.sub("[,:]", ".", part or "0")) for part in match.groups()[:3])
    if not packed and match[1] is None and start:
        # After a date 12:30 is hours and minutes; alone it is minutes and seconds.
        hours, minutes, seconds = minutes, seconds, 0.0
    half = match[4].lower() if not packed and match[4] else ""
    hours = hours % 12 + (12 if half == "pm" else 0) if half else hours
    zone = _ZONE.search(stamp, start)
    ahead = float(f"{zone[1]}1") * (int(zone[2]) * 3600.0 + int(zone[3]) * 60.0) if zone else 0.0
    return hours * 3600.0 + minutes * 60.0 + seconds - ahead


def _days(parts: Sequence[tuple[str | None, ...] | None]) -> tuple[Array, str]:
    """Days from the first date; NaN where there is none, or none in the calendar."""
    found = [part for part in parts if part is not None]
    if not found:
        return np.zeros(len(parts)), ""
    first = [int(part[0]) for part in found if part[0] and part[1] and part[1].isdigit()]
    second = [int(part[1]) for part in found if part[1] and part[1].isdigit()]
    month_first = bool(second) and max(first) <= 12 < max(second)
    changing = len({part for part in found}) > 1
    unsure = changing and bool(second) and max(first) <= 12 and max(second) <= 12
    days = np.array([float("nan") if part is None else _ordinal(part, month_first) for part in parts])
    known = days[~np.isnan(days)]
    return days - (known[0] if known.size else 0.0), "dates are read as day, month, year" if unsure else ""


def _ordinal(part: tuple[str | None, ...], month_first: bool) -> float:
    a, b, c, *packed = part
    if a is None or b is None or c is None:
        year, month, day = (int(text or 0) for text in packed)
    elif not b.isdigit():
        day, month, year = int(a), _MONTHS.get(b.lower(), 0), int(c)
    elif len(a) == 4:
        year, month, day = int(a), int(b), int(c)
    else:
        day, month, year = (int(b), int(a), int(c)) if month_first else (int(a), int(b), int(c))
    try:
        return float(date(year + 2000 if year < 100 else year, month, day).toordinal())
    except ValueError:
        return float("nan")


def _past_midnight(time: Array) -> Array:
    known = np.flatnonzero(~np.isnan(time))
    later = np.r_[0.0, np.cumsum(np.diff(time[known]) < -0.5 * DAY)] * DAY if known.size else np.zeros(0)
    result = time.copy()
    result[known] += later
    return result


_NAMES = [
    "time",
    "t",
    "zeit",
    "temps",
    "tiempo",
    "tempo",
    "timestamp",
    "time_stamp",
    "time-stamp",
    "stamp",
    "elapsed",
    "elapsed_time",
    "time_elapsed",
    "seconds",
    "secs",
    "sec",
    "millis",
    "micros",
    "clock",
    "uhrzeit",
    "date",
    "datetime",
    "rel_time",
    "reltime",
    "relative_time",
    "ms",
]
# Seconds, ms, us and ns since 1970 that lie between 1980 and 2100; days since 1900, as spreadsheets count, or since the year 0.
_EPOCHS = (("s", 3.2e8, 4.2e9), ("ms", 3.2e11, 4.2e12), ("us", 3.2e14, 4.2e15), ("ns", 3.2e17, 4.2e18))
_SERIAL_DAYS = ((29000.0, 73000.0), (722000.0, 767000.0))
DAY = 86400.0
DAY_STEP = 0.2


def with_clock(
    reading: Reading,
    values: Mapping[str, Array],
    stamps: Sequence[str],
    units: Mapping[str, str],
    counted_rate: float | None,
    wanted: str | None = None,
) -> tuple[Reading, tuple[str, ...]]:
    """Complete a reading by its time.

    A column named as time goes first, then stamps (a date and a time of the day are joined), then a column in a unit of
    time, then a first column that grows from row to row; at last the samples are counted, if a rate is known.

    Args:
        reading: how the file is read so far.
        values: the columns of numbers, by name in the order of the file, NaN where there is none.
        stamps: the columns that hold dates or times of the day.
        units: what the header says.
        counted_rate: the sampling rate in Hz if the file or the user says it.
        wanted: the column that the user says is time.

    Returns:
        The reading, and what was assumed.

    Raises:
        MisfitError: there is no time.
    """
    if wanted is not None:
        if wanted in stamps:
            return replace(reading, time=(wanted,), time_kind="stamps"), ()
        if wanted not in values:
            raise MisfitError(f"no column {wanted!r} that could be time; columns: {listed([*values, *stamps])}")
        return _numbers(reading, wanted, values[wanted], units.get(wanted))
    growing = [name for name in values if _grows(values[name])]
    named = [name for name in growing if name not in stamps and _plain(name) in _NAMES]
    if named:
        return _numbers(reading, named[0], values[named[0]], units.get(named[0]))
    if stamps:
        return replace(reading, time=tuple(stamps[:2]), time_kind="stamps"), ()
    timed = [name for name in growing if _is_time(units.get(name))]
    if timed:
        return _numbers(reading, timed[0], values[timed[0]], units.get(timed[0]))
    if counted_rate is not None:
        note = f"no column holds time; the samples are counted at {counted_rate:g} Hz"
        return replace(reading, time=(), time_kind="counted"), (note,)
    first = next(iter(values))
    if first in growing:
        found, notes = _numbers(reading, first, values[first], units.get(first))
        return found, (f"no column is named as time; {first!r}, which grows from row to row, is taken as time", *notes)
    raise MisfitError(
        f"no column holds time; expected one named time or t, time stamps, or one in s or ms; columns: {listed([*values, *stamps])}; name it with --time COLUMN, or give the sampling rate with --rate HZ"
    )


def _plain(name: str) -> str:
    return split_header(name)[0].lower().rstrip("()").strip().replace(" ", "_")


def _is_time(unit: str | None) -> bool:
    if not unit:
        return False
    try:
        conversion(unit, "s")
    except MisfitError:
        return False
    return True


def _grows(values: Array) -> bool:
    """Whether nearly all steps go up; rows in the wrong order or a clock that repeats its stamps are repaired later."""
    steps = np.diff(values[~np.isnan(values)])
    return bool(steps.size and np.mean(steps < 0) <= 0.05 and np.any(steps > 0))


def _steps_in_days(name: str, step: float) -> bool:
    """Whether steps are days, and not seconds of a machine that has run for long: named as dates, or round in seconds only."""
    dated = "date" in name.lower() or "datum" in name.lower()
    return 0 < step < DAY_STEP and (dated or (_is_round(step * DAY) and not _is_round(step)))


def _is_round(value: float) -> bool:
    return abs(float(f"{value:.1e}") / value - 1) < 3e-3


def _numbers(reading: Reading, name: str, values: Array, unit: str | None) -> tuple[Reading, tuple[str, ...]]:
    known = values[~np.isnan(values)]
    first, step = float(known[0]), float(np.median(np.abs(np.diff(known)))) if len(known) > 1 else 0.0
    for epoch, low, high in _EPOCHS:
        if low < first < high and (unit is None or unit == epoch):
            notes = () if unit else (f"{name!r} counts {epoch} since 1970; time starts at its first value",)
            return replace(reading, time=(name,), time_kind="epoch", time_unit=epoch), notes
    if unit is None and any(low < first < high for low, high in _SERIAL_DAYS) and _steps_in_days(name, step):
        note = f"{name!r} counts days, as spreadsheets do; time starts at its first value"
        return replace(reading, time=(name,), time_kind="epoch", time_unit="d"), (note,)
    if _is_time(unit):
        return replace(reading, time=(name,), time_kind="number", time_unit=unit or "s"), ()
    return replace(reading, time=(name,), time_kind="number", time_unit="s"), (
        f"{name!r} states no unit of time; taken as s",
    )
