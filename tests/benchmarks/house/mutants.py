"""Mutants of one file in each of several rooms: which ones do the quick tests let through, and which of those do the slow tests?

    python -m tests.benchmarks.house.mutants COPY [--each 5] [--seed 1]

COPY is a checkout of its own, since its files are changed; each is written back. A mutant turns a comparison or an operator round, or
changes a number. What no test notices may still be the same program: survivors are listed with file and line to be looked at.
"""

import argparse
import ast
import os
import random
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

# File and the tests that guard it.
ROOMS = {
    "hil/safety/rules.py": "tests/hil/test_safety_rules.py tests/hil/test_safety_core.py tests/hil/test_adversary.py",
    "orchestrator/gp/kernels/radial.py": "tests/gp/test_kernels.py tests/gp/test_predictor.py",
    "orchestrator/diagnosis/linear/subsets.py": "tests/diagnosis/test_subsets.py",
    "orchestrator/regress/comparison/tube.py": "tests/regress_comparison",
    "orchestrator/measurements/pulses.py": "tests/measurements/test_pulses.py",
    "orchestrator/cosim/masters/loops.py": "tests/cosim/test_masters.py tests/cosim/test_graph.py",
    "fmus/units.py": "tests/fmus/test_units_by_hand.py tests/fmus/test_lint_units.py tests/measurements/test_bind.py tests/cosim/test_convert.py",
}
TURNED: dict[type, type] = {
    ast.Lt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
}


def mutants(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of each mutant of a file."""
    count = sum(_can_change(node) for node in ast.walk(ast.parse(source)))
    for number in range(count):
        tree = ast.parse(source)
        node = [each for each in ast.walk(tree) if _can_change(each)][number]
        _change(node)
        yield node.lineno, ast.unparse(tree)


def _can_change(node: ast.AST) -> bool:
    if isinstance(node, ast.Compare):
        return type(node.ops[0]) in TURNED
    if isinstance(node, ast.BinOp):
        return type(node.op) in TURNED and not isinstance(node.left, ast.Constant | ast.JoinedStr)
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def _change(node: ast.AST) -> None:
    if isinstance(node, ast.Compare):
        node.ops[0] = TURNED[type(node.ops[0])]()
    elif isinstance(node, ast.BinOp):
        node.op = TURNED[type(node.op)]()
    elif isinstance(node, ast.Constant):
        node.value = node.value * 2 + 1


def survives(copy: Path, tests: str, marked: str) -> bool:
    """Whether all of the tests with a mark pass, or there are none."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", marked, *tests.split()]
    environment = {**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, timeout=300)
    except subprocess.TimeoutExpired:
        return False  # a program that does not end is noticed
    return done.returncode in (0, 5)


def main() -> None:
    """Print a row for each room."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("copy", type=Path)
    options.add_argument("--each", type=int, default=5)
    options.add_argument("--seed", type=int, default=1)
    chosen = options.parse_args()
    print("| file | mutants | survive the quick tests | survive all tests |\n|---|---|---|---|")
    for name, tests in ROOMS.items():
        file = chosen.copy / name
        source = file.read_text()
        every = list(mutants(source))
        picked = random.Random(chosen.seed).sample(every, min(chosen.each, len(every)))
        quick, whole = [], []
        try:
            for line, text in picked:
                file.write_text(text)
                if survives(chosen.copy, tests, "not slow"):
                    quick.append(line)
                    whole += [line] if survives(chosen.copy, tests, "slow") else []
        finally:
            file.write_text(source)
        lines = f" (lines {', '.join(map(str, whole))})" if whole else ""
        print(f"| `{name}` | {len(picked)} | {len(quick)} | {len(whole)}{lines} |", flush=True)


if __name__ == "__main__":
    main()
