"""Where results and caches live, and how files are written so that a crash leaves the old or the new one."""

import os
import sys
import tempfile
from pathlib import Path
from typing import IO, Any

import platformdirs

from fmus.errors import MisfitError


def cache_path(name: str) -> Path:
    """Return the place of a folder for things that can be made again; `MISFIT_CACHE` moves it."""
    return Path(os.environ.get("MISFIT_CACHE") or platformdirs.user_cache_dir("misfit")) / name


def cache_folder(name: str) -> Path:
    """Return (and create) a folder for things that can be made again.

    Raises:
        MisfitError: if it cannot be made.
    """
    folder = cache_path(name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MisfitError(
            f"the cache folder {folder} cannot be made: {error.strerror}; "
            "set the environment variable MISFIT_CACHE to a folder that can be written"
        ) from error
    return folder


def try_writing(path: Path) -> None:
    """Make a file where `path` or its first missing folder will be, and remove it: rights alone do not tell (`/proc`).

    Raises:
        OSError: if nothing can be written there.
    """
    wanted = path.absolute()
    while not wanted.parent.exists():
        wanted = wanted.parent
    handle, temporary = tempfile.mkstemp(dir=wanted.parent, prefix=f".{wanted.name}.")
    os.close(handle)
    os.unlink(temporary)


def require_name_of_results(path: Path) -> None:
    """Refuse what a file of results cannot replace.

    Raises:
        MisfitError: if the path is a folder, a device or a pipe.
    """
    if path.exists() and not path.is_file():
        kind = "folder" if path.is_dir() else "device or a pipe"
        raise MisfitError(f"{path} is a {kind}; expected the name of a file of results")


def write_atomically(path: Path, data: bytes) -> None:
    """Replace a file as a whole: readers see the old content or the new, never a part; devices and pipes are written to."""
    if path.exists() and not path.is_file() and not path.is_dir():
        path.write_bytes(data)
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError as error:
        Path(temporary).unlink(missing_ok=True)
        raise OSError(error.errno, error.strerror, str(path)) from error  # a full disk names no file
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


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
