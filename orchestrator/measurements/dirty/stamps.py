"""Time stamps of any kind as seconds from the first."""

import re
from collections.abc import Sequence
from datetime import date

import numpy as np

from orchestrator.measurements.trial import Array

DAY = 86400.0
_MONTHS = {
    name: n
    for n, name in enumerate(["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"], 1)
}
_DATE = re.compile(r"(\d{1,4})[-./ ]([A-Za-z]{3}|\d{1,2})[-./ ](\d{1,4})|(\d{4})(\d{2})(\d{2})")
_CLOCK = re.compile(r"(?:(\d{1,3}):)?(\d{1,2}):(\d{2}(?:[.,]\d+)?)\s*([AaPp][Mm])?")
_PACKED = re.compile(r"T(\d{2})(\d{2})(\d{2}(?:[.,]\d+)?)")


def seconds_of(stamps: Sequence[str]) -> tuple[Array, str]:
    """Read dates, times of the day, or both, as seconds from the first one that is readable.

    Days may stand first or months (`3/4/2024`): a number above 12 decides, else the day. A time of the day without a
    date that falls back by half a day has passed midnight. Time zones are not looked at: a record stays in one.

    Returns:
        Seconds (n,), NaN where a stamp is not readable, and what had to be assumed ("" if nothing).

    Example:
        >>> seconds_of(["23:59:59.5", "00:00:00.5"])[0].tolist()
        [0.0, 1.0]
        >>> seconds_of(["01.02.2024 12:00:00,0", "01.02.2024 12:00:00,25"])[0].tolist()
        [0.0, 0.25]
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
    hours, minutes, seconds = (float((part or "0").replace(",", ".")) for part in match.groups()[:3])
    if not packed and match[1] is None and start:
        # After a date 12:30 is hours and minutes; alone it is minutes and seconds.
        hours, minutes, seconds = minutes, seconds, 0.0
    half = match[4].lower() if not packed and match[4] else ""
    hours = hours % 12 + (12 if half == "pm" else 0) if half else hours
    return hours * 3600.0 + minutes * 60.0 + seconds


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
