"""What speaks against a set that fits best, by hand-made errors in units of the noise."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from orchestrator.diagnosis.search import trace as module
from orchestrator.diagnosis.search.trace import Trace

TOO_SMALL = "is of a size that does not matter"


def objection(monkeypatch: pytest.MonkeyPatch, nominal: float, before: float, after: float) -> str:
    """What is said of a set of two that brings an rms (in noises) from `before`, that of one, to `after`."""
    monkeypatch.setattr(module, "explained_by_noise", lambda *args: False)
    monkeypatch.setattr(Trace, "p_value", lambda self, found: 0.005)
    monkeypatch.setattr(Trace, "_charge", lambda self, found: 0.0)
    monkeypatch.setattr(Trace, "_shows", lambda self, found, stage: False)
    many = SimpleNamespace(rows=10_000)
    one = SimpleNamespace(cost=before**2, labels=frozenset("a"), ids=("a",), fit=many)
    stage = SimpleNamespace(tangent=SimpleNamespace(base=one), colour=SimpleNamespace(level=1.0), nominal_rms=nominal)
    two: Any = SimpleNamespace(
        cost=after**2, labels=frozenset("ab"), ids=("a", "b"), pressed=list, is_meaningful=lambda: False
    )
    trace = Trace(stages=[stage])  # type: ignore[list-item]
    return trace.objection(two)


def test_a_small_effect_beside_a_large_one_matters_where_it_is_as_large_as_half_the_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A lag that does 100 noises, and cogging that does 0.9: without it 1.35 is left, with it the noise."""
    assert objection(monkeypatch, 100.0, np.hypot(1.0, 0.9), 1.0) == ""
    assert objection(monkeypatch, 100.0, np.hypot(1.0, 0.4), 1.0) == TOO_SMALL


def test_beside_a_model_that_was_nearly_right_an_effect_of_a_sixth_of_the_noise_matters(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert objection(monkeypatch, np.hypot(1.0, 2.0), np.hypot(1.0, 0.16), 1.0) == ""
    assert objection(monkeypatch, np.hypot(1.0, 2.0), np.hypot(1.0, 0.14), 1.0) == TOO_SMALL


def test_where_more_than_noise_is_left_a_small_effect_may_imitate_a_part_of_that(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert objection(monkeypatch, 100.0, np.hypot(3.0, 2.5), 3.0) == TOO_SMALL
