"""The clocks that an FMU of FMI 3.0 declares, as the standard describes them (section 2.2.8)."""

import xml.etree.ElementTree as ET
import zipfile
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Clock:
    """A clock: `variability` is that of its interval (constant, fixed, calculated, tunable, changing, countdown, triggered).

    `interval` and `shift` are in s, None and 0 where the description does not say. Of two that tick at one instant, the
    one with the lower `priority` is served first.
    """

    name: str
    reference: int
    causality: str
    variability: str
    interval: float | None = None
    shift: float = 0.0
    priority: int = 0


def read_clocks(path: Path) -> tuple[Clock, ...]:
    """Clocks in the order of the description; FMPy does not read their intervals."""
    with zipfile.ZipFile(path) as archive, archive.open("modelDescription.xml") as stream:
        return tuple(map(_clock, ET.parse(stream).findall("ModelVariables/Clock")))


def _clock(element: ET.Element) -> Clock:
    resolution = float(element.get("resolution") or 1.0)
    interval = _time(element, "interval", resolution)
    return Clock(
        name=element.get("name", ""),
        reference=int(element.get("valueReference", "0")),
        causality=element.get("causality", "local"),
        variability=element.get("intervalVariability", ""),
        interval=interval,
        shift=_time(element, "shift", resolution) or 0.0,
        priority=int(element.get("priority") or 0),
    )


def _time(element: ET.Element, kind: str, resolution: float) -> float | None:
    decimal, counter = element.get(f"{kind}Decimal"), element.get(f"{kind}Counter")
    if decimal is not None:
        return float(decimal)
    return None if counter is None else float(counter) / resolution
