"""A search takes no more than its work, counted in steps of the filter and not in seconds, and says what it left."""

from pathlib import Path

import pytest
from plants import slide_record

from fmus.catalogue import find_modelica_model
from orchestrator.greybox.diagnose import Outcome, diagnose_greybox
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Diagnosis


def _diagnosed(folder: Path, most_work: float, workers: int) -> Diagnosis:
    source = find_modelica_model(f"{folder / 'Slide.mo'}:Slide")
    return diagnose_greybox(
        source, load_measurements(str(folder)), workers=workers, limits=Thresholds(most_work=most_work)
    )


def _sets(found: Diagnosis) -> dict[str, float]:
    assert isinstance(found.search, Outcome)
    return {str(sorted(s.key)): s.loss for s in found.search.decision.ranked}


def test_a_search_without_work_left_decides_on_what_it_has_whatever_the_number_of_workers(tmp_path: Path) -> None:
    folder = slide_record(tmp_path, lambda x, v: -2.0 * v, samples=120)
    whole, cut = _diagnosed(folder, 4e9, 2), _diagnosed(folder, 1.0, 2)

    assert len(_sets(cut)) < len(_sets(whole))
    assert not any("ended before all sets" in note for note in whole.warnings)
    assert any("ended before all sets" in note for note in cut.warnings)
    assert [effect.id for effect in cut.effects] == ["viscous_friction"]  # among the first that were tried
    assert cut.effects[0].parameters["b"].value == pytest.approx(2.0, rel=0.01)
    assert _sets(_diagnosed(folder, 1.0, 1)) == _sets(cut)
