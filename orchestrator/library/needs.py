"""What a record must contain for an effect to show in it, as effect cards declare it."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from fmus.errors import MisfitError
from orchestrator.measurements.toml_values import TomlTable, number

COUNTED = ("within", "beyond", "below", "above")
KINDS = (*COUNTED, "reversals", "spread")
_EXAMPLE = 'such as variable = "w", what = "speed", within = 0.1, samples = 50'


@dataclass(frozen=True)
class Need:
    """Excitation that an effect needs, in a `variable` of its class, which `what` calls by a word.

    `within` and `beyond` count samples of |variable| below and above `limit`, `below` and `above` those of the variable
    itself; `wanted` of them are needed. `reversals` counts changes of sign, `spread` is the range; there `limit` is needed.
    A limit is a number in the variable's unit, or the name of a parameter of the effect.
    """

    variable: str
    what: str
    kind: Literal["within", "beyond", "below", "above", "reversals", "spread"]
    limit: float | str
    wanted: float


def read_needs(card: TomlTable, parameters: Collection[str]) -> tuple[Need, ...]:
    """Read the `[[needs]]` of a card.

    Raises:
        MisfitError: if one is not complete; one line names the card, its number and the key.
    """
    entries = card.values.get("needs", [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise card.wrong("needs", f"tables [[needs]], {_EXAMPLE}")
    return tuple(
        _need(TomlTable(f"{card.where} [[needs]] {k}", entry), parameters) for k, entry in enumerate(entries, start=1)
    )


def _need(table: TomlTable, parameters: Collection[str]) -> Need:
    kinds = [key for key in table.values if key in KINDS]
    others = {"variable", "what", *(["samples"] if kinds and kinds[0] in COUNTED else [])}
    if len(kinds) != 1 or set(table.values) != {*kinds, *others}:
        has = ", ".join(table.values) or "nothing"
        raise MisfitError(f"{table.where}: has {has}; expected one of {', '.join(KINDS)} beside its words, {_EXAMPLE}")
    for key in ("variable", "what"):
        if not isinstance(table.values[key], str) or not table.values[key].strip():
            raise table.wrong(key, "a text in quotation marks")
    kind, limit = kinds[0], table.values[kinds[0]]
    if isinstance(limit, str):
        if limit not in parameters or kind not in COUNTED:
            raise table.wrong(kind, f"a number, or a parameter of the card: {', '.join(parameters)}")
    elif number(limit) is None:
        raise table.wrong(kind, "a number")
    wanted = table.get_positive("samples") if kind in COUNTED else float(limit)
    assert wanted is not None
    return Need(table.values["variable"], table.values["what"], kind, limit, wanted)  # type: ignore[arg-type]
