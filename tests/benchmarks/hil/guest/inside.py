"""Inside the guest: a virtual robot and a session on `vcan0`, `candump` beside them: `python -m ...inside RATE SECONDS CANDUMP`.

What each of the session's frames was, by identifier and in order, must be what `candump` heard, and `misfit hil decode` must find as many
positions in its log as the session has recorded.
"""

import contextlib
import json
import os
import pty
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hil.codecs.barrett.identifiers import Group, answer_of
from hil.codecs.frame import parse_frame
from hil.recording.records import Kind
from hil.recording.replay import read_records
from hil.session.recorded import ROBOT

OUT = Path("/mnt/out")
MISFIT = str(Path(sys.executable).with_name("misfit"))
# A machine that translates instructions stands still now and then; a session there is one without a person at the arm.
BENCH = """
[bus]
interface = "socketcan"
channel = "vcan0"
[robot]
gravity = false
[limits]
missing_comply_s = 0.3
missing_release_s = 0.9
late_comply_s = 1.0
stall_s = 0.2
answer_s = 0.1
force_missing_s = 0.5
"""


# The questions before a session's first cycle bring so many positions of a motor.
POSITIONS = 20
# A start-up whose answers this machine brings too late is tried again.
ATTEMPTS = 5
# What is typed when a session asks it.
ANSWERS = {"on its stops?": "y\n", "Type ARM": "ARM\n"}


def main() -> None:
    """Run it, and write down what came of it."""
    rate, seconds, candump = sys.argv[1:]
    bench, log = OUT / "bench.toml", OUT / "candump.log"
    bench.write_text(BENCH)
    began = time.monotonic()
    with (
        _beside([candump, "-L", "vcan0"], log),
        _beside([MISFIT, "hil", "robot", "--interface", "socketcan", "--channel", "vcan0"]),
    ):
        _until_it_answers(log)
        started = time.monotonic() - began
        for attempt in range(1, ATTEMPTS + 1):
            folder = OUT / f"session-{attempt}"
            hold = [
                MISFIT,
                "hil",
                "hold",
                "--bench",
                str(bench),
                "--rate",
                rate,
                "--seconds",
                seconds,
                "--out",
                str(folder),
            ]
            code, said = _at_a_terminal([*hold, "--json", str(OUT / "hold.json")])
            if (folder / ROBOT).exists():
                break
        time.sleep(1.0)
    replayed = subprocess.run([MISFIT, "hil", "replay", str(folder)], text=True, capture_output=True, check=False)
    found = {
        "attempts until the robot was up": attempt,
        "exit code of the session": code,
        "what it said": said.strip()[-600:],
        "s until the robot was up": round(started, 1),
        **_session(OUT / "hold.json"),
        "replay": (replayed.stdout + replayed.stderr).strip(),
        **_compared(folder, log),
    }
    (OUT / "result.json").write_text(json.dumps(found, indent=2) + "\n")


def _at_a_terminal(command: list[str]) -> tuple[int, str]:
    """Run a session as somebody at a terminal would, who answers its questions; its exit code and all that it said."""
    ours, its = pty.openpty()
    process = subprocess.Popen(command, stdin=its, stdout=its, stderr=its, start_new_session=True)
    os.close(its)
    said, answers = "", dict(ANSWERS)
    with contextlib.suppress(OSError):  # the terminal is gone when the session has ended
        while data := os.read(ours, 4096):
            said += data.decode(errors="replace")
            for question in [each for each in answers if each in said]:
                time.sleep(0.5)
                os.write(ours, answers.pop(question).encode())
    return process.wait(), said


def _session(path: Path) -> dict[str, object]:
    if not path.exists():
        return {}
    document = json.loads(path.read_text())
    wanted = ("rate_hz", "cycles", "missed", "answers_late", "frames_lost", "round_trip_us", "largest_gap_ms", "faults")
    return {key: document[key] for key in wanted}


def _compared(folder: Path, log: Path) -> dict[str, object]:
    """Frames of the recording beside those of the log, which begins earlier and ends later."""
    ours, theirs = defaultdict(list), defaultdict(list)
    for kind, _, timed in read_records(folder):
        if kind in (Kind.RECEIVED, Kind.SENT):
            ours[timed.frame.identifier].append(timed.frame.data)
    for line in log.read_text().splitlines():
        frame = parse_frame(line.split()[2])
        theirs[frame.identifier].append(frame.data)
    # The last frames of a session may be those of its watchdog, which nobody records.
    missing = {
        f"{identifier:03X}": len(data) for identifier, data in ours.items() if not _contains(theirs[identifier], data)
    }
    decoded = OUT / "decoded"
    command = [
        MISFIT,
        "hil",
        "decode",
        str(log),
        "--database",
        "proficio",
        "--at",
        "Position1",
        "--out",
        str(decoded),
        "--json",
        "-",
    ]
    said = subprocess.run(command, text=True, capture_output=True, check=False)
    positions = answer_of(1, Group.POSITIONS)
    return {
        "frames recorded, by candump": (sum(map(len, ours.values())), sum(map(len, theirs.values()))),
        "identifiers whose frames differ": missing,
        "positions of motor 1 recorded, by candump": (len(ours[positions]), len(theirs[positions])),
        "misfit hil decode": said.stderr.strip() or "a measurement set",
        "equal": len(ours[positions]) > POSITIONS and not missing and said.returncode == 0,
    }


def _contains(whole: list[bytes], part: list[bytes]) -> bool:
    """Whether the part stands in the whole without a gap."""
    return any(whole[k : k + len(part)] == part for k in range(len(whole) - len(part) + 1))


@contextmanager
def _beside(command: list[str], log: Path | None = None) -> Iterator[None]:
    """Run a program beside the rest."""
    with (log or OUT / "robot.txt").open("wb") as file:
        process = subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT)
        try:
            yield
        finally:
            process.terminate()
            process.wait()


def _until_it_answers(log: Path) -> None:
    """Ask the robot's first motor for its STAT until `candump` has heard an answer."""
    import can

    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        for _ in range(300):
            bus.send(can.Message(arbitration_id=1, data=[5], is_extended_id=False))
            if bus.recv(1.0) is not None and log.stat().st_size:
                break
    time.sleep(2.0)


if __name__ == "__main__":
    main()
