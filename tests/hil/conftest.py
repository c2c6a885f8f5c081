"""Benches of the tests are closed after each of them, and virtual robots are not waited for."""

from collections.abc import Iterator

import pytest

from tests.hil import bench
from tests.hil.held import SETTLE_S


@pytest.fixture(autouse=True)
def close_benches() -> Iterator[None]:
    yield
    while bench.OPEN:
        bench.OPEN.pop().close()


@pytest.fixture(autouse=True)
def awake_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.barrett.start_up.SETTLE_S", SETTLE_S)
