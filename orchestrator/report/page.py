"""What a report page consists of, ready to be printed: texts, tables of texts, and images."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from orchestrator.compare.result import Comparison
from orchestrator.ledger import LedgerEntry
from orchestrator.report.answer.rivals import plain_reason
from orchestrator.report.answer.words import share, what
from orchestrator.report.numbers import digits, estimate_parts, percent, quantity
from orchestrator.report.sentences import effect_name, errors, most_of, ranked_name
from orchestrator.report.summary import Fact
from orchestrator.verdicts.open_questions import CollinearPair, Coverage
from orchestrator.verdicts.result import HeldOut, NamedEffect, RankedSet, Tried

MAX_TRIALS = 40
MAX_TRIED = 15


@dataclass(frozen=True)
class PageTable:
    """A table of texts; the first column holds the row headings."""

    caption: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Picture:
    """An `<img>` element and the line below it."""

    image: str
    caption: str


@dataclass(frozen=True)
class Section:
    """A part of a report under its own heading: texts, pairs of words, tables, then pictures. `warns` marks its texts."""

    heading: str
    texts: tuple[str, ...] = ()
    pairs: tuple[tuple[str, str], ...] = ()
    tables: tuple[PageTable, ...] = ()
    pictures: tuple[Picture, ...] = ()
    warns: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing under the heading."""
        return not (self.texts or self.pairs or self.tables or self.pictures)


@dataclass(frozen=True)
class Page:
    """A report, in reading order; empty sections are left out.

    The first page is for everyone: `verdict`, `plain` words, `facts`, the `falling_error` (of one
    model alone: its error by trial). `replay` is a motion, whose script
    is the only one that a page has. `sections` are for whoever wants to know why. `answer` is the markup of the first screen of
    a diagnosis, made by this program, in place of verdict, words and facts; the rest of the page is folded behind it then.
    """

    title: str
    verdict: str
    falling_error: Picture | None
    sections: tuple[Section, ...]
    plain: str = ""
    facts: tuple[Fact, ...] = ()
    replay: Picture | None = None
    answer: str = ""


def effects_table(effects: Sequence[NamedEffect]) -> tuple[PageTable, ...]:
    """Return the parameters of effects, one a row; nothing for no effects."""
    rows = []
    for effect in effects:
        for name, found in effect.parameters.items():
            value, interval = estimate_parts(found)
            rows.append((effect_name(effect), name, value, found.unit, interval))
        if not effect.parameters:
            rows.append((effect_name(effect), "none", "", "", ""))
    headings = ("effect", "parameter", "value", "unit", "90 % interval")
    return (PageTable("Effects that are missing from the model as given", headings, tuple(rows)),) if rows else ()


def set_errors_table(comparison: Comparison, caption: str = "Error (rms) of each set") -> PageTable:
    """Return the errors of the learning and the held-out set, one signal a row."""
    sets = [("learning", comparison.learning)]
    if comparison.held_out is not None:
        sets.append(("held out", comparison.held_out))
    rows = []
    for name, found in sets:
        for signal in comparison.signals:
            numbers = _against_floor(found.rmse[signal], comparison.noise_floor[signal], comparison.units[signal])
            rows.append((name, signal, *numbers))
    return PageTable(caption, ("set", "signal", "error", "noise floor", "times the floor"), tuple(rows))


def trial_errors_table(comparison: Comparison) -> PageTable:
    """Return the errors of each trial, one signal a row, numbered as in the figures."""
    rows = []
    for number, trial in enumerate(comparison.trials[:MAX_TRIALS], start=1):
        for signal in comparison.signals:
            numbers = _against_floor(trial.rmse[signal], comparison.noise_floor[signal], comparison.units[signal])
            group, fit = trial.set.replace("_", " "), percent(trial.fit_percent[signal] / 100)
            rows.append((str(number), trial.file, group, signal, *numbers, fit))
    left = len(comparison.trials) - MAX_TRIALS
    caption = "Error (rms) of each trial" + (f"; {left} more trials are in the JSON result" if left > 0 else "")
    headings = ("trial", "file", "set", "signal", "error", "noise floor", "times the floor", "fit")
    return PageTable(caption, headings, tuple(rows))


def held_out_table(held_out: HeldOut, units: Mapping[str, str]) -> tuple[PageTable, ...]:
    """Return the held-out errors before and after, one signal a row; nothing without held-out trials."""
    rows = []
    for signal, before in held_out.rmse_before.items():
        floor, unit = held_out.noise_floor[signal], units.get(signal, "")
        after = held_out.rmse_after.get(signal, before)
        was, now = _against_floor(before, floor, unit), _against_floor(after, floor, unit)
        rows.append((signal, was[0], now[0], was[1], was[2], now[2]))
    headings = ("signal", "before", "after", "noise floor", "before / floor", "after / floor")
    removed = f"{share(held_out.reducible_removed)} of the avoidable error is gone"
    return (PageTable(f"Held-out error (rms): {removed}", headings, tuple(rows)),) if rows else ()


def versions_table(entries: Sequence[LedgerEntry]) -> PageTable:
    """Return the ledger, one version a row."""
    rows = []
    for entry in entries:
        held_out = "none" if entry.held_out is None else errors(entry.held_out.rmse, entry.units)
        decisive = entry.learning if entry.held_out is None else entry.held_out
        listed, others = most_of(entry.effects)
        effects = ", ".join(filter(None, [*map(effect_name, listed), others])) or "as given"
        learning = errors(entry.learning.rmse, entry.units)
        rows.append((str(entry.version), entry.name, effects, learning, held_out, digits(decisive.over_floor)))
    headings = ("version", "name", "effects in it", "learning error", "held-out error", "times the floor")
    return PageTable("Versions of the model", headings, tuple(rows))


def tried_table(tried: Sequence[Tried]) -> tuple[PageTable, ...]:
    """Return what was tried and what became of it, one set a row; nothing if nothing was tried."""
    rows = tuple(
        (ranked_name(RankedSet(t.effects, t.sites, 0.0, 0.0)), plain_reason(t.outcome)) for t in tried[:MAX_TRIED]
    )
    left = len(tried) - MAX_TRIED
    caption = "What was tried, best first" + (f"; {left} more are in the JSON result" if left > 0 else "")
    return (PageTable(caption, ("added to the model", "what became of it"), rows),) if rows else ()


def collinear_table(entries: Sequence[CollinearPair]) -> tuple[PageTable, ...]:
    """Return which effects act like the named ones in these data, the most alike first; nothing if none does."""
    rows = tuple(
        (*(what({"id": each.card.id, "site": each.site}) for each in (k.effect, k.other)), digits(k.cosine))
        for k in entries[:MAX_TRIED]
    )
    headings = ("named", "acts alike", "cosine between them")
    return (PageTable("Effects that act like the named ones here, to first order", headings, rows),) if rows else ()


def excitation_table(entries: Sequence[Coverage]) -> tuple[PageTable, ...]:
    """Return what effects need in order to show and how much of it the data have, what is lacking first."""
    ordered = sorted(entries, key=lambda entry: entry.is_enough)
    rows = tuple(
        (what({"id": e.effect, "site": e.site}), e.words, digits(e.found), "enough" if e.is_enough else "too little")
        for e in ordered[:MAX_TRIED]
    )
    left = len(ordered) - MAX_TRIED
    caption = "What effects need in order to show" + (f"; {left} more are in the JSON result" if left > 0 else "")
    return (PageTable(caption, ("effect", "needs", "the data have", ""), rows),) if rows else ()


def experiment_rows(experiment: Mapping[str, Any] | None) -> tuple[tuple[str, str], ...]:
    """Return the parts of a proposed experiment as pairs of words, whatever their names are."""
    return tuple((str(key).replace("_", " "), _words(value)) for key, value in (experiment or {}).items())


def _words(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_words(part)}" for key, part in value.items())
    if isinstance(value, Iterable) and not isinstance(value, str):
        return ", ".join(_words(part) for part in value)
    return digits(value) if isinstance(value, float) else str(value).replace("_", " ")


def _against_floor(rmse: float, floor: float, unit: str) -> tuple[str, str, str]:
    return quantity(rmse, unit), quantity(floor, unit), digits(rmse / floor if floor else float("inf"))
