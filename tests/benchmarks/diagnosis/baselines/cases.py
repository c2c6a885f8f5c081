"""All baselines on one case, kept as a file."""

import json
import time
import zlib
from pathlib import Path
from typing import Any

from tests.benchmarks.diagnosis.baselines.methods import METHODS, Regression
from tests.benchmarks.diagnosis.baselines.regression import regression_of
from tests.benchmarks.diagnosis.diagnose_cases import answer_of, write_json
from tests.benchmarks.diagnosis.truth.families import Wish


def baselines_of(wish: Wish, out: Path) -> dict[str, Any]:
    """What each method names on a case; one that fails has a sentence instead."""
    file = out / "baselines" / f"{wish.name}.json"
    if not file.exists():
        answer = answer_of(wish, out)
        began = time.monotonic()
        problem = regression_of(answer["model"], out / "cases" / wish.name)
        seconds = time.monotonic() - began
        methods = {name: _named(problem, name, zlib.crc32(wish.name.encode())) for name in METHODS}
        write_json(file, {"screening_seconds": seconds, "methods": methods})
    found: dict[str, Any] = json.loads(file.read_text())["methods"]
    return found


def _named(problem: Regression, method: str, seed: int) -> dict[str, Any]:
    began = time.monotonic()
    if not problem.groups:
        return {"effects": [], "ranking": [], "failed": "no candidate can be screened on this model"}
    named = METHODS[method](problem, seed)
    return {"effects": list(named.effects), "ranking": list(named.ranking), "seconds": time.monotonic() - began}
