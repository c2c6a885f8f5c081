"""Which room may import which: no circle between files or rooms, with imports in functions and for types counted."""

import ast
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("fmus", "orchestrator", "hil")


def test_no_room_imports_itself_by_way_of_others() -> None:
    graph: dict[str, set[str]] = {}
    for here, there in _imports():
        graph.setdefault(here, set()).add(there)

    assert list(TopologicalSorter(graph).static_order())  # a CycleError names the rooms


def test_no_file_imports_itself_by_way_of_others() -> None:
    files = {_module(file): file for package in PACKAGES for file in (ROOT / package).rglob("*.py")}
    graph = {name: {other for other in _named(file) & set(files) if other != name} for name, file in files.items()}

    assert list(TopologicalSorter(graph).static_order())  # a CycleError names the files


# Each room of the diagnosis imports only those before it.
DIAGNOSIS = ("noise", "fit", "linear", "decide", "search", "referee", "advise")


def test_rooms_of_the_diagnosis_import_only_the_rooms_before_them() -> None:
    upwards = {
        (here, there)
        for k, here in enumerate(DIAGNOSIS)
        for file in (ROOT / "orchestrator" / "diagnosis" / here).glob("*.py")
        for name in _named(file)
        for there in name.split(".")[2:3]
        if name.startswith("orchestrator.diagnosis.") and there not in DIAGNOSIS[: k + 1]
    }

    assert upwards == set()


def test_what_is_below_imports_nothing_above() -> None:
    imports = _imports()

    above = {(a, b) for a, b in imports if a == "fmus" and b != "fmus"}
    above |= {(a, b) for a, b in imports if a.startswith("orchestrator.") and b.startswith("hil")}
    assert above == set()
    assert not {
        (a, b)
        for a, b in imports
        if b in ("orchestrator.api", "orchestrator.cli", "orchestrator.diagnose") and a in LOWER
    }


LOWER = {
    f"orchestrator.{room}"
    for room in [
        "measurements",
        "models",
        "library",
        "verdicts",
        "compare",
        "datacheck",
        "blackbox",
        "diagnosis",
        "greybox",
        "laws",
        "cosim",
        "gp",
        "regress",
    ]
}


@cache
def _imports() -> frozenset[tuple[str, str]]:
    """Pairs of rooms of which the first imports the second, anywhere in its code."""
    found = set()
    for package in PACKAGES:
        for file in sorted((ROOT / package).rglob("*.py")):
            here = _room(_module(file))
            found |= {(here, there) for there in map(_room, _named(file)) if there != here}
    return frozenset(found)


@cache
def _named(file: Path) -> frozenset[str]:
    """Modules of ours that a file imports: on top, in functions, and for types alone."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        found |= {name for name in names if name.split(".")[0] in PACKAGES}
    return frozenset(found)


def _module(file: Path) -> str:
    return ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def _room(module: str) -> str:
    """A package below `orchestrator` or `hil`; all of `fmus` is one room."""
    parts = module.split(".")
    return "fmus" if parts[0] == "fmus" else ".".join(parts[:2])
