"""Locks on files, which the system takes back when their holder ends; the same calls on POSIX and Windows."""

import sys
from typing import IO, Any


def try_lock(file: IO[Any] | int) -> bool:
    """Lock an open file for this process alone; False where another one holds it."""
    return _locked(file, wait=False)


def lock(file: IO[Any] | int) -> None:
    """Lock an open file for this process alone, and wait until that can be."""
    _locked(file, wait=True)


def _locked(file: IO[Any] | int, wait: bool) -> bool:
    if sys.platform == "win32":
        import msvcrt

        try:
            msvcrt.locking(
                file if isinstance(file, int) else file.fileno(), msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1
            )
        except OSError:
            return False
        return True
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
