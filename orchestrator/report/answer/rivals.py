"""What else it could be: the named set first, then what came closest, each with a reason in words."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from orchestrator.report.answer.words import capital, joined, name_of, place_of, share, what
from orchestrator.report.numbers import digits, spaced

Document = Mapping[str, Any]
MOST = 4
# Odds above this are beyond doubt for whoever reads them.
CLEAR = 1000.0
# A rival whose share of what is missing is this much less than the named set's explains less; closer ones are told by odds.
LESS = 0.02
# Outcomes of the method that speak of learning trials without saying so, or in its own words.
PLAIN = {
    "the error of the model as given is not told from noise": "learning trials are within the noise without it",
    "explains less than the best set for its size": "explains less for its number of parameters",
    "not refitted": "shows too little in the missing force to be fitted",
    "makes the record less probable than the chosen set does": "makes the record less probable",
}
# A larger set that the checks of its effects rule out: odds would speak of its fit alone.
CLOSER = re.compile(r"fits closer by .* more parameters?, but")


@dataclass(frozen=True)
class Rival:
    """A row: what, the odds in words ("" for the named set), and why it is or is not the answer."""

    name: str
    odds: str
    reason: str
    named: bool


def rivals_of(document: Document) -> tuple[Rival, ...]:
    """The named set (if any) and the best others, best first; nothing where nothing is missing."""
    if document.get("verdict") == "adequate":
        return ()
    ranking = [entry for entry in document.get("ranking") or () if entry.get("effects")]
    named = [(effect["id"], effect["site"]) for effect in document.get("effects") or ()]
    own = next((entry for entry in ranking if _pairs(entry) == sorted(named)), None)
    rows = []
    if named:
        rows.append(Rival(capital(joined(map(what, document["effects"]))), "", _why_named(document), True))
    others = [entry for entry in ranking if _pairs(entry) != sorted(named) and not _contains(_pairs(entry), named)]
    for entry in _one_of_each(others)[: MOST - len(rows)]:
        rows.append(_rival(document, entry, own))
    return tuple(rows)


def not_tried(document: Document) -> str:
    """How much more was looked at, in one sentence."""
    ranking = [entry for entry in document.get("ranking") or () if entry.get("effects")]
    left = len(ranking) - MOST
    return f"{left} more sets were tried and rejected." if left > 0 and document.get("effects") else ""


def _rival(document: Document, entry: Mapping[str, Any], own: Mapping[str, Any] | None) -> Rival:
    name = capital(_name(_without_place(_pairs(entry), own)))
    score = float(entry.get("score", 0.0))
    odds = _odds(document, entry, own)
    if own is None:
        # Nothing is named that it could be behind of: what it does to the error says most.
        said = f"explains {share(score)} of what is missing"
        return Rival(name, "", said if score > 0 else _outcome(document, entry) or said, False)
    if float(own.get("score", 0.0)) - score > LESS:
        return Rival(name, odds, f"explains less: {share(score)} of what is missing", False)
    outcome = _outcome(document, entry) or "fits about as well here"
    return Rival(name, "" if outcome.startswith("fits closer") else odds, outcome, False)


def _why_named(document: Document) -> str:
    if document.get("verdict") == "ambiguous":
        return "fits, as others do"
    if (document.get("held_out") or {}).get("rmse_after"):
        return "confirmed on held-out trials"
    return "fits best; no trial was held out"


def _odds(document: Document, entry: Mapping[str, Any], own: Mapping[str, Any] | None) -> str:
    """Odds against a rival: as stated for the effect in the named one's place, else by probability."""
    effects = set(entry["effects"])
    stated = [float(each["odds"]) for each in document.get("odds") or () if each.get("rival") in effects]
    if stated:
        return odds_words(min(stated))
    if own is None:
        return ""
    mine, other = float(own.get("probability", 0.0)), float(entry.get("probability", 0.0))
    return odds_words(mine / other if other > 0 else float("inf")) if mine > 0 else ""


def odds_words(odds: float) -> str:
    """Odds against something.

    >>> odds_words(2.77), odds_words(1e6), odds_words(0.5)
    ('2.77 : 1', 'over 1000 : 1', 'even')
    """
    if odds > CLEAR:
        return "over 1000 : 1"
    return f"{digits(odds)} : 1" if odds > 1.1 else "even"


def _outcome(document: Document, entry: Mapping[str, Any]) -> str:
    for each in document.get("tried") or ():
        if _pairs(each) == _pairs(entry):
            return plain_reason(str(each.get("outcome", "")))
    return ""


def plain_reason(outcome: str) -> str:
    """The last part of an outcome, without the figures of the method; the JSON has them.

    >>> plain_reason("weighted error 1.87e+03 (noise alone: 1): explains less than the best set for its size (BIC/2 behind by 1.8)")
    'explains less for its number of parameters'
    """
    reason = re.sub(r"\s*\([^()]*\)|, by \S+ nats", "", outcome.rpartition(": ")[2]).strip()
    if CLOSER.match(reason):
        return "fits closer, but not every effect in it is needed"
    return PLAIN.get(reason, spaced(reason))


def _pairs(entry: Mapping[str, Any]) -> list[tuple[str, str]]:
    effects, sites = list(entry["effects"]), list(entry.get("sites") or ())
    return sorted(zip(effects, sites if len(sites) == len(effects) else [""] * len(effects), strict=True))


def _contains(pairs: Sequence[tuple[str, str]], named: Sequence[tuple[str, str]]) -> bool:
    """Whether a set is the named one with more in it: that is no other answer."""
    return bool(named) and set(named) < set(pairs)


def _one_of_each(entries: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """The best entry of each set of effects, wherever it acts."""
    seen: set[tuple[str, ...]] = set()
    kept = []
    for entry in entries:
        key = tuple(sorted(set(entry["effects"])))
        if key not in seen:
            seen.add(key)
            kept.append(entry)
    return kept


def _without_place(pairs: Sequence[tuple[str, str]], own: Mapping[str, Any] | None) -> Sequence[tuple[str, str]]:
    """A rival in the very place of the named set needs no place of its own."""
    same = own is not None and {site for _, site in pairs} == {site for _, site in _pairs(own)}
    return [(effect, "") for effect, _ in pairs] if same else pairs


def _name(pairs: Sequence[tuple[str, str]]) -> str:
    return joined(f"{name_of(effect)} {place_of(site)}".strip() for effect, site in pairs)
