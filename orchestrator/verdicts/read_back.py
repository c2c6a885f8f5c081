"""Results, read back from their JSON as the objects that reports are made of."""

from collections.abc import Sequence
from typing import Any

from orchestrator.compare.result import Comparison, SetErrors, TrialErrors
from orchestrator.verdicts.result import Adjusted, Estimate, NamedEffect, Tried


def comparison_of(document: dict[str, Any]) -> Comparison:
    """A comparison without its curves."""
    held_out = document["held_out"]
    return Comparison(
        model=document["model"],
        data=document["data"],
        signals=tuple(document["signals"]),
        units=document["units"],
        noise_floor=document["noise_floor"],
        trials=tuple(TrialErrors(t["file"], t["set"], t["rmse"], t["fit_percent"]) for t in document["trials"]),
        learning=_set_errors(document["learning"]),
        held_out=None if held_out is None else _set_errors(held_out),
        where=document["where"],
        findings=tuple(document["findings"]),
        notes=tuple(document["notes"]),
    )


def effects_of(document: dict[str, Any]) -> list[NamedEffect]:
    """The effects of a step, or of a whole diagnosis."""
    return [_effect(each) for each in document["effects"]]


def _effect(document: dict[str, Any]) -> NamedEffect:
    parameters = {name: _estimate(found) for name, found in document["parameters"].items()}
    return NamedEffect(document["id"], document["site"], parameters, document.get("variant", ""))


def tried_of(diagnosis: dict[str, Any]) -> list[Tried]:
    """What became of each set that was tried."""
    return [Tried(tuple(each["effects"]), tuple(each["sites"]), each["outcome"]) for each in diagnosis["tried"]]


def adjusted_of(entries: Sequence[dict[str, Any]]) -> list[Adjusted]:
    """The model's own parameters that were fitted within their tolerances."""
    return [Adjusted(each["name"], each["nominal"], _estimate(each["fitted"])) for each in entries]


def _set_errors(document: dict[str, Any]) -> SetErrors:
    return SetErrors(document["rmse"], document["over_floor"])


def _estimate(document: dict[str, Any]) -> Estimate:
    low, high = document["ci90"]
    return Estimate(document["value"], document["unit"], (low, high))
