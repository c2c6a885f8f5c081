"""Mutants of the compiled safety core: `python -m tests.benchmarks.hil.mutants_compiled [--every K] [--only FILE]`.

The mutants are those of `mutants`; each is translated to C and compiled (about 15 s), and its tests run against the machine code. All 671
take some hours, so every K-th is taken. Exit code 1 if one survives that is not argued to be the same program.
"""

import argparse
import ast
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.benchmarks.hil.equivalent import EQUIVALENT
from tests.benchmarks.hil.mutants import FILES, SAFETY, mutants_of

HERE = Path(__file__).parents[3]
MODULES = [f"hil/safety/{name}.py" for name in ("cycle", *FILES)]
# Values of the wrong kind are refused by machine code itself, with other words.
LEFT_OUT = "nan-period_ns or nan-oscillation or inf-period_ns or inf-oscillation"
_TESTS = """
import sys
sys.path.insert(0, sys.argv[1])
import hil.safety.core as core
assert core.__file__.endswith(".so"), core.__file__
import pytest
files = ["tests/hil/test_safety_rules.py", "tests/hil/test_safety_core.py"]
sys.exit(pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-k", "not (LEFT_OUT)", *files]))
""".replace("LEFT_OUT", LEFT_OUT)
PATIENCE_S = 900.0


def survives(module: str, text: str) -> bool:
    """Compile the core with this text of one of its modules and run its tests; whether none of them failed."""
    with tempfile.TemporaryDirectory() as place:
        tree = Path(place)
        for package in ("hil", "fmus"):
            shutil.copytree(
                HERE / package, tree / package, ignore=shutil.ignore_patterns("__pycache__", "*.so", "build")
            )
        (tree / "hil" / "safety" / f"{module}.py").write_text(text)
        environment = {**os.environ, "MISFIT_PURE": "1", "MYPYC_OPT_LEVEL": "0"}
        compiler = [sys.executable, "-m", "mypyc", "--ignore-missing-imports", "--follow-imports=silent", *MODULES]
        built = subprocess.run(compiler, cwd=tree, env=environment, capture_output=True, text=True, check=False)
        if built.returncode:
            return False  # types do not let it through
        command = [sys.executable, "-c", _TESTS, place]
        try:
            done = subprocess.run(
                command, cwd=HERE, env=environment, capture_output=True, timeout=PATIENCE_S, check=False
            )
        except subprocess.TimeoutExpired:
            return False
        return done.returncode == 0


def main() -> None:
    """Print survivors and counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=20, help="only every K-th mutant")
    parser.add_argument("--only", choices=FILES)
    args = parser.parse_args()
    if not survives("core", (SAFETY / "core.py").read_text()):
        sys.exit("the tests fail for the core as it is, so they would kill every mutant")
    began, count, left, argued = time.monotonic(), 0, 0, 0
    for module in FILES if args.only is None else (args.only,):
        for mutant in list(mutants_of(module))[:: args.every]:
            count += 1
            if not survives(module, ast.unparse(mutant.tree)):
                continue
            why = next((reason for text, reason in EQUIVALENT.items() if text in str(mutant)), "")
            argued, left = argued + bool(why), left + (not why)
            print(f"{'argued' if why else 'SURVIVOR'}: {mutant}" + (f" ({why})" if why else ""), flush=True)
    print(
        f"{count} compiled mutants in {time.monotonic() - began:.0f} s: {left} survive, {argued} more are argued to be the same program"
    )
    sys.exit(1 if left else 0)


if __name__ == "__main__":
    main()
