"""How a force sensor is mounted is a setting: its axes, signs and scale are nowhere published."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmus.errors import MisfitError
from hil.control.pilot import Decision
from hil.session.loop import Loop, Wishes
from hil.session.recorded import pilot_of
from hil.settings import read_settings, settings_of_json
from tests.hil.bench import SETTINGS, Bench, ExactTimer

# The sensor's y is the wrist's x, its x points against the wrist's y, and its z shows half of the force.
MOUNTED = ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 2.0))


def test_a_force_is_seen_in_the_wrists_axes_however_the_sensor_is_mounted() -> None:
    settings = replace(SETTINGS, force_axes=MOUNTED)
    bench, seen = Bench(settings=settings), []
    pilot = pilot_of(bench.started(), settings)
    bench.plant.force = np.array([10.0, 20.0, 15.0])

    def watch(start_ns: int, decision: Decision) -> None:
        seen.append(decision.observed.force)

    Loop(bench.wire, pilot, ExactTimer(bench), watch=watch).run(lambda: Wishes(over=len(seen) > 5))

    assert seen[-1] == pytest.approx([20.0, -10.0, 30.0], abs=3.0)  # the virtual sensor is noisy


def test_the_axes_of_a_bench_file_are_those_of_its_recording(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(f"[robot]\nforce_axes = {json.dumps(MOUNTED)}\n")
    settings = read_settings(path)
    assert settings.force_axes == MOUNTED
    assert settings_of_json(json.dumps(settings.to_json())) == settings


def test_a_recording_from_before_there_was_the_setting_replays_with_the_sensors_own_axes() -> None:
    document = SETTINGS.to_json()
    del document["force_axes"]
    assert settings_of_json(json.dumps(document)) == SETTINGS


@pytest.mark.parametrize(
    "axes", ["[[1,0,0],[0,1,0]]", "[[1,0,0],[0,1,0],[1,1,0]]", "[[1],[2],[3]]", "[]", "[[nan,0,0],[0,1,0],[0,0,1]]"]
)
def test_axes_that_lose_a_direction_are_refused(axes: str, tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(f"[robot]\nforce_axes = {axes}\n")
    with pytest.raises(MisfitError, match="force_axes need three rows of three numbers"):
        read_settings(path)
