"""`import misfit` is the public list: documented exactly, quick to import, and what the examples of the docs import from."""

import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import misfit

ROOT = Path(__file__).parents[2]
ROOMS = ("orchestrator", "fmus", "hil")
# Pages whose examples still reach behind the front door. The list may only shrink.
BEHIND_THE_DOOR = {"comparison_of_results.md", "gp.md", "running.md"}


def test_the_reference_documents_exactly_the_public_list() -> None:
    text = (ROOT / "docs" / "reference" / "python.md").read_text()

    documented = re.findall(r"^::: misfit\.(\w+)$", text, re.MULTILINE)

    assert len(documented) == len(re.findall(r"^:::", text, re.MULTILINE))
    assert sorted(documented) == sorted(misfit.__all__) == sorted(misfit._HOMES)


@pytest.mark.parametrize("name", misfit.__all__)
def test_each_public_name_is_there_and_says_what_it_is(name: str) -> None:
    assert (getattr(misfit, name).__doc__ or "").strip()


def test_an_unknown_name_lists_what_there_is() -> None:
    with pytest.raises(AttributeError, match="misfit has no 'Modle'; it has Bench"):
        _ = misfit.Modle


def test_import_loads_no_room_and_takes_a_moment() -> None:
    program = (
        "import sys, time; t = time.process_time(); import misfit; "
        "print(time.process_time() - t, *[m for m in sys.modules if m.split('.')[0] in ('orchestrator','fmus','hil','numpy')])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)

    seconds, *loaded = done.stdout.split()
    assert loaded == []
    assert float(seconds) < 0.2


def test_examples_of_the_docs_import_from_the_front_door_alone() -> None:
    behind = set()
    for page in sorted((ROOT / "docs").rglob("*.md")):
        for block in re.findall(r"^```python\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL):
            if _imported(block) & set(ROOMS):
                behind.add(page.name)

    assert behind == BEHIND_THE_DOOR


def _imported(code: str) -> set[str]:
    """Top-level packages that a piece of code imports."""
    found = set()
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module.split(".")[0])
    return found


def _documented() -> list[tuple[str, object]]:
    """Every public function and method of the public list."""
    found: list[tuple[str, object]] = []
    for name in misfit.__all__:
        offered = getattr(misfit, name)
        if inspect.isclass(offered):
            parts = {key: getattr(each, "__func__", each) for key, each in vars(offered).items() if key[0] != "_"}
            found += [(f"{name}.{key}", each) for key, each in parts.items() if inspect.isfunction(each)]
        elif inspect.isfunction(offered):
            found.append((name, offered))
    return found


def test_public_functions_say_what_each_of_their_arguments_is() -> None:
    functions = _documented()
    lacking = []
    for name, function in functions:
        asked = [each for each in inspect.signature(function).parameters if each not in ("self", "cls")]  # type: ignore[arg-type]
        text = inspect.getdoc(function) or ""
        if not text or (len(asked) > 1 and "Args:" not in text):
            lacking.append(name)

    assert len(functions) > 30
    assert lacking == []
