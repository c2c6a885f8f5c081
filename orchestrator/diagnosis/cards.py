"""Effect cards: what a missing effect is called, which Modelica class adds it, where it can attach."""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from fmus.errors import MisfitError

SHIPPED = Path(__file__).parent / "cards"


@dataclass(frozen=True)
class CardParameter:
    """A fitted parameter of an effect.

    `start` is the first guess, `absent` the value (or limit) at which the effect vanishes, `meaningful` the smallest
    departure from it that matters. Unit and bounds are declared in the Modelica class. With `start_from`
    "residual_peak_hz" the first guess is the frequency at which the correction residual is largest. With a `grid` it is
    the value of the grid at which the effect's other parameters, taken linearly, explain the most.
    """

    name: str
    start: float
    absent: float
    meaningful: float
    start_from: Literal["", "residual_peak_hz"] = ""
    grid: tuple[float, ...] = ()


@dataclass(frozen=True)
class EffectCard:
    """One effect of the library.

    `slots` are the replaceable parts of a model that can hold it, in order of preference. `elements` tells whether
    the elements of its parameter arrays (joints, muscles) are fitted together, stand for one site each, or are the
    entries of a matrix off its diagonal, one site each ("pairs"; `site` is then a pattern such as
    `channel{0}->muscle{1}`). Cards of one id with different laws differ in `variant`.
    """

    id: str
    title: str
    class_name: str
    slots: tuple[str, ...]
    site: str
    elements: Literal["together", "each", "pairs"]
    confusable: tuple[str, ...]
    experiment: str
    parameters: tuple[CardParameter, ...]
    variant: str = ""


def read_card(path: Path) -> EffectCard:
    """Read a card from its TOML file.

    Raises:
        MisfitError: if the file is not a complete card.
    """
    try:
        entry = tomllib.loads(path.read_text())
        return _card(entry)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise MisfitError(f"effect card {path.name} cannot be read: {error}") from error
    except (KeyError, TypeError) as error:
        raise MisfitError(f"effect card {path.name} lacks or misuses {error}") from error


def _card(entry: dict[str, Any]) -> EffectCard:
    return EffectCard(
        id=entry["id"],
        title=entry["title"],
        class_name=entry["class"],
        slots=tuple(entry["slots"]),
        site=entry["site"],
        elements=entry["elements"],
        confusable=tuple(entry["confusable"]),
        experiment=entry["experiment"],
        parameters=tuple(
            CardParameter(name, **{**values, "grid": tuple(values.get("grid", ()))})
            for name, values in entry["parameters"].items()
        ),
        variant=entry.get("variant", ""),
    )


def effect_library() -> tuple[EffectCard, ...]:
    """Return the shipped cards, by id."""
    return tuple(read_card(path) for path in sorted(SHIPPED.glob("*.toml")))
