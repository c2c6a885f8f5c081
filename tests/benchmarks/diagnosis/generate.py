"""Make cases: `python -m tests.benchmarks.diagnosis.generate --family S --plant arm --n 20 --seed 1 --out DIR`."""

import argparse
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tests.benchmarks.diagnosis.truth.families import FAMILIES, Wish, draw_case
from tests.benchmarks.diagnosis.truth.machines import MACHINES
from tests.benchmarks.diagnosis.truth.sensors import LEVELS
from tests.benchmarks.diagnosis.truth.write import write_case


def generate(wishes: Iterable[Wish], out: Path) -> dict[str, Any]:
    """Write the cases and `answers.json` of a folder; answers of earlier calls into it stay."""
    file = out / "answers.json"
    answers = json.loads(file.read_text()) if file.exists() else {"held_out_trials": [5, 6], "cases": {}}
    for wish in wishes:
        answers["cases"][wish.name] = write_case(draw_case(wish), out / wish.name)
    out.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(answers, indent=1) + "\n")
    return answers


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--family", choices=list(FAMILIES), required=True)
    parser.add_argument("--plant", choices=list(MACHINES), required=True)
    parser.add_argument("--n", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="index of the first case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--enr", type=float)
    parser.add_argument("--noise", choices=LEVELS)
    parser.add_argument("--seconds", type=float, default=10.0, help="length of a trial; tanks take 60 times as long")
    parser.add_argument("--effect", action="append", default=[], help="the effect itself; repeat for a set")
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    indices = range(args.first, args.first + args.n)
    more = {"enr": args.enr, "noise": args.noise, "seconds": args.seconds, "effects": tuple(args.effect)}
    answers = generate([Wish(args.family, args.plant, k, args.seed, **more) for k in indices], args.out)
    for name, case in answers["cases"].items():
        print(f"{name:30s} {'+'.join(case['effects']):40s} ENR {case['enr']:9.2f}  noise {case['noise_level']}")


if __name__ == "__main__":
    main()
