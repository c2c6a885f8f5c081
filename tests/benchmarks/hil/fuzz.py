"""Ten million random frames through all decoders: `python -m tests.benchmarks.hil.fuzz [--frames N] [--seed S]`.

Every frame must be decoded or refused in one line, with `FrameError` or another `MisfitError`; anything else is printed with the frame, and the exit code is 1. Each
frame goes to the decoder that its identifier belongs to and, in turn, to one of the others; every hundredth through a whole
virtual robot too, and through a pilot.
"""

import argparse
import sys
import time
from collections.abc import Callable

import numpy as np

from fmus.errors import MisfitError
from hil.codecs.barrett.force_torque import DIVISORS, unpack_reading
from hil.codecs.barrett.identifiers import Group, address_of
from hil.codecs.barrett.positions import motor_counts, unpack_positions
from hil.codecs.barrett.properties import decode_request, decode_value
from hil.codecs.barrett.safety_module import decode_mode, decode_pendant
from hil.codecs.barrett.tables import kind_of, properties
from hil.codecs.barrett.torques import unpack_torques
from hil.codecs.database import JOINT_ARM, Database
from hil.codecs.frame import Frame, Timed, parse_frame
from hil.codecs.slcan import SLCAN
from hil.codecs.socketcand import SOCKETCAND
from hil.control.pilot import CycleInput
from tests.hil.bench import Bench

_BLOCK = 100_000
_ARM = Database(JOINT_ARM)


def _number(data: bytes) -> int:
    return int.from_bytes(data, "little", signed=True)


DECODERS: tuple[Callable[[Frame], object], ...] = (
    lambda frame: address_of(frame.identifier),
    lambda frame: unpack_positions(frame.data),
    lambda frame: motor_counts(frame.data),
    lambda frame: SOCKETCAND.cut(frame.data.decode("latin-1")),
    lambda frame: SOCKETCAND.parse(f" frame {frame.data.decode('latin-1')}"),
    lambda frame: SLCAN.parse(frame.data.decode("latin-1")),
    lambda frame: unpack_torques(frame.data),
    lambda frame: decode_value(frame.data),
    lambda frame: decode_request(frame.data),
    lambda frame: unpack_reading(list(DIVISORS)[len(frame.data) % 3], frame.data),
    lambda frame: decode_mode(_number(frame.data[:4])),
    lambda frame: decode_pendant(_number(frame.data[:4])),
    lambda frame: properties(kind_of(_number(frame.data[:2])), _number(frame.data[2:4])),
    lambda frame: parse_frame(frame.data.decode("latin-1")),
    lambda frame: _ARM.decode(Frame(0x100 + frame.identifier % 0x40, frame.data)),
)
_GROUPS = {Group.POSITIONS: 1, Group.PROPERTIES: 3, Group.LOWER_TORQUES: 2, Group.FORCE: 5, Group.TORQUE: 5}


def main() -> None:
    """Print how many frames were refused, and what else happened."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=10_000_000)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    random, began = np.random.default_rng(args.seed), time.process_time()
    refused = failed = done = 0
    bench = Bench()
    pilot = bench.pilot()
    while done < args.frames:
        count = min(_BLOCK, args.frames - done)
        identifiers = random.integers(0, 0x800, count).tolist()
        sizes = random.integers(0, 9, count).tolist()
        content = random.bytes(8 * count)
        for k in range(count):
            frame = Frame(identifiers[k], content[8 * k : 8 * k + sizes[k]])
            for decoder in (DECODERS[_GROUPS.get(identifiers[k] & 0x1F, 0)], DECODERS[k % len(DECODERS)]):
                try:
                    decoder(frame)
                except MisfitError:
                    refused += 1
                except Exception as error:  # that is what is looked for
                    failed += 1
                    print(f"{frame}: {type(error).__name__}: {error}", flush=True)
            if k % 100 == 0:
                time_ns = (done + k + 1) * 1_000_000 + bench.bus.time_ns
                bench.robot.receive(frame, time_ns)
                pilot.decide(CycleInput(time_ns, [Timed(time_ns + 1, frame)]))
        done += count
    used = time.process_time() - began
    bench.wire.close()
    print(f"{done} frames in {used:.0f} CPU s: refused {refused} times in one line, anything else {failed} times")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
