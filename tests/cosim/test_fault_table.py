"""The table of faults in the documentation is what happens."""

from pathlib import Path

import pytest
from fault_table import DOCUMENT, FAULTS, HEAD, observe, table
from faulty import held, left_behind


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_ends_as_the_table_says_and_leaves_nothing_behind(fault: str, tmp_path: Path) -> None:
    before = held()
    line = table({fault: observe(fault, tmp_path)}).removeprefix(HEAD)
    assert line in DOCUMENT.read_text()
    assert not left_behind(before)  # no child is left, not even a dead one
    assert not (tmp_path.parent / "outside.txt").exists() and not (tmp_path / "run.parquet.unfinished").exists()


def test_the_table_has_no_other_faults() -> None:
    assert DOCUMENT.read_text().count("\n| ") == len(FAULTS) + 1
