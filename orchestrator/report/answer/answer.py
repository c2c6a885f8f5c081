"""What a diagnosis answers, from its JSON document: the sentence, what it buys, what is next, what else it could be."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any

from orchestrator.compare.estimates import REFUTED, WITHIN_NOISE
from orchestrator.report.answer.formulas import add_command
from orchestrator.report.answer.rivals import Rival, not_tried, rivals_of
from orchestrator.report.answer.words import (
    PARAMETER_ERROR,
    capital,
    joined,
    name_of,
    note_sentences,
    share,
    sizes,
    what,
)
from orchestrator.report.numbers import digits, over_floor

Document = Mapping[str, Any]
# Letters that the label of a bar has room for.
MOST_LABEL = 28


@dataclass(frozen=True)
class Bar:
    """One bar of "what it buys": the error in multiples of the noise; `kind` is given, better or floor."""

    label: str
    value: float
    kind: str


@dataclass(frozen=True)
class Answer:
    """The first screen of a result.

    `headline` is the one sentence that names effect and place, `detail` size and what it buys, `caution` what is still open
    ("" if nothing), `next_step` what to do, `can_add` whether something can be put into the model. `bars` and `rivals` are
    the two lists of the screen.
    """

    verdict: str
    headline: str
    detail: str
    caution: str
    next_step: str
    can_add: bool
    bars: tuple[Bar, ...]
    rivals: tuple[Rival, ...]
    not_tried: str

    @property
    def text(self) -> str:
        """The same for a terminal."""
        return " ".join(part for part in (self.headline, self.detail, self.caution) if part)

    def added(self, name: str, before: float, now: float, then: str | None) -> "Answer":
        """The same once effects are in the model, whose version is called `name`; `then` is what is still to be added."""
        fell = (
            f"{name} has it: the error on held-out trials fell from {digits(before)} to {digits(now)} times the noise."
        )
        step = f"Add {then}." if then else "Take the model away: Modelica, FMU and report are under Take away."
        size = re.split(" (?:Adding|Correcting) ", self.detail)[0]
        return replace(self, detail=f"{size} {fell}".strip(), next_step=step)


def answer_of(document: Document) -> Answer:
    """Read the answer from a `misfit.diagnosis/1` document; keys that it lacks are left out of what is said."""
    effects, best = list(document.get("effects") or ()), list(document.get("best") or ())
    shown = effects or best
    before, after = before_after(document)
    return Answer(
        verdict=str(document.get("verdict", "")),
        headline=_headline(document, effects),
        detail=_detail(document, effects, before, after),
        caution=_caution(document, effects, before, after),
        next_step=_next_step(document, effects, best),
        can_add=bool(effects),
        bars=_bars(shown, before, after, bool(effects)),
        rivals=rivals_of(document),
        not_tried=not_tried(document),
    )


def before_after(document: Document) -> tuple[float, float]:
    """Errors of the held-out trials as multiples of the noise, as given and with the effects; NaN where there is none."""
    held_out = document.get("held_out") or {}
    floor = held_out.get("noise_floor") or {}
    return tuple(over_floor(held_out.get(key) or {}, floor) for key in ("rmse_before", "rmse_after"))  # type: ignore[return-value]


def _headline(document: Document, effects: Sequence[Mapping[str, Any]]) -> str:
    match document.get("verdict"):
        case "adequate":
            if _fitted_within_tolerances(document):
                return "Nothing is missing: parameters within their tolerances explain the error."
            return "Nothing is missing that these data can show."
        case "named":
            return _missing(effects) + (", but not all that is missing." if document.get("incomplete") else ".")
        case "ambiguous":
            return _ambiguous(document, effects)
        case "unknown":
            return "Something is missing that no effect in the library explains."
        case _:
            if wrong := _wrong_record(document):
                return f"The record is wrong, so that no physics is named; first {wrong[0]}."
            return "These data cannot tell whether anything is missing."


def _wrong_record(document: Document) -> list[str]:
    """What would mend a record that is wrong, the surest first."""
    return [check["proposal"] for check in document.get("data_checks") or () if check["strong"]]


def _missing(effects: Sequence[Mapping[str, Any]]) -> str:
    lacking = [what(effect) for effect in effects if effect["id"] != PARAMETER_ERROR]
    wrong = [str(effect["site"]) for effect in effects if effect["id"] == PARAMETER_ERROR]
    parts = []
    if lacking:
        parts.append(f"{joined(lacking)} {'is' if len(lacking) == 1 else 'are'} missing")
    if wrong:
        verb = "value of {} is wrong" if len(wrong) == 1 else "values of {} are wrong"
        parts.append(f"the model's {verb.format(joined(wrong))}")
    return capital(" and ".join(parts)) or "An effect is missing"


def _ambiguous(document: Document, effects: Sequence[Mapping[str, Any]]) -> str:
    """What all sets that fit share, and in what they differ."""
    sets: list[Sequence[Mapping[str, Any]]] = [effects]
    groups = [set(group) for group in document.get("confusable") or ()]
    for entry in document.get("ranking") or ():
        other = [{"id": id, "site": site} for id, site in _pairs(entry)]
        different = {id for id, _ in {*map(_pair, effects)} ^ {*map(_pair, other)}}
        if different in groups:
            groups.remove(different)
            sets.append(other)
    shared = [e for e in effects if all(_pair(e) in map(_pair, each) for each in sets)]
    choices = [[e for e in each if _pair(e) not in map(_pair, shared)] for each in sets]
    if groups or len(sets) < 2 or not shared or not all(choices):
        return f"Something is missing, and these data cannot tell which: {_choice(document, effects)}."
    told = joined([joined(map(what, each), "and") for each in choices], "or")
    return f"{_missing(shared)}, and beside that one of these, which the data cannot tell apart: {told}."


def _pair(effect: Mapping[str, Any]) -> tuple[str, str]:
    return effect["id"], effect["site"]


def _pairs(entry: Mapping[str, Any]) -> list[tuple[str, str]]:
    return list(zip(entry["effects"], entry.get("sites") or (), strict=False))


def _choice(document: Document, effects: Sequence[Mapping[str, Any]]) -> str:
    places = {each["id"]: what(each) for each in effects}
    for entry in document.get("ranking") or ():
        for id, site in _pairs(entry):
            places.setdefault(id, what({"id": id, "site": site}))
    groups = [
        joined((places.get(each) or name_of(each) for each in group), "or")
        for group in document.get("confusable") or ()
    ]
    return "; ".join(groups) or joined((what(effect) for effect in effects), "or") or "several effects fit"


def _fitted_within_tolerances(document: Document) -> list[Mapping[str, Any]]:
    """Parameters of the last model of an answer that needs no effect, with what they were and are."""
    steps = list(document.get("steps") or ())
    return [] if len(steps) < 2 or steps[-1]["effects"] else list(steps[-1].get("adjusted") or ())


def _detail(document: Document, effects: Sequence[Mapping[str, Any]], before: float, after: float) -> str:
    if fitted := _fitted_within_tolerances(document):
        shares = {each["name"]: each["fitted"]["value"] / each["nominal"] - 1.0 for each in fitted}
        far = max(shares, key=lambda name: abs(shares[name]))
        return (
            f"Most of all {far}, {100 * shares[far]:+.2f} %. With the fitted values the error on held-out trials falls from"
            f" {digits(before)} to {digits(after)} times the noise."
        )
    if not effects:
        return _present(before)
    found = sizes(effects)
    return " ".join(
        part for part in (f"Size: {found}." if found else "", _buys(document, effects, before, after)) if part
    )


def _present(before: float) -> str:
    if math.isnan(before):
        return ""
    if before <= WITHIN_NOISE:
        return f"On held-out trials the model is off by {digits(before)} times the noise, which is the noise itself."
    return f"On held-out trials the model is off by {digits(before)} times the noise."


def _buys(document: Document, effects: Sequence[Mapping[str, Any]], before: float, after: float) -> str:
    """What adding the effects does to the error that nobody had looked at."""
    if math.isnan(before) or math.isnan(after):
        return "No trial was held out, so what it buys is not proven."
    only_values = all(effect["id"] == PARAMETER_ERROR for effect in effects)
    change = f"{'Correcting' if only_values else 'Adding'} {_them(document, effects)}"
    fall = f"{change} takes the error on held-out trials from {digits(before)} to {digits(after)} times the noise"
    removed = (document.get("held_out") or {}).get("reducible_removed")
    if after >= before:
        return f"{change} does not lower the error on held-out trials ({digits(before)} to {digits(after)} times the noise)."
    if before <= 1.0 or removed is None or not math.isfinite(removed):
        return f"{fall}."
    return f"{fall}: {share(removed)} of the avoidable error."


def _them(document: Document, effects: Sequence[Mapping[str, Any]]) -> str:
    """What stands for the effects in a sentence."""
    if document.get("verdict") == "ambiguous":
        return "the first"
    return "it" if len(effects) < 2 else "them"


def _caution(document: Document, effects: Sequence[Mapping[str, Any]], before: float, after: float) -> str:
    left = share(float(document.get("unexplained_share") or 0.0)) if document.get("incomplete") else ""
    if effects and after > WITHIN_NOISE:
        force = f" and {left} of the missing force" if left else ""
        return f"What is left, {digits(after)} times the noise{force}, is not explained by {_them(document, effects)}."
    if effects and left:
        if after <= WITHIN_NOISE:
            return f"Free runs are within the noise; {left} of the force that still disturbs the model in between is not explained."
        return f"{capital(left)} of the missing force is still not explained."
    if effects and after < REFUTED:
        return "The noise floor is too high here: it takes fast changes of an input for noise of its sensor."
    if document.get("verdict") == "unknown" and (best := document.get("best")):
        return f"Closest in the library: {joined(what(effect) for effect in best)}; it is not proven."
    if document.get("verdict") == "cannot_tell" and (open_notes := _open_notes(document)):
        return open_notes[0]
    return ""


def _open_notes(document: Document) -> list[str]:
    """What the record does not show, without what was not tried."""
    return [note for note in note_sentences(document.get("warnings") or ()) if "not tried" not in note.lower()]


def _next_step(document: Document, effects: Sequence[Mapping[str, Any]], best: Sequence[Mapping[str, Any]]) -> str:
    experiment = document.get("next_experiment") or {}
    do = str(experiment.get("do", experiment.get("experiment", "")))
    if document.get("laws"):
        command = add_command(document)
        return (
            f"Add the formula below: {command}." if command else "Look at the formula below, and add it to the model."
        )
    match document.get("verdict"):
        case "named" if written := document.get("patched_model"):
            return f"Use {PurePath(written).name}, the model with {_them(document, effects)}."
        case "named":
            return f"Add {_them(document, effects)} to the model."
        case "adequate" if _fitted_within_tolerances(document):
            written = document.get("patched_model")
            name = PurePath(written).name if written else "the model"
            return f"Nothing has to be added; use {name} with the fitted values."
        case "adequate":
            return "Nothing has to be added; use the model as it is."
        case "ambiguous" if do:
            return _record(do)
        case "ambiguous":
            return "Record trials that move the model differently, and diagnose again."
        case "unknown":
            return "Learn the missing force along these trials: misfit learn."
        case _ if wrong := _wrong_record(document):
            return f"Mend the record ({wrong[0]}), and diagnose again."
        case _ if do:
            return _record(do)
        case _:
            return "Record trials with more motion or less noise, and diagnose again."


def _record(do: str) -> str:
    """The proposed experiment; that there is none is said as it is."""
    return f"{capital(do)}." if do.startswith("no ") else f"Record this: {do}."


def _bars(shown: Sequence[Mapping[str, Any]], before: float, after: float, proven: bool) -> tuple[Bar, ...]:
    if not math.isfinite(before):
        return ()
    bars = [Bar("as given", before, "given")]
    if shown and math.isfinite(after):
        names = joined(name_of(effect["id"]) for effect in shown)
        if len(names) > MOST_LABEL:
            names = {2: "both effects"}.get(len(shown), f"all {len(shown)} effects" if len(shown) > 1 else names)
        bars.append(Bar(f"+ {names}{'' if proven else ' (not proven)'}", after, "better"))
    return (*bars, Bar("noise floor", 1.0, "floor"))
