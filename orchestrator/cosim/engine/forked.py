"""Tells a process from the copies that an FMU makes of it by fork(): those must not go on with the run.

A copy would write the same rows a second time, or rows that the run has left behind, into memory that it shares.
"""

import ctypes
import mmap
import os
import sys
from functools import cache

# `MADV_WIPEONFORK` of Linux: the page is full of zeros in a process that was forked off.
_WIPE_ON_FORK = 18


@cache
def _page() -> mmap.mmap | None:
    if sys.platform != "linux":
        return None
    page = mmap.mmap(-1, mmap.PAGESIZE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    try:
        page.madvise(_WIPE_ON_FORK)
    except OSError:  # a kernel before 4.14
        return None
    page[0] = 1
    return page


@cache
def own_process_address() -> int | None:
    """Address of a number that is 1 here and 0 in copies of this process; None where the system cannot tell."""
    page = _page()
    return None if page is None else ctypes.addressof(ctypes.c_int32.from_buffer(page))


def end_copies() -> None:
    """End this process if it is a copy that an FMU has made."""
    page = _page()
    if page is not None and page[0] == 0:
        os._exit(0)
