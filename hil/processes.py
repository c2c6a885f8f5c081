"""Files in shared memory that carry the number of their process in their name, and whether that process lives."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

# What python-can imports for files that no process but the user's own reads: with pandas it is 0.6 s and 250 MB.
NOT_NEEDED = "asammdf"


def shared_folder() -> Path:
    """Where sessions keep what others look at: `MISFIT_SHARED`, else shared memory where there is any.

    Sessions and views with different folders do not see each other.
    """
    if chosen := os.environ.get("MISFIT_SHARED"):
        return Path(chosen)
    return Path("/dev/shm") if os.access("/dev/shm", os.W_OK) else Path(tempfile.gettempdir())


def process_of(path: Path, prefix: str) -> int:
    """Number of the process whose file `PREFIX<number>-...` this is; 0 for a name that has none."""
    number = path.name.removeprefix(prefix).split("-")[0]
    return int(number) if number.isdigit() else 0


def lives(process: int) -> bool:
    """Whether there is a process of this number."""
    if process <= 0:
        return False
    try:
        os.kill(process, 0)
    except PermissionError:
        return True
    except OSError:
        return False
    return True


def of_living(folder: Path, prefix: str) -> Iterator[Path]:
    """Files of processes that live; those that killed ones have left behind are removed."""
    for path in folder.glob(f"{prefix}*"):
        if lives(process_of(path, prefix)):
            yield path
        else:
            try:
                path.unlink(missing_ok=True)
            except OSError:  # another user's
                continue
