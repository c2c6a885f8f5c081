"""What is said of proposed formulas, from the JSON document, in a terminal and on pages."""

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from orchestrator.compare.estimates import REFUTED
from orchestrator.report.answer.words import capital, joined, size, what
from orchestrator.report.numbers import digits, over_floor, quantity

Document = Mapping[str, Any]


def formula_lines(document: Document) -> list[str]:
    """Sentences for the first formula, and a line for each that explains the record as well; empty if none is proposed."""
    laws: Sequence[Mapping[str, Any]] = document.get("laws") or ()
    if not laws:
        return []
    first, *others = laws
    found = [
        f"{_stands(document, first)}: {first['sentence']}.",
        f"At {first['site']}, in {first.get('unit', '')}: {first['formula']}",
        *(f"{_constant(name, row)}." for name, row in first["parameters"].items()),
        _buys(document, first),
    ]
    if seen := first.get("seen"):
        units = dict(zip(first["coordinates"], first["coordinate_units"], strict=True))
        ranges = joined(f"{name} from {low:.3g} to {high:.3g} {_unit(units[name])}".rstrip() for name, (low, high) in seen.items())  # fmt: skip
        found.append(f"Seen for {ranges}; beyond that it is an extrapolation.")
    found += [f"The record cannot tell it from {law['formula']} ({law['sentence']})." for law in others]
    return [*found, f"{capital(first['separated_by'])}."] if first["separated_by"] else found


def add_command(document: Document) -> str:
    """The command that adds the first formula to the model, empty if it has no card."""
    card, model = document["laws"][0].get("card"), document.get("model_file") or document.get("model")
    return shlex.join(["misfit", "add", card, "--to", str(model)]) if card else ""


def _stands(document: Document, law: Mapping[str, Any]) -> str:
    """Whether a formula is beside effects of the library, in place of them, or where none is named."""
    if beside := law.get("beside"):
        return f"A formula explains what {joined(map(what, beside))} leave{'s' if len(beside) == 1 else ''}"
    if document.get("verdict") == "named" and (effects := document.get("effects")):
        return f"A formula explains more than {joined(map(what, effects))}, and takes {'its' if len(effects) == 1 else 'their'} place"
    return "A formula explains what no effect of the library does"


def _constant(name: str, row: Mapping[str, Any]) -> str:
    if row["ci90"][0] < row["ci90"][1]:
        return size(name, row)
    return f"{name} {quantity(row['value'], row['unit'])} (held)"


def _buys(document: Document, law: Mapping[str, Any]) -> str:
    held_out = document.get("held_out") or {}
    floor = held_out.get("noise_floor") or {}
    fell = joined(
        f"{signal} {law['held_out_before'][signal]:.3g} -> {after:.3g} {law.get('held_out_units', {}).get(signal, '')}".rstrip()
        for signal, after in law["held_out_after"].items()
    )
    times = over_floor(law["held_out_after"], floor)
    if times < REFUTED:  # so that the floor is none
        return f"It takes the error on held-out trials from {fell.replace(' -> ', ' to ')}."
    text = f"It takes the error on held-out trials to {digits(times)} times the noise ({fell})"
    if not document.get("effects"):
        return f"{text}."
    return f"{text}; what the library names, to {digits(over_floor(held_out['rmse_after'], floor))}."


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit
