"""Cases read from TOML: `NAME.regress.toml` (or `regress.toml`), one case a file or several as [[case]]."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from orchestrator.cosim.values import value_of
from orchestrator.measurements.toml_values import TomlTable, number
from orchestrator.measurements.wording import nearest, shown
from orchestrator.regress.case import Case, CaseLimits, Reference, Stimulus
from orchestrator.regress.check_tables import check_names, read_formulas, read_signals, read_tolerance
from orchestrator.regress.comparison import Check
from orchestrator.regress.names import ENDING

# Keys of each check with the value that `CHECK = true` stands for; None has to be given.
CHECKS: dict[str, dict[str, Any]] = {
    "conformance": {"accept": ()},
    "determinism": {},
    "save_restore": {"at": 0.5, "within": 0.0},
    "convergence": {"halvings": 2, "within": 1e-3},
    "release": {"fmu": None, "allow": "minor"},
    "speed": {"fmu": None, "at_most": 1.5, "memory_at_most": 1.5, "runs": 5},
}


def settings_of(table: TomlTable) -> dict[str, Mapping[str, Any]]:
    """Settings of the checks that [checks] names, complete.

    Raises:
        MisfitError: if a check or key is unknown, or a value is of another type.
    """
    found: dict[str, Mapping[str, Any]] = {}
    for name, given in table.values.items():
        if name not in CHECKS:
            raise MisfitError(f"{table.where}: unknown check {shown(name)}; {nearest(name, CHECKS)}")
        usual = CHECKS[name]
        if given is False:
            continue
        if isinstance(given, str) and "fmu" in usual:
            given = {"fmu": given}
        if given is not True and not isinstance(given, dict):
            raise table.wrong(name, "true, false or a table")
        own = TomlTable(f"{table.where} {name}", {} if given is True else given)
        found[name] = {**usual, **{key: _value(own, key, usual) for key in own.values}}
        missing = [key for key, value in found[name].items() if value is None]
        if missing:
            raise MisfitError(f"{own.where}: no {missing[0]}; expected a file to compare with")
    return found


def _value(table: TomlTable, key: str, usual: Mapping[str, Any]) -> Any:
    if key not in usual:
        raise MisfitError(f"{table.where}: unknown key {shown(key)}; {nearest(key, usual)}")
    value, like = table.values[key], usual[key]
    if isinstance(like, tuple):
        return table.get_texts(key)
    if isinstance(like, int | float):
        found = number(value)
        if found is None or found <= 0.0:
            raise table.wrong(key, "a number above 0")
        return int(found) if isinstance(like, int) else found
    if not isinstance(value, str) or not value:
        raise table.wrong(key, "a text in quotation marks")
    return value


_CASE = (
    "model",
    "run",
    "parameters",
    "inputs",
    "reference",
    "tolerance",
    "signals",
    "formulas",
    "checks",
    "interface",
    "limits",
    "tags",
    "description",
)
# What a case says that is only about the model as a whole.
NO_REFERENCE = "none"
_RUN = ("start", "stop", "step", "master", "tolerance", "interface")
_INTERFACES = ("CoSimulation", "ModelExchange")
_INTERFACE = ("allow",)
_LIMITS = ("seconds", "patience_s", "memory_gib", "retries")


def read_cases(path: Path) -> list[Case]:
    """Read the cases of a file.

    Raises:
        MisfitError: if it is no TOML or no case; names file, table, key, value and what was expected.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise MisfitError(f"{path} cannot be read: {error.strerror}; expected a case file") from error
    table = TomlTable.parse(path, content)
    table.check_keys((*_CASE, "case"))
    base = path.name.removesuffix(ENDING).removesuffix(".toml")
    several = table.values.get("case")
    if several is None:
        return [_case(table, base, path)]
    if not isinstance(several, list) or not several or not all(isinstance(each, dict) for each in several):
        raise table.wrong("case", "tables [[case]], each with a name")
    shared = {key: value for key, value in table.values.items() if key != "case"}
    cases = []
    for place, each in enumerate(several, 1):
        one = TomlTable(f"{path} [[case]] {place}", _merged(shared, {k: v for k, v in each.items() if k != "name"}))
        name = each.get("name")
        if not isinstance(name, str) or not name or "/" in name:
            raise MisfitError(f"{one.where}: name = {shown(name)}; expected a name for this case, without '/'")
        cases.append(_case(one, f"{base}/{name}", path))
    names = [case.name for case in cases]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise MisfitError(f"{path}: two cases are called {twice[0]!r}; give each its own name")
    return cases


def _merged(shared: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """What all cases of a file have, with one case's own keys over it, table by table."""
    found = dict(shared)
    for key, value in own.items():
        both = isinstance(value, dict) and isinstance(found.get(key), dict)
        found[key] = _merged(found[key], value) if both else value
    return found


def _case(table: TomlTable, name: str, path: Path) -> Case:
    table.check_keys(_CASE)
    model = table.get_text("model")
    if not model:
        raise MisfitError(
            f'{table.where}: no model; expected an FMU, a system file or a built-in, such as model = "Ball.fmu"'
        )
    run = table.get_table("run")
    run.check_keys(_RUN)
    interface = run.get_text("interface")
    if interface and interface not in _INTERFACES:
        raise run.wrong("interface", " or ".join(_INTERFACES))
    tolerance = read_tolerance(table.get_table("tolerance"))
    parameters = table.get_table("parameters")
    signals = read_signals(table.get_table("signals"), tolerance)
    formulas = read_formulas(table.get_table("formulas"))
    check_names(formulas, tuple(signals))
    return Case(
        name=name,
        file=path,
        model=model,
        interface=interface,
        start=run.get_number("start"),
        stop=run.get_number("stop"),
        step=run.get_positive("step"),
        master=run.get_text("master") or None,
        solver_tolerance=run.get_positive("tolerance"),
        parameters={key: value_of(parameters, key) for key in parameters.values},
        stimulus=_stimulus(table.get_table("inputs"), path.parent),
        reference=_reference(table) or _default_reference(table, name, path, signals),
        signals=signals,
        formulas=formulas,
        tolerance=tolerance,
        checks=settings_of(table.get_table("checks")),
        allowed=_allowed(table.get_table("interface")),
        limits=_limits(table.get_table("limits")),
        tags=table.get_texts("tags") or (),
    )


def _allowed(table: TomlTable) -> tuple[str, ...]:
    table.check_keys(_INTERFACE)
    return table.get_texts("allow") or ()


def _stimulus(table: TomlTable, folder: Path) -> Stimulus:
    """`file`, `hold` and `columns`, then one generator, or constant number, for each input."""
    file = table.get_text("file")
    signals: dict[str, Mapping[str, Any]] = {}
    for key, value in table.values.items():
        if key in ("file", "hold", "columns"):
            continue
        constant = number(value) if not isinstance(value, bool) else float(value)
        if constant is not None:
            signals[key] = {"kind": "constant", "value": constant}
        elif isinstance(value, dict):
            signals[key] = value
        else:
            raise table.wrong(key, 'a number or a generator such as { kind = "step", at = 1.0, to = 2.0 }')
    columns = table.get_table("columns").texts()
    return Stimulus(folder / file if file else None, table.get_flag("hold") is True, signals, columns)


def _reference(table: TomlTable) -> Reference | None:
    if table.values.get("reference") == NO_REFERENCE:
        return None
    if isinstance(table.values.get("reference"), str):
        return Reference("file", table.values["reference"])
    given = table.get_table("reference")
    if not given.values:
        return None
    given.check_keys(("file", "own", "model", "measurement", "columns", "trial", "floors", "points"))
    kinds = [kind for kind in ("file", "own", "model", "measurement") if kind in given.values]
    if len(kinds) != 1:
        found = " and ".join(kinds) or "none of them"
        raise MisfitError(f"{given.where}: {found}; expected one of file, own, model or measurement")
    kind = kinds[0]
    if kind == "own":
        if given.get_flag("own") is not True:
            raise given.wrong("own", "true, for the results that the FMU brings along")
        return Reference("own", points=True)
    trial = given.values.get("trial", 1)
    if isinstance(trial, bool) or not isinstance(trial, int | str):
        raise given.wrong("trial", "a trial's number from 1, or its name")
    columns = given.get_table("columns").texts()
    floors, points = given.get_positive("floors") or 5.0, given.get_flag("points") is True
    return Reference(kind, given.get_text(kind), columns, trial, floors, points)


def default_reference(name: str) -> str:
    """Where a case without a word on it has its reference, beside its file.

    Example:
        >>> default_reference("ball/drop")
        'ball_drop_ref.csv'
    """
    return f"{name.replace('/', '_')}_ref.csv"


def _default_reference(
    table: TomlTable, name: str, path: Path, signals: Mapping[str, Sequence[Check]]
) -> Reference | None:
    """The usual file, unless nothing of the case could be compared with it or it says `reference = "none"`."""
    if table.values.get("reference") == NO_REFERENCE:
        return None
    source = default_reference(name)
    compared = not signals or any(check.needs_reference for several in signals.values() for check in several)
    return Reference("file", source) if compared or (path.parent / source).is_file() else None


def _limits(table: TomlTable) -> CaseLimits:
    table.check_keys(_LIMITS)
    retries = table.values.get("retries", 0)
    if isinstance(retries, bool) or not isinstance(retries, int) or not 0 <= retries <= 10:
        raise table.wrong("retries", "a whole number from 0 to 10")
    usual = CaseLimits()
    return CaseLimits(
        table.get_positive("seconds") or usual.seconds,
        table.get_positive("patience_s") or usual.patience_s,
        table.get_positive("memory_gib") or usual.memory_gib,
        retries,
    )
