"""Barrett's own library as a client of the virtual robot: `python -m tests.benchmarks.hil.libbarrett.run LIBBARRETT --eigen FOLDER`.

LIBBARRETT is a checkout of the library, which is not shipped; FOLDER holds Eigen 2. Needs g++, boost (thread), gsl, libconfig++ and
curses. The library's frames are compared with this project's codecs, what it reads of the virtual robot with what that was given,
and its `Wam<3>` runs a loop, whose answers are counted. Exit code 1 if anything differs, 3 if it cannot be built.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hil.codecs.barrett.force_torque import unpack_reading
from hil.codecs.barrett.identifiers import Group, answer_of, to_group
from hil.codecs.barrett.positions import motor_counts
from hil.codecs.barrett.torques import pack_torques, saturated
from hil.codecs.frame import Frame, parse_frame
from hil.control.timing import real_time_priority
from hil.robots import proficio
from hil.virtual.process import virtual_robot
from tests.benchmarks.hil.libbarrett.build import NotBuilt, build

POSITIONS = frozenset(answer_of(k, Group.POSITIONS) for k in (1, 2, 3))
TORQUES = to_group(Group.LOWER_TORQUES)
_FRAMES, TRIES = 30_000, 5
# The transmission in the library's example differs from the Proficio's in the third joint.
_JOINT_TO_MOTOR = np.array([[-8.51, 15.19643, 0.0], [8.51, 15.19643, 0.0], [0.0, 0.0, 9.57]])


class Facts(dict[str, list[list[str]]]):
    """What the client said: lists of words by the first one."""

    @staticmethod
    def of(text: str) -> "Facts":
        """Read its lines."""
        found = Facts()
        for line in text.splitlines():
            name, *words = line.split()
            found.setdefault(name, []).append(words)
        return found


def same_frames(facts: Facts) -> Iterator[tuple[str, bool, str]]:
    """Torques that the library packs, positions and forces that it reads, beside the codecs of this project."""
    torques = [(int(k, 16), bytes.fromhex(data), list(map(float, rest))) for k, data, *rest in facts["torques"]]
    wrong = sum(k != TORQUES or data != pack_torques(saturated(values)) for k, data, values in torques)
    yield "torques packed alike", wrong == 0, f"{len(torques)} frames, {wrong} differ"
    positions = [(bytes.fromhex(data), int(counts)) for data, counts in facts["position"]]
    wrong = sum(motor_counts(data) != counts for data, counts in positions)
    yield "positions read alike", wrong == 0, f"{len(positions)} frames, {wrong} differ"
    forces = [(bytes.fromhex(data), tuple(map(float, rest))) for data, *rest in facts["force"]]
    wrong = sum(unpack_reading(Group.FORCE, data)[:3] != values for data, values in forces)
    yield "forces read alike", wrong == 0, f"{len(forces)} frames, {wrong} differ"


def same_robot(facts: Facts) -> Iterator[tuple[str, bool, str]]:
    """What the library found of the virtual robot, beside what that was made of."""
    found = " ".join(facts["found"][0])
    yield "a Wam<3> with module and sensor", found == "wam3 1 wam4 0 wam7 0 module 1 sensor 1 hand 0", found
    nodes = {int(number): " ".join(words) for number, *words in facts["puck"]}
    yield "nodes", sorted(nodes) == [1, 2, 3, 8, 10], "; ".join(f"{k}: {words}" for k, words in sorted(nodes.items()))
    properties = {(int(node), name): int(value) for node, name, value in facts["property"]}
    scales = proficio.Controller()
    expected = {"CTS": scales.counts, "IPNM": round(scales.torque_units), "STAT": 2, "ERROR": 0}
    for name, value in expected.items():
        said = [properties[node, name] for node in (1, 2, 3)]
        yield f"property {name}", said == [value] * 3, f"{said}"
    others = sorted({name for _, name in properties} - expected.keys())
    said = ", ".join(f"{name} {[properties[node, name] for node in (1, 2, 3)]}" for name in others)
    yield "other properties are answered", True, said
    yield (
        "idle, and not zeroed yet",
        " ".join(facts["zeroed"][0]) == "0 mode 1",
        "zeroed " + " ".join(facts["zeroed"][0]),
    )
    before, changed, restored = (" ".join(facts[name][0]) for name in ("limits", "changed", "restored"))
    yield (
        "TL and VL of the module are set and restored",
        before == restored != changed,
        f"{before} -> {changed} -> {restored}",
    )
    yield "a force of the sensor", len(facts["force"][0]) == 3, " ".join(facts["force"][0])
    for wanted, heard in ((words[:3], words[4:]) for words in facts["asked"]):
        motors = np.linalg.inv(_JOINT_TO_MOTOR).T @ np.array(list(map(float, wanted)))
        units = [int(np.floor(units)) for units in motors * scales.torque_units]
        yield (
            f"torques {' '.join(wanted)} N.m",
            units == list(map(int, heard)),
            f"T {' '.join(heard)}, expected {units}",
        )


def same_loop(facts: Facts, log: Path) -> Iterator[tuple[str, bool, str]]:
    """How the library's own loop fared: answers to its questions for positions, and where its arm went."""
    frames = [(float(at), way, parse_frame(text)) for at, way, text in map(str.split, log.read_text().splitlines())]
    asked, trips, waiting = 0, list[float](), dict[int, float]()
    question = _question(frames)
    for at, way, frame in frames:
        if way == "T" and frame == question:
            asked += 1
            waiting = dict.fromkeys(POSITIONS, at)
        elif way == "R" and frame.identifier in waiting:
            trips.append(at - waiting.pop(frame.identifier))
    torques = sum(way == "T" and frame.identifier == TORQUES for _, way, frame in frames)
    lost = 3 * asked - len(trips)
    p50, p99 = np.percentile(trips, [50, 99]) * 1e3
    words = f"{asked} questions, {lost} answers lost, {p50:.2f} ms (50 %), {p99:.2f} ms (99 %), {torques} torque frames"
    yield "positions of the loop are answered", asked > 0 and lost <= 3, words
    start, wanted, reached = (np.array(list(map(float, facts[name][0]))) for name in ("start", "wanted", "reached"))
    error, moved = float(np.abs(wanted - reached).max()), float(np.abs(reached - start).max())
    words = f"moved by {moved:.3f} rad, off by {1e3 * error:.2f} mrad"
    yield "the arm goes where the library wants it", moved > 0.1 and error < 0.05, words
    yield "idle at the end", facts["mode"][0] == ["1"], f"mode {facts['mode'][0][0]}"


def _question(frames: list[tuple[float, str, Frame]]) -> Frame:
    """The frame that the loop sends again and again and that is no torque."""
    sent = [frame for _, way, frame in frames if way == "T" and frame.identifier == to_group(Group.ARM)]
    return max(set(sent), key=sent.count)


def main() -> None:
    """Build, run and compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source", type=Path, help="a checkout of libbarrett")
    parser.add_argument("--eigen", type=Path, required=True, help="the folder with Eigen 2")
    parser.add_argument("--build", type=Path, default=Path("build/libbarrett"), help="where to build")
    parser.add_argument("--seconds", type=float, default=5.0, help="of the loop")
    args = parser.parse_args()
    try:
        client = build(args.source.resolve(), args.eigen.resolve(), args.build.resolve())
    except NotBuilt as error:
        print(error)
        sys.exit(3)
    config = str(client.parent / "source/config/default.conf")
    found = list(same_frames(_said(client, "frames", str(_FRAMES))))
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        found += same_robot(_with_robot(client, "robot", config))
        found += same_loop(_with_robot(client, "loop", config, str(args.seconds), log=log), log)
    for name, good, words in found:
        print(f"{'ok ' if good else 'BAD'}  {name}: {words}")
    sys.exit(0 if all(good for _, good, _ in found) else 1)


def _with_robot(client: Path, *words: str, log: Path | None = None) -> Facts:
    """Run the client beside a fresh virtual robot, both with priority where that is permitted: the library waits some
    milliseconds for answers and takes those that come later for answers to its next question."""
    for left in range(TRIES - 1, -1, -1):
        with real_time_priority(), virtual_robot() as bus:
            facts = _said(client, *words, port=bus["port"], log=log, may_fail=left > 0)
        if facts:
            return facts
        print(
            f"tried again: the robot answered the library's {words[0]} too late, as other work keeps this machine busy"
        )
    raise AssertionError("not reached")


def _said(client: Path, *words: str, port: object = "", log: Path | None = None, may_fail: bool = False) -> Facts:
    """Run the client; what it said, nothing if it failed and may."""
    shim = {"LD_PRELOAD": str(client.with_name("can_shim.so")), "CAN_SHIM_PORT": str(port)} if port else {}
    environment = {**os.environ, **shim, **({"CAN_SHIM_LOG": str(log)} if log is not None else {})}
    done = subprocess.run([str(client), *words], env=environment, capture_output=True, text=True, timeout=120)
    if done.returncode != 0 and may_fail:
        return Facts()
    if done.returncode != 0:
        print(f"the client failed ({done.returncode}): {done.stdout[-500:]} {done.stderr[-500:]}")
        sys.exit(1)
    return Facts.of(done.stdout)


if __name__ == "__main__":
    main()
