"""Why: the force that the model lacks over the coordinate that tells most about it, from the JSON document."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from orchestrator.compare.maps import shape

Document = Mapping[str, Any]
# Panels that have room beside each other.
MOST_PANELS = 2
Z90 = 1.645
QUANTITIES = {
    "N.m": "torque",
    "W": "heat flow",
    "rad/s2": "acceleration",
    "m/s2": "acceleration",
    "m3/s": "flow",
    "kg/s": "flow",
    "A": "current",
    "V": "voltage",
}


@dataclass(frozen=True)
class Witness:
    """Dots (n,) of the missing force `balance` in `unit` over a coordinate, with 90 % half-widths, and the fitted law if known."""

    balance: str
    unit: str
    coordinate: str
    coordinate_unit: str
    x: tuple[float, ...]
    force: tuple[float, ...]
    band: tuple[float, ...]
    law: tuple[float, ...]


def witnesses_of(document: Document) -> tuple[Witness, ...]:
    """The panels: as the document states them, else its curves of what no effect explains, else its map of the force."""
    given = [found for each in document.get("witness") or () if (found := stated(each)) is not None]
    maps = _binned(document)
    if not any(each.law for each in given) and any(each.law for each in maps):
        given = maps  # the fitted law through the force says more than the force alone
    return tuple((given or _latent(document) or maps)[:MOST_PANELS])


def stated(entry: Mapping[str, Any]) -> Witness | None:
    """A panel as a document states it; none if it holds no curve."""
    x, force = _numbers(entry.get("x")), _numbers(entry.get("force"))
    if len(x) < 2 or len(x) != len(force):
        return None
    band, law = _numbers(entry.get("band")), _numbers(entry.get("law"))
    order = sorted(range(len(x)), key=x.__getitem__)
    return Witness(
        _titled(str(entry.get("balance", ""))),
        str(entry.get("unit", "")),
        str(entry.get("coordinate", "")),
        str(entry.get("coordinate_unit", "")),
        tuple(x[k] for k in order),
        tuple(force[k] for k in order),
        tuple(band[k] for k in order) if len(band) == len(x) else (),
        # A law that supplies no force here, such as a delay, has no line to draw.
        tuple(law[k] for k in order) if len(law) == len(x) and any(law) else (),
    )


def _titled(balance: str) -> str:
    """What a panel shows, by the name of the variable whose balance lacks a force, a flow or a current."""
    if not balance:
        return "the missing force"
    return balance if " " in balance else f"missing at {balance}"


def _latent(document: Document) -> list[Witness]:
    """Curves of what is left, where no effect explains it."""
    found = []
    for each in document.get("latent_forces") or ():
        x, force = _numbers(each.get("at")), _numbers(each.get("force"))
        low, high = _numbers(each.get("low")), _numbers(each.get("high"))
        if len(x) < 2 or len({len(x), len(force), len(low), len(high)}) > 1:
            continue
        coordinate, unit = each["coordinates"][0], each["coordinate_units"][0]
        band = tuple((b - a) / 2 for a, b in zip(low, high, strict=True))
        found.append(
            Witness(
                f"what is left of {each['signal']}", each["unit"], coordinate, unit, tuple(x), tuple(force), band, ()
            )
        )
    return found


def _binned(document: Document) -> list[Witness]:
    """One panel for each signal: the mean missing force in bins of the coordinate of the greatest strength."""
    where = document.get("where") or {}
    rows = where.get("force") or () if isinstance(where, Mapping) else ()
    found = []
    for signal in dict.fromkeys(row["signal"] for row in rows):
        own = [row for row in rows if row["signal"] == signal]
        best = max(own, key=lambda row: (float(row.get("strength") or 0.0), row["against"]))["against"]
        bins = [row for row in own if row["against"] == best and row.get("count")]
        if len(bins) < 3:
            continue
        bins.sort(key=lambda row: float(row["from"]))
        spread = [max(float(b["rmse"]) ** 2 - float(b["bias"]) ** 2, 0.0) ** 0.5 for b in bins]
        found.append(
            Witness(
                f"missing {quantity_of(str(bins[0].get('force_unit', '')))} on {signal}",
                str(bins[0].get("force_unit", "")),
                str(best),
                str(bins[0].get("unit", "")),
                tuple((float(b["from"]) + float(b["to"])) / 2 for b in bins),
                tuple(float(b["bias"]) for b in bins),
                tuple(Z90 * s / math.sqrt(b["count"]) for s, b in zip(spread, bins, strict=True)),
                tuple(float(b["law"]) for b in bins) if all("law" in b for b in bins) else (),
            )
        )
    return found


def shape_words(found: Sequence[Witness]) -> str:
    """What the dots show, in words; the plainest of the shapes that tells most of their variance.

    >>> line = Witness("torque", "N.m", "speed of q", "rad/s", (-2.0, -1.0, 1.0, 2.0), (2.0, 1.0, -1.0, -2.0), (), ())
    >>> shape_words([line])
    'the missing torque opposes speed of q, in proportion to it'
    """
    if not found:
        return ""
    first = found[0]
    lack = "what is left" if first.balance.startswith("what is left") else f"the missing {quantity_of(first.unit)}"
    x, force = np.array(first.x), np.array(first.force)
    if np.ptp(x) == 0 or np.ptp(force) == 0:
        return f"{lack} hardly changes with {first.coordinate}"
    way = shape(x, force)
    if first.coordinate.startswith("speed") and way.startswith("falls"):
        return f"{lack} opposes {first.coordinate}{', in proportion to it' if 'proportion' in way else ''}"
    return f"{lack} {way} {first.coordinate}"


def quantity_of(unit: str) -> str:
    """What is missing, by its unit; a balance that is no force's has a rate of its own.

    >>> quantity_of("N.m"), quantity_of("W"), quantity_of("rad/s2"), quantity_of("")
    ('torque', 'heat flow', 'acceleration', 'force')
    """
    return QUANTITIES.get(unit, "force" if unit in ("", "N") else "rate")


def _numbers(values: Any) -> list[float]:
    try:
        found = [float(value) for value in values or ()]
    except (TypeError, ValueError):
        return []
    return found if all(map(math.isfinite, found)) else []
