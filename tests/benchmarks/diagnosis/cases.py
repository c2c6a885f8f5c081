"""One case from its wish to its row, whatever happens on the way; what is done already is kept in files."""

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.benchmarks.diagnosis.baselines.cases import baselines_of
from tests.benchmarks.diagnosis.diagnose_cases import answer_of, diagnosis_after_experiment, diagnosis_of, write_json
from tests.benchmarks.diagnosis.scoring.judge import judge, judge_again
from tests.benchmarks.diagnosis.truth.families import Wish
from tests.benchmarks.diagnosis.truth.native import TruthError

TIME_IS_UP = "time is up"


@dataclass(frozen=True)
class Job:
    """A case to do by `deadline` (of the monotonic clock), a diagnosis in at most `limit_s`."""

    wish: Wish
    out: Path
    limit_s: float
    deadline: float


@dataclass(frozen=True)
class Done:
    """A case as it ended: its `row`, None if it was not diagnosed (`why`), and what baselines named."""

    name: str
    row: dict[str, Any] | None
    baselines: dict[str, Any] = field(default_factory=dict)
    why: str = ""


def do_case(job: Job) -> Done:
    """Make, diagnose and judge a case; one that has not begun when time is up stays as it is."""
    wish, out = job.wish, job.out
    begun = (out / "answers" / f"{wish.name}.json").exists()
    if not begun and time.monotonic() > job.deadline:
        return Done(wish.name, None, why=TIME_IS_UP)
    try:
        truth = answer_of(wish, out)
    except TruthError as error:
        return Done(wish.name, None, why=str(error))
    result = diagnosis_of(wish, out, job.limit_s)
    row = judge(wish.name, truth, result)
    row |= judge_again(truth, row, diagnosis_after_experiment(wish, out, job.limit_s))
    try:
        return Done(wish.name, row, baselines_of(wish, out))
    except Exception as error:  # a baseline that fails must not take the diagnosis' result with it
        write_json(out / "baselines" / f"{wish.name}.json", {"methods": {}, "failed": repr(error)})
        return Done(wish.name, row)


def lost_case(job: Job, error: Exception) -> Done:
    """The row of a case whose process ended: a failure of the diagnosis, as far as anybody can tell."""
    file = job.out / "answers" / f"{job.wish.name}.json"
    if not file.exists():
        return Done(job.wish.name, None, why=f"its process ended: {error!r}")
    result = {"failed": f"the process that diagnosed it ended: {error!r}"}
    write_json(job.out / "results" / f"{job.wish.name}.json", result)
    return do_case(job)
