"""The headline of a comparison weighs learning and held-out trials alike."""

from types import SimpleNamespace
from typing import Any

import pytest

from orchestrator.report.sentences import comparison_sentence


def compared(learning: float, held_out: float | None, worst: float = 1.0) -> Any:
    """A comparison with errors as multiples of the noise floor."""

    def errors(over_floor: float) -> SimpleNamespace:
        return SimpleNamespace(over_floor=over_floor, rmse={"q": over_floor * 1e-3})

    return SimpleNamespace(
        learning=errors(learning),
        held_out=None if held_out is None else errors(held_out),
        units={"q": "rad"},
        noise_floor={"q": 1e-3},
        trials=[
            SimpleNamespace(file="run_1.csv", rmse={"q": 1e-3}),
            SimpleNamespace(file="run_2.csv", rmse={"q": worst * 1e-3}),
        ],
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


def test_an_average_over_trials_hides_no_trial_that_is_not_explained() -> None:
    text = comparison_sentence(compared(1.2, 1.3, worst=2.7))
    assert "agrees" in text and text.endswith("; but q of run_2.csv is off by 2.70 times it."), text
    assert "but" not in comparison_sentence(compared(1.2, 1.3, worst=1.4))
