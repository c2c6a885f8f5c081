"""The benchmark of the diagnosis: `python -m tests.benchmarks.diagnosis.run --size small`; see `make bench-diagnosis`.

Every case leaves files under the output folder: a later call with the same folder and the same code goes on where this
one stopped.
"""

import argparse
import os
import subprocess
import time
from pathlib import Path

from tests.benchmarks.diagnosis.cases import Done, Job, do_case, lost_case
from tests.benchmarks.diagnosis.earlier import commits, folders_of, keep_commit
from tests.benchmarks.diagnosis.report import About, write_report
from tests.benchmarks.diagnosis.suite import SEED, SIZES, suite
from tests.benchmarks.diagnosis.truth.families import FAMILIES
from tests.benchmarks.diagnosis.truth.machines import MACHINES
from tests.benchmarks.diagnosis.version import code_version
from tests.benchmarks.diagnosis.workers import side_by_side


def main() -> None:
    """Run from the command line."""
    args = _arguments()
    out = args.out / f"{code_version()}_{args.seed}"
    wishes = [
        wish
        for wish in suite(args.size, args.seed)
        if wish.machine in (args.plant or MACHINES) and wish.family in (args.family or FAMILIES)
    ][: args.limit]
    began = time.monotonic()
    folders = folders_of(wishes, out, args.earlier)
    keep_commit(out, _commit())
    jobs = [Job(wish, folders[wish.name], args.limit_s, began + args.budget) for wish in wishes]
    done = []
    try:
        for case in side_by_side(do_case, lost_case, jobs, args.workers):
            done.append(case)
            _say(case)
    except KeyboardInterrupt:
        print(f"stopped; the same call goes on after the {len(done)} cases that are done", flush=True)
        os._exit(130)  # its workers notice; an ordinary end would wait for them
    order = {wish.name: k for k, wish in enumerate(wishes)}
    done.sort(key=lambda case: order[case.name])
    about = About(
        args.size,
        args.seed,
        len(wishes),
        commits([folders[case.name] for case in done if case.row is not None], out),
        args.workers,
        args.limit_s,
        args.budget,
        time.monotonic() - began,
    )
    write_report(done, about, args.report, out / "scores.json")
    print(f"{sum(case.row is not None for case in done)} of {len(wishes)} cases; report: {args.report}")


def _say(case: Done) -> None:
    if case.row is None:
        return
    row = case.row
    said = "+".join(row["said"]) or row["verdict"]
    then = f" -> {row['again']}" if row["again"] else ""
    print(f"{case.name:32s} {'+'.join(row['true']) or 'none':42s} -> {said}{then}", flush=True)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--size", choices=list(SIZES), default="small")
    parser.add_argument("--seed", type=int, default=SEED, help="another draw of cases of the same kinds")
    parser.add_argument("--out", type=Path, default=Path("build/bench-diagnosis"))
    parser.add_argument(
        "--earlier",
        type=Path,
        action="append",
        default=[],
        help="folder of other code's cases, which are not done again",
    )
    parser.add_argument("--report", type=Path, default=Path("build/bench-diagnosis/diagnosis.md"))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--limit", type=int, help="only the first cases")
    parser.add_argument("--plant", action="append", choices=list(MACHINES))
    parser.add_argument("--family", action="append", choices=list(FAMILIES))
    parser.add_argument("--limit-s", type=float, default=240.0, help="processor seconds that a diagnosis may take")
    parser.add_argument("--budget", type=float, default=float("inf"), help="seconds after which no new case begins")
    return parser.parse_args()


def _commit() -> str:
    done = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True)
    return done.stdout.strip() or "unknown"


if __name__ == "__main__":
    main()
