"""The headline of the study over ten seeds or more, without draws and side variants: in a tenth of the time of `misfit study caregivers`.

    python tests/benchmarks/study/ten_seeds.py [--seeds 10] [--out build/ten_seeds.md]

For both strengths of caregivers: what the four strong muscles and each muscle gain, with the mean, its 90 % interval and the worst seed; the line of
errors; the bars.
"""

import argparse
import pickle
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from orchestrator.study.muscles import MUSCLES
from orchestrator.study.regression import errors_at
from orchestrator.study.researcher import SETS
from orchestrator.study.study import LIMITS, Case, CollectTask, ModelsTask, Study
from orchestrator.study.summary import bars, chosen, improvements, lines, over, strong_mean
from orchestrator.study.variants import Setting, outcome

# Ways of which each muscle is told.
EACH = ("joint", "compensated", "refitted")
WAYS = ("joint", "without velocity", "clear of stops", "compensated", "refitted")
Found = tuple[list[Case], dict[tuple[int, float], tuple], int]


def one_seed(seed: int) -> Found:
    """All ways for both strengths; errors of the corrections; how many there are."""
    models = [ModelsTask(seed, SETS["small"], sees).run() for sees in (True, False)]
    cases: list[Case] = []
    errors, count = {}, 0
    for limit in LIMITS:
        corrections = CollectTask(seed, limit, 8).run()
        count = len(corrections)
        errors[seed, limit] = errors_at(corrections, corrections.state), errors_at(corrections, corrections.goal)
        setting = Setting(models[0], models[1], corrections)
        cases += [Case(seed, "small", limit, way, outcome(way, setting)) for way in WAYS]
    return cases, errors, count


def page(study: Study) -> Iterator[str]:
    """Tables as Markdown."""
    yield "| way to learn | strength | strong four, % | mean, 90 % interval | least muscle, median | least muscle, worst seed |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for limit in LIMITS:
        for way in WAYS:
            cases = chosen(study, way, "small", limit)
            strong, each = strong_mean(cases), improvements(cases)
            yield (
                f"| {way} | {limit:g} N | {strong.median:.1f} ({strong.low:.1f}…{strong.high:.1f}) | "
                f"{strong.mean:.1f} ({strong.ci90[0]:.1f}…{strong.ci90[1]:.1f}) | {min(m.median for m in each):.1f} | "
                f"{min(m.low for m in each):.1f} ({MUSCLES[int(np.argmin([m.low for m in each]))]}) |"
            )
    yield ""
    yield "Each muscle: mean over the seeds (its 90 % interval), and the worst seed, %."
    yield ""
    yield "| way to learn | strength | " + " | ".join(MUSCLES) + " |"
    yield "| --- | --- |" + " --- |" * len(MUSCLES)
    for limit in LIMITS:
        for way in EACH:
            cells = [
                f"{m.mean:.0f} ({m.ci90[0]:.0f}…{m.ci90[1]:.0f}), {m.low:.0f}"
                for m in improvements(chosen(study, way, "small", limit))
            ]
            yield f"| {way} | {limit:g} N | {' | '.join(cells)} |"
    yield ""
    yield "Error of a correction against the required force: mean over the seeds (its 90 % interval)."
    yield ""
    yield "| perfect correction at | strength | slope | intercept, N | R2 |"
    yield "| --- | --- | --- | --- | --- |"
    for limit in LIMITS:
        for goal, where in enumerate(("actual state", "goal posture")):
            cells = [
                f"{o.mean:{form}} ({o.ci90[0]:{form}}…{o.ci90[1]:{form}})"
                for name, form in (("slope", ".2f"), ("intercept", ".0f"), ("r2", ".2f"))
                for o in [over(getattr(line, name) for line in lines(study, limit, bool(goal)))]
            ]
            yield f"| {where} | {limit:g} N | {' | '.join(cells)} |"
    yield ""
    yield "| claim | found | bar | |"
    yield "| --- | --- | --- | --- |"
    for bar in bars(study):
        wanted = f"{bar.low:g} or more" if bar.high == float("inf") else f"{bar.low:g} to {bar.high:g}"
        yield f"| {bar.claim} | {bar.found:.2f} | {wanted} | {'met' if bar.met else '**not met**'} |"


def main() -> None:
    """Print the tables; a seed that was done is not done again."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--out", type=Path, default=Path("build/ten_seeds.md"))
    args = parser.parse_args()
    args.out.parent.mkdir(parents=True, exist_ok=True)
    seeds = tuple(range(1, 1 + args.seeds))
    cases: list[Case] = []
    errors, count = {}, 0
    for seed in seeds:
        kept = args.out.with_name(f"{args.out.stem}_{seed}.pickle")
        if not kept.exists():
            with threadpool_limits(1, "blas"):
                kept.write_bytes(pickle.dumps(one_seed(seed)))
            print(f"seed {seed} done", flush=True)
        more, seen, count = pickle.loads(kept.read_bytes())  # noqa: S301 - written by this script
        cases, errors = [*cases, *more], errors | seen
    args.out.write_text("\n".join(page(Study(count, seeds, 0, errors, tuple(cases), ()))) + "\n")
    print(args.out.read_text())


if __name__ == "__main__":
    main()
