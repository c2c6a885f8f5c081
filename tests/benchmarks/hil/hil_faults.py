"""How soon the arm is without torque, and what the user is told: `python -m tests.benchmarks.hil.hil_faults [--trials N] [--json F]`.

A man in the middle on the bus, or a signal to a process, makes each fault at 100, 500 and 1000 Hz. Faults of the bus and of nodes run
in virtual time, so their figures are the same on every machine; those of processes run in real time. Time counts until the last
motor makes no torque any more. Exit code 1 if an aim is missed: 3 periods for faults that one cycle shows, 30 ms for a process
that is dead or frozen.
"""

import argparse
import json
import math
import statistics
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path

from tests.benchmarks.hil.bus_faults import FAULTS, refusals_at_start, times_of
from tests.benchmarks.hil.process_faults import WAYS, process_times

RATES = (100.0, 500.0, 1000.0)
PERIODS, PROCESS_MS = 3.0, 30.0


@dataclass(frozen=True)
class Line:
    """What came of one fault at one rate: times in ms, the aim in ms (0: none), what the user was told."""

    fault: str
    rate_hz: float
    seen_ms: float
    median_ms: float
    worst_ms: float
    aim_ms: float
    told: str

    @property
    def is_kept(self) -> bool:
        """Whether the aim is met, if there is one."""
        return not self.aim_ms or self.worst_ms <= self.aim_ms

    def __str__(self) -> str:
        """One line of the table."""
        aim = f"{'ok' if self.is_kept else 'MISSED'} (aim {self.aim_ms:g})" if self.aim_ms else ""
        return (
            f"| {self.fault} | {self.rate_hz:g} | {self.seen_ms:.1f} | {self.median_ms:.1f} | {self.worst_ms:.1f} | {aim} |"
            f" {self.told} |"
        )


HEAD = "| fault | Hz | seen after ms, worst | no torque after ms, median | worst | | what the user is told |\n|---|---|---|---|---|---|---|"


def bus_lines(trials: int, rates: tuple[float, ...] = RATES) -> Iterator[Line]:
    """Faults of the bus and of nodes, in virtual time."""
    for fault in FAULTS:
        for rate_hz in rates:
            found = [times_of(fault, rate_hz, trial) for trial in range(trials)]
            zero = sorted(each.zero_ms for each in found)
            aim = PERIODS * 1e3 / rate_hz if fault.at_once else 0.0
            seen = max(each.seen_ms for each in found)
            yield Line(fault.name, rate_hz, seen, statistics.median(zero), zero[-1], aim, found[0].told)


def process_lines(trials: int, rates: tuple[float, ...] = RATES) -> Iterator[Line]:
    """Processes that are killed or frozen, in real time."""
    for way in WAYS:
        for rate_hz in rates:
            try:
                times, told = process_times(way, rate_hz, trials)
            except RuntimeError as error:  # a machine that is too busy for this rate
                yield Line(
                    way, rate_hz, math.nan, math.nan, math.nan, 0.0, f"not measured here: {str(error).splitlines()[-1]}"
                )
                continue
            yield Line(way, rate_hz, times[-1], statistics.median(times), times[-1], PROCESS_MS, told)


def table(lines: list[Line]) -> str:
    """All lines in Markdown."""
    return "\n".join([HEAD, *map(str, lines)]) + "\n"


def main() -> None:
    """Print one line for each fault and rate."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=12, help="of each fault in virtual time")
    parser.add_argument("--process-trials", type=int, default=5, help="of each process; 0 leaves them out")
    parser.add_argument("--json", type=Path, help="the same as JSON")
    args = parser.parse_args()
    print(HEAD, flush=True)
    lines = []
    for line in chain(bus_lines(args.trials), process_lines(args.process_trials) if args.process_trials else ()):
        lines.append(line)
        print(line, flush=True)
    for words in refusals_at_start():
        print(f"refused before arming: {words}")
    if args.json is not None:
        args.json.write_text(json.dumps([asdict(line) for line in lines], indent=2) + "\n")
    missed = [f"{line.fault} at {line.rate_hz:g} Hz" for line in lines if not line.is_kept]
    print(f"\n{'all aims are met' if not missed else 'MISSED: ' + ', '.join(missed)}")
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
