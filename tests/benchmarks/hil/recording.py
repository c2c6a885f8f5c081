"""What recording costs in the loop, told apart from what the machine does: a loop that only adds numbers runs beside it.

Blocks of records and of sums take turns until as much time was spent in calls of both, with the priority and the locked memory of
a session. A call that takes long because the machine stood still is met by sums as often; one that takes long by itself is not.
"""

import tempfile
import time
import timeit
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hil.codecs.frame import Frame, Timed
from hil.control.timing import real_time_priority
from hil.recording.frames import write_frames
from hil.recording.recorder import FRAMES
from hil.recording.records import MAGIC, Kind, pack_frame
from hil.recording.ring import Ring

# No call may take longer.
LIMIT_NS = 50_000
_BLOCK = 1000
_BURST = 10
_NUMBERS = tuple(range(40))


@dataclass
class Calls:
    """Calls that were made, the time in them, the longest, and those beyond the limit; ns."""

    count: int = 0
    inside_ns: int = 0
    worst_ns: int = 0
    long: int = 0

    def make(self, call: Callable[[], object], count: int) -> None:
        """Make some more."""
        clock, worst, long, inside = time.perf_counter_ns, 0, 0, 0
        for _ in range(count):
            before = clock()
            call()
            took = clock() - before
            inside += took
            if took > worst:
                worst = took
            if took > LIMIT_NS:
                long += 1
        self.worst_ns, self.long = max(self.worst_ns, worst), self.long + long
        self.count, self.inside_ns = self.count + count, self.inside_ns + inside


@dataclass(frozen=True)
class Cost:
    """Records and sums in turns, and how the ring did; `refused` is what of a session's priority was not permitted."""

    us_a_frame: float
    records: Calls
    sums: Calls
    refused: tuple[str, ...]
    lost: bool

    @property
    def is_ours(self) -> bool:
        """Whether more calls were long than the machine explains; its stalls come in bursts, so twice as many say nothing."""
        return self.records.long > 2 * self.sums.long + _BURST


def cost(frames: int = 300_000) -> tuple[Cost, bytes]:
    """Measure; returns the records, too."""
    timed = Timed(time.monotonic_ns(), Frame(0x423, b"\x01\x02\x03"))
    ring = Ring.create()
    records, sums = Calls(), Calls()

    def record() -> None:
        ring.put(pack_frame(Kind.RECEIVED, timed))

    with real_time_priority() as refused:
        for _ in range(frames // _BLOCK):
            records.make(record, _BLOCK)
            while sums.inside_ns < records.inside_ns:
                sums.make(_add, _BLOCK // 10)
        data = ring.take()
        us = min(timeit.repeat(record, number=20_000, repeat=7, timer=time.thread_time)) / 20_000 * 1e6
    lost = ring.overflowed
    ring.remove()
    return Cost(us, records, sums, tuple(refused), lost), data


def _add() -> int:
    return sum(_NUMBERS)


def exports(data: bytes, ending: str) -> tuple[float, bool]:
    """CPU s that a format takes for the records, and whether two exports are the same bytes."""
    with tempfile.TemporaryDirectory() as name:
        folder, files = Path(name), []
        (folder / FRAMES).write_bytes(MAGIC + data)
        worked = time.process_time()
        for _ in range(2):
            write_frames(folder, folder / f"frames{ending}")
            files.append((folder / f"frames{ending}").read_bytes())
        return 0.5 * (time.process_time() - worked), files[0] == files[1]
