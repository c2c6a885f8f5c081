"""An adversary of the safety core finds no way past its limits, and would find one if a limiter were missing."""

from functools import partial

import pytest

from hil.safety.core import step
from hil.safety.limiters import LIMITERS
from tests.hil import adversary
from tests.hil.adversary import attack


def test_no_adversarial_cycle_breaches_a_limit() -> None:
    found = attack(seed=3, cycles=20_000)
    assert found.breaches == []
    assert found.energised > 5_000  # or nothing would have been shown
    assert found.stopped > 2_000


@pytest.mark.parametrize(
    ("limiter", "words"),
    [
        ("torque", "N.m, limit"),
        ("torque_rate", "in a cycle"),
        ("power", " W"),
        ("braking_only", "driven on"),
        ("inwards_only", "pushed outwards"),
        ("unpinching", "in a zone"),
    ],
)
def test_the_adversary_notices_each_limiter_that_is_missing(
    limiter: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = tuple(each for each in LIMITERS if each.__name__ != limiter)
    monkeypatch.setattr(adversary, "step", partial(step, limiters=left))
    found = attack(seed=3, cycles=20_000, until=words)
    assert any(words in breach for breach in found.breaches)
