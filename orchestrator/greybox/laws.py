"""Laws: formulas of physical effects, with the places where they can act; read from cards (TOML)."""

import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Literal

from fmus.errors import MisfitError
from orchestrator.greybox.unit_algebra import combined

FOLDER = Path(__file__).parent / "laws"
# Balances whose laws have the names of another unit's: a flow of gas, as vacuum technicians count it.
ALIKE = {"Pa.m3/s": "m3/s"}
Place = Literal[
    "motion",
    "storage",
    "between_motions",
    "between_storages",
    "input",
    "between_inputs",
    "output",
    "response",
    "parameter",
]


@dataclass(frozen=True)
class LawParameter:
    """A parameter of a law.

    `kind` is its unit in terms of the place, such as "force/speed^2". A `gain` enters linearly and is 0 where the effect is
    absent; `positive` says that physics allows no negative value, `most` is the largest that it allows, `along` that it has the sign of the model's own response there. Any other parameter is a
    shape: `grid` holds values in multiples of the record's own scale of that kind, `fitted` says whether it is estimated; one that `smooths` is, and counts as none: it says how sharp a corner is. `prior` is the standard deviation of a
    gain's prior. A shape with `waves` counts waves per turn; values of which the record shows fewer waves are left out.
    One `beyond_noise` is a value of an input that its sensor's noise does not reach: a narrower dead zone would take noise away.
    `value` is what was fitted where the law was found, with its 90 % interval `ci90`; a shape starts there.
    """

    name: str
    kind: str
    gain: bool = False
    positive: bool = False
    along: bool = False
    most: float = math.inf
    grid: tuple[float, ...] = ()
    fitted: bool = True
    smooths: bool = False
    prior: float = 0.0
    waves: float = 0.0
    beyond_noise: bool = False
    description: str = ""
    value: float = math.nan
    ci90: tuple[float, ...] = ()

    def unit(self, units: Mapping[str, str]) -> str:
        """The unit, given those of the place's quantities."""
        return combined(*((units[name], power) for name, power in self._factors()))

    def scale(self, scales: Mapping[str, float]) -> float:
        """The record's scale of the parameter, given those of the place's quantities."""
        return math.prod(scales[name] ** power for name, power in self._factors())

    def _factors(self) -> Iterator[tuple[str, int]]:
        """Quantities of the kind with their powers: `force/speed^2` gives force and 1, speed and -2."""
        above, *below = self.kind.split("/")
        for sign, group in ((1, above), *((-1, each) for each in below)):
            name, _, exponent = group.partition("^")
            if name != "1":
                yield name, sign * int(exponent or 1)


@dataclass(frozen=True)
class Law:
    """A formula at a kind of place.

    `expression` is Modelica text in the place's coordinates and the law's parameters: what it adds to a balance, what an
    input becomes (in `u`), or what an output becomes (in `y`). `states` are hidden states with their derivatives, `starts` is what
    they begin with, else 0; `unknown_starts` names the parameter that is the size of what a state begins with in any trial, which the
    filter finds. Laws of one id differ in `variant`, such as stops above and below. `units` restricts the law to places whose balance or position has one of these units; `names` and `titles` are its id and words where a unit has its own.
    `written` is how a law is written back if an equation of the model holds what the law changes: `net` is all else that flows
    into a balance, which Modelica cannot name, `storage` what its equation multiplies der(x) with; `written_states` are rates of
    states written so. A `single` law acts at one balance, never between two. The gain of a `curved` law enters linearly near zero
    only. A `bounded` law depends on a position that
    comes back; a `slow` one belongs to stores of heat, charge and the like, not to motion. A `rare` law is tried only where the
    others do not explain the record. `contains` lists ids, with variants, of simpler laws that it becomes at the limit of a parameter, `alike`
    ids of laws elsewhere that do the same to a linear plant: they are tried beside it.
    `also` names further variables of a model by the coordinates that the law uses for them, `needs` what else the place must know.
    `site` is where a law of the user's own was found, `seen` the range of each coordinate there, `beside` the effects that were in
    the model with it, as JSON names them.
    """

    id: str
    title: str
    place: Place
    expression: str
    parameters: tuple[LawParameter, ...]
    variant: str = ""
    units: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    titles: Mapping[str, str] = field(default_factory=dict)
    renamed: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    states: Mapping[str, str] = field(default_factory=dict)
    starts: Mapping[str, str] = field(default_factory=dict)
    unknown_starts: Mapping[str, str] = field(default_factory=dict)
    contains: tuple[str, ...] = ()
    alike: tuple[str, ...] = ()
    bounded: bool = False
    slow: bool = False
    single: bool = False
    curved: bool = False
    rare: bool = False
    written: str = ""
    written_states: Mapping[str, str] = field(default_factory=dict)
    also: Mapping[str, str] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    site: str = ""
    seen: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    beside: tuple[Mapping[str, Any], ...] = ()

    @property
    def asks_for(self) -> set[str]:
        """What the law must know of the place that it acts at.

        Names in its formulas: the position `q`, the speed `v`, what is stored `x`, all else that flows into its balance (`net`), the input that drives
        its balance (`load`). And `position` and `speed`, if they are scales of its parameters.
        """
        formulas = " ".join((self.expression, *self.states.values()))
        scales = {name for parameter in self.parameters for name, _ in parameter._factors()}
        return set(re.findall(r"\b(?:q|v|x|net|load)\b", formulas)) | ({"position", "speed"} & scales) | set(self.needs)

    def id_at(self, unit: str) -> str:
        """The id at a balance of this unit."""
        return self.names.get(ALIKE.get(unit, unit), self.id)

    def is_called(self, effect: str, variant: str, parameters: Iterable[str], unit: str) -> bool:
        """Whether an effect of a result is this law at a balance of a unit; results of old do not tell the variant."""
        own = {self.public(parameter.name, unit) for parameter in self.parameters}
        return effect == self.id_at(unit) and variant in ("", self.variant) and own == set(parameters)

    def title_at(self, unit: str) -> str:
        """What the effect is called at a balance of this unit."""
        return self.titles.get(ALIKE.get(unit, unit), self.title)

    def public(self, parameter: str, unit: str) -> str:
        """The name of a parameter at a balance of this unit."""
        return self.renamed.get(ALIKE.get(unit, unit), {}).get(parameter, parameter)


@cache
def laws() -> tuple[Law, ...]:
    """All shipped laws, by file name."""
    return tuple(read_law(path) for path in sorted(FOLDER.glob("*.toml")))


def is_law_card(path: Path) -> bool:
    """Whether a card is a law, a formula at a place; a card of a class in a slot is none."""
    try:
        return "expression" in tomllib.loads(path.read_text())
    except (OSError, ValueError):
        return False


def own_laws(folders: Sequence[Path]) -> tuple[Law, ...]:
    """The laws of the user's folders, those that `misfit discover` wrote among them.

    Raises:
        MisfitError: if a law card is not complete.
    """
    return tuple(read_law(path) for folder in folders for path in sorted(folder.glob("*.toml")) if is_law_card(path))


def read_law(path: Path) -> Law:
    """Read one card.

    Raises:
        MisfitError: if it is no complete law card.
    """
    try:
        table: dict[str, Any] = _with_tuples(tomllib.loads(path.read_text()))
        parameters: dict[str, dict[str, Any]] = table.pop("parameters")
        table["seen"] = _with_tuples(table.get("seen", {}))
        own = tuple(LawParameter(name, **_with_tuples(each)) for name, each in parameters.items())
        return Law(parameters=own, **table)
    except OSError as error:
        raise MisfitError(f"law card {path} cannot be read: {error.strerror}") from error
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise MisfitError(f"law card {path}: {error}; expected keys as in docs/laws.md") from error


def _with_tuples(table: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in table.items()}
