"""Children that have run a simulation and wait for the next one of the same FMUs: starting one costs more than a short run.

Only a child whose runs all ended well is kept, and it only gets FMUs that it has loaded already, so that no FMU ever
runs in a process in which another one has been.
"""

import atexit
import threading
from collections.abc import Hashable, Mapping
from pathlib import Path

from fmus.errors import MisfitError
from orchestrator.cosim.isolate.process import Child
from orchestrator.cosim.system import System

# Children that wait at a time, and runs after which one has done enough: what FMUs leak must not add up.
MOST_WAITING, MOST_RUNS = 4, 1000

_waiting: list[tuple[Hashable, Child]] = []
_lock = threading.Lock()


def key_of(system: System) -> Hashable | None:
    """What a child has loaded that has run a system; None for a system with parts that run a user's own Python."""
    from orchestrator.cosim.fmu import read_description

    if any(spec.kind != "fmu" for spec in system.components.values()):
        return None
    try:
        files = {Path(system.folder / spec.source) for spec in system.components.values()}
        return frozenset(read_description(file).digest for file in files)
    except MisfitError:  # the child says what is wrong with it
        return None


def take(key: Hashable | None) -> Child | None:
    """A child that waits for these FMUs, None if there is none."""
    with _lock:
        for place, (known, child) in enumerate(_waiting):
            if key is not None and known == key:
                del _waiting[place]
                return child
    return None


def put_back(key: Hashable | None, child: Child) -> None:
    """Let a child wait for the next run, or end it."""
    child.runs += 1
    if key is None or child.runs >= MOST_RUNS or child.resident_gib() > 0.5 * child.limits.memory_gib:
        child.close()
        return
    with _lock:
        _waiting.append((key, child))
        ended = _waiting[:-MOST_WAITING]
        del _waiting[:-MOST_WAITING]
    for _, each in ended:
        each.close()


def end_waiting() -> None:
    """End all children that wait."""
    with _lock:
        ended = [child for _, child in _waiting]
        _waiting.clear()
    for child in ended:
        child.close()


def waiting() -> Mapping[Hashable, int]:
    """How many children wait for which FMUs."""
    with _lock:
        keys = [key for key, _ in _waiting]
    return {key: keys.count(key) for key in keys}


atexit.register(end_waiting)
