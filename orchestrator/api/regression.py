"""Regression cases of FMUs and systems, run from Python."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmus.errors import MisfitError

if TYPE_CHECKING:
    from orchestrator.regress.outcome import Outcome


@dataclass(frozen=True)
class Regression:
    """What became of regression cases, in the order in which they were found."""

    outcomes: "tuple[Outcome, ...]"

    @property
    def passed(self) -> bool:
        """Whether all cases passed."""
        return all(outcome.verdict == "passed" for outcome in self.outcomes)

    @property
    def verdicts(self) -> dict[str, str]:
        """`passed`, `failed` or `error` of each case, by name."""
        return {outcome.name: outcome.verdict for outcome in self.outcomes}

    def to_json(self) -> dict[str, Any]:
        """The `misfit.regress/1` document."""
        from orchestrator.regress.outcome import document

        return document(self.outcomes)

    def to_html(self) -> str:
        """A self-contained page."""
        from orchestrator.regress.page import page

        return page(self.outcomes)

    def _repr_html_(self) -> str:
        from html import escape

        rows = "".join(
            f"<tr><td>{escape(o.name)}</td><td>{o.verdict}</td><td>{escape(o.reason)}</td></tr>" for o in self.outcomes
        )
        return f"<table><tr><th>case</th><th>verdict</th><th>reason</th></tr>{rows}</table>"


def regress(paths: "str | Path | Sequence[str | Path]" = ".", *, words: str = "", workers: int = 2) -> Regression:
    """Run the regression cases in the files `NAME.regress.toml` below some paths.

    Args:
        paths: a file or folder, or several.
        words: only cases whose names or tags have all of these words.
        workers: processes.

    Raises:
        MisfitError: if a path does not exist.
    """
    from orchestrator.api.progress import progress
    from orchestrator.regress.collect import collect
    from orchestrator.regress.pool import run_cases

    wanted = [paths] if isinstance(paths, str | Path) else list(paths)
    for path in wanted:
        if not Path(path).exists():
            raise MisfitError(f"{path} does not exist; expected a case file or a folder with NAME.regress.toml")
    cases, broken = collect([Path(path) for path in wanted])
    chosen = [case for case in cases if all(word in " ".join((case.name, *case.tags)) for word in words.split())]
    with progress() as say:
        outcomes = run_cases(chosen, workers, lambda outcome: say(f"{outcome.name} {outcome.verdict}"), "verdict")
    return Regression((*broken, *outcomes))
