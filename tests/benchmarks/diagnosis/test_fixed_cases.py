"""A small fixed part of the benchmark, made on the fly: what was once diagnosed right stays right."""

from pathlib import Path
from typing import Any

import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements
from tests.benchmarks.diagnosis.scoring.judge import judge
from tests.benchmarks.diagnosis.truth.families import Wish, draw_case
from tests.benchmarks.diagnosis.truth.write import write_case


def judged(wish: Wish, folder: Path) -> dict[str, Any]:
    truth = write_case(draw_case(wish), folder)
    found = diagnose(find_modelica_model(wish.machine), load_measurements(folder), workers=1)
    return judge(wish.name, truth, found.to_json())


@pytest.mark.parametrize(
    ("machine", "effect", "noise", "enr", "seconds"),
    [
        ("pendulum", "viscous_friction", "mid", 30.0, 5.0),
        ("drive", "coulomb_friction", "lo", 30.0, 10.0),  # of 5 s, odds of 9 against Stribeck friction: ambiguous
        ("arm", "muscle_weakness", "mid", 100.0, 2.0),
    ],
)
def test_clear_effect_is_named_where_it_is_and_its_size_found(
    machine: str, effect: str, noise: str, enr: float, seconds: float, tmp_path: Path
) -> None:
    row = judged(Wish("S", machine, 0, 5, enr=enr, noise=noise, seconds=seconds, effects=(effect,)), tmp_path)

    assert (row["verdict"], row["said"], row["exact_site"]) == ("named", [effect], True)
    assert all(error < 0.03 for error, _ in row["parameters"])
    assert row["over_true"] < 1.5
    assert row["removed"] > 0.95


@pytest.mark.parametrize(("family", "machine"), [("N0", "cart"), ("N1", "drive")])
def test_nothing_is_named_where_nothing_is_missing(family: str, machine: str, tmp_path: Path) -> None:
    row = judged(Wish(family, machine, 0, 5, noise="mid", seconds=5.0), tmp_path)

    assert (row["verdict"], row["said"]) == ("adequate", [])


def test_spring_that_no_card_has_is_called_unknown(tmp_path: Path) -> None:
    wish = Wish("O", "drive", 0, 5, enr=30.0, noise="mid", seconds=2.5, effects=("cubic_spring",))

    row = judged(wish, tmp_path)

    assert (row["verdict"], row["said"]) == ("unknown", [])
