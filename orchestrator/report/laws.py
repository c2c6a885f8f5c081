"""Proposed laws on a page: formula, constants, what held-out trials say, and the law over the missing force."""

from collections.abc import Mapping
from typing import Any

from orchestrator.report import figures
from orchestrator.report.page import Picture


def laws_sentences(document: Mapping[str, Any]) -> tuple[str, ...]:
    """What is proposed, a sentence for each; none where nothing is."""
    found = []
    for law in document.get("laws", ()):
        constants = ", ".join(
            f"{name} = {row['value']:.4g} {row['unit'] if row['unit'] != '1' else ''}".strip()
            for name, row in law["parameters"].items()
        )
        errors = ", ".join(
            f"{signal} {law['held_out_before'][signal]:.3g} -> {after:.3g}"
            for signal, after in law["held_out_after"].items()
        )
        first = f"{law['sentence'].capitalize()}, at {law['site']}: {law['formula']} with {constants}"
        found.append(f"{first}. Error of held-out trials, before and with it: {errors}.")
        if law["alike"]:
            found.append(f"The data cannot tell it from: {'; '.join(law['alike'])}. {law['separated_by']}")
    return tuple(found)


def laws_pictures(document: Mapping[str, Any]) -> tuple[Picture, ...]:
    """Each law over the missing force."""
    return tuple(
        Picture(figures.law_curve(law), f"{law['sentence']}: the missing force with its 90 % band, and the law.")
        for law in document.get("laws", ())
        if law["curve"]
    )
