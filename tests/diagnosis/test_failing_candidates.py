"""A candidate that cannot be built, simulated or fitted is one row of what was tried, and never ends a diagnosis."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.errors import MisfitError
from orchestrator.diagnose import diagnose
from orchestrator.diagnosis.search.tasks import RefitTask
from orchestrator.library.cards import effect_library
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Diagnosis
from orchestrator.work import Here, Task

IDS = ("viscous_friction", "coulomb_friction", "end_stop")
TIME = np.arange(500) * 0.01
NOISE = 1e-3
DAMPING = 0.02


class WithoutDryFriction(Here):
    """Work on which every fit of dry friction breaks, first as a user's mistake, then as numbers that overflow."""

    def __init__(self, error: Exception) -> None:
        self.error = error

    def do(self, task: Task) -> Any:
        """Run a task that is not about dry friction."""
        if isinstance(task, RefitTask) and any(c.card.id == "coulomb_friction" for c in task.candidates):
            raise self.error
        return super().do(task)


def record(folder: Path) -> Path:
    """Two trials of a drive with viscous friction."""
    drive, random = find_modelica_model("drive"), np.random.default_rng(1)
    inertia = next(v.start for v in drive.compile().parameters if v.name == "J")
    assert inertia is not None
    for k in (1, 2):
        torque = 0.05 * np.sin(2 * np.pi * (0.3 + 0.1 * k) * TIME) + 0.04 * np.sin(2 * np.pi * 1.3 * TIME + k)
        phi, speed, step = np.zeros(len(TIME)), 0.0, TIME[1]
        for i in range(1, len(TIME)):  # semi-implicit Euler is exact enough beside the noise
            for part in range(20):
                push = torque[i - 1] + (torque[i] - torque[i - 1]) * part / 20
                speed += (push - DAMPING * speed) / inertia * step / 20
                phi[i] += speed * step / 20
            phi[i] += phi[i - 1]
        measured = phi + NOISE * random.standard_normal(len(TIME))
        table = np.column_stack([TIME, torque, measured])
        np.savetxt(folder / f"trial_{k}.csv", table, delimiter=",", header="time,torque,phi", comments="")
    text = 'files = ["trial_1.csv", "trial_2.csv"]\nlearning = [1]\nheld_out = [2]\n[columns]\ntime = "s"\n'
    (folder / "case.toml").write_text(
        f'{text}torque = "N.m"\nphi = "rad"\n[sensors]\nencoder_noise_std_rad = {NOISE}\n'
    )
    return folder


def diagnosed(folder: Path, work: Here) -> Diagnosis:
    cards = [card for card in effect_library() if card.id in IDS]
    return diagnose(find_modelica_model("drive"), load_measurements(folder), cards=cards, workers=1, work=work)


@pytest.mark.parametrize("error", [MisfitError("the law of friction is missing"), ValueError("infinite numbers")])
def test_a_candidate_that_breaks_is_told_with_its_reason_and_the_others_go_on(tmp_path: Path, error: Exception) -> None:
    found = diagnosed(record(tmp_path), WithoutDryFriction(error))

    outcomes = {entry.effects: entry.outcome for entry in found.tried}
    assert (found.verdict, [effect.id for effect in found.effects]) == ("named", ["viscous_friction"])
    assert str(error) in outcomes[("coulomb_friction",)]


def test_ranking_has_each_effect_of_the_library_once_at_its_site_best_first(tmp_path: Path) -> None:
    """Two cards tell of an end stop, one above and one below; they are one effect."""
    found = diagnosed(record(tmp_path), Here())

    rows = [tuple(sorted(zip(entry.effects, entry.sites, strict=True))) for entry in found.ranking]
    assert len(set(rows)) == len(rows)
    assert {name for (name, _), *more in rows if not more} == set(IDS)
    assert rows[0] == (("viscous_friction", found.effects[0].site),)
    assert 0.5 < found.ranking[0].probability <= sum(entry.probability for entry in found.ranking) <= 1.0


def test_a_search_among_slots_that_breaks_says_so_and_the_balance_equations_are_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(self: Any) -> None:
        raise ValueError("arrays of other sizes")

    monkeypatch.setattr("orchestrator.diagnosis.search.search.Searcher.run", broken)
    found = diagnosed(record(tmp_path), Here())

    assert (found.verdict, [effect.id for effect in found.effects]) == ("named", ["viscous_friction"])
    assert any("the search for effects failed" in text and "other sizes" in text for text in found.warnings)
