"""Effect cards: what a missing effect is called, which Modelica class adds it, where it can attach."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

from fmus.errors import MisfitError
from orchestrator.library.needs import Need, read_needs
from orchestrator.measurements.toml_values import TomlTable

SHIPPED = Path(__file__).parent / "cards"
ELEMENTS = ("together", "each", "pairs")
_KEYS = (
    "id",
    "title",
    "class",
    "slots",
    "site",
    "elements",
    "parameters",
    "confusable",
    "experiment",
    "variant",
    "needs",
    "contacts",
    "imperfect",
)
_OPTIONAL = ("confusable", "experiment", "variant", "needs", "contacts", "imperfect")
_PARAMETER_KEYS = ("start", "absent", "meaningful", "start_from", "grid", "waves_over", "phase")


@dataclass(frozen=True)
class CardParameter:
    """A fitted parameter of an effect.

    `start` is the first guess, `absent` the value (or limit) at which the effect vanishes, `meaningful` the smallest
    departure from it that matters; of a time constant that is infinite where the effect is absent, so that its inverse says
    how large that is, the largest value that matters. Unit and bounds are declared in the Modelica class. With `start_from`
    "residual_peak_hz" the first guess is the frequency at which the correction residual is largest. With a `grid` it is
    the value of the grid at which the effect's other parameters, taken linearly, explain the most; with `waves_over`, a
    variable of the card's needs, it is a number of waves, of which the grid is as fine as the record tells apart. With a
    `phase`, two states of that name in the class are sine and cosine of a phase, and the parameter is the amplitude of an
    oscillation, the same one if all three change sign, so answers give the form in which the largest element is positive.
    `low` and `high` are bounds within those of the class, which come from a record (see `placed.py`).
    """

    name: str
    start: float
    absent: float
    meaningful: float
    start_from: Literal["", "residual_peak_hz"] = ""
    grid: tuple[float, ...] = ()
    waves_over: str = ""
    phase: str = ""
    low: float = -math.inf
    high: float = math.inf

    @property
    def zero(self) -> float:
        """The value from which departures count against standard deviations: of T, infinite at absence, 1/T has as many
        as T."""
        return self.absent if math.isfinite(self.absent) else 0.0

    def matters(self, value: float) -> bool:
        """Whether the effect is there in a size that matters.

        >>> slow, rigid = (CardParameter("T", 30.0, math.inf, m) for m in (700.0, math.inf))
        >>> slow.matters(600.0), slow.matters(800.0), rigid.matters(1.0)
        (True, False, False)
        """
        if not math.isfinite(self.meaningful):
            return False
        return value <= self.meaningful if math.isinf(self.absent) else abs(value - self.absent) >= self.meaningful


@dataclass(frozen=True)
class EffectCard:
    """One effect of the library.

    `slots` are the replaceable parts of a model that can hold it, in order of preference. `elements` tells whether the
    elements of its parameter arrays (joints, muscles) are fitted together, stand for one site each, or are the entries
    of a matrix off its diagonal, one site each ("pairs"; `site` is then a pattern such as `channel{0}->muscle{1}`).
    Cards of one id with different laws differ in `variant`. `needs` is the excitation without which the effect does not
    show. An effect with `contacts` makes and breaks them, so that a run which is off by a little goes another way: its
    fits begin with the first stretches of the trials. An effect is `imperfect` by the share (rms) of what it does that
    its class, whose equations must be solved, leaves of the law. `card_file` is where the card stands; `class_file` is
    the Modelica file of its class, None for a class of the shipped library.
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
    needs: tuple[Need, ...] = ()
    contacts: bool = False
    imperfect: float = 0.0
    card_file: Path | None = None
    class_file: Path | None = None

    @property
    def class_text(self) -> str:
        """Modelica text of the class, empty for a class of the shipped library."""
        return "" if self.class_file is None else self.class_file.read_text()


def read_card(path: Path) -> EffectCard:
    """Read a card from its TOML file; its class is one of the library `FESArm`, or stands in a `.mo` file beside it.

    Raises:
        MisfitError: if the file is not a complete card; one line names the file, the key and what was expected.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise MisfitError(f"effect card {path} cannot be read: {error.strerror}") from error
    table = TomlTable.parse(path, content)
    _check_keys(table, _KEYS, _OPTIONAL)
    effect_id, class_name, elements = (_text(table, key) for key in ("id", "class", "elements"))
    if not re.fullmatch(r"[a-z][a-z0-9_]*", effect_id):
        raise table.wrong("id", "small letters, digits and underscores, such as 'magnetic_drag'")
    if elements not in ELEMENTS:
        raise table.wrong("elements", f"one of {', '.join(ELEMENTS)}")
    slots = table.get_texts("slots")
    if not slots:
        raise table.wrong("slots", 'a list of slots of the model, such as ["jointTorque1"]')
    names = table.get_table("parameters")
    if not names.values:
        raise table.wrong("parameters", "at least one table such as [parameters.b], for what is fitted")
    needs = read_needs(table, names.values)
    variables = [need.variable for need in needs]
    parameters = tuple(_parameter(name, _parameter_table(table, names, name), variables) for name in names.values)
    return EffectCard(
        id=effect_id,
        title=_text(table, "title"),
        class_name=class_name,
        slots=slots,
        site=_text(table, "site"),
        elements=elements,  # type: ignore[arg-type]  # checked above
        confusable=table.get_texts("confusable") or (),
        experiment=_text(table, "experiment") if "experiment" in table.values else "",
        parameters=parameters,
        variant=_text(table, "variant") if "variant" in table.values else "",
        needs=needs,
        contacts=_flag(table, "contacts"),
        imperfect=_share(table, "imperfect"),
        card_file=path,
        class_file=_class_file(table, path.parent, class_name),
    )


def _parameter(name: str, table: TomlTable, variables: Sequence[str]) -> CardParameter:
    _check_keys(table, _PARAMETER_KEYS, ("start_from", "grid", "waves_over", "phase"))
    start_from = table.values.get("start_from", "")
    if start_from not in ("", "residual_peak_hz"):
        raise table.wrong("start_from", '"residual_peak_hz", or leave it out')
    grid = table.values.get("grid", [])
    if not isinstance(grid, list) or not all(_is_number(value) for value in grid):
        raise table.wrong("grid", "a list of numbers")
    waves_over = _text(table, "waves_over") if "waves_over" in table.values else ""
    if waves_over and waves_over not in variables:
        raise table.wrong(
            "waves_over", f"the variable of one of the card's [[needs]]: {', '.join(variables) or 'it has none'}"
        )
    if waves_over and (len(grid) < 2 or any(low >= high for low, high in pairwise(grid))):
        raise table.wrong(
            "waves_over", "with it a `grid` of two or more numbers of waves that ascend, to be made finer"
        )
    meaningful = _number(table, "meaningful")
    if meaningful <= 0:
        raise table.wrong("meaningful", "a number above 0: the smallest departure from `absent` that matters")
    return CardParameter(
        name=name,
        start=_number(table, "start"),
        absent=_number(table, "absent"),
        meaningful=meaningful,
        start_from=start_from,
        grid=tuple(map(float, grid)),
        waves_over=waves_over,
        phase=_text(table, "phase") if "phase" in table.values else "",
    )


def _parameter_table(card: TomlTable, names: TomlTable, name: str) -> TomlTable:
    return TomlTable(f"{card.where} [parameters.{name}]", names.get_table(name).values)


def _check_keys(table: TomlTable, known: Sequence[str], optional: Sequence[str]) -> None:
    for key in table.values:
        if key not in known:
            near = get_close_matches(key, known, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"keys are {', '.join(known)}"
            raise MisfitError(f"{table.where}: '{key}' is no key of an effect card; {hint}")
    for key in known:
        if key not in table.values and key not in optional:
            raise MisfitError(f"{table.where}: lacks '{key}'; an effect card needs it")


def _text(table: TomlTable, key: str) -> str:
    value = table.values[key]
    if not isinstance(value, str) or not value.strip():
        raise table.wrong(key, "a text in quotation marks")
    return value


def _flag(table: TomlTable, key: str) -> bool:
    value = table.values.get(key, False)
    if not isinstance(value, bool):
        raise table.wrong(key, "true or false")
    return value


def _number(table: TomlTable, key: str) -> float:
    if not _is_number(table.values[key]):
        raise table.wrong(key, "a number")
    return float(table.values[key])


def _share(table: TomlTable, key: str) -> float:
    value = table.values.get(key, 0.0)
    if not _is_number(value) or not 0.0 <= value < 1.0:
        raise table.wrong(key, "a share, from 0 to less than 1")
    return float(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value == value


def _class_file(table: TomlTable, folder: Path, class_name: str) -> Path | None:
    """The `.mo` file beside the card that declares its class at top level; None for a class of the library."""
    if class_name.startswith("FESArm."):
        return None
    if "." in class_name:
        raise table.wrong("class", "a class at the top of its file (no dots), or one of the library FESArm")
    files = sorted(folder.glob("*.mo"))
    declares = re.compile(rf"^\s*(?:model|block)\s+{re.escape(class_name)}\b", re.MULTILINE)
    for file in files:
        text = file.read_text(errors="replace")
        if declares.search(text):
            if re.search(r"^\s*within\s+\w", text, re.MULTILINE):
                raise MisfitError(
                    f"{table.where}: class {class_name} in {file.name} is part of a package; remove `within`"
                )
            return file
    beside = ", ".join(file.name for file in files) or "no .mo file"
    raise table.wrong("class", f"a model declared in a .mo file beside the card; there is {beside}")


@cache
def _shipped() -> tuple[EffectCard, ...]:
    return tuple(read_card(path) for path in sorted(SHIPPED.glob("*.toml")))


def _is_law(file: Path) -> bool:
    """Whether a card is a formula of its own, for models without slots (`orchestrator/greybox/laws.py` reads those)."""
    return b"\nexpression" in b"\n" + file.read_bytes()


def effect_library(folders: Sequence[Path] = ()) -> tuple[EffectCard, ...]:
    """Return the shipped cards, by file name, then those of the user's folders.

    Raises:
        MisfitError: if a folder holds no card, or a card is not complete or repeats another one.
    """
    cards = list(_shipped())
    for folder in folders:
        files = sorted(folder.glob("*.toml"))
        if not files:
            raise MisfitError(f"{folder}: no effect card there; expected a folder with cards (*.toml)")
        cards += [read_card(file) for file in files if not _is_law(file)]
    known: dict[tuple[str, str], EffectCard] = {}
    for card in cards:
        other = known.setdefault((card.id, card.variant), card)
        if other is not card:
            where = "the shipped library" if other.card_file and other.card_file.parent == SHIPPED else other.card_file
            raise MisfitError(
                f"{card.card_file}: id = '{card.id}' is taken by {where}; choose another id, or tell them apart by `variant`"
            )
    return tuple(cards)


@dataclass(frozen=True)
class Candidate:
    """An effect at a site: `element` is its subscript in the parameter arrays (`[3]`), empty for all together."""

    card: EffectCard
    slot: str
    element: str
    site: str

    @property
    def label(self) -> str:
        """Short name for progress and messages."""
        return f"{self.card.id} {self.card.variant}".rstrip() + f" at {self.site}"
