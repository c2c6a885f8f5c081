"""What the rescue mechanisms of the search by free runs do on the shipped cases, and what the answers are without them.

    python -m tests.benchmarks.house.ablation [--off NAME ...] [--cases NAME ...]

Each mechanism looks again at a fit that may have gone astray. A row a case: verdict, effects, CPU seconds; then a row a mechanism: how often
it was asked, and how often what it gave differs from doing nothing. `--off NAME` makes a mechanism do nothing, `--off all` every one.
"""

import argparse
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.diagnosis.search import fitting, proposals, search
from orchestrator.diagnosis.search.screening import Screener
from orchestrator.measurements import load_measurements

CASES = Path(__file__).parents[2] / "cases"
SHIPPED = {
    "pendulum": ("pendulum", "pendulum"),
    **{
        name: ("arm", f"arm/{name}")
        for name in ("case_003", "case_004", "case_007", "case_008", "case_009", "case_006")
    },
    "rat_muscle": ("rat-muscle", "rat_muscle"),
}


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
    "other points of a grid": (fitting.Fitter, "_from_elsewhere", _same),
    "an effect started anew beside the others": (fitting.Fitter, "put_back", _same),
    "minima along a valley": (fitting.Fitter, "along_valleys", _same),
    "sets without what does not show": (fitting.Fitter, "pruned", _nothing),
    "sets with contacts that were lost": (fitting, "lost_contacts", _nothing),
    "another path": (search.Searcher, "_other_path", _no_set),
    "the metric of the best set": (search.Searcher, "_in_its_metric", _same),
    "effects left out that are none": (search.Searcher, "simplified", _same),
    "similar effects in another's place": (search.Searcher, "try_collinear", _none),
    "rivals fitted to the end": (search.Searcher, "_finish_rivals", _none),
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
            given = (idle if name in off or "all" in off else usual)(*arguments)
            acted[name] += _fits(arguments[0]) != before if idle is _none else _changed(idle, arguments, given)
            return given

        setattr(place, attribute, counted)


def main() -> None:
    """Diagnose the cases, and print the rows."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--off", nargs="*", default=[], metavar="NAME")
    options.add_argument("--cases", nargs="*", default=list(SHIPPED), choices=list(SHIPPED))
    chosen = options.parse_args()
    unknown = set(chosen.off) - {"all", *MECHANISMS}
    if unknown:
        options.error(f"no mechanism {unknown.pop()!r}; there are {', '.join(MECHANISMS)}")
    asked, acted = Counter[str](), Counter[str]()
    watch(set(chosen.off), asked, acted)
    for case in chosen.cases:
        model, folder = SHIPPED[case]
        begun = time.process_time()
        found = diagnose(find_modelica_model(model), load_measurements(CASES / folder), workers=1)
        effects = ", ".join(f"{e.id} at {e.site}" for e in found.effects)
        left = max(found.held_out.rmse_after.values())
        print(f"| {case} | {found.verdict} | {effects} | {left:.4g} | {time.process_time() - begun:.0f} |", flush=True)
    for name in MECHANISMS:
        print(f"| {name} | {asked[name]} | {acted[name]} |", flush=True)


if __name__ == "__main__":
    main()
