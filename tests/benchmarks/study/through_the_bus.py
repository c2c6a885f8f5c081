"""The study with corrections that travelled over the bus: sessions of trials on the virtual robot, then `misfit study caregivers --recorded`.

    python -m tests.benchmarks.study.through_the_bus --caregivers 8 --out build/study-bus

Sessions run without time on a bus inside the process, with the session's own cycle, safety core and recorder; each caregiver meets patterns
of their own and differs from the others in stiffness, strength and haste. Where the safety core ends a session (an arm that nobody can hold
becomes too fast), a next one goes on behind that trial, which is not asked for again. A session that is there is not run again.
"""

import argparse
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from hil.emulation.settings import MUSCLES
from hil.trials.protocol import Protocol, Trial, read_protocol
from hil.virtual.caregiver import Person
from orchestrator.study.recorded import study_of
from tests.hil.trial_session import run_trials

# Of the logarithm of each number of a caregiver, as in the simulated study.
SPREAD = 0.25
# Activations that people can hold against.
MOST = 0.25


def person_of(number: int) -> Person:
    """A caregiver, each number log-normal about the usual one; never faster than a person answers."""
    rng, usual = np.random.default_rng([number, 1]), vars(Person())
    found = {name: value * float(np.exp(SPREAD * rng.normal())) for name, value in usual.items()}
    return Person(**{**found, "reaction_s": float(np.clip(found["reaction_s"], 0.08, 0.5))})


def protocol_of(number: int, seed: int) -> Protocol:
    """The study's postures in an order of the caregiver's own, each with a pattern of its own."""
    whole, rng = read_protocol("study"), np.random.default_rng([seed, 2, number])
    patterns = rng.uniform(0.0, MOST, (len(whole.trials), MUSCLES))
    order = rng.permutation(len(whole.trials))
    trials = tuple(
        Trial(whole.trials[k].posture, tuple(map(float, row))) for k, row in zip(order, patterns, strict=True)
    )
    return replace(whole, trials=trials, confirm=False)


def sessions(out: Path, number: int, seed: int) -> tuple[list[Path], int]:
    """Folders of a caregiver's sessions that hold trials, and how many trials the safety core ended."""
    protocol, found, ended = protocol_of(number, seed), [], 0
    left = protocol.trials
    for part in range(1, 1 + len(left)):
        folder = out / f"caregiver_{number}_{part}"
        if not folder.exists():
            _record(folder, replace(protocol, trials=left), number)
        count = len(list(folder.glob("trial_*.parquet")))
        found += [folder] if count else []
        ended += count < len(left)
        left = left[count + 1 :]
        if not left:
            break
    return found, ended


def _record(folder: Path, protocol: Protocol, number: int) -> None:
    begun = folder.with_name(f"begun_{folder.name}")
    shutil.rmtree(begun, ignore_errors=True)
    with threadpool_limits(1, "blas"):
        session = run_trials(begun, protocol, body="arm", person=person_of(number))
    begun.rename(folder)
    print(f"{folder.name}: {'; '.join(session.summary.faults[:1]) or 'all trials done'}", flush=True)


def main() -> None:
    """Run the sessions that are missing, then the study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--caregivers", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("build/study-bus"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    folders: list[str] = []
    for number in range(1, args.caregivers + 1):
        more, ended = sessions(args.out, number, args.seed)
        folders += map(str, more)
        print(f"caregiver {number}: {len(more)} sessions, {ended} trials ended by the safety core", flush=True)
    found = study_of(folders, args.seed, lambda said: None)
    (args.out / "study.json").write_text(json.dumps(found, indent=1))
    print(f"{found['corrections']} corrections")
    for name, way in found["ways"].items():
        gains = " ".join(f"{gain:7.1f}" for gain in way["improvement"].values())
        inside = "" if way["coverage_90"] is None else f"  inside {100.0 * way['coverage_90']:.0f} %"
        print(f"{name:24s} {way['used']:5d} {gains}  strong {way['strong_four']:6.1f}{inside}")


if __name__ == "__main__":
    main()
