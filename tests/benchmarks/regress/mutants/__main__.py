"""Mutation score of regression tests: `python -m tests.benchmarks.regress.mutants`; a run that was stopped goes on.

Mutants are one-line changes of the Modelica sources, built into FMUs and judged by `misfit regress`; whether one should
be caught says FMPy with a plain subtraction. Harmless rebuilds of the same models must all pass. Exit code 1 when fewer
than 99 % are caught or a rebuild fails.
"""

import argparse
import hashlib
import sys
import time
from pathlib import Path

from tests.benchmarks.regress.mutants.campaign import Campaign, Fate
from tests.benchmarks.regress.mutants.choose import chosen_mutants
from tests.benchmarks.regress.mutants.peers import seen_by_others
from tests.benchmarks.regress.mutants.rebuilds import run_rebuilds
from tests.benchmarks.regress.mutants.report import Found, report
from tests.benchmarks.regress.mutants.subjects import SUBJECTS
from tests.benchmarks.regress.mutants.workshop import Workshop

HERE = Path(__file__).parent
ROOT = HERE.parents[3]


def main() -> None:
    """Run what is left to run, then write the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--per-row", type=int, default=9, help="mutants of each operator row for each model")
    parser.add_argument("--budget", type=float, default=float("inf"), help="seconds after which no batch begins")
    parser.add_argument("--out", type=Path, default=ROOT / "build/bench-regress")
    parser.add_argument("--report", type=Path, default=ROOT / "docs/benchmarks/regress.md")
    arguments = parser.parse_args()
    until = time.perf_counter() + arguments.budget
    out = arguments.out / version()
    workshop = Workshop.open(out / "workshop")
    fates: list[Fate] = []
    others: dict[str, dict[str, bool]] = {}
    chosen = 0
    rebuilds: dict[str, dict[str, dict]] = {}
    for subject in SUBJECTS.values():
        campaign = Campaign(subject, out / subject.name, workshop)
        campaign.prepare()
        mutants = chosen_mutants(subject, arguments.per_row)
        campaign.run(mutants, until=until, clock=time.perf_counter)
        chosen += len(mutants)
        done = [campaign.fates[mutant.name] for mutant in mutants if mutant.name in campaign.fates]
        fates += done
        seen = seen_by_others(subject, campaign.folder, done)
        others |= {f"{subject.name} {name}": each for name, each in seen.items()}
        if time.perf_counter() < until:
            rebuilds[subject.name] = run_rebuilds(subject, campaign.folder, workshop)
        print(
            f"{subject.name}: {len(campaign.fates)} mutants, {len(rebuilds.get(subject.name, {}))} rebuilds", flush=True
        )
    found = Found(tuple(fates), chosen, rebuilds, others)
    arguments.report.parent.mkdir(parents=True, exist_ok=True)
    arguments.report.write_text(report(found))
    print(found.summary)
    if not found.meets_targets:
        sys.exit(1)


def version() -> str:
    """A name for what mutants depend on, so that their FMUs are not taken for those of other sources."""
    files = [HERE / name for name in ("subjects.py", "operators.py", "source_text.py", "workshop.py", "cases.py")]
    files += sorted((ROOT / "modelica").rglob("*.mo"))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:10]


if __name__ == "__main__":
    main()
