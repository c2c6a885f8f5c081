"""What blocks of `misfit learn` are worth: free-run errors along trials without them, with them, and of the true model.

    python -m tests.benchmarks.learn.run --fresh 24 --seed 2311 --out build/bench-learn --report docs/benchmarks/learn.md

A run that was stopped goes on where it was. Exit code 1 if a block that was written makes a case worse.
"""

import argparse
import json
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from fmus.files import write_atomically
from orchestrator.datacheck.holding import with_interpolation
from orchestrator.gp.from_trials import learn_missing
from orchestrator.gp.trials.judged import free_run_errors
from orchestrator.measurements import BoundSet, bind, load_measurements
from orchestrator.model_argument import load_modelica
from orchestrator.models.symbolic import SymbolicModel
from tests.benchmarks.learn.cases import Case, fresh, shipped, wishes
from tests.benchmarks.learn.page import page, worse


@dataclass(frozen=True)
class Row:
    """Errors in rad of a case over all signals: along held-out trials, and along further ones that learning never saw."""

    name: str
    hidden: str
    verdict: str
    reason: str
    without: float
    with_block: float
    true: float
    as_learned: float | None
    without_unseen: float | None
    with_unseen: float | None
    true_unseen: float | None
    noise: float
    seconds: float


def main() -> None:
    """Do the cases that are not done, print the table, write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fresh", type=int, default=24, help="how many fresh cases")
    parser.add_argument("--seed", type=int, default=2311)
    parser.add_argument("--out", type=Path, default=Path("build/bench-learn"))
    parser.add_argument("--report", type=Path, help="Markdown page to write")
    parser.add_argument("--no-more", action="store_true", help="begin no case; the page of what is done")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    rows = []
    with threadpool_limits(1, "blas"):
        for case in shipped():
            file = args.out / f"{case.name}.json"
            if file.exists() or not args.no_more:
                rows.append(_done(file, case))
        for wish in wishes(args.fresh, args.seed):
            file = args.out / f"{wish.name}.{args.seed}.json"
            if args.no_more and not file.exists():
                continue
            rows.append(Row(**json.loads(file.read_text())) if file.exists() else _done(file, fresh(wish, args.out)))
    if args.report:
        args.report.write_text(page([asdict(row) for row in rows], args.seed, args.fresh))
    sys.exit(1 if any(worse(asdict(row)) for row in rows) else 0)


def _done(file: Path, case: Case) -> Row:
    if file.exists():
        return Row(**json.loads(file.read_text()))
    row = _learned(case)
    write_atomically(file, json.dumps(asdict(row), indent=1).encode())
    print(
        f"{row.name:14s} {row.hidden[:40]:40s} {row.verdict:8s} {1e3 * row.without:9.3f} {1e3 * row.with_block:9.3f}"
        f" {1e3 * row.true:8.3f} mrad  {row.seconds:5.1f} s",
        flush=True,
    )
    return row


def _learned(case: Case) -> Row:
    """As `misfit learn` does it."""
    began = time.process_time()
    loaded = SymbolicModel("arm", load_modelica("arm").compile())
    data = _bound(loaded, case.data)
    model = loaded.restricted(data.output_names).with_held(data.trials[0].held)
    noise = np.array([data.noise_std[name] for name in data.output_names])
    found = learn_missing(model, data)
    seconds = time.process_time() - began
    judgement = found.judgement
    assert judgement is not None
    unseen: list[float | None] = [None, None]
    if case.unseen is not None:
        trials = _bound(loaded, case.unseen).trials
        alone = free_run_errors(model, None, trials, noise).all
        unseen = [alone, alone if found.block is None else free_run_errors(model, found.block, trials, noise).all]
    return Row(
        name=case.name,
        hidden=case.hidden,
        verdict=judgement.verdict,
        reason=judgement.reason,
        without=judgement.before.all,
        with_block=judgement.after.all,
        true=case.true,
        as_learned=judgement.refused.finite() if judgement.refused is not None else None,
        without_unseen=unseen[0],
        with_unseen=unseen[1],
        true_unseen=case.true_unseen,
        noise=float(np.sqrt(np.mean(noise**2))),
        seconds=seconds,
    )


def _bound(model: SymbolicModel, folder: Path) -> BoundSet:
    return bind(with_interpolation(model, load_measurements(folder)), model.inputs, model.outputs)


if __name__ == "__main__":
    main()
