"""Cases that a call at another commit has done: kept as they are, and the report says of which commit they are."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from tests.benchmarks.diagnosis.truth.families import Wish

_COMMIT = "commit.txt"


def folders_of(wishes: Sequence[Wish], own: Path, earlier: Sequence[Path]) -> Mapping[str, Path]:
    """The folder of each case by its name: the first of `earlier` in which it is finished, else `own`."""
    return {
        wish.name: next((f for f in earlier if (f / "baselines" / f"{wish.name}.json").exists()), own)
        for wish in wishes
    }


def keep_commit(folder: Path, commit: str) -> None:
    """Note of which commit the cases of a folder are."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / _COMMIT).write_text(f"{commit}\n")


def commits(folders: Sequence[Path], own: Path) -> str:
    """In words, the commit of a call, and those of the cases that others have done; `folders` has an entry for each case."""
    counts = Counter(folders)
    others = [f"{n} of {_commit_of(folder)}" for folder, n in counts.items() if folder != own]
    return f"{_commit_of(own)} ({counts[own]} cases; {', '.join(others)})" if others else _commit_of(own)


def _commit_of(folder: Path) -> str:
    file = folder / _COMMIT
    return file.read_text().strip() if file.exists() else "an unknown commit"
