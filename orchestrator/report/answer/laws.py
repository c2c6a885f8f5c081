"""Proposed laws in words: formula, constants, what held-out trials say, and what else explains the record."""

from collections.abc import Mapping, Sequence
from typing import Any


def laws_sentences(laws: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sentences for the first law, a line for each that explains the record as well."""
    if not laws:
        return []
    first, *others = laws
    constants = ", ".join(f"{name} = {_with_unit(row)}" for name, row in first["parameters"].items())
    units = first.get("held_out_units", {})  # results of earlier versions have none
    errors = ", ".join(
        f"{signal} {first['held_out_before'][signal]:.3g} -> {after:.3g} {units.get(signal, '')}".rstrip()
        for signal, after in first["held_out_after"].items()
    )
    found = [
        f"{first['sentence'].capitalize()}, at {first['site']}: {first['formula']} with {constants}.",
        f"Error of held-out trials, before and with it: {errors}.",
        *(f"The record cannot tell it from {law['formula']} ({law['sentence']})." for law in others),
    ]
    return [*found, f"{first['separated_by'].capitalize()}."] if first["separated_by"] else found


def _with_unit(row: Mapping[str, Any]) -> str:
    return f"{row['value']:.4g} {row['unit'] if row['unit'] != '1' else ''}".strip()
