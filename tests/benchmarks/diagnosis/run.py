"""The benchmark of the diagnosis: `python -m tests.benchmarks.diagnosis.run --size small`; see `make bench-diagnosis`.

Every case leaves files under the output folder: a later call with the same folder and the same code goes on where this
one stopped.
"""

import argparse
import subprocess
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from tests.benchmarks.diagnosis.baselines.cases import baselines_of
from tests.benchmarks.diagnosis.diagnose_cases import answer_of, diagnosis_of, write_json
from tests.benchmarks.diagnosis.report import write_report
from tests.benchmarks.diagnosis.scoring.judge import judge
from tests.benchmarks.diagnosis.suite import COUNTS, suite
from tests.benchmarks.diagnosis.truth.families import FAMILIES, Wish
from tests.benchmarks.diagnosis.truth.machines import MACHINES
from tests.benchmarks.diagnosis.version import code_version


def main() -> None:
    """Run from the command line."""
    args = _arguments()
    out = args.out / code_version()
    wishes = [
        wish
        for wish in suite(args.size)
        if wish.machine in (args.plant or MACHINES) and wish.family in (args.family or FAMILIES)
    ][: args.limit]
    began = time.monotonic()
    rows, named = [], dict[str, Any]()
    with ProcessPoolExecutor(args.workers) as pool:
        jobs = {pool.submit(_case, wish, out, args.timeout, began + args.budget): wish for wish in wishes}
        for job in as_completed(jobs):
            found = job.result()
            if found is not None:
                row, baselines = found
                rows.append(row)
                named[row["case"]] = baselines
                said = "+".join(row["said"]) or row["verdict"]
                print(f"{row['case']:32s} {'+'.join(row['true']) or 'none':42s} -> {said}", flush=True)
    order = {wish.name: k for k, wish in enumerate(wishes)}
    rows.sort(key=lambda row: order[row["case"]])
    write_report(
        rows, named, _about(args, len(rows), len(wishes), time.monotonic() - began), args.report, out / "scores.json"
    )
    print(f"{len(rows)} of {len(wishes)} cases; report: {args.report}")


def _case(wish: Wish, out: Path, timeout: float, deadline: float) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """Row and baselines of a case; None if it is not there and time is up."""
    done = (out / "results" / f"{wish.name}.json").exists() and (out / "baselines" / f"{wish.name}.json").exists()
    if not done and time.monotonic() > deadline:
        return None
    row = judge(wish.name, answer_of(wish, out), diagnosis_of(wish, out, timeout))
    try:
        return row, baselines_of(wish, out)
    except Exception as error:  # a baseline that fails must not take the diagnosis' result with it
        write_json(out / "baselines" / f"{wish.name}.json", {"methods": {}, "failed": repr(error)})
        return row, {}


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--size", choices=list(COUNTS), default="small")
    parser.add_argument("--out", type=Path, default=Path("build/bench-diagnosis"))
    parser.add_argument("--report", type=Path, default=Path("build/bench-diagnosis/diagnosis.md"))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--limit", type=int, help="only the first cases")
    parser.add_argument("--plant", action="append", choices=list(MACHINES))
    parser.add_argument("--family", action="append", choices=list(FAMILIES))
    parser.add_argument("--timeout", type=float, default=300.0, help="seconds that a diagnosis may take")
    parser.add_argument("--budget", type=float, default=float("inf"), help="seconds after which no new case begins")
    return parser.parse_args()


def _about(args: argparse.Namespace, done: int, wanted: int, seconds: float) -> str:
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    return (
        f"Size `{args.size}`: {done} of {wanted} cases at commit {commit or 'unknown'}, {args.workers} processes, "
        f"at most {args.timeout:g} s a case; this call took {seconds:.0f} s."
    )


if __name__ == "__main__":
    main()
