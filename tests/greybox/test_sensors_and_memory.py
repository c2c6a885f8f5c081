"""Sensors' gain and zero, and friction with memory, are named in models that have no place for them."""

from pathlib import Path

import pytest
from plants import diagnosed, slide_record


def test_a_sensor_that_reads_too_much_is_named_with_its_error(tmp_path: Path) -> None:
    found = diagnosed(slide_record(tmp_path, lambda x, v: 0.0, sensor=lambda x: 1.06 * x, seed=11))
    assert found.verdict == "named"
    (effect,) = found.effects
    assert effect.id == "joint_scale" and effect.parameters["k"].value == pytest.approx(0.06, rel=0.1)


def test_a_wrong_zero_is_called_like_a_constant_force_where_a_spring_turns_one_into_the_other(tmp_path: Path) -> None:
    found = diagnosed(slide_record(tmp_path, lambda x, v: 0.0, sensor=lambda x: x + 0.01, seed=11))
    assert found.verdict == "ambiguous"
    assert {"joint_offset", "constant_force"} <= {name for group in found.confusable for name in group}


def test_friction_that_develops_over_a_way_is_told_from_dry_friction(tmp_path: Path) -> None:
    found = diagnosed(slide_record(tmp_path, lambda x, v: 0.0, dahl=(0.8, 0.04), seed=12))
    assert found.verdict == "named"
    (effect,) = found.effects
    assert effect.id == "hysteresis"
    assert effect.parameters["H"].value == pytest.approx(0.8, rel=0.1)
    assert effect.parameters["xYield"].value == pytest.approx(0.04, rel=0.2)
