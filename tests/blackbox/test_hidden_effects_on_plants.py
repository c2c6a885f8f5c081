"""Effects hidden by the benchmark's independent simulator are named from outside the plants' FMUs, of both kinds."""

from pathlib import Path

import pytest

from fmus.catalogue import find_modelica_model
from fmus.package import build_fmu
from orchestrator.blackbox.source import FmuSource
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements
from tests.benchmarks.diagnosis.truth.families import Wish, draw_case
from tests.benchmarks.diagnosis.truth.write import write_case


@pytest.mark.parametrize(
    ("plant", "effect", "fmi_version", "stepped"),
    [
        ("pendulum", "coulomb_friction", "3.0", True),
        ("two-mass", "viscous_friction", "3.0", False),
        ("tanks", "sensor_lag", "2.0", False),
    ],
)
def test_hidden_effect_is_named_and_its_size_found(
    plant: str, effect: str, fmi_version: str, stepped: bool, tmp_path: Path
) -> None:
    wish = Wish("S", plant, 0, 5, enr=30.0, noise="mid", seconds=2.0, effects=(effect,))
    truth = write_case(draw_case(wish), tmp_path / "data")
    box = build_fmu(find_modelica_model(plant).compile(), tmp_path / "box.fmu", fmi_version=fmi_version)
    measurements = load_measurements(tmp_path / "data")
    source = FmuSource.prepare(box, measurements, stepped=stepped)

    found = diagnose(source, measurements, workers=1)

    source.fmu.close()  # type: ignore[union-attr]
    assert [e.id for e in found.effects] == [effect]
    (true,) = [v for k, v in truth["parameters"][0].items() if k not in ("effect", "site")]
    assert max(p.value for p in found.effects[0].parameters.values()) == pytest.approx(true, rel=0.08)
    assert found.held_out.reducible_removed > 0.9
