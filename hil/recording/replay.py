"""A recording through the same decisions again: they must come out bit for bit."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from fmus.errors import MisfitError
from hil.codecs.frame import Frame, Timed
from hil.control.pilot import CycleInput, Decision, Pilot
from hil.recording.recorder import FRAMES
from hil.recording.records import DOUBLE, MAGIC, RECORD, Flag, Kind, Record, unknown_kind, unpack_records

# Wishes and state by the flags of a cycle's record.
_WISHES: Final = [tuple(bool(flags & flag) for flag in Flag) for flags in range(sum(Flag) + 1)]
_RECEIVED: Final = int(Kind.RECEIVED)
_SENT: Final = int(Kind.SENT)
_DECIDED: Final = int(Kind.DECIDED)
_CYCLE: Final = int(Kind.CYCLE)
_BEGIN: Final = int(Kind.BEGIN)
_ASKED: Final = int(Kind.ASKED)


class RecordedCycle:
    """What a decision had, and the frames that came out of it, with the time at which they were sent."""

    def __init__(self, given: CycleInput, decided: list[Timed]) -> None:
        self.given = given
        self.decided = decided

    @property
    def took(self) -> float:
        """Seconds from the beginning of the cycle until something was sent; 0 if nothing was."""
        return (self.decided[0].time_ns - self.given.start_ns) * 1e-9 if self.decided else 0.0


def record_bytes(folder: Path) -> bytes:
    """The records of a recording as they are on disk, without its head; the last one may be cut off.

    Raises:
        MisfitError: if there is no recording, or one of another kind.
    """
    path = folder / FRAMES
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MisfitError(f"{path} cannot be read: {error.strerror}; name the folder of a recording") from error
    if not data.startswith(MAGIC):
        raise MisfitError(f"{path} is no recording of this version; it should begin with {MAGIC.decode().strip()!r}")
    return data[len(MAGIC) :]


def read_records(folder: Path) -> Iterator[Record]:
    """All records of a recording, in their order.

    Raises:
        MisfitError: if there is no recording, one of another kind, or a damaged one.
    """
    try:
        yield from unpack_records(record_bytes(folder))
    except ValueError as error:
        raise _damaged(folder, str(error)) from error


def cycles_of(folder: Path) -> Iterator[RecordedCycle]:
    """The cycles of a session; frames before the first one are those of the start-up.

    Raises:
        MisfitError: as for `read_records`.
    """
    frames: list[Timed] = []
    given: CycleInput | None = None
    decided: list[Timed] = []
    asked: list[float] = []
    data = record_bytes(folder)
    for kind, flags, identifier, size, time_ns, content in RECORD.iter_unpack(
        data[: len(data) - len(data) % RECORD.size]
    ):
        if kind == _RECEIVED:
            frames.append(Timed(time_ns, Frame(identifier, content[:size])))
        elif kind == _SENT:
            continue
        elif kind == _DECIDED:
            decided.append(Timed(time_ns, Frame(identifier, content[:size])))
        elif kind == _CYCLE:
            if given is not None:
                yield RecordedCycle(given, decided)
            computing = int.from_bytes(content, "little", signed=True)
            arm, abort, recording, end, watched, confirm, silent = _WISHES[flags % len(_WISHES)]
            outside = tuple(asked) if asked else None
            given = CycleInput(
                time_ns, frames, computing, arm, abort, recording, end, watched, confirm, silent, outside
            )
            frames, decided, asked = [], [], []
        elif kind == _BEGIN:
            frames = []
        elif kind == _ASKED:
            asked.extend(DOUBLE.unpack(content))
        else:
            raise _damaged(folder, unknown_kind(kind))
    if given is not None:
        yield RecordedCycle(given, decided)


def _damaged(folder: Path, words: str) -> MisfitError:
    return MisfitError(f"{folder / FRAMES} is damaged: {words}; what comes before is whole")


@dataclass
class Replayed:
    """How many cycles were replayed, and the first one (from 0) whose frames differ, None if all are identical."""

    cycles: int = 0
    first_different: int | None = None


def _is_same(frames: list[Frame], decided: list[Timed]) -> bool:
    """Whether these are the frames that were sent; field by field, which is ten times as fast as to compare records."""
    if len(frames) != len(decided):
        return False
    for k, frame in enumerate(frames):
        sent = decided[k].frame
        if frame.identifier != sent.identifier or frame.data != sent.data:
            return False
    return True


def replay(folder: Path, pilot: Pilot) -> Iterator[tuple[Replayed, RecordedCycle, Decision]]:
    """Run a recording through a pilot that is set up as the session's was."""
    found = Replayed()
    for cycle in cycles_of(folder):
        decision = pilot.decide(cycle.given)
        if not _is_same(decision.frames, cycle.decided) and found.first_different is None:
            found.first_different = found.cycles
        found.cycles += 1
        yield found, cycle, decision
