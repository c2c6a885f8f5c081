"""What a campaign found, in words and tables."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from tests.benchmarks.regress.mutants.campaign import Fate
from tests.benchmarks.regress.mutants.operators import ALL_ROWS

LEAST_SCORE = 0.99
SIZES = (1.0, 2.0, 5.0, 20.0, 100.0, math.inf)
LEAST_MUTANTS = LEAST_REBUILDS = 200


@dataclass(frozen=True)
class Found:
    """Fates of mutants, how many were chosen, and outcomes of harmless rebuilds by model and name.

    `others` says by mutant which other tool sees it.
    """

    fates: tuple[Fate, ...]
    chosen: int
    rebuilds: Mapping[str, Mapping[str, Mapping[str, str]]]
    others: Mapping[str, Mapping[str, bool]] = field(default_factory=dict)

    def of(self, state: str, fates: Iterable[Fate] | None = None) -> list[Fate]:
        """Return the mutants of one state."""
        return [fate for fate in (self.fates if fates is None else fates) if fate.state == state]

    @property
    def score(self) -> float:
        """Killed over killed and survived; 1 without either."""
        killed, survived = len(self.of("killed")), len(self.of("survived"))
        return killed / (killed + survived) if killed + survived else 1.0

    @property
    def all_rebuilds(self) -> dict[str, Mapping[str, str]]:
        """Outcomes by "model name"."""
        return {f"{model} {name}": each for model, outcomes in self.rebuilds.items() for name, each in outcomes.items()}

    @property
    def failed_rebuilds(self) -> dict[str, Mapping[str, str]]:
        """Rebuilds that did not pass."""
        return {name: each for name, each in self.all_rebuilds.items() if each["verdict"] != "passed"}

    @property
    def alarms(self) -> list[Fate]:
        """Mutants below the tolerance that were called different nonetheless."""
        return [fate for fate in self.fates if fate.is_false_alarm]

    @property
    def meets_targets(self) -> bool:
        """At least 200 mutants and rebuilds, 99 % caught, none of the rebuilds failed."""
        enough = len(self.fates) >= LEAST_MUTANTS and len(self.all_rebuilds) >= LEAST_REBUILDS
        return enough and self.score >= LEAST_SCORE and not self.failed_rebuilds

    @property
    def summary(self) -> str:
        """One line."""
        return (
            f"{len(self.fates)} of {self.chosen} mutants: {len(self.of('killed'))} caught and "
            f"{len(self.of('survived'))} not ({100 * self.score:.1f} %), {len(self.of('equivalent'))} below the "
            f"tolerance ({len(self.alarms)} of them called different), {len(self.of('invalid'))} invalid; "
            f"{len(self.failed_rebuilds)} false alarms on {len(self.all_rebuilds)} rebuilds"
        )


def report(found: Found) -> str:
    """Return the page."""
    rows = [_row(row, [fate for fate in found.fates if fate.row == row], found) for row in ALL_ROWS]
    models = list(dict.fromkeys(fate.subject for fate in found.fates))
    by_model = [_row(model, [fate for fate in found.fates if fate.subject == model], found) for model in models]
    head = "| | mutants | caught | not caught | score | below the tolerance | invalid |\n|---|---|---|---|---|---|---|"
    return f"""# Mutation score of the regression tests

Written by `python -m tests.benchmarks.regress.mutants`. Each mutant is one changed line in the Modelica sources of an
arm, a muscle, a drive or two tanks, with effects in their slots; it is built into an FMU and judged by
`misfit regress` against the original's trajectory (0.1 % of each output's range). Whether it should be caught is
measured apart: FMPy simulates both, and the largest difference of any output at any sample is divided by the tolerance.
Where that is at most 1, the mutant is below the tolerance and does not count; where no FMU comes out or it does not
start, it is invalid. `when`, `reinit` and `pre` have no mutants, as the models have none of them.

**{found.summary}.**

{_others(found)}
## By operator row

{head}
{chr(10).join(rows)}

## By model

{head}
{chr(10).join(by_model)}

## By the size of the effect

{_sizes(found)}

## Not caught

{_listed([f"{each.subject}, {each.file}:{each.line}, {each.what}: effect {each.effect:.3g} times the tolerance" for each in found.of("survived")])}

## Harmless rebuilds

Other compiler flags, solver tolerances (1e-6, 1e-7 and 1e-9 where the reference has 1e-8) and steps (half, the same and
twice the reference's), all against the same reference.

{_rebuild_table(found)}

{_listed([f"{name}: {each['reason']}" for name, each in found.failed_rebuilds.items()])}

## Invalid mutants, by what refused them

{_listed([f"{count} x {reason}" for reason, count in _reasons(found)])}

## Called different below the tolerance

{_listed([f"{each.subject}, {each.file}:{each.line}, {each.what}: {each.effect:.3g} times the tolerance; {each.reason}" for each in found.alarms])}
"""


def _row(name: str, fates: list[Fate], found: Found) -> str:
    killed, survived = len(found.of("killed", fates)), len(found.of("survived", fates))
    score = f"{100 * killed / (killed + survived):.1f} %" if killed + survived else "-"
    equivalent, invalid = len(found.of("equivalent", fates)), len(found.of("invalid", fates))
    return f"| {name} | {len(fates)} | {killed} | {survived} | {score} | {equivalent} | {invalid} |"


def _sizes(found: Found) -> str:
    """Caught mutants by how far they are above the tolerance."""
    lines = ["| largest difference over the tolerance | mutants | caught |", "|---|---|---|"]
    for low, high in zip(SIZES[:-1], SIZES[1:], strict=True):
        fates = [fate for fate in found.fates if fate.effect is not None and low < fate.effect <= high]
        counted = [fate for fate in fates if fate.state in ("killed", "survived")]
        lines.append(f"| {low:g} to {high:g} | {len(counted)} | {len(found.of('killed', counted))} |")
    return "\n".join(lines)


def _others(found: Found) -> str:
    """What other tools see of the same mutants."""
    if not found.others:
        return ""
    tools = dict.fromkeys(tool for seen in found.others.values() for tool in seen)
    lines = []
    for tool in tools:
        count = sum(seen[tool] for seen in found.others.values())
        lines.append(f"| {tool} | {count} | {100 * count / len(found.others):.0f} % |")
    head = "Of those that should be caught, others see:\n\n| tool | caught | score |\n|---|---|---|"
    return f"{head}\n{chr(10).join(lines)}\n"


def _rebuild_table(found: Found) -> str:
    counts: Counter[str] = Counter()
    passed: Counter[str] = Counter()
    for name, each in found.all_rebuilds.items():
        build = name.split(" ", 1)[1].split("-1e")[0]
        counts[build] += 1
        passed[build] += each["verdict"] == "passed"
    lines = [f"| {build} | {count} | {count - passed[build]} |" for build, count in sorted(counts.items())]
    return "\n".join(["| build | rebuilds | false alarms |", "|---|---|---|", *lines])


def _reasons(found: Found) -> list[tuple[str, int]]:
    kinds = (
        ("units", "the check of units"),
        ("does not start", "the FMU does not start"),
        ("typecheck", "the compiler's check of types"),
        ("start condition", "a missing start condition"),
    )
    counts: Counter[str] = Counter()
    for fate in found.of("invalid"):
        counts[next((text for word, text in kinds if word in fate.reason), "the translator")] += 1
    return counts.most_common()


def _listed(lines: list[str]) -> str:
    return "\n".join(f"- {line}" for line in lines) or "None."
