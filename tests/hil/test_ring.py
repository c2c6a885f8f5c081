"""The shared memory between loop and recorder: nothing is lost, doubled or torn while both sides hurry."""

import subprocess
import sys
from pathlib import Path
from struct import Struct

import pytest

from fmus.errors import ComponentError
from hil.recording.records import RECORD
from hil.recording.ring import Ring

COUNT = 300_000
WRITER = """
import sys
from pathlib import Path
from hil.recording.records import RECORD
from hil.recording.ring import Ring
ring = Ring(Path(sys.argv[1]), int(sys.argv[2]))
for k in range(int(sys.argv[3])):
    ring.put(k.to_bytes(RECORD.size, "little"))
ring.close()
sys.exit(ring.overflowed)
"""


def test_a_reader_in_a_hurry_takes_every_record_once_and_in_order() -> None:
    ring = Ring.create(1 << 19)
    with subprocess.Popen([sys.executable, "-c", WRITER, str(ring.path), str(1 << 19), str(COUNT)]) as writer:
        parts = []
        while not ring.is_closed and writer.poll() is None:
            parts.append(ring.take())
        writer.wait(timeout=60)
    parts.append(ring.take())
    ring.remove()
    assert writer.returncode == 0
    numbers = Struct(f"<Q{RECORD.size - 8}x")
    assert [k for (k,) in numbers.iter_unpack(b"".join(parts))] == list(range(COUNT))


def test_a_full_ring_keeps_what_it_has_and_says_that_it_overflowed() -> None:
    ring = Ring.create(4)
    for k in range(5):
        ring.put(bytes([k]) * RECORD.size)
    assert ring.overflowed
    assert ring.take() == b"".join(bytes([k]) * RECORD.size for k in range(4))
    ring.remove()


def test_a_damaged_ring_is_an_error_and_no_endless_read(tmp_path: Path) -> None:
    ring = Ring.create(4)
    ring.put(b"\x01" * RECORD.size)
    ring.take()
    ring._counts[0] = 0  # taken more than was written
    with pytest.raises(ComponentError, match="the ring of records is damaged"):
        ring.take()
    ring.remove()


def test_a_recorder_whose_disk_is_full_says_so_in_one_line_and_leaves_no_memory_behind() -> None:
    ring = Ring.create()
    ring.put(bytes(RECORD.size))
    command = [sys.executable, "-m", "hil.recording.writer", str(ring.path), "/dev/full"]

    ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)

    assert (ended.returncode, len(ended.stderr.splitlines())) == (1, 1)
    assert "/dev/full can no longer be written: No space left on device; the session ends" in ended.stderr
    assert not ring.path.exists()
