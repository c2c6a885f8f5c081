"""Run the benchmark of laws beyond the library: `python -m tests.benchmarks.laws.run RESULTS.jsonl`; cases that are done are left."""

import argparse
import json
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.discover import discover
from orchestrator.greybox.expression import evaluate_numbers
from orchestrator.greybox.laws import laws
from orchestrator.greybox.memory import memories
from orchestrator.greybox.places import coordinate
from orchestrator.laws.proposal import LawProposal
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import NamedEffect
from tests.benchmarks.laws.cases import CASES, Hidden
from tests.benchmarks.laws.plants import PLANTS, Plant
from tests.benchmarks.laws.truth import Truth, record

WORKERS = 2
RIGHT = 0.05


@dataclass(frozen=True)
class Score:
    """What came out of a case: `off` is the error of the proposed force as a share of the true one (rms, held-out trial)."""

    case: str
    seed: int
    verdict: str
    named: tuple[str, ...]
    proposed: str
    sentence: str
    beside: tuple[str, ...]
    off: float | None
    simplest: bool
    held_out_ratio: float | None
    library_ratio: float
    before_ratio: float
    worse: bool
    seconds: float
    processor_seconds: float


def score(case: Hidden, seed: int = 0, workers: int = WORKERS) -> Score:
    """Run one case; errors over several signals are root mean squares, in units of each one's noise."""
    plant = PLANTS[case.plant]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = record(case, folder, seed)
        source = find_modelica_model(f"{folder / plant.model}.mo:{plant.model}")
        began = time.monotonic(), time.process_time()
        found = discover(source, load_measurements(str(folder)), folder / "out", workers=workers)
        seconds, processor = time.monotonic() - began[0], time.process_time() - began[1]
    first = found.laws[0] if found.laws else None
    noise, held_out = truth[2].noise, found.diagnosis.held_out
    before = _over(held_out.rmse_before, noise)
    after = None if first is None else _over(first.held_out_after, noise)
    return Score(
        f"{case.plant}: {case.name}",
        seed,
        found.diagnosis.verdict,
        tuple(e.id for e in found.diagnosis.effects),
        "" if first is None else first.formula,
        "" if first is None else first.sentence,
        () if first is None else tuple(effect.id for effect in first.beside),
        None if first is None else _off(first, plant, case, truth[2]),
        first is not None and not first.beside and any(_is(first, terms) for terms in case.simplest),
        after,
        _over(held_out.rmse_after, noise),
        before,
        after is not None and after > 1.02 * before,
        seconds,
        processor,
    )


def _over(errors: Mapping[str, float], noise: Mapping[str, float]) -> float:
    return float(np.sqrt(np.mean([(errors[s] / noise[s]) ** 2 for s in noise])))


def _is(law: LawProposal, terms: frozenset[str]) -> bool:
    return any(law.id == "_and_".join(order)[:60] for order in permutations(terms))


def _off(law: LawProposal, plant: Plant, case: Hidden, truth: Truth) -> float:
    """Error of a proposal's force along the true held-out trial, with what effects beside it give; none where it acts elsewhere."""
    known = {name: truth.states[:, k] for k, name in enumerate(plant.names)} | {"u": truth.input, "time": truth.time}
    names = {key: coordinate(variable, known) for key, variable in zip(law.law.seen, law.coordinates, strict=True)}
    names |= {key: value.value for key, value in law.parameters.items()}
    names |= memories(law.law.states, names, truth.time)
    names |= _flows_in(plant, case, truth) if "net" in law.law.asks_for else {}
    force = np.asarray(evaluate_numbers(law.law.expression, names), dtype=float)
    for effect in law.beside:
        force = force + _shipped(effect, plant, known)
    signs = case.at or {plant.hit: 1}
    sites = [_site(plant, state) for state in signs]
    if (
        law.site not in (sites[0], *("-".join(order) for order in permutations(sites)))
        or "-" in law.site
        and len(sites) < 2
    ):
        return float("inf")
    sign = signs[next(iter(signs))] * (-1 if "-" in law.site and law.site.split("-")[0] != sites[0] else 1)
    return float(np.sqrt(np.mean((force - sign * truth.force) ** 2) / max(np.mean(truth.force**2), 1e-300)))


def _flows_in(plant: Plant, case: Hidden, truth: Truth) -> dict[str, Any]:
    """What the plant's balance multiplies its rate with, and what flows in without the hidden effect (n,)."""
    state = next(iter(case.at), plant.hit)
    k = plant.names.index(state)
    rates = np.array([plant.rates(u, list(y), {})[k] for u, y in zip(truth.input, truth.states, strict=True)])
    pushed = plant.rates(truth.input[0], list(truth.states[0]), {state: 1.0})[k]
    storage = 1.0 / (pushed - rates[0])
    return {"storage": storage, "net": storage * rates}


def _site(plant: Plant, state: str) -> str:
    """The name of a balance: the position whose speed the state is, else the state."""
    rate = f") = {state}"
    return next((e.removeprefix("der(").removesuffix(rate) for e in plant.equations if e.endswith(rate)), state)


def _shipped(effect: NamedEffect, plant: Plant, known: dict[str, np.ndarray]) -> np.ndarray:
    """The force of an effect of the library; no number for what changes a parameter, input or output, or acts between balances."""
    for law in laws():
        public = {p.name: next((n for n in (p.name, law.renamed.get("N.m", {}).get(p.name)) if n in effect.parameters), "") for p in law.parameters}  # fmt: skip
        # A speed is called by its position, which is a state as well.
        moving = sorted((s for s in plant.names if _site(plant, s) == effect.site), key=lambda s: s == effect.site)
        if (
            effect.id in (law.id, *law.names.values())
            and all(public.values())
            and law.place in ("motion", "storage")
            and moving
            and not law.states
            and "net" not in law.expression
        ):
            names = {"q": known[effect.site], "x": known[effect.site], "v": known[moving[0]], "t": known["time"]}
            names |= {key: np.float64(effect.parameters[name].value) for key, name in public.items()}
            return np.asarray(evaluate_numbers(law.expression, names), dtype=float)
    return np.full(len(known["time"]), np.nan)


def main() -> None:
    """Run cases, and add a line for each to the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("parts", nargs="*", help="parts of names of cases; all without")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--sample", type=int, default=0, help="so many cases, drawn by the seed")
    parser.add_argument("--workers", type=int, default=WORKERS)
    args = parser.parse_args()
    file: Path = args.results
    rows = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    done = {row["case"] for row in rows if row["seed"] == args.seed}
    cases = {f"{case.plant}: {case.name}": case for case in CASES}
    if args.sample:
        # In the drawn order, so that what has run so far is a sample, too.
        drawn = np.random.default_rng(args.seed).permutation(list(cases))[: args.sample]
        cases = {str(name): cases[str(name)] for name in drawn}
    for name, case in cases.items():
        if name in done or (args.parts and not any(part in name for part in args.parts)):
            continue
        found = score(case, args.seed, args.workers)
        with file.open("a") as stream:
            stream.write(json.dumps(asdict(found)) + "\n")
        print(f"{name}: {found.verdict} {found.named} | {found.proposed} {found.beside} off {found.off} ratio {found.held_out_ratio} of {found.before_ratio:.3g}, library {found.library_ratio:.3g} ({found.processor_seconds:.0f} s)", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
