"""The effect catalogue: its curves are the laws of the effects, and its texts are those of the Modelica classes."""

from functools import cache

import numpy as np
import pytest

from docs.generator.class_text import read_class, slots_of
from docs.generator.scenes import Scene, groups, name_of, scenes
from docs.generator.signatures import Signature, signatures
from docs.generator.type_text import type_text
from fmus.catalogue import built_in_models
from orchestrator.library.cards import effect_library
from orchestrator.models.patch import free_slots

# What each effect adds to the torque of the drive, by its law; q, w, a of the shaft and the commanded torque u.
LAWS = {
    "viscous_friction": lambda q, w, a, u: -0.05 * w,
    "coulomb_friction": lambda q, w, a, u: -0.05 * np.tanh(w / 0.002),
    "passive_stiffness": lambda q, w, a, u: 0.1 - 0.1 * q,
    "rotor_inertia": lambda q, w, a, u: -0.002 * a,
    "quadratic_drag_joint": lambda q, w, a, u: -0.01 * np.abs(w) * w,
    "saturation_drive": lambda q, w, a, u: np.clip(u, -0.2, 0.2) - u,
    "cogging": lambda q, w, a, u: 0.02 * np.sin(12 * q) + 0.02 * np.cos(12 * q),
}


@cache
def shown() -> dict[str, Signature]:
    wanted: list[Scene] = [scene for scene in scenes() if scene.name in LAWS]
    return {found.scene.name: found for group in groups(wanted) for found in signatures(group)}


@pytest.mark.parametrize("name", LAWS)
def test_the_missing_torque_of_an_effect_is_its_law(name: str) -> None:
    found = shown()[name]
    q, time = found.with_effect.values, found.time
    w = np.gradient(q, time)
    expected = LAWS[name](q, w, np.gradient(w, time), found.scene.plant.drive(time)["torque"])
    # Differences of samples are rough at the ends and where the law has a jump.
    steady = np.abs(w) > 0.05
    steady[:5] = steady[-5:] = False

    assert np.abs(found.missing.values - expected)[steady].max() < 0.02 * np.abs(expected).max()


def test_every_card_has_a_scene_on_a_plant_with_a_slot_for_it() -> None:
    found = scenes()

    assert [scene.name for scene in found] == [name_of(card) for card in effect_library()]
    for scene in found:
        assert slots_of(built_in_models()[scene.plant.model].class_name) & set(scene.card.slots), scene.name


@pytest.mark.parametrize("model", ["arm", "drive", "tanks"])
def test_slots_read_from_the_text_are_those_of_the_compiled_model(model: str) -> None:
    source = built_in_models()[model]

    assert slots_of(source.class_name) == set(free_slots(source.compile()))


def test_a_class_that_only_chooses_values_takes_its_equations_from_its_parent() -> None:
    found = read_class("FESArm.Effects.JointTorque.EndStopAbove")

    assert found.equations_of == "FESArm.Effects.JointTorque.PartialEndStop"
    assert "tau[i] = -side*k[i]" in found.equations
    assert found.law.startswith("tau = -k (q - qStop)")


def test_every_class_of_the_library_states_law_and_equations() -> None:
    for card in effect_library():
        found = read_class(card.class_name)
        assert found.law and "=" in found.equations, card.class_name


def test_types_are_said_in_words() -> None:
    assert type_text(tuple[float, float]) == "[number, number]"
    assert type_text(dict[str, int] | None) == "object of whole number by name, or null"
