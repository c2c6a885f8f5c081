"""Benches of the tests are closed after each of them."""

from collections.abc import Iterator

import pytest

from tests.hil import bench


@pytest.fixture(autouse=True)
def close_benches() -> Iterator[None]:
    yield
    while bench.OPEN:
        bench.OPEN.pop().close()
