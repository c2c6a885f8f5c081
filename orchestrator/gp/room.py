"""How much memory exact conditioning takes, said before the computer runs out of it."""

import os

from fmus.errors import MisfitError

# Matrices of n x n that conditioning and a likelihood hold at a time, at 8 bytes an entry.
CONDITION, LIKELIHOOD = 2, 6


def require_room(count: int, matrices: int) -> None:
    """Refuse so many data if their covariance does not fit into the memory that is free.

    Raises:
        MisfitError: with the memory needed and what there is.
    """
    need, free = 8.0 * matrices * count**2, _free()
    if need > free:
        raise MisfitError(
            f"{count} data need {need / 1e9:.1f} GB of memory for exact conditioning, {free / 1e9:.1f} GB are free; take fewer, or "
            "condition_sparse (orchestrator.gp.sparse), whose memory does not grow with them"
        )


def _free() -> float:
    """Bytes of memory that can be had now."""
    try:
        with open("/proc/meminfo") as lines:
            for line in lines:
                if line.startswith("MemAvailable:"):
                    return 1024.0 * float(line.split()[1])
    except OSError:
        pass
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (ValueError, OSError, AttributeError):
        return float("inf")
