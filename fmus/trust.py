"""Which FMUs may run in the process of misfit itself: those it built on this machine, and those the user trusts.

An FMU is native code: one that crashes takes along the process it runs in. What is not trusted runs in a process of its own.
Trust goes by content: an FMU that is changed by a byte has to earn it again.
"""

import os
from pathlib import Path

import platformdirs

from fmus.files import write_atomically


def trust_folder() -> Path:
    """Folder with a file for each trusted content, named by its SHA-256; `MISFIT_TRUST` moves it."""
    chosen = os.environ.get("MISFIT_TRUST")
    return Path(chosen) if chosen else Path(platformdirs.user_data_dir("misfit")) / "trusted"


def trust(digest: str, why: str) -> None:
    """Trust FMUs whose file has this SHA-256, in hex, from now on; `why` is for people who look into the folder."""
    path = trust_folder() / digest
    if path.exists():
        return
    try:
        write_atomically(path, f"{why}\n".encode())
    except OSError:
        return  # nowhere to remember it: the FMU keeps running in a process of its own, which is always right


def is_trusted(digest: str) -> bool:
    """Whether FMUs whose file has this SHA-256 are trusted."""
    return (trust_folder() / digest).is_file()
