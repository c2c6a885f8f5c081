"""How each effect card is shown in the catalogue, and which of them share one compiled model."""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from docs.generator.plants import PLANTS, Plant
from fmus.catalogue import find_modelica_model
from orchestrator.library.cards import EffectCard, effect_library
from orchestrator.models.patch import free_slots

FILE = Path(__file__).with_name("scenes.toml")


@dataclass(frozen=True)
class Scene:
    """An effect card on a plant: `values` replace its first guesses, `against` names the coordinate that shows it."""

    name: str
    card: EffectCard
    plant: Plant
    signal: str
    against: str
    values: Mapping[str, float]
    alone: bool
    remark: str


@cache
def scenes() -> tuple[Scene, ...]:
    """Every card of the library with its scene, in the order of the library.

    Raises:
        KeyError: if a card has no scene: write one into scenes.toml.
    """
    tables = tomllib.loads(FILE.read_text())
    return tuple(_scene(card, tables) for card in effect_library())


def name_of(card: EffectCard) -> str:
    """The name of a shipped card: that of its file."""
    assert card.card_file is not None
    return card.card_file.stem


def _scene(card: EffectCard, tables: Mapping[str, Any]) -> Scene:
    name = name_of(card)
    if name not in tables:
        raise KeyError(f"the effect card {name}.toml has no scene; add [{name}] to {FILE.name}")
    table = tables[name]
    plant = PLANTS[table["plant"]]
    return Scene(
        name,
        card,
        plant,
        table.get("signal", plant.signal),
        table["against"],
        table.get("values", {}),
        table.get("alone", False),
        table.get("remark", ""),
    )


@dataclass(frozen=True)
class Group:
    """Scenes whose effects stand in one model together, each in a slot of its own."""

    plant: Plant
    slots: Mapping[str, Scene]


def groups(wanted: Iterable[Scene]) -> tuple[Group, ...]:
    """Put scenes of a plant into as few models as their slots allow."""
    found: list[Group] = []
    closed: set[int] = set()
    for scene in wanted:
        fitting = () if scene.alone else enumerate(found)
        for place, group in fitting:
            slot = None if place in closed or group.plant is not scene.plant else _free_slot(scene, group.slots)
            if slot is not None:
                found[place] = Group(scene.plant, {**group.slots, slot: scene})
                break
        else:
            slot = _free_slot(scene, {})
            if slot is None:
                raise KeyError(f"{scene.plant.model} has no slot of {scene.name}: {', '.join(scene.card.slots)}")
            closed |= {len(found)} if scene.alone else set()
            found.append(Group(scene.plant, {slot: scene}))
    return tuple(found)


def _free_slot(scene: Scene, taken: Mapping[str, Scene]) -> str | None:
    offered = free_slots(find_modelica_model(scene.plant.model).compile())
    return next((slot for slot in scene.card.slots if slot in offered and slot not in taken), None)
