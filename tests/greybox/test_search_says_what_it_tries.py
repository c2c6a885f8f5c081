"""While a search fits, which may take minutes, it says what is tried and how much of the present step is done."""

from types import SimpleNamespace
from typing import Any

import pytest

from fmus.errors import ComponentError
from orchestrator.elapsed import Elapsed
from orchestrator.greybox.search import Search
from orchestrator.greybox.thresholds import Thresholds

NOT_RUN = SimpleNamespace(box=SimpleNamespace(work=[]))


def candidate(id: str, site: str = "x") -> Any:
    return SimpleNamespace(id=id, family=(id, site), place=SimpleNamespace(site=site))


def test_each_set_is_named_with_its_number_among_those_that_are_tried_and_then_among_those_that_are_fitted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said: list[str] = []
    nothing: Any = SimpleNamespace(key=frozenset(), loss=0.0, price=1.0)

    def fails(begun: Any, rival: float) -> Any:
        raise ComponentError("no matter what is said")

    setting = SimpleNamespace(fitter=SimpleNamespace(end=fails), thresholds=Thresholds())
    search = Search(setting, (), nothing, said.append)  # type: ignore[arg-type]
    begun: Any = SimpleNamespace(
        key=frozenset({("drag", "x")}), candidates=(candidate("drag"),), loss=1.0, counted=1, fit=NOT_RUN
    )
    monkeypatch.setattr(search, "_begun", lambda candidates, about: [begun] if len(candidates) < 3 else [])
    drag, spring = candidate("drag"), candidate("spring")

    search._fit_all([(drag,), (spring,), (drag, spring), (spring, *(candidate("drift", site) for site in "abc"))])

    tried = ["drag at x", "spring at x", "drag at x and spring at x", "spring at x and drift at 3 places"]
    assert said[:4] == [f"trying {k} of 4: {words}" for k, words in enumerate(tried, 1)]
    assert said[4:] == [f"fitting {k} of 3: drag at x" for k in (1, 2, 3)]
    gone = Elapsed(lambda: 0.0)
    gone.said(said[0])
    assert gone.words == "25 % of this step"
