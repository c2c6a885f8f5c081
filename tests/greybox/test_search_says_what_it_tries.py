"""While a search fits, which may take minutes, it says what is tried and how much of the present step is done."""

from types import SimpleNamespace
from typing import Any

import pytest

from orchestrator.elapsed import Elapsed
from orchestrator.greybox.search import Search


def candidate(id: str, site: str = "x") -> Any:
    return SimpleNamespace(id=id, family=(id, site), place=SimpleNamespace(site=site))


def test_each_set_is_named_with_its_number_among_those_of_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    nothing: Any = SimpleNamespace(key=frozenset(), loss=0.0)
    search = Search(SimpleNamespace(), (), nothing, said.append)  # type: ignore[arg-type]
    monkeypatch.setattr(search, "_fitted", lambda candidates, about: None)
    drag, spring = candidate("drag"), candidate("spring")

    search._fit_all([(drag,), (spring,), (drag, spring), (spring, *(candidate("drift", site) for site in "abc"))])

    assert said == [
        "trying 1 of 2: drag at x",
        "trying 2 of 2: spring at x",
        "trying drag at x and spring at x",
        "trying spring at x and drift at 3 places",
    ]
    gone = Elapsed(lambda: 0.0)
    gone.said(said[0])
    assert gone.words == "50 % of this step"
