"""Small measurement sets written by the tests themselves."""

from collections.abc import Callable
from pathlib import Path

import pytest

WriteCase = Callable[..., Path]


@pytest.fixture
def write_case(tmp_path: Path) -> WriteCase:
    """Write data files, and a case.toml if its text is given, into a fresh folder."""

    def write(files: dict[str, str | bytes], case: str | None = None) -> Path:
        for name, content in files.items():
            data = content.encode() if isinstance(content, str) else content
            (tmp_path / name).write_bytes(data)
        if case is not None:
            (tmp_path / "case.toml").write_text(case)
        return tmp_path

    return write


@pytest.fixture
def swing() -> str:
    """Ten samples at 10 Hz of an angle q that grows by 2 per second."""
    rows = [f"{k / 10},{k / 5}" for k in range(10)]
    return "\n".join(["time,q", *rows]) + "\n"
