"""Pages whose words are asked for do not wait for their pictures."""

from collections.abc import Iterator

import pytest
from builders import blank


@pytest.fixture(scope="module")
def blank_pictures() -> Iterator[None]:
    """Figures are made and not drawn; test_report_figures.py and test_report_html.py draw them."""
    with blank():
        yield
