"""What the rescue mechanisms of the search by free runs do, and what the answers are without them.

    python -m tests.benchmarks.house.ablation [--off NAME ...] [--seed N --families F ... --plants P ... --budget S] [--out DIR]

Each mechanism looks again at a fit that may have gone astray. Every case is diagnosed with all of them; where one of them gave anything
but what was there, also without any; where that changes the verdict, the effects or what they are confused with, without each that acted.
`--off NAME` leaves these mechanisms out of the first diagnosis, too. The cases are the shipped ones or, with `--seed`, those of the benchmark
`tests.benchmarks.diagnosis` of models with slots, in its order, until S seconds are over. What is done already is kept in DIR.
"""

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.diagnosis.search import fitting, proposals, search
from orchestrator.diagnosis.search.screening import Screener
from orchestrator.measurements import load_measurements
from orchestrator.models.patch import free_slots
from tests.benchmarks.diagnosis.child import run_child
from tests.benchmarks.diagnosis.diagnose_cases import answer_of
from tests.benchmarks.diagnosis.suite import suite
from tests.benchmarks.diagnosis.truth.families import FAMILIES
from tests.benchmarks.diagnosis.truth.machines import MACHINES
from tests.benchmarks.diagnosis.truth.native import TruthError

CASES = Path(__file__).parents[2] / "cases"
SHIPPED = {
    "pendulum": ("pendulum", "pendulum"),
    **{
        name: ("arm", f"arm/{name}")
        for name in ("case_003", "case_004", "case_007", "case_008", "case_009", "case_006")
    },
    "rat_muscle": ("rat-muscle", "rat_muscle"),
}
LIMIT_S = 240.0


def _same(self: Any, found: Any, *rest: Any) -> Any:
    """Nothing is done: the fit stays."""
    return found


def _none(*rest: Any) -> None:
    """Nothing is done: the fits stay as they are."""


def _no_set(*rest: Any) -> None:
    """Nothing is done: there is no other set."""


def _nothing(*rest: Any) -> list[Any]:
    """Nothing is done: there are no further sets or values."""
    return []


# Mechanism: where it is, its name there, and what doing nothing is.
MECHANISMS: dict[str, tuple[Any, str, Callable[..., Any]]] = {
    "growing stretches from first values": (fitting.Fitter, "from_first_stretch", _same),
    "growing stretches of contacts": (fitting.Fitter, "in_stretches", _same),
    "sets without what does not show": (fitting.Fitter, "pruned", _nothing),
    "sets with contacts that were lost": (fitting, "lost_contacts", _nothing),
    "another path": (search.Searcher, "_other_path", _no_set),
    "the metric of the best set": (search.Searcher, "_in_its_metric", _same),
    "effects left out that are none": (search.Searcher, "simplified", _same),
    "similar effects in another's place": (search.Searcher, "try_collinear", _none),
    "unions of fitted sets": (proposals, "unions", _nothing),
    "whole sets by first order": (proposals.Proposer, "_whole_sets", _nothing),
    "other peaks of the spectrum": (Screener, "_at_other_peaks", _nothing),
}


def _changed(idle: Callable[..., Any], arguments: tuple[Any, ...], given: Any) -> bool:
    """Whether a mechanism gave something else than doing nothing."""
    return given is not arguments[1] if idle is _same else bool(given)


def _fits(searcher: Any) -> list[int]:
    """Which fits a search has, for mechanisms that add to them."""
    return [id(fit) for fit in searcher.trace.refitted] if isinstance(searcher, search.Searcher) else []


def watch(off: set[str], asked: Counter[str], acted: Counter[str]) -> None:
    """Count what mechanisms do, and let some of them do nothing."""
    for name, (place, attribute, idle) in MECHANISMS.items():
        usual = getattr(place, attribute)

        def counted(*arguments: Any, name: str = name, usual: Any = usual, idle: Any = idle) -> Any:
            asked[name] += 1
            before = _fits(arguments[0])
            try:
                given = (idle if name in off or "all" in off else usual)(*arguments)
            except Exception:  # such as that trials are to be cut
                acted[name] += 1
                raise
            acted[name] += _fits(arguments[0]) != before if idle is _none else _changed(idle, arguments, given)
            return given

        setattr(place, attribute, counted)


def diagnosed(model: str, folder: Path, off: set[str]) -> dict[str, Any]:
    """Diagnose a folder without some mechanisms: the answer, CPU seconds, and what the others did."""
    asked, acted = Counter[str](), Counter[str]()
    watch(off, asked, acted)
    found = diagnose(find_modelica_model(model), load_measurements(folder), workers=1)
    return {
        "verdict": found.verdict,
        "effects": sorted(f"{e.id} at {e.site}" for e in found.effects),
        "confusable": sorted(sorted(group) for group in found.confusable),
        "left": max(found.held_out.rmse_after.values(), default=float("nan")),
        "cpu_s": time.process_time(),
        "asked": asked,
        "acted": acted,
    }


def _row(model: str, folder: Path, off: Sequence[str], file: Path) -> dict[str, Any]:
    """What a process of its own says of a case; one that fails or takes too long has the verdict `failed`."""
    if not file.exists():
        command = [sys.executable, "-m", "tests.benchmarks.house.ablation", "--one", model, str(folder), str(file)]
        ended = run_child([*command, "--off", *off], LIMIT_S, file.with_suffix(".txt"))
        if not file.exists():
            why = f"no result within {LIMIT_S:g} s" if ended.code is None else ended.said
            row = {"verdict": "failed", "effects": [], "confusable": [], "left": float("nan"), "cpu_s": ended.cpu_s}
            file.write_text(json.dumps(row | {"asked": {}, "acted": {}, "why": why}))
    row = json.loads(file.read_text())
    said = f"{row['verdict']} | {', '.join(row['effects'])} | {row['left']:.4g} | {row['cpu_s']:.0f}"
    print(f"| {folder.name} | {', '.join(off)} | {said} |", flush=True)
    return row


def _cases(seed: int | None, families: Sequence[str], plants: Sequence[str], out: Path) -> Iterator[tuple[str, Path]]:
    """Models and folders of the cases, which are made when they are asked for."""
    if seed is None:
        yield from ((model, CASES / folder) for model, folder in SHIPPED.values())
        return
    for wish in suite("medium", seed):
        if (
            wish.family in families
            and wish.machine in plants
            and free_slots(find_modelica_model(wish.machine).compile())
        ):
            try:
                truth = answer_of(wish, out)
            except TruthError:
                continue
            print(f"# {wish.name}: {', '.join(truth['effects'])} {truth['enr_each']}", flush=True)
            yield wish.machine, out / "cases" / wish.name


def _answer(row: dict[str, Any]) -> tuple[Any, ...]:
    return row["verdict"], row["effects"], row["confusable"]


def main() -> None:
    """Diagnose the cases, and print the rows."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--off", nargs="*", default=[], metavar="NAME")
    options.add_argument("--seed", type=int)
    options.add_argument("--families", nargs="*", default=list(FAMILIES), choices=list(FAMILIES))
    options.add_argument("--plants", nargs="*", default=list(MACHINES), choices=list(MACHINES))
    options.add_argument("--budget", type=float, default=float("inf"))
    options.add_argument("--out", type=Path, default=Path("build/ablation"))
    options.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    chosen = options.parse_args()
    if unknown := set(chosen.off) - {"all", *MECHANISMS}:
        options.error(f"no mechanism {unknown.pop()!r}; there are {', '.join(MECHANISMS)}")
    if chosen.one:
        model, folder, file = chosen.one
        Path(file).write_text(json.dumps(diagnosed(model, Path(folder), set(chosen.off))))
        return
    began, asked, acted = time.monotonic(), Counter[str](), Counter[str]()
    rows = chosen.out / "rows"
    rows.mkdir(parents=True, exist_ok=True)
    for model, folder in _cases(chosen.seed, chosen.families, chosen.plants, chosen.out):
        if time.monotonic() - began > chosen.budget:
            break
        usual = _row(model, folder, chosen.off, rows / f"{folder.name}.json")
        asked, acted = asked + Counter(usual["asked"]), acted + Counter(usual["acted"])
        did = [name for name in MECHANISMS if usual["acted"].get(name)]
        if (
            did
            and usual["verdict"] != "failed"
            and _answer(_row(model, folder, ["all"], rows / f"{folder.name}_all.json")) != _answer(usual)
        ):
            for k, name in enumerate(MECHANISMS):
                if name in did:
                    _row(model, folder, [name], rows / f"{folder.name}_{k}.json")
    for name in MECHANISMS:
        print(f"| {name} | {asked[name]} | {acted[name]} |", flush=True)


if __name__ == "__main__":
    main()
