"""The recording of a real pendulum: viscous friction is what its model lacks, and nothing else.

With one sample in ten it is 15 s at 100 Hz, of which the same holds in a seventh of the time.
"""

from pathlib import Path

import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Diagnosis
from tests.thinned import thinned

DATA = Path(__file__).parents[1] / "cases" / "pendulum"
PUBLISHED = 2.2394e-4


@pytest.fixture(scope="module", params=[10, pytest.param(1, marks=pytest.mark.slow)], ids="one sample in {}".format)
def found(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    folder = thinned(DATA, tmp_path_factory.mktemp("pendulum"), request.param)
    return diagnose(find_modelica_model("pendulum"), load_measurements(folder))


def test_viscous_friction_is_named_and_nothing_else(found: Diagnosis) -> None:
    assert found.verdict == "named"
    assert [effect.id for effect in found.effects] == ["viscous_friction"]
    assert found.ranking[0].effects == ("viscous_friction",)


def test_friction_is_near_the_published_value(found: Diagnosis) -> None:
    """The authors' value leaves 0.096 rad on this recording; theirs was fitted to other swings as well."""
    fitted = found.effects[0].parameters["b[1]"]

    assert fitted.value == pytest.approx(PUBLISHED, rel=0.2)
    assert not any("bound" in warning for warning in found.warnings)


def test_ten_seconds_of_swinging_are_followed_to_a_hundredth_of_a_radian(found: Diagnosis) -> None:
    nominal, extended = found.steps[0].comparison, found.steps[-1].comparison

    assert nominal.learning.rmse["theta"] > 1
    assert extended.learning.rmse["theta"] < 0.01
    assert found.held_out.rmse_after["theta"] < found.held_out.rmse_before["theta"] / 5
