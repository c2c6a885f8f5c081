"""Delays that no data can tell apart: that of every input that moves, and that of every output that is measured.

A plant whose equations do not change with time answers u(t - T) with y(t - T). So a delay of all its inputs shows the same
readings as one of all its sensors, whatever approximations of the two say of a record.
"""

from collections.abc import Sequence
from dataclasses import replace

from fmus.symbolic.system import SymbolicSystem
from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.search import FittedSet

MIRROR = {"input_delay": "sensor_delay", "sensor_delay": "input_delay"}
# Delays that differ by no more, and shares that are at least this, are one whole delay.
ALIKE, WHOLE = 0.05, 0.9


def mirrored(
    chosen: FittedSet, candidates: Sequence[Candidate], system: SymbolicSystem
) -> tuple[Candidate, ...] | None:
    """The set with the delay on the other side of the plant; None if the delays of a set have no such counterpart.

    Args:
        candidates: all that there are, which show where delays can be.
    """
    delays = [c for c in chosen.candidates if c.id in MIRROR]
    if len({c.id for c in delays}) != 1 or _changes_with_time(system):
        return None
    if {c.place.site for c in delays} != {c.place.site for c in candidates if c.id == delays[0].id}:
        return None
    there = {c.place.site: c for c in candidates if c.id == MIRROR[delays[0].id]}
    time = sum(chosen.value(c, "T")[0] * chosen.value(c, "share")[0] for c in delays) / len(delays)
    late = [replace(c, shapes={**c.shapes, "T": time}) for c in there.values()]
    return (*(c for c in chosen.candidates if c not in delays), *late) if late else None


def is_one_delay(chosen: FittedSet) -> bool:
    """Whether the delays of a set are whole ones and alike, so that the set on the other side says the same."""
    delays = [c for c in chosen.candidates if c.id in MIRROR]
    times = [chosen.value(c, "T")[0] for c in delays]
    return all(chosen.value(c, "share")[0] >= WHOLE for c in delays) and max(times) <= (1 + ALIKE) * min(times)


def _changes_with_time(system: SymbolicSystem) -> bool:
    return bool(system.rhs.jac_sparsity(0, 0).nnz() or system.rhs.jac_sparsity(1, 0).nnz())
