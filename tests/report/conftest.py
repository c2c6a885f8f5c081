"""Pages whose words are asked for do not wait for their pictures."""

from collections.abc import Iterator
from typing import Any

import pytest


@pytest.fixture(scope="module")
def blank_pictures() -> Iterator[None]:
    """Figures are made and not drawn; test_report_figures.py and test_report_html.py draw them."""
    from matplotlib.figure import Figure

    def save(figure: Figure, stream: Any, **_: object) -> None:
        stream.write(b"blank")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", save)
        yield
