"""A recording through the same decisions again: they must come out bit for bit."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fmus.errors import MisfitError
from hil.codecs.frame import Timed
from hil.control.pilot import CycleInput, Decision, Pilot
from hil.recording.recorder import FRAMES
from hil.recording.records import DOUBLE, MAGIC, Flag, Kind, Record, unpack_records

_FLAGS = tuple(int(flag) for flag in Flag)


@dataclass(frozen=True)
class RecordedCycle:
    """What a decision had, and the frames that came out of it, with the time at which they were sent."""

    given: CycleInput
    decided: tuple[Timed, ...]

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
        raise MisfitError(f"{folder / FRAMES} is damaged: {error}; what comes before is whole") from error


def cycles_of(records: Iterator[Record]) -> Iterator[RecordedCycle]:
    """The cycles of a session; frames before the first one are those of the start-up."""
    frames: list[Timed] = []
    given: CycleInput | None = None
    decided: list[Timed] = []
    asked: list[float] = []
    for kind, flags, timed in records:
        if kind is Kind.SENT:
            continue
        if kind is Kind.CYCLE:
            if given is not None:
                yield RecordedCycle(given, tuple(decided))
            computing = int.from_bytes(timed.frame.data, "little", signed=True)
            arm, abort, recording, end, watched, confirm, silent = (bool(flags & flag) for flag in _FLAGS)
            given = CycleInput(
                timed.time_ns,
                tuple(frames),
                computing,
                arm,
                abort,
                recording,
                end,
                watched,
                confirm,
                silent,
                tuple(asked) or None,
            )
            frames, decided, asked = [], [], []
        elif kind is Kind.BEGIN:
            frames = []
        elif kind is Kind.ASKED:
            asked.extend(DOUBLE.unpack(timed.frame.data))
        elif kind is Kind.RECEIVED:
            frames.append(timed)
        elif kind is Kind.DECIDED:
            decided.append(timed)
    if given is not None:
        yield RecordedCycle(given, tuple(decided))


@dataclass
class Replayed:
    """How many cycles were replayed, and the first one (from 0) whose frames differ, None if all are identical."""

    cycles: int = 0
    first_different: int | None = None


def replay(folder: Path, pilot: Pilot) -> Iterator[tuple[Replayed, RecordedCycle, Decision]]:
    """Run a recording through a pilot that is set up as the session's was."""
    found = Replayed()
    for cycle in cycles_of(read_records(folder)):
        decision = pilot.decide(cycle.given)
        if decision.frames != [timed.frame for timed in cycle.decided] and found.first_different is None:
            found.first_different = found.cycles
        found.cycles += 1
        yield found, cycle, decision
