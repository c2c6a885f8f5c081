"""Lines and branches of the safety core that its tests run: `python -m tests.benchmarks.hil.cover`; exit code 1 below all of them."""

import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[3]
TESTS = ("tests/hil/test_safety_rules.py", "tests/hil/test_safety_core.py", "tests/hil/test_adversary.py")


def main() -> None:
    """Run the tests of the core under coverage.py and print its table."""
    with tempfile.TemporaryDirectory() as folder:
        data = f"--data-file={folder}/coverage"
        run = [sys.executable, "-m", "coverage"]
        tests = subprocess.run(
            [
                *run,
                "run",
                data,
                "--branch",
                "--source=hil/safety",
                "-m",
                "pytest",
                "-q",
                "-p",
                "no:cacheprovider",
                *TESTS,
            ],
            cwd=ROOT,
            check=False,
        )
        table = subprocess.run([*run, "report", data, "--show-missing", "--fail-under=100"], cwd=ROOT, check=False)
    sys.exit(1 if tests.returncode or table.returncode else 0)


if __name__ == "__main__":
    main()
