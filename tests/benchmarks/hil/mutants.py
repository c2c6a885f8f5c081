"""Mutants of the safety core, and whether its tests notice: `python -m tests.benchmarks.hil.mutants [--every K] [--only FILE]`.

Each mutant is one change of one operator, constant, comparison, call or statement in `hil/safety`. It runs in a forked child
that has loaded everything before, so that a mutant costs its tests and nothing else; most die within a tenth of a second.
Survivors are printed with their place; those that are argued to be the same program stand in `EQUIVALENT` with the reason.
"""

import argparse
import ast
import copy
import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

SAFETY = Path(__file__).parents[3] / "hil" / "safety"
FILES = ("limits", "motion", "limiters", "rules", "core")
# CPU seconds that the tests of one mutant may take: a loop that never ends is noticed as well.
PATIENCE_S = 60
RANDOM = "whatever_it_shows or same_cycles or stays_until"

_COMPARISONS = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.GtE),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
}
_OPERATORS = {
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.Pow: (ast.Mult,),
}
_CALLS = {"min": "max", "max": "min", "any": "all", "all": "any"}


@dataclass(frozen=True)
class Mutant:
    """A changed module: its name, the line, what was changed, and its whole tree."""

    module: str
    line: int
    words: str
    tree: ast.Module

    def __str__(self) -> str:
        """Place and change."""
        return f"{self.module}.py:{self.line}: {self.words}"


def mutants_of(module: str) -> Iterator[Mutant]:
    """All mutants of one file."""
    tree = ast.parse((SAFETY / f"{module}.py").read_text())
    for number, node in enumerate(list(ast.walk(tree))):
        for words, change in _changes(node):
            changed = copy.deepcopy(tree)
            twin = list(ast.walk(changed))[number]
            change(twin)
            yield Mutant(module, getattr(node, "lineno", 0), words, ast.fix_missing_locations(changed))


def _changes(node: ast.AST):  # type: ignore[no-untyped-def]
    """What can be changed at a node: words, and a function that does it to its twin in a copy of the tree."""
    if isinstance(node, ast.Compare):
        for place, operator in enumerate(node.ops):
            for other in _COMPARISONS.get(type(operator), ()):
                words = f"{type(operator).__name__} -> {other.__name__} in `{ast.unparse(node)}`"
                yield words, lambda twin, place=place, other=other: twin.ops.__setitem__(place, other())
    elif isinstance(node, ast.BinOp):
        for other in _OPERATORS.get(type(node.op), ()):
            words = f"{type(node.op).__name__} -> {other.__name__} in `{ast.unparse(node)}`"
            yield words, lambda twin, other=other: setattr(twin, "op", other())
    elif isinstance(node, ast.BoolOp):
        other = ast.Or if isinstance(node.op, ast.And) else ast.And
        yield (
            f"{type(node.op).__name__} -> {other.__name__} in `{ast.unparse(node)}`",
            lambda t: setattr(t, "op", other()),
        )
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield f"not dropped in `{ast.unparse(node)}`", _truth
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield f"sign dropped in `{ast.unparse(node)}`", lambda twin: setattr(twin, "op", ast.UAdd())
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        yield f"{node.value} + 1", lambda twin: setattr(twin, "value", twin.value + 1)
        if node.value:
            yield f"{node.value} -> 0", lambda twin: setattr(twin, "value", 0)
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _CALLS:
        yield (
            f"{node.func.id} -> {_CALLS[node.func.id]} in `{ast.unparse(node)}`",
            lambda twin: setattr(twin.func, "id", _CALLS[twin.func.id]),
        )
    elif isinstance(node, ast.If | ast.IfExp):
        for value in (True, False):
            words = f"`{ast.unparse(node.test)}` -> {value}"
            yield words, lambda twin, value=value: setattr(twin, "test", ast.Constant(value))
    elif isinstance(node, ast.Attribute) and ast.unparse(node.value) == "Reaction" and node.attr != "PASS":
        yield f"Reaction.{node.attr} -> PASS", lambda twin: setattr(twin, "attr", "PASS")


def _truth(twin: ast.UnaryOp) -> None:
    """`+x` of what was `not x` would fail on None; a double negation has the truth of x."""
    twin.op, twin.operand = ast.Not(), ast.UnaryOp(ast.Not(), twin.operand)


def survives(mutant: Mutant) -> bool:
    """Run the tests on a mutant in a child; whether none of them failed."""
    child = os.fork()
    if child == 0:
        _as_mutant(mutant)
    deadline = time.monotonic() + 10 * PATIENCE_S
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status) == 0
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.002)


def _as_mutant(mutant: Mutant) -> None:
    import resource

    import hypothesis
    import pytest

    resource.setrlimit(resource.RLIMIT_CPU, (PATIENCE_S, PATIENCE_S))
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    code = 1
    try:
        hypothesis.settings.register_profile("mutants", database=None, derandomize=True)
        hypothesis.settings.load_profile("mutants")
        module = sys.modules[f"hil.safety.{mutant.module}"]
        exec(compile(mutant.tree, str(module.__file__), "exec"), module.__dict__)
        _pass_on(mutant.module)
        quick = [
            "-x",
            "-q",
            "-p",
            "no:cacheprovider",
            "-W",
            "ignore::pytest.PytestAssertRewriteWarning",
            "tests/hil/test_safety_rules.py",
            "tests/hil/test_safety_core.py",
        ]
        # Those with thousands of random cycles only if no other test has noticed.
        code = int(pytest.main([*quick, "-k", f"not ({RANDOM})"])) or int(pytest.main([*quick, "-k", RANDOM]))
    finally:
        os._exit(min(code, 1))


def _pass_on(changed: str) -> None:
    """Modules that had taken names from the changed one get its new ones, in the order in which they import each other."""
    import importlib

    later = FILES[FILES.index(changed) + 1 :]
    for name in later:
        importlib.reload(sys.modules[f"hil.safety.{name}"])


def main() -> None:
    """Print survivors and counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=1, help="only every K-th mutant")
    parser.add_argument("--only", choices=FILES)
    args = parser.parse_args()
    os.environ["MISFIT_PURE"] = "1"  # machine code cannot be changed line by line; see `mutants_compiled`
    import hypothesis  # noqa: F401
    import numpy  # noqa: F401
    import pytest  # noqa: F401

    import hil.safety.core  # noqa: F401  (loaded before the children are forked)
    from tests.benchmarks.hil.equivalent import EQUIVALENT

    chosen = FILES if args.only is None else (args.only,)
    for module in chosen:
        whole = Mutant(module, 0, "nothing", ast.parse((SAFETY / f"{module}.py").read_text()))
        if not survives(whole):
            sys.exit(f"the tests fail for {module}.py as it is, so they would kill every mutant")
    counts: Counter[str] = Counter()
    began = time.monotonic()
    for module in chosen:
        for number, mutant in enumerate(mutants_of(module)):
            if number % args.every:
                continue
            counts["mutants"] += 1
            if counts["mutants"] % 20 == 0:
                print(f"{counts['mutants']} mutants, at {mutant}", file=sys.stderr, flush=True)
            if survives(mutant):
                why = next((reason for text, reason in EQUIVALENT.items() if text in str(mutant)), "")
                counts["argued" if why else "survivors"] += 1
                print(f"{'argued' if why else 'SURVIVOR'}: {mutant}" + (f" ({why})" if why else ""), flush=True)
    print(
        f"{counts['mutants']} mutants in {time.monotonic() - began:.0f} s: {counts['survivors']} survive,"
        f" {counts['argued']} more are argued to be the same program"
    )
    sys.exit(1 if counts["survivors"] else 0)


if __name__ == "__main__":
    main()
