"""The study with corrections that travelled over the bus: sessions of trials on the virtual robot, then `misfit study caregivers --recorded`.

    python -m tests.benchmarks.study.through_the_bus --caregivers 8 --out build/study-bus

Sessions run without time on a bus inside the process, with the session's own cycle, safety core and recorder; each caregiver meets patterns
of their own and differs from the others in stiffness, strength and haste. A session that is there is not run again.
"""

import argparse
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from hil.emulation.settings import MUSCLES
from hil.trials.protocol import Trial, read_protocol
from hil.virtual.caregiver import Person
from orchestrator.study.recorded import study_of
from tests.hil.trial_session import run_trials

# Of the logarithm of each number of a caregiver, as in the simulated study.
SPREAD = 0.25


def person_of(number: int) -> Person:
    """A caregiver, each number log-normal about the usual one; never faster than a person answers."""
    rng, usual = np.random.default_rng([number, 1]), vars(Person())
    found = {name: value * float(np.exp(SPREAD * rng.normal())) for name, value in usual.items()}
    return Person(**{**found, "reaction_s": float(np.clip(found["reaction_s"], 0.08, 0.5))})


def main() -> None:
    """Run the sessions that are missing, then the study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--caregivers", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("build/study-bus"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    whole, folders = read_protocol("study"), []
    for number in range(1, args.caregivers + 1):
        folder, begun = args.out / f"caregiver_{number}", args.out / f"begun_{number}"
        folders.append(str(folder))
        if folder.exists():
            continue
        shutil.rmtree(begun, ignore_errors=True)
        rng = np.random.default_rng([args.seed, 2, number])
        patterns = rng.uniform(0.0, 0.25, (len(whole.trials), MUSCLES))
        order = rng.permutation(len(whole.trials))
        trials = tuple(
            Trial(whole.trials[k].posture, tuple(map(float, row))) for k, row in zip(order, patterns, strict=True)
        )
        with threadpool_limits(1, "blas"):
            run_trials(begun, replace(whole, trials=trials, confirm=False), body="arm", person=person_of(number))
        begun.rename(folder)
        print(f"caregiver {number}: recorded", flush=True)
    found = study_of(folders, args.seed, lambda said: None)
    (args.out / "study.json").write_text(json.dumps(found, indent=1))
    for name, way in found["ways"].items():
        gains = " ".join(f"{gain:7.1f}" for gain in way["improvement"].values())
        print(f"{name:24s} {way['used']:5d} {gains}  strong {way['strong_four']:6.1f}")


if __name__ == "__main__":
    main()
