"""Run the benchmark of laws beyond the library: `python -m tests.benchmarks.laws.run RESULTS.jsonl [PART OF A NAME ...]`; cases that are done are left."""

import json
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.discover import discover
from orchestrator.greybox.expression import evaluate_numbers
from orchestrator.greybox.laws import laws
from orchestrator.greybox.memory import remembered
from orchestrator.laws.proposal import LawProposal
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import NamedEffect
from tests.benchmarks.laws.cases import CASES, Hidden
from tests.benchmarks.laws.plants import PLANTS
from tests.benchmarks.laws.truth import Truth, record

WORKERS = 2
RIGHT = 0.05


@dataclass(frozen=True)
class Score:
    """What came out of a case: `off` is the error of the proposed force as a share of the true one (rms, held-out trial)."""

    case: str
    verdict: str
    named: tuple[str, ...]
    proposed: str
    sentence: str
    beside: tuple[str, ...]
    off: float | None
    simplest: bool
    held_out_ratio: float | None
    before_ratio: float
    worse: bool
    seconds: float


def score(case: Hidden, seed: int = 0) -> Score:
    """Run one case."""
    plant = PLANTS[case.plant]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = record(case, folder, seed)
        source = find_modelica_model(f"{folder / plant.model}.mo:{plant.model}")
        began = time.monotonic()
        found = discover(source, load_measurements(str(folder)), folder / "out", workers=WORKERS)
        seconds = time.monotonic() - began
    first = found.laws[0] if found.laws else None
    output, noise = plant.output[0], truth[2].noise
    before = found.diagnosis.held_out.rmse_before[output] / noise
    after = None if first is None else first.held_out_after[output] / noise
    off = None if first is None else _off(first, plant.states, truth[2])
    return Score(
        f"{case.plant}: {case.name}",
        found.diagnosis.verdict,
        tuple(e.id for e in found.diagnosis.effects),
        "" if first is None else first.formula,
        "" if first is None else first.sentence,
        () if first is None else tuple(effect.id for effect in first.beside),
        off,
        first is not None and not first.beside and any(_is(first, terms) for terms in case.simplest),
        after,
        before,
        after is not None and after > 1.02 * before,
        seconds,
    )


def _is(law: LawProposal, terms: frozenset[str]) -> bool:
    return any(law.id == "_and_".join(order) for order in (sorted(terms), sorted(terms, reverse=True)))


def _off(law: LawProposal, states: tuple[str, ...], truth: Truth) -> float:
    """Error of a proposal's force along the true held-out trial, without what effects beside it give."""
    known = {name: truth.states[:, k] for k, name in enumerate(states)} | {"u": truth.input, "time": truth.time}
    coordinates = {key: known[variable] for key, variable in zip(law.law.seen, law.coordinates, strict=True)}
    names = dict(coordinates) | {key: value.value for key, value in law.parameters.items()}
    for state, rate in law.law.states.items():
        names[state] = remembered(rate, state, names, truth.time)
    force = np.asarray(evaluate_numbers(law.law.expression, names), dtype=float)
    for effect in law.beside:
        force = force + _shipped(effect, states, known)
    return float(np.sqrt(np.mean((force - truth.force) ** 2) / max(np.mean(truth.force**2), 1e-300)))


def _shipped(effect: NamedEffect, states: tuple[str, ...], known: dict[str, np.ndarray]) -> np.ndarray:
    """The force of an effect of the library at the only balance; no number for what changes a parameter, input or output."""
    for law in laws():
        public = {p.name: next((n for n in (p.name, law.renamed.get("N.m", {}).get(p.name)) if n in effect.parameters), "") for p in law.parameters}  # fmt: skip
        moves = law.place == "motion" and len(states) == 2
        if effect.id in (law.id, *law.names.values()) and all(public.values()) and (moves or law.place == "storage"):
            speed = next((s for s in states if s != effect.site), effect.site)
            names = {"q": known[effect.site], "x": known[effect.site], "v": known[speed], "t": known["time"]}
            names |= {key: np.float64(effect.parameters[name].value) for key, name in public.items()}
            return np.asarray(evaluate_numbers(law.expression, names), dtype=float)
    return np.full(len(known["time"]), np.nan)


def main() -> None:
    results, *parts = sys.argv[1:]
    file = Path(results)
    done = {json.loads(line)["case"] for line in file.read_text().splitlines()} if file.exists() else set()
    for case in CASES:
        name = f"{case.plant}: {case.name}"
        if name in done or (parts and not any(part in name for part in parts)):
            continue
        found = score(case)
        with file.open("a") as stream:
            stream.write(json.dumps(asdict(found)) + "\n")
        print(f"{name}: {found.verdict} {found.named} | {found.proposed} off {found.off} ratio {found.held_out_ratio} of {found.before_ratio:.3g} ({found.seconds:.0f} s)", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
