"""The effects that can be attached to an FMU from outside, sized for one FMU and one set of data."""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from fmus.catalogue import ModelicaModel
from fmus.symbolic.system import SymbolicSystem
from orchestrator.library.cards import CardParameter, EffectCard

FOLDER = Path(__file__).parent / "effects"
CLASSES = FOLDER / "Effects.mo"
# Where effects act, in the order in which a signal passes them.
INPUT_SLOTS = ("inputDelay", "inputStatic", "inputLag", "inputGain", "inputOffset")
FORCE_SLOTS = ("force1", "force2", "force3")
OUTPUT_SLOTS = ("outputLag", "outputScale", "outputOffset")
PARAMETER_SLOT = "parameter"


@dataclass(frozen=True)
class Scales:
    """Typical sizes of one kind of site, in the FMU's units, and the units themselves.

    `sizes` and `units` have the keys force, speed, position, input, output; `sizes` may have s, by which times are
    multiplied for plants that are slower than 100 samples in a second; `place` is (middle, half the range) of the
    positions.
    """

    sizes: Mapping[str, float]
    units: Mapping[str, str]
    place: tuple[float, float]

    def factor(self, unit: str) -> float:
        """Size of `force/speed2` and the like; what has no size counts 1."""
        if unit == "place":
            return self.place[1]
        result = 1.0
        for name, power in _factors(unit):
            result *= self.sizes.get(name, 1.0) ** power
        return result

    def offset(self, unit: str) -> float:
        """What a relative value of 0 stands for: the middle of the range for a place, else 0."""
        return self.place[0] if unit == "place" else 0.0

    def unit(self, unit: str) -> str:
        """Unit in the FMU's own units, such as `N.m.s/rad` for `force/speed`."""
        if unit == "place":
            return self.units.get("position", "")
        parts: dict[str, int] = {}
        for name, power in _factors(unit):
            for base, exponent in _unit_powers(self.units.get(name, name)):
                parts[base] = parts.get(base, 0) + power * exponent
        above = [_power(base, e) for base, e in parts.items() if e > 0]
        below = [_power(base, -e) for base, e in parts.items() if e < 0]
        text = ".".join(above) or "1"
        if not below:
            return text
        return f"{text}/{below[0]}" if len(below) == 1 else f"{text}/({'.'.join(below)})"


@dataclass(frozen=True)
class Law:
    """An effect as the library states it, its parameters relative to the sizes of a plant."""

    card: EffectCard
    entries: Mapping[str, Mapping[str, Any]]

    def sized(self, scales: Scales) -> EffectCard:
        """The card with values in the FMU's units; parameters that are not fitted are left out."""
        found = []
        for parameter in self.card.parameters:
            entry = self.entries[parameter.name]
            if entry["low"] == entry["high"]:
                continue
            scale, offset = scales.factor(entry["unit"]), scales.offset(entry["unit"])
            found.append(
                CardParameter(
                    parameter.name,
                    offset + scale * parameter.start,
                    offset + scale * parameter.absent,
                    scale * parameter.meaningful,
                    grid=tuple(offset + scale * value for value in parameter.grid),
                )
            )
        return EffectCard(**{**vars(self.card), "parameters": tuple(found)})

    @property
    def needs_position(self) -> bool:
        """Whether a force depends on where things are."""
        return any("position" in entry["unit"] or entry["unit"] == "place" for entry in self.entries.values())

    @property
    def system(self) -> SymbolicSystem:
        """The equations of the law for one signal or one force."""
        return _system(self.card.class_name)


@cache
def laws() -> tuple[Law, ...]:
    """Return all laws, by file name."""
    return tuple(_law(tomllib.loads(path.read_text())) for path in sorted(FOLDER.glob("*.toml")))


def _law(entry: dict[str, Any]) -> Law:
    parameters = tuple(
        CardParameter(name, p["start"], p["absent"], p["meaningful"], grid=tuple(p.get("grid", ())))
        for name, p in entry["parameters"].items()
    )
    card = EffectCard(
        id=entry["id"],
        title=entry["title"],
        class_name=entry["class"],
        slots=tuple(entry["slots"]),
        site=entry["site"],
        elements=entry["elements"],
        confusable=tuple(entry["confusable"]),
        experiment=entry["experiment"],
        parameters=parameters,
    )
    return Law(card, entry["parameters"])


@cache
def _system(class_name: str) -> SymbolicSystem:
    return ModelicaModel(class_name, class_name, CLASSES).compile()


def _factors(unit: str) -> list[tuple[str, int]]:
    """`force/speed2` -> [("force", 1), ("speed", -2)]."""
    found = []
    for place, part in enumerate(unit.split("/")):
        for factor in part.split("."):
            name, power = re.fullmatch(r"([A-Za-z]+|1)(\d*)", factor).groups()  # type: ignore[union-attr]
            found.append((name, (-1 if place else 1) * int(power or 1)))
    return [(name, power) for name, power in found if name != "1"]


def _unit_powers(unit: str) -> list[tuple[str, int]]:
    found = []
    for place, part in enumerate(unit.replace("(", "").replace(")", "").split("/")):
        for factor in part.split("."):
            match = re.fullmatch(r"([^\d-]+)(-?\d*)", factor)
            if match is not None:
                found.append((match[1], (-1 if place else 1) * int(match[2] or 1)))
    return found


def _power(base: str, exponent: int) -> str:
    return base if exponent == 1 else f"{base}{exponent}"
