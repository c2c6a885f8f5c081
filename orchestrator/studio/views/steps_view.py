"""The picture of a ledger on a page."""

from collections.abc import Sequence

from nicegui import ui

from orchestrator.ledger import LedgerEntry
from orchestrator.report.numbers import digits
from orchestrator.studio.views.parts import Words, section
from orchestrator.studio.views.steps_drawing import STYLE, Step, drawing, steps_of, summary

COLUMNS = (
    "version",
    "model",
    "added",
    "learning trials, times the floor",
    "held-out trials, times the floor",
    "errors",
)


class StepsView:
    """Bars for all versions of a ledger; those that `show` adds fall from the height of the one before."""

    def __init__(self, entries: Sequence[LedgerEntry]) -> None:
        ui.add_css(STYLE)
        self._shown: int | None = None
        with section("Error, version by version"):
            self._picture = ui.html("", sanitize=False)
            self.words = Words("Error by version")
        self.show(entries)

    def show(self, entries: Sequence[LedgerEntry]) -> None:
        """Show these versions; nothing moves at first, or where there are fewer than before."""
        steps = steps_of(entries)
        already = self._shown if self._shown is not None and self._shown < len(steps) else None
        self._picture.set_content(drawing(steps, already))
        self.words.say(summary(steps), COLUMNS, [_row(step) for step in steps])
        self._shown = len(steps)


def _row(step: Step) -> list[str]:
    held_out = "" if step.held_out is None else digits(step.held_out)
    return [str(step.version), step.name, step.added, digits(step.learning), held_out, step.signals]
