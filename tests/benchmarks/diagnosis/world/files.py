"""Written cases, changed as recorders and people change them: columns file by file, and the lines of case.toml."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

Columns = dict[str, np.ndarray]


def trials_of(folder: Path) -> list[Path]:
    """Data files of a case, in order."""
    return sorted(folder.glob("trial_*.csv"))


def read_columns(file: Path) -> Columns:
    """Columns of a trial by name."""
    names = file.read_text().split("\n", 1)[0].split(",")
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    return dict(zip(names, rows.T, strict=True))


def write_columns(file: Path, columns: Columns) -> None:
    """Write a trial."""
    rows = np.column_stack(list(columns.values()))
    np.savetxt(file, rows, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")


def rewrite(folder: Path, change: Callable[[Columns, int], Columns]) -> None:
    """Change the columns of every trial, numbered from 1."""
    for number, file in enumerate(trials_of(folder), 1):
        write_columns(file, change(read_columns(file), number))


def edit_toml(folder: Path, change: Callable[[str], str]) -> None:
    """Change the text of case.toml."""
    file = folder / "case.toml"
    file.write_text(change(file.read_text()))


def without_section(text: str, section: str) -> str:
    """Text of a case.toml without one of its sections.

    >>> without_section("a = 1\\n[b]\\nc = 2\\n[d]\\ne = 3\\n", "b")
    'a = 1\\n[d]\\ne = 3\\n'
    """
    kept, inside = [], False
    for line in text.splitlines(keepends=True):
        if line.startswith("["):
            inside = line.startswith(f"[{section}]")
        if not inside:
            kept.append(line)
    return "".join(kept)
