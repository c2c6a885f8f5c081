"""The headline of a comparison weighs learning and held-out trials alike."""

from types import SimpleNamespace
from typing import Any

import pytest

from orchestrator.report.sentences import comparison_sentence


def compared(learning: float, held_out: float | None) -> Any:
    """A comparison with errors as multiples of the noise floor."""

    def errors(over_floor: float) -> SimpleNamespace:
        return SimpleNamespace(over_floor=over_floor, rmse={"q": over_floor * 1e-3})

    return SimpleNamespace(
        learning=errors(learning), held_out=None if held_out is None else errors(held_out), units={"q": "rad"}
    )


@pytest.mark.parametrize(
    ("learning", "held_out", "words"),
    [
        (18.0, 0.9, ["does not explain the learning trials", "18.0 times", "on the held-out trials"]),
        (0.9, 18.0, ["does not explain the held-out trials", "18.0 times", "on the learning trials"]),
        (0.9, 1.0, ["agrees with the held-out trials within the noise", "on the learning trials"]),
        (5.0, None, ["does not explain the learning trials"]),
    ],
)
def test_neither_set_hides_what_the_other_shows(learning: float, held_out: float | None, words: list[str]) -> None:
    text = comparison_sentence(compared(learning, held_out))
    assert all(word in text for word in words), text
