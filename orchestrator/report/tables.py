"""Results as tables for a terminal or a pipe, at most 100 columns wide."""

import math
import unicodedata
from collections.abc import Mapping, Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console, ConsoleOptions, Group, RenderResult
from rich.table import Table
from rich.text import Text

from orchestrator.compare.result import Comparison, SetErrors
from orchestrator.ledger import LedgerEntry
from orchestrator.report.answer import answer_of
from orchestrator.report.answer.words import note_sentences
from orchestrator.report.numbers import digits, estimate, percent, quantity
from orchestrator.report.sentences import (
    comparison_sentence,
    effect_name,
    experiment_sentence,
    most_of,
    verdict_sentence,
)
from orchestrator.verdicts.result import Diagnosis, NamedEffect

__all__ = ["LedgerTable", "comparison_table", "diagnosis_table", "verdict_sentence"]

BAR_WIDTH = 7
TRIAL_ROWS = 40
_EIGHTHS = " ▏▎▍▌▋▊▉█"


# A terminal with fewer columns has no room for bars beside the numbers, nor for names beside their effects.
NARROW = 90


def bar(share: float, width: int = BAR_WIDTH) -> str:
    """Return a bar of Unicode blocks for a share of `width` characters; shares outside [0, 1] are clipped.

    Example:
        >>> bar(0.55, 4)
        '██▎'
    """
    eighths = 0 if math.isnan(share) else round(8 * width * min(1.0, max(0.0, share)))
    return "█" * (eighths // 8) + _EIGHTHS[eighths % 8].strip()


class LedgerTable:
    """One row per version: its effects, the errors, and a bar in proportion to the error of the first version along the same
    measurements; a line stands where the measurements are others. What it is printed on decides whether bars have room."""

    def __init__(self, entries: Sequence[LedgerEntry]) -> None:
        self.entries = entries

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield _ledger(self.entries, narrow=options.max_width < NARROW)


def _ledger(entries: Sequence[LedgerEntry], narrow: bool) -> Table:
    table = _table()
    table.add_column("v", justify="right", no_wrap=True)
    if not narrow:
        table.add_column("name", overflow="fold", max_width=18)
    # No narrower than an interval's number: it would be broken in the middle.
    table.add_column(f"{'name, ' if narrow else ''}effects, 90 % interval", overflow="fold", min_width=13)
    table.add_column("learning", no_wrap=True)
    table.add_column("held out", no_wrap=True)
    table.add_column("x floor", justify="right", no_wrap=True)
    if not narrow:
        table.add_column("error", no_wrap=True, width=BAR_WIDTH)
    firsts: dict[str, LedgerEntry] = {}
    for before, entry in zip((None, *entries), entries, strict=False):
        if before is not None and before.data_hash != entry.data_hash:
            table.add_section()
        first = _deciding(firsts.setdefault(entry.data_hash, entry)).over_floor
        now = _deciding(entry).over_floor
        _row(
            table,
            str(entry.version),
            *([f"{entry.name}\n{_effects(entry.effects)}"] if narrow else [entry.name, _effects(entry.effects)]),
            _signals(entry.learning, entry.units),
            "none" if entry.held_out is None else _signals(entry.held_out, entry.units),
            digits(now),
            *([] if narrow else [bar(now / first if first > 0 and math.isfinite(first) else 1.0)]),
        )
    return table


def comparison_table(comparison: Comparison) -> Group:
    """Return the finding in a sentence, then the errors of both sets and of each trial, signal by signal."""
    table = _table()
    table.add_column("trial", overflow="fold", max_width=36)
    table.add_column("set", no_wrap=True)
    table.add_column("signal", overflow="fold", max_width=20)
    for heading in ("error (rms)", "floor", "x floor", "fit"):
        table.add_column(heading, justify="right", no_wrap=True)
    rows = _comparison_rows(comparison)
    for row in rows[:TRIAL_ROWS]:
        _row(table, *row)
    if len(rows) > TRIAL_ROWS:
        table.caption = f"{len(rows) - TRIAL_ROWS} more rows are in the JSON result"
    return Group(_plain(comparison_sentence(comparison)), table)


def diagnosis_table(diagnosis: Diagnosis) -> Group:
    """Return the answer and what is next, what else it could be unless there is nothing to explain, and what is left open."""
    answer = answer_of(diagnosis.to_json())
    left_open = [_plain(f"Note: {note}") for note in note_sentences(diagnosis.warnings) if note != answer.caution]
    proposed = diagnosis.next_experiment
    if proposed and proposed.get("effects") and (sentence := experiment_sentence(proposed, answer.next_step)):
        left_open.append(_plain(sentence))
    first = (_plain(answer.text), _plain(f"Next: {answer.next_step}"))
    if not answer.rivals:
        return Group(*first, *left_open)
    table = _table()
    table.add_column(
        "what else it could be" if answer.rivals[0].named else "what it could be", overflow="fold", ratio=3
    )
    table.add_column("odds against", overflow="fold", min_width=12, ratio=1)
    table.add_column("why", overflow="fold", ratio=2)
    for place, rival in enumerate(answer.rivals, start=1):
        _row(table, f"{place} {rival.name}", rival.odds, rival.reason)
    if answer.not_tried:
        table.caption = answer.not_tried
    left_over = [_plain(f"{line}.") for line in diagnosis.findings]
    left_over += [_plain(f"{curve.sentence()}.") for curve in diagnosis.latent_forces]
    return Group(*first, table, *left_over, *left_open)


def _table() -> Table:
    return Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False, caption_justify="left", caption_style="")


def _row(table: Table, *cells: str) -> None:
    table.add_row(*(_plain(cell) for cell in cells))


def _plain(text: str) -> Text:
    """Keep text from commanding: rich reads `tauC[a]` in a string as markup, a terminal obeys escapes in file names."""
    return Text("".join(c if c == "\n" or unicodedata.category(c) != "Cc" else "�" for c in text))


def _comparison_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    rows = []
    sets = (("all learning", "learning", comparison.learning), ("all held-out", "held_out", comparison.held_out))
    for label, name, found in sets:
        if found is not None:
            rows += [_comparison_row(comparison, label, name, signal, found.rmse, {}) for signal in comparison.signals]
    for trial in comparison.trials:
        for signal in comparison.signals:
            rows.append(_comparison_row(comparison, trial.file, trial.set, signal, trial.rmse, trial.fit_percent))
    return rows


def _comparison_row(
    comparison: Comparison, label: str, group: str, signal: str, rmse: Mapping[str, float], fit: Mapping[str, float]
) -> tuple[str, ...]:
    value, unit, floor = rmse[signal], comparison.units[signal], comparison.noise_floor[signal]
    over = digits(value / floor) if floor else "∞"
    fitted = percent(fit[signal] / 100) if signal in fit else ""
    return label, group.replace("_", " "), signal, quantity(value, unit), quantity(floor, unit), over, fitted


def _deciding(entry: LedgerEntry) -> SetErrors:
    return entry.learning if entry.held_out is None else entry.held_out


def _effects(effects: Sequence[NamedEffect]) -> str:
    lines = []
    listed, others = most_of(effects)
    for effect in listed:
        lines += [effect_name(effect), *(estimate(name, found) for name, found in effect.parameters.items())]
    return "\n".join([*lines, *filter(None, [others])]) or "as given"


def _signals(found: SetErrors, units: Mapping[str, str]) -> str:
    return "\n".join(f"{name} {quantity(value, units.get(name, ''))}" for name, value in found.rmse.items())
