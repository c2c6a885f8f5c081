"""Test files are imported by their bare names, so that two of one name cannot be collected together."""

from collections import Counter
from pathlib import Path

TESTS = Path(__file__).parents[1]


def test_no_two_test_files_have_one_name() -> None:
    bare = (file for file in TESTS.rglob("test_*.py") if not (file.parent / "__init__.py").exists())
    names = Counter(file.name for file in bare)
    assert [name for name, count in names.items() if count > 1] == []
