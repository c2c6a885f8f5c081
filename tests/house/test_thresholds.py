"""Numbers that the diagnosis decides by stand in one file of each room, each under its own meaning."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2] / "orchestrator" / "diagnosis"


def test_no_file_of_a_room_but_its_thresholds_sets_a_public_number() -> None:
    files = [file for file in ROOT.glob("*/*.py") if file.name != "thresholds.py"]

    assert len(files) > 40
    assert [f"{file.parent.name}/{file.name}: {name}" for file in files for name in _numbers(file)] == []


def test_each_room_of_the_diagnosis_has_thresholds() -> None:
    rooms = {file.parent for file in ROOT.glob("*/__init__.py")}

    assert all(_numbers(room / "thresholds.py") for room in rooms)


def _numbers(file: Path) -> list[str]:
    """Public names that the top level of a file sets to a number or numbers."""
    found = []
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.Assign) and _is_number(node.value):
            names = [name for target in node.targets for name in ast.walk(target) if isinstance(name, ast.Name)]
            found += [name.id for name in names if not name.id.startswith("_")]
    return found


def _is_number(value: ast.expr) -> bool:
    if isinstance(value, ast.Tuple):
        return all(map(_is_number, value.elts))
    inner = value.operand if isinstance(value, ast.UnaryOp) else value
    return isinstance(inner, ast.Constant) and type(inner.value) in (int, float)
