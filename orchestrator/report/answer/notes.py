"""What the data leave open, as sentences a person acts on."""

import re
from collections.abc import Sequence

from orchestrator.report.answer.words import name_of
from orchestrator.report.numbers import spaced

# A row of names in a note is counted instead; the names stand in the JSON result.
_NAMES = re.compile(r": ((?:[a-z][a-z0-9]*(?:_[a-z0-9]+)*, ){4,}[a-z][a-z0-9_]*)\.?$")
_CLOSED = re.compile(r"(\w+(?:, \w+)*) (?:is|are) not tried: the FMU would have to expose")
# What an effect's place lacks in the record: one sentence for all places that lack the same.
_NEEDS = re.compile(r"(?P<effect>\w+) at (?P<site>\S+) needs (?P<need>.+; these data have .+)$")
# The table of rivals has the odds.
_ODDS = re.compile(r"\w+ or \w+: odds \S+ to 1$")
_NO_SLOT = "not tried, the model has no free slot for them"


def note_sentences(notes: Sequence[str]) -> list[str]:
    """Notes with a capital letter and a full stop, and counts in place of long rows of names.

    >>> note_sentences(["not tried, the model has no free slot for them: backlash, fatigue, leak, payload, tremor"])
    ['5 effects of the library were not tried, because this model has no place for them.']
    >>> note_sentences(["not tried, the model has no free slot for them: joint_elasticity"])
    ['Not tried, because this model has no place for them: joint elasticity.']
    >>> need = "needs command above 0.1 for at least 50 samples; these data have 0"
    >>> note_sentences([f"stimulation_crosstalk at channel1->muscle{k} {need}" for k in (2, 3)])
    ['Stimulation crosstalk at 2 places, such as channel1->muscle2, needs command above 0.1 for at least 50 samples; these data have 0.']
    >>> note_sentences(["it is open"])
    ['It is open.']
    """
    closed = [found for note in notes if (found := _CLOSED.match(note))]
    others = [note for note in notes if not _CLOSED.match(note) and not _ODDS.match(note)]
    kept = [_sentence(note) for note in _by_need(others)]
    if len(closed) < 2:
        return kept if not closed else [*kept, _sentence(closed[0].string)]
    count = sum(found[1].count(",") + 1 for found in closed)
    return [*kept, f"{count} effects were not tried, because this FMU does not expose what they act on."]


def _by_need(notes: Sequence[str]) -> list[str]:
    """Notes in their order; what an effect needs stands once, at the first of its places."""
    places: dict[tuple[str, str], list[str]] = {}
    found = [(note, _NEEDS.match(note)) for note in notes]
    for _, match in found:
        if match:
            places.setdefault((match["effect"], match["need"]), []).append(match["site"])
    kept = []
    for note, match in found:
        sites = places.pop((match["effect"], match["need"]), []) if match else []
        if match is None:
            kept.append(note)
        elif sites:
            where = f"at {sites[0]}" if len(sites) == 1 else f"at {len(sites)} places, such as {sites[0]},"
            kept.append(f"{name_of(match['effect'])} {where} needs {match['need']}")
    return kept


def _sentence(note: str) -> str:
    text = spaced(note.rstrip(". "))
    found = _NAMES.search(text)
    if found:
        count = found[1].count(",") + 1
        if text.startswith(_NO_SLOT):
            return f"{count} effects of the library were not tried, because this model has no place for them."
        text = f"{text[: found.start()]}: {count} effects"
    elif text.startswith(_NO_SLOT):
        names = text.removeprefix(_NO_SLOT).replace("_", " ")
        return f"Not tried, because this model has no place for them{names}."
    # A name such as tauC[1] stays as it is.
    plain = re.match(r"[a-z]+\b(?![\[_.])", text)
    return f"{text[:1].upper()}{text[1:]}." if plain else f"{text}."
