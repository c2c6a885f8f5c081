"""A whole caregiver session: `python -m tests.benchmarks.hil.whole_session [--trials N] [--out DIR] [--no-discover]`.

Twenty-one trials on the virtual robot, whose arm has friction at the elbow that nobody is told of. The session is recorded,
replayed bit for bit, compared with the nominal arm; `misfit discover` adds what is missing, and the Gaussian-process block learns
it. Time is virtual: a session of three minutes takes about one on one core.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from hil.session.recorded import replay_session
from hil.trials.protocol import read_protocol
from tests.benchmarks.hil.held_out import error_ahead, learned_from, missing_torque, read_trials
from tests.hil.trial_session import FRICTION, run_trials


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=21)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--no-discover", action="store_true")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = (args.out or Path(name)) / "session"
        folder.parent.mkdir(parents=True, exist_ok=True)
        _session(folder, args.trials)
        _block(folder)
        if not args.no_discover:
            _discover(folder)


def _session(folder: Path, count: int) -> None:
    study = read_protocol("study")
    began = time.process_time()
    session = run_trials(folder, replace(study, trials=study.trials[:count], confirm=False))
    used, cycles = time.process_time() - began, session.summary.cycles
    print(f"{count} trials, {cycles} cycles at 500 Hz = {cycles / 500:.0f} s of session in {used:.0f} CPU s")
    print(f"faults: {session.summary.faults or 'none'}; answers missing: {session.summary.frames_lost}")
    began = time.process_time()
    found = replay_session(folder)
    used = time.process_time() - began
    same = "identical bit for bit" if found.first_different is None else f"cycle {found.first_different} DIFFERS"
    print(f"replayed {found.cycles} cycles: {same}, {found.cycles / 500 / used:.1f} times as fast as real time")


def _block(folder: Path) -> None:
    trials = read_trials(folder)
    kept = len(trials) - round(len(trials) / 3)
    corrections = learned_from(trials[:kept])
    before, after = missing_torque(trials[kept:], corrections)
    print(
        f"Gaussian-process block: learned from {kept} trials ({corrections.moments} moments), held out {len(trials) - kept}"
    )
    print(f"  missing torque, RMS N.m by joint:  {_pair(before)} without it, {_pair(after)} with it")
    without, with_block = error_ahead(trials[kept:], None), error_ahead(trials[kept:], corrections)
    print(
        f"  a quarter of a second ahead, RMS mrad: {_pair(1e3 * without)} without it, {_pair(1e3 * with_block)} with it"
    )


def _discover(folder: Path) -> None:
    result = folder.parent / "discover.json"
    command = [str(Path(sys.executable).with_name("misfit")), "discover", "arm", str(folder), "--workers", "1"]
    began = time.monotonic()
    done = subprocess.run(
        [*command, "--out", str(folder.parent / "found"), "--json", str(result)], capture_output=True, text=True
    )
    print(
        f"misfit discover (hidden: viscous friction of {FRICTION} N.m.s/rad at joint 2), {time.monotonic() - began:.0f} s:"
    )
    print("\n".join(f"  {line}" for line in (done.stdout + done.stderr).splitlines()[:14]))
    if result.exists():
        print(f"  result: {json.dumps(json.loads(result.read_text()))[:400]}")


def _pair(values: np.ndarray) -> str:
    return " and ".join(f"{value:.3g}" for value in values)


if __name__ == "__main__":
    main()
