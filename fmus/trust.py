"""Which FMUs may run in the process of misfit itself: those it built on this machine, and those the user trusts.

An FMU is native code: one that crashes takes along the process it runs in. What is not trusted runs in a process of its own.
Trust goes by content: an FMU that is changed by a byte has to earn it again. It is kept in the cache, one file for each
SHA-256; where that is lost, FMUs run in processes of their own, which is always right.
"""

from fmus.files import cache_folder, write_atomically


def trust(digest: str, why: str) -> None:
    """Trust FMUs whose file has this SHA-256, in hex, from now on; `why` is for people who look into the folder."""
    write_atomically(cache_folder("trusted") / digest, f"{why}\n".encode())


def is_trusted(digest: str) -> bool:
    """Whether FMUs whose file has this SHA-256 are trusted."""
    return (cache_folder("trusted") / digest).is_file()
