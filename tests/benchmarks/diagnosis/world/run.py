"""Diagnose cases that look like the world: `python -m tests.benchmarks.diagnosis.world.run --n 2 --seed 1 --out DIR`."""

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from orchestrator.datacheck.check import check_data
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_model
from tests.benchmarks.diagnosis.diagnose_cases import diagnose_folder, write_json
from tests.benchmarks.diagnosis.scoring.wilson import Share
from tests.benchmarks.diagnosis.truth.native import TruthError
from tests.benchmarks.diagnosis.world.baselines import named_by_baselines
from tests.benchmarks.diagnosis.world.families import TITLES, WORLD, WorldWish, make_case

METHODS = ("misfit", "stepwise BIC", "stepwise cross-validation", "multiple shooting")


def do_case(wish: WorldWish, out: Path, limit_s: float, parts: Sequence[str]) -> dict[str, Any]:
    """The row of a case: what the data check found, what each method named; what is done already is kept."""
    folder = out / "cases" / wish.name
    answer = kept(out / "answers" / f"{wish.name}.json", lambda: make_case(wish, folder))
    row: dict[str, Any] = {
        "case": wish.name,
        "family": wish.family,
        "true": answer["effects"],
        "wrong": answer["wrong"],
    }
    if "checks" in parts:
        row["checks"] = kept(out / "checks" / f"{wish.name}.json", lambda: checked(answer["model"], folder))["checks"]
    if "misfit" in parts:
        file = out / "results" / f"{wish.name}.json"
        row["misfit"] = said(kept(file, lambda: diagnose_folder(answer["model"], folder, out, limit_s)))
    if "baselines" in parts and not answer["wrong"]:
        file = out / "baselines" / f"{wish.name}.json"
        row |= {
            name: {"said": names, "verdict": "named" if names else "adequate"}
            for name, names in kept(file, lambda: dict(named_by_baselines(answer["model"], folder))).items()
        }
    return row


def kept(file: Path, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """The content of a file, which is made where it is not there."""
    if not file.exists():
        write_json(file, make())
    found: dict[str, Any] = json.loads(file.read_text())
    return found


def checked(model: str, folder: Path) -> dict[str, Any]:
    """What the data checks say of a case."""
    found = check_data(load_model(model), load_measurements(folder))
    return {"checks": [finding.to_json() for finding in found]}


def said(result: dict[str, Any]) -> dict[str, Any]:
    """What a diagnosis named, and whether it made held-out trials worse."""
    verdict = result.get("verdict", "failed")
    effects = [e["id"] for e in result.get("effects") or []] if verdict in ("named", "ambiguous") else []
    removed = (result.get("held_out") or {}).get("reducible_removed")
    return {"said": effects, "verdict": verdict, "worse": bool(effects) and removed is not None and removed < 0}


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Shares by family and method, as Markdown."""
    lines = ["| family | method | main effect named | wrong effect named | made worse |", "|---|---|---|---|---|"]
    for family, title in TITLES.items():
        for method in METHODS:
            own = [row for row in rows if row["family"] == family and not row["wrong"] and method in row]
            if not own:
                continue
            right = Share.of(set(row["true"]) <= set(row[method]["said"]) for row in own)
            other = Share.of(
                bool(row[method]["said"]) and not set(row["true"]) & set(row[method]["said"]) for row in own
            )
            worse = str(Share.of(row[method]["worse"] for row in own)) if method == "misfit" else ""
            lines.append(f"| {family}: {title} | {method} | {right} | {other} | {worse} |")
    checked_rows = [row for row in rows if "checks" in row]
    wrong = [row for row in checked_rows if row["wrong"]]
    found = Share.of(any(c["kind"] == row["wrong"] and c["strong"] for c in row["checks"]) for row in wrong)
    alarms = Share.of(any(c["strong"] for c in row["checks"]) for row in checked_rows if not row["wrong"])
    lines += ["", "| data checks | share |", "|---|---|", f"| wrong data recognised, with the right kind | {found} |"]
    return "\n".join([*lines, f"| false alarms on records that are not wrong | {alarms} |", ""])


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--family", choices=list(WORLD), action="append", default=[])
    parser.add_argument("--n", type=int, default=1, help="cases of each family on each of its machines")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=10.0, help="length of a trial")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for a diagnosis")
    parser.add_argument("--part", choices=("checks", "misfit", "baselines"), action="append", default=[])
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    rows = []
    for index in range(args.n):
        for family in args.family or WORLD:
            for machine in WORLD[family]:
                wish = WorldWish(family, machine, index, args.seed, args.seconds)
                try:
                    rows.append(do_case(wish, args.out, args.limit, args.part or ("checks", "misfit", "baselines")))
                except TruthError as error:
                    print(f"{wish.name} cannot be made: {error}")
    write_json(args.out / "rows.json", {"rows": rows})
    print(table(rows))


if __name__ == "__main__":
    main()
