"""Cases of `misfit learn`: shipped ones, and fresh ones of the separate truth simulator with trials that nobody judges a block by."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.benchmarks.diagnosis.truth.excitation import plan_trial
from tests.benchmarks.diagnosis.truth.families import HELD_OUT, TRIALS, Drawn, Wish, draw_case
from tests.benchmarks.diagnosis.truth.write import _on_grid, _true_error, write_measurements

ROOT = Path(__file__).parents[3]
SHIPPED = ROOT / "tests/cases/arm"
# Families of fresh cases and how many of each 12: one effect, one that is in no library, nothing.
SHARES = {"S": 10, "O": 1, "N1": 1}
UNSEEN = 2


@dataclass(frozen=True)
class Case:
    """A measurement set to learn from, and a set of further trials that learning never sees (None for shipped cases).

    `hidden` says what the truth has that the model lacks; `true` and `true_unseen` are the errors in rad of free runs of
    the true model along the held-out and the further trials.
    """

    name: str
    hidden: str
    data: Path
    unseen: Path | None
    true: float
    true_unseen: float | None


def shipped() -> Iterator[Case]:
    """All arm cases that the repository has."""
    answers = json.loads((SHIPPED / "answers.json").read_text())["cases"]
    for folder in sorted(SHIPPED.glob("case_*")):
        answer = answers[folder.name]
        hidden = " + ".join(str(each.get("kind", each["effect"])) for each in answer["parameters"]) or "nothing"
        yield Case(folder.name, hidden, folder, None, answer["true_model_rmse_heldout_rad"], None)


def wishes(count: int, seed: int) -> list[Wish]:
    """`count` fresh cases of the arm, of all families in their shares."""
    one_round = [family for family, share in SHARES.items() for _ in range(share)]
    families = [one_round[k % len(one_round)] for k in range(count)]
    return [Wish(family, "arm", families[:k].count(family), seed) for k, family in enumerate(families)]


def fresh(wish: Wish, folder: Path) -> Case:
    """Draw a case and write its measurement sets."""
    drawn = draw_case(wish)
    random = np.random.default_rng([wish.seed, wish.index, 11])
    further = [plan_trial(drawn.machine, TRIALS + k, wish.seconds, random) for k in range(UNSEEN)]
    data, unseen = folder / wish.name, folder / f"{wish.name}_unseen"
    records = write_measurements(drawn, data, further)
    plans = [*drawn.plans, *further]
    true = [
        _true_error(
            drawn,
            plan,
            _on_grid(drawn, run, columns),
            columns["time"],
            np.column_stack([columns[name] for name in drawn.machine.outputs]),
        )
        for plan, (run, columns) in list(zip(plans, records, strict=True))[TRIALS - len(HELD_OUT) :]
    ]
    _split(data, unseen)
    judged, rest = true[: len(HELD_OUT)], true[len(HELD_OUT) :]
    return Case(wish.name, _hidden(drawn), data, unseen, _rms(judged), _rms(rest))


def _hidden(drawn: Drawn) -> str:
    names = [f"{each.id or drawn.kind} ({each.site})" if each.site else each.id for each in drawn.injections]
    found = " + ".join(names) or "nothing, tolerances of 5 %"
    return f"{drawn.kind}, in no library" if drawn.kind else found


def _split(data: Path, unseen: Path) -> None:
    """Move the further trials into a set of their own."""
    text = (data / "case.toml").read_text()
    rest = [f"trial_{TRIALS + k + 1:02d}.csv" for k in range(UNSEEN)]
    lines = text.splitlines()
    ours = [f"trial_{k:02d}.csv" for k in range(1, TRIALS + 1)]
    learning = [k for k in range(1, TRIALS + 1) if k not in HELD_OUT]
    for folder, files, learned, kept in ((data, ours, learning, list(HELD_OUT)), (unseen, rest, [1], [2])):
        folder.mkdir(exist_ok=True)
        said = {"files": json.dumps(files), "learning": str(learned), "held_out": str(kept)}
        changed = [f"{key} = {said[key]}" if (key := line.split(" = ")[0]) in said else line for line in lines]
        (folder / "case.toml").write_text("\n".join(changed) + "\n")
    for name in rest:
        (data / name).replace(unseen / name)


def _rms(squares: list[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(squares)))
