"""500 small cases by `misfit regress` against bare FMPy `simulate_fmu` calls, in turn on the same machine.

    .venv/bin/python tests/benchmarks/regress_throughput/run.py [--cases N] [--rounds N] [--workers N]

Both run the same FMUs with the same stop time, step and parameter values. FMPy only simulates; misfit also reads 500 case
files, compares every signal with its reference and writes JSON and JUnit, starting from nothing each round. The limit is
1.5 x (FMPy's time, serially) / 2. On a busy machine the clock says little, so CPU seconds stand beside it: those of all
processes of misfit may be 1.5 x those of FMPy.
"""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "tests/cosim"), str(ROOT / "tests/regress")]

from small_fmus import small_fmu  # noqa: E402

# FMU, stop and step in s, the parameter that is varied, and its usual value.
MODELS = (
    ("decay", 2.0, 0.01, "k", 1.0),
    ("ball", 1.0, 0.005, "g", 9.81),
    ("gain", 1.0, 0.01, "a", 0.5),
    ("mass", 2.0, 0.01, "m", 1.0),
)
MISFIT = str(Path(sys.executable).with_name("misfit"))


def cpu() -> float:
    """CPU seconds of this process and of all its children that have ended."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def measured(what: Callable[[], None]) -> tuple[float, float]:
    """Seconds of the clock and CPU seconds."""
    began, before = time.perf_counter(), cpu()
    what()
    return time.perf_counter() - began, cpu() - before


def plan(count: int) -> list[tuple[str, float, float, str, float]]:
    """What each case runs."""
    return [(*MODELS[k % len(MODELS)][:4], MODELS[k % len(MODELS)][4] * (1.0 + 1e-3 * k)) for k in range(count)]


def write_cases(folder: Path, count: int) -> None:
    """A case file for each, and references from misfit's own update."""
    for name, *_ in MODELS:
        shutil.copy(small_fmu(name), folder / f"{name}.fmu")
    for k, (name, stop, step, parameter, value) in enumerate(plan(count)):
        text = f'model = "{name}.fmu"\nrun = {{ stop = {stop}, step = {step}, interface = "CoSimulation" }}\n'
        (folder / f"case{k:03d}.regress.toml").write_text(f"{text}parameters = {{ {parameter} = {value!r} }}\n")
    subprocess.run([MISFIT, "regress", folder, "--update", "--quiet"], check=True)


def misfit(folder: Path, workers: int) -> None:
    """The command, as CI calls it."""
    command = [MISFIT, "regress", folder, "--workers", str(workers), "--quiet", "--json", folder / "r.json"]
    subprocess.run([*command, "--junit", folder / "r.xml"], check=True)


def fmpy(folder: Path, count: int) -> None:
    """FMPy, one call after the other."""
    from fmpy import simulate_fmu

    for name, stop, step, parameter, value in plan(count):
        simulate_fmu(
            str(folder / f"{name}.fmu"),
            fmi_type="CoSimulation",
            stop_time=stop,
            step_size=step,
            output_interval=step,
            start_values={parameter: value},
        )


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--cases", type=int, default=500)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        write_cases(folder, given.cases)
        rows = []
        for _ in range(given.rounds):
            rows.append(
                (*measured(lambda: fmpy(folder, given.cases)), *measured(lambda: misfit(folder, given.workers)))
            )
    print(f"{given.cases} cases, {given.workers} workers; seconds of the clock and CPU seconds")
    print("| round | FMPy clock | FMPy CPU | misfit clock | misfit CPU | clock / (FMPy / 2) | CPU / FMPy |")
    print("|---|---|---|---|---|---|---|")
    for k, (clock, used, ours, taken) in enumerate(rows, 1):
        print(
            f"| {k} | {clock:.1f} | {used:.1f} | {ours:.1f} | {taken:.1f} | {2 * ours / clock:.2f} | {taken / used:.2f} |"
        )
    print("limit: 1.5 in either of the last two columns")


if __name__ == "__main__":
    main()
