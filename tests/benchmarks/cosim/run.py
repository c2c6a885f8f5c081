"""Cost of a co-simulation step beside the tools of others, on the same FMUs and steps; run by `make bench`, never as a test.

Each figure is the median of rounds in turn, each in a process of its own: CPU microseconds a step with all outputs recorded, loading
excluded. Tools that need another environment are looked for in `build/peers` (`make bench-peers`); those that are not
there are said to be missing. Exit code 1 when misfit misses its own limits.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from bodies import PAIRS, build
from contestants import CONTESTANTS

ROUNDS = 3
STEPS, STEPS_OF_SLOW = 500_000, 5_000
HERE = Path(__file__).parent
ROOT = HERE.parents[2]
PEERS = ROOT / "build/peers/bin/python"
QUICK = ("misfit", "misfit_parquet", "misfit_isolated", "fmu_container")
# CPU us a step (pair, chain8).
LIMITS = {"misfit": (0.4, 1.2), "misfit_isolated": (10.0, 10.0)}
# s: the import, and a first run of two FMUs with and without what the cache holds.
START_LIMITS = {"import orchestrator": 0.15, "misfit run, caches warm": 0.5, "misfit run, caches empty": 3.0}


def main() -> None:
    """Print the tables."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        build(folder)
        kept = _steps(folder) & _starts(folder)
    if not kept:
        sys.exit(1)


def _steps(folder: Path) -> bool:
    found: dict[tuple[str, str], list[dict[str, float]]] = {}
    missing: dict[str, str] = {}
    for _ in range(ROUNDS):
        for system, pairs in PAIRS.items():
            found.setdefault(("C loop by hand", system), []).append(_json([folder / "loop", folder, pairs, STEPS]))
            for name in CONTESTANTS:
                if name not in missing:
                    answer = _contest(name, folder, pairs)
                    if isinstance(answer, str):
                        missing[name] = answer
                    else:
                        found.setdefault((name, system), []).append(answer)
    print(f"{'CPU us a step, all outputs recorded':38s} {'pair':>9s} {'chain8':>9s}")
    kept = True
    for name in dict.fromkeys(name for name, _ in found):
        cells = [statistics.median(run["cpu_us"] for run in found[name, system]) for system in PAIRS]
        late = [limit for limit, cell in zip(LIMITS.get(name, ()), cells, strict=False) if cell > limit]
        kept &= not late
        print(f"{name:38s} {cells[0]:9.3f} {cells[1]:9.3f}" + (f"   ABOVE the limit {late}" if late else ""))
    for name, why in missing.items():
        print(f"{name:38s} missing: {why}")
    return kept


def _contest(name: str, folder: Path, pairs: int) -> dict[str, float] | str:
    """Figures, or why there are none."""
    steps = STEPS if name in QUICK else STEPS_OF_SLOW
    why = "not installed"
    for python in (sys.executable, PEERS):
        if Path(python).exists():
            command = [python, HERE / "contestants.py", name, folder, pairs, steps]
            done = subprocess.run(
                [str(part) for part in command],
                env={**os.environ, "PYTHONPATH": str(ROOT)},
                capture_output=True,
                text=True,
                check=False,
            )
            if done.returncode == 0:
                return json.loads(done.stdout)
            why = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1][:60]
    return why


def _json(command: list[object]) -> dict[str, float]:
    return json.loads(
        subprocess.run([str(part) for part in command], capture_output=True, text=True, check=True).stdout
    )


def _starts(folder: Path) -> bool:
    """CPU seconds until something happens, compilers included; on an idle machine as many by the clock."""
    run = ["-m", "orchestrator.cli", "run", folder / "system1.toml", "--stop", "0.1", "--quiet", "--no-isolate"]
    cold = [folder / f"cache{k}" for k in range(ROUNDS)]
    bare = statistics.median(_cpu(["-c", "pass"], folder) for _ in range(ROUNDS))
    imported = statistics.median(_cpu(["-c", "import orchestrator.cosim"], folder) for _ in range(ROUNDS))
    figures = {
        "import orchestrator": imported - bare,
        "misfit run, caches empty": statistics.median(_cpu(run, cache) for cache in cold),
        "misfit run, caches warm": statistics.median(_cpu(run, cold[0]) for _ in range(ROUNDS)),
    }
    print(f"\n{'CPU seconds to start':38s} {'s':>9s}")
    for name, seconds in figures.items():
        print(f"{name:38s} {seconds:9.3f}" + ("" if seconds <= START_LIMITS[name] else "   ABOVE the limit"))
    return all(seconds <= START_LIMITS[name] for name, seconds in figures.items())


def _cpu(arguments: list[object], cache: Path) -> float:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MISFIT_CACHE": str(cache)}
    before = os.times()
    subprocess.run([sys.executable, *map(str, arguments)], env=environment, check=True)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


if __name__ == "__main__":
    main()
