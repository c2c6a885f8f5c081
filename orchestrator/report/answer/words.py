"""Effects, places and sizes in plain words."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from orchestrator.report.numbers import digits, engineering_exponent, prefixed, spaced, takes_prefix

Effect = Mapping[str, Any]
# Sizes that are named; the others stand behind "Why do you think so?".
MOST_SIZES = 4
PARAMETER_ERROR = "parameter_error"
# Ids that name a joint; the sensor may be one of anything.
WORDS = {"joint_scale": "scale error", "joint_offset": "zero error"}
_PEOPLE = re.compile(r"\b(?:coulomb|stribeck)\b")


def name_of(effect: str) -> str:
    """The words of an effect's id.

    >>> name_of("coulomb_friction"), name_of("coulomb_friction+payload"), name_of("joint_scale")
    ('Coulomb friction', 'Coulomb friction and payload', 'scale error')
    """
    words = joined(WORDS.get(part, part.replace("_", " ").strip()) for part in effect.split("+"))
    return _PEOPLE.sub(lambda found: found[0].capitalize(), words)


def place_of(site: str) -> str:
    """Where an effect acts.

    >>> place_of("joint1+joint2"), place_of("muscle1+muscle2+muscle3"), place_of("channel3->muscle4"), place_of("")
    ('at joint1 and joint2', 'at muscle1 to muscle3', 'from channel3 to muscle4', '')
    """
    if not site:
        return ""
    if "->" in site:
        source, _, target = site.partition("->")
        return f"from {source} to {target}"
    if site.startswith("sensor:"):
        return f"in the sensor {site.removeprefix('sensor:')}"
    parts = site.split("+")
    stem = parts[0].rstrip("0123456789")
    if len(parts) > 2 and parts == [f"{stem}{k}" for k in range(1, len(parts) + 1)]:
        return f"at {parts[0]} to {parts[-1]}"
    return f"at {joined(parts)}"


def what(effect: Effect) -> str:
    """An effect with its place, such as `Coulomb friction at joint1`."""
    if effect["id"] == PARAMETER_ERROR:
        return f"the value of {effect['site']}"
    return " ".join(filter(None, (name_of(effect["id"]), effect.get("variant", ""), place_of(effect["site"]))))


def sizes(effects: Sequence[Effect]) -> str:
    """The fitted parameters with their 90 % intervals, such as `tauC[1] 37.3 mN·m (37.0 to 37.7)`."""
    found = [
        size(f"{name.split('[')[0]} of {effect['site']}" if effect["id"] == PARAMETER_ERROR else name, value)
        for effect in effects
        for name, value in _fitted(effect.get("parameters") or {}).items()
    ]
    left = len(found) - MOST_SIZES
    return ", ".join(found[:MOST_SIZES]) + (f" and {left} more" if left > 0 else "")


def _fitted(parameters: Mapping[str, Any]) -> Mapping[str, Any]:
    """Those that the record says something of: not held at a value, as the width of a smoothed sign may be, nor known to no more
    than their own size; all if there are none."""
    widths = {name: value["ci90"][1] - value["ci90"][0] for name, value in parameters.items()}
    told = {name: value for name, value in parameters.items() if 0 < widths[name] <= 2 * abs(value["value"])}
    return told or {name: value for name, value in parameters.items() if widths[name] > 0} or parameters


def size(name: str, estimate: Mapping[str, Any]) -> str:
    """One parameter: value, unit and 90 % interval, all with the same prefix and to the digits that the interval allows.

    >>> size("tauC[1]", {"value": 0.03731, "unit": "N.m", "ci90": [0.0370, 0.0377]})
    'tauC[1] 37.3 mN·m (37.0 to 37.7)'
    >>> size("gain", {"value": 0.81, "unit": "1", "ci90": [0.80, 0.82]})
    'gain 0.810 (0.800 to 0.820)'
    """
    value, unit, (low, high) = float(estimate["value"]), str(estimate["unit"]), estimate["ci90"]
    exponent = engineering_exponent(value) if takes_prefix(unit) else 0
    scale = 10.0**-exponent
    width = abs(float(high) - float(low)) * scale / 2
    texts = [_to(x * scale, width) for x in (value, float(low), float(high))]
    return f"{name} {texts[0]} {unit_text(prefixed(unit, exponent))}".rstrip() + f" ({texts[1]} to {texts[2]})"


def _to(value: float, half_width: float) -> str:
    if not math.isfinite(half_width) or half_width <= 0 or not math.isfinite(value) or not 1e-4 <= abs(value) < 1e5:
        return digits(value)
    decimals = max(0, math.ceil(math.log10(3.0 / half_width)))
    return f"{value:.{decimals}f}" if decimals <= 6 else digits(value)


def unit_text(unit: str) -> str:
    """A unit as people read it; dimensionless is nothing.

    >>> unit_text("N.m.s/rad"), unit_text("1"), unit_text("kg.m2"), unit_text("rad/s2")
    ('N·m·s/rad', '', 'kg·m²', 'rad/s²')
    """
    raised = re.sub(r"(?<=[A-Za-z])[23]", lambda found: {"2": "²", "3": "³"}[found[0]], unit)
    return "" if unit == "1" else raised.replace(".", "·")


def share(value: float) -> str:
    """A share in whole per cent; never 100 % of what is not all, nor 0 % of what is something.

    >>> share(0.981), share(0.9996), share(0.0004), share(1.0), share(-0.2)
    ('98 %', 'more than 99 %', 'less than 1 %', '100 %', 'none')
    """
    if not math.isfinite(value):
        return "an unknown share"
    if value <= 0:
        return "none"
    if 0.995 < value < 1.0:
        return "more than 99 %"
    return "less than 1 %" if value < 0.005 else f"{100 * min(value, 1.0):.0f} %"


def joined(names: Iterable[str], last: str = "and") -> str:
    """Names in a row, such as `a, b and c`."""
    *first, final = list(names) or [""]
    return f"{', '.join(first)} {last} {final}" if first else final


def capital(text: str) -> str:
    """A sentence begins with a capital letter; the rest stays as it is."""
    return text[:1].upper() + text[1:]


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
