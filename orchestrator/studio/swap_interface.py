"""Two interfaces side by side: one row for each property of a variable that differs, with what it means for who uses it."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from orchestrator.cosim.component import Port
from orchestrator.cosim.swap import Match

# What a caller relies on; start values and the way a variable may change are a component's own affair.
_RELIED_ON = ("name", "causality", "type", "unit", "size")
_SHOWN = ("input", "output", "parameter", "structuralParameter")


@dataclass(frozen=True)
class Row:
    """One difference; `old` and `new` are texts, "missing" where there is no such variable."""

    variable: str
    what: str
    old: str
    new: str
    breaking: bool


def interface_rows(old: Iterable[Port], new: Iterable[Port], matches: Sequence[Match]) -> list[Row]:
    """Every difference, those that break something first; variables are paired as a swap would pair them."""
    olds, news = ({p.name: p for p in ports if p.causality in _SHOWN} for ports in (old, new))
    pairs = {match.old: match.new for match in matches if match.old in olds}
    taken = set(pairs.values())
    rows = [row for name, target in pairs.items() if target in news for row in _differences(olds[name], news[target])]
    rows += [Row(name, "variable", port.causality, "missing", True) for name, port in olds.items() if name not in pairs]
    rows += [
        Row(name, "variable", "missing", port.causality, port.causality == "input" and port.start is None)
        for name, port in news.items()
        if name not in taken
    ]
    return sorted(rows, key=lambda row: not row.breaking)


def _differences(old: Port, new: Port) -> Iterator[Row]:
    before, after = _properties(old), _properties(new)
    for what, value in before.items():
        if value != after[what]:
            # Who sets a parameter during a run needs it to stay tunable.
            lost = what == "variability" and (value, after[what]) == ("tunable", "fixed")
            yield Row(old.name, what, value, after[what], lost or what in _RELIED_ON)


def _properties(port: Port) -> Mapping[str, str]:
    return {
        "name": port.name,
        "causality": port.causality,
        "variability": port.variability,
        "type": port.type,
        "unit": port.unit or "none",
        "size": str(port.size),
        "start": "none" if port.start is None else _text(port.start),
    }


def _text(value: Any) -> str:
    text = f"{value:.9g}" if isinstance(value, float) else " ".join(str(value).split())
    return text if len(text) <= 60 else text[:57] + "..."
