"""What free runs named, in the terms of the grey box: how much it leaves unexplained, and when another set is likelier."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from fmus.catalogue import ModelicaModel, find_modelica_model
from orchestrator.greybox.other_answer import OtherAnswer, other_answer
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.library.cards import effect_library
from orchestrator.measurements import MeasurementSet, load_measurements
from orchestrator.verdicts.result import Estimate
from orchestrator.versions import default_effect, extended_class
from tests.datacheck.records import pendulum, write_case

DAMPING = 2e-3


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> MeasurementSet:
    folder = tmp_path_factory.mktemp("pole")
    return load_measurements(
        write_case(folder, lambda seed: pendulum(seed, damping=DAMPING), {"theta": "rad"}, trials=3)
    )


def seen(model: ModelicaModel, effect: str, size: float, measured: MeasurementSet, parameters: int = 1) -> OtherAnswer:
    """The model with an effect of a size in its first slot; other values of the effect stay those of its card."""
    named = default_effect(model, effect)
    first, *_ = named.parameters
    unit = named.parameters[first].unit
    named = replace(named, parameters={**named.parameters, first: Estimate(size, unit, (size, size))})
    answer = extended_class(model, [named], effect_library())
    return other_answer(model, answer, parameters, measured, Thresholds())


def test_the_right_friction_leaves_nothing_unexplained_and_the_wrong_one_gives_way_to_it(
    measured: MeasurementSet,
) -> None:
    model, limits = find_modelica_model("pendulum"), Thresholds()
    right = seen(model, "viscous_friction", DAMPING, measured)
    little = seen(model, "viscous_friction", 0.01 * DAMPING, measured)
    assert right.unexplained < 0.05 and little.unexplained > 0.8
    assert little.gives_way_to(right.own, limits)
    assert not right.gives_way_to(little.own, limits)


def test_a_parameter_has_to_pay_its_price(measured: MeasurementSet) -> None:
    model = find_modelica_model("pendulum")
    one, hundred = (seen(model, "viscous_friction", DAMPING, measured, count) for count in (1, 100))
    assert hundred.own.loss - one.own.loss == pytest.approx(99 * one.own.price)
    assert hundred.gives_way_to(one.own, Thresholds())


def test_a_set_with_more_parameters_takes_no_answers_place(measured: MeasurementSet) -> None:
    model = find_modelica_model("pendulum")
    right, little = (seen(model, "viscous_friction", size, measured, 0) for size in (DAMPING, 0.01 * DAMPING))
    richer = SimpleNamespace(counted=1, loss=right.own.loss, losses=right.own.losses)
    assert little.gives_way_to(right.own, Thresholds())
    assert not little.gives_way_to(richer, Thresholds())  # type: ignore[arg-type]
