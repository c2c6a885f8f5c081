"""Outcomes as workflow commands that GitHub shows beside the changed files."""

from collections.abc import Sequence
from pathlib import Path

from orchestrator.regress.outcome import Outcome


def annotations(outcomes: Sequence[Outcome], folder: Path) -> list[str]:
    """One `::error` for each case that did not pass; files are relative to `folder`, as GitHub wants them.

    Example:
        >>> annotations([Outcome("ball", "m/ball.regress.toml", "failed", "h is off by 2 m")], Path())
        ['::error file=m/ball.regress.toml,line=1,title=misfit regress%3A ball failed::h is off by 2 m']
    """
    found = []
    for outcome in outcomes:
        if outcome.verdict == "passed":
            continue
        title = _property(f"misfit regress: {outcome.name} {outcome.verdict}")
        place = _property(_relative(outcome.file, folder))
        found.append(f"::error file={place},line=1,title={title}::{_data(outcome.reason)}")
    return found


def _relative(file: str, folder: Path) -> str:
    path = Path(file)
    try:
        return path.resolve().relative_to(folder.resolve()).as_posix() if path.is_absolute() else path.as_posix()
    except ValueError:
        return path.as_posix()


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
