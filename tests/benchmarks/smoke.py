"""Every benchmark at its smallest size, so that none can stop working unseen; run by `make bench-smoke`, about a minute.

Figures of so few rounds mean nothing: limits are not judged here, only that each benchmark comes to its end.
"""

import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]

# Each in a process of its own, as `make bench` runs it, with the constants that make it long made small.
PARTS = {
    "speed of building and simulating": ("", "import run; run.ROUNDS = 1; run.main()"),
    "co-simulation": (
        "cosim",
        "import run; run.ROUNDS = 1; run.STEPS = run.STEPS_OF_SLOW = 1000; run.CONTESTANTS = dict.fromkeys(['misfit']); run.main()",
    ),
    "comparison of results": (
        "",
        "import tests.benchmarks.regress.run as run; run.ROUNDS = 1; run.SMALL_CASES = 3; run.main()",
    ),
    "Gaussian processes": (
        "gp",
        "import run; run.ROUNDS = 1; run.SIZES = run.SIZES[:1]; run.LIMITS_LIKELIHOOD = run.LIMITS_LIKELIHOOD[:1];"
        " run.LIMITS_FIT = run.LIMITS_FIT[:1]; run.main()",
    ),
    "study": ("study", "import sys; sys.argv += ['--draws', '8', '--direct', '1']; import run; run.main()"),
}


def main() -> None:
    """Run all; exit code 1 if one breaks."""
    broken = [name for name, (folder, program) in PARTS.items() if not _comes_to_its_end(name, folder, program)]
    if broken:
        sys.exit(f"broken benchmarks: {', '.join(broken)}")


def _comes_to_its_end(name: str, folder: str, program: str) -> bool:
    """Whether a benchmark ends by itself; exit code 1 without a traceback is a limit, which is not judged here."""
    began = time.monotonic()
    here = Path(__file__).parent / folder
    program = f"import sys; sys.path[:0] = [{str(here)!r}, {str(ROOT)!r}]; {program}"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    ended = done.returncode in (0, 1) and "Traceback" not in done.stderr
    print(f"{name:36s} {'ok' if ended else 'BROKEN'} {time.monotonic() - began:6.1f} s", flush=True)
    if not ended:
        print("\n".join(done.stderr.strip().splitlines()[-3:]))
    return ended


if __name__ == "__main__":
    main()
