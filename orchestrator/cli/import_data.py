"""`misfit import`: recorded files as they are become a measurement set."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fmus.errors import MisfitError
from orchestrator.cli.common import can_be_filled, json_option, library_option, quiet_option, show, write_json

if TYPE_CHECKING:
    from orchestrator.measurements.dirty.plan import Plan, Wishes
    from orchestrator.models.contract import Model

HOW = ("linear", "hold")
# Model and record tell it later.
OPEN = "as the data say"


@click.command("import")
@click.argument("data", nargs=-1, required=True, metavar="FILES|FOLDER", type=click.Path(path_type=Path))
@click.option("--model", metavar="MODEL", help="Match the columns with the inputs and outputs of MODEL.")
@click.option("--yes", is_flag=True, help="Take what is proposed; else it is asked on a terminal.")
@click.option(
    "--out",
    "folder",
    metavar="DIR",
    callback=can_be_filled,
    help="Where case.toml and copies of the files go; the files' own folder by default.",
)
@click.option(
    "--map",
    "mapped",
    multiple=True,
    metavar="COLUMN=VARIABLE",
    help="This column is that variable of the model; nothing after '=' keeps it out.",
)
@click.option("--unit", "units", multiple=True, metavar="COLUMN=UNIT", help="The unit of a column, such as theta=deg.")
@click.option(
    "--interpolation", "held", multiple=True, metavar="COLUMN=hold|linear", help="How an input runs between samples."
)
@click.option("--time", "time", metavar="COLUMN", help="The column that holds time.")
@click.option(
    "--rate",
    "rate_hz",
    type=click.FloatRange(0, min_open=True),
    metavar="HZ",
    help="Sampling rate of files without a time.",
)
@click.option(
    "--bridge",
    "bridge_up_to_s",
    type=click.FloatRange(0),
    metavar="SECONDS",
    help="Holes up to this long are bridged, longer ones cut out; 0 cuts all.",
)
@click.option(
    "--held-out", "held_out", metavar="N,N", default="", help="Numbers of the trials that are kept for the final score."
)
@library_option
@json_option
@quiet_option
def import_data(
    data: tuple[Path, ...],
    model: str | None,
    yes: bool,
    folder: str | None,
    mapped: tuple[str, ...],
    units: tuple[str, ...],
    held: tuple[str, ...],
    time: str | None,
    rate_hz: float | None,
    bridge_up_to_s: float | None,
    held_out: str,
    json_file: str | None,
    quiet: bool,
) -> None:
    """Write a case.toml for recorded FILES as they are: any separator, decimal sign, encoding, header and clock."""
    from orchestrator.measurements.dirty.plan import Wishes, proposed_plan
    from orchestrator.measurements.dirty.write import home_of, require_free, write_plan
    from orchestrator.measurements.load import load_measurements
    from orchestrator.model_argument import load_model
    from orchestrator.models.correction import PREFIX

    target = Path(folder) if folder else home_of(data)
    require_free(target)
    wishes = Wishes(
        _pairs("--map", mapped),
        _units(units),
        _interpolations(held),
        rate_hz,
        time,
        bridge_up_to_s,
        _numbers(held_out),
    )
    loaded = load_model(model) if model else None

    def propose(wishes: "Wishes") -> "Plan":
        return proposed_plan(data, loaded.inputs if loaded else (), loaded.outputs if loaded else (), wishes)

    plan = propose(wishes)
    if not yes:
        plan = _asked(plan, wishes, propose, loaded)
    elif not quiet:
        _show(plan, loaded)
    _require_an_output(plan, loaded)
    case = write_plan(plan, target)
    notes = (*plan.notes, *(note for note in load_measurements(target).notes if note not in plan.notes))
    notes += _assumed_units(plan, loaded)
    notes += tuple(
        f"no column is the input {v.name!r} of the model, which stays at {v.start or 0.0:g} {v.unit or ''}".rstrip()
        for v in (loaded.inputs if loaded else ())
        if v.name not in plan.variable_of.values() and not v.name.startswith(PREFIX)
    )
    write_json(json_file, _document(plan, case, notes, loaded))
    show(
        "\n".join([*notes, f"{case} is written; next: misfit compare {model or 'MODEL'} {target}"]),
        quiet or json_file == "-",
    )


def _asked(plan: "Plan", wishes: "Wishes", propose: Any, loaded: "Model | None") -> "Plan":
    """Show the proposal and change it column by column until it is taken."""
    if not sys.stdin.isatty():
        raise MisfitError(
            "misfit import asks what each column is, which needs a terminal; add --yes to take what it proposes"
        )
    while True:
        _show(plan, loaded)
        number = click.prompt(
            "Number of a column to change, or Enter to write case.toml",
            default=0,
            show_default=False,
            type=click.IntRange(0, len(plan.columns)),
        )
        if not number:
            return plan
        changed = _changed(plan, wishes, plan.columns[number - 1], loaded)
        try:
            plan, wishes = propose(changed), changed
        except MisfitError as error:
            show(f"not changed: {error}", False)


def _changed(plan: "Plan", wishes: "Wishes", column: str, loaded: "Model | None") -> "Wishes":
    """Ask what one column is."""
    from dataclasses import replace

    variables, units, held = dict(wishes.variables), dict(wishes.units), dict(wishes.interpolation)
    drives = True
    if loaded is not None:
        names = ["", *(v.name for v in (*loaded.inputs, *loaded.outputs))]
        show("\n".join(f"{place:3} {name or '(none)'}" for place, name in enumerate(names)), False)
        now = names.index(plan.variable_of.get(column, ""))
        variables[column] = names[click.prompt("Variable", default=now, type=click.IntRange(0, len(names) - 1))]
        drives = variables[column] in {v.name for v in loaded.inputs}
    units[column] = click.prompt("Unit", default=plan.units.get(column, "1"), value_proc=_unit)
    if drives:
        now_held = plan.interpolation.get(column, OPEN)
        said = click.prompt("Between samples", default=now_held, type=click.Choice((*HOW, OPEN)))
        held[column] = "" if said == OPEN else said
    return replace(wishes, variables=variables, units=units, interpolation=held)


def _show(plan: "Plan", loaded: "Model | None") -> None:
    from rich import box
    from rich.table import Table

    first = plan.files[0]
    table = Table(box=box.SIMPLE_HEAD, title=_heading(plan), title_justify="left")
    for name in ("", "column", "unit", "variable", "what becomes of it", "between samples"):
        table.add_column(name)
    for row in _rows(plan, loaded):
        table.add_row(*(str(row[key]) for key in ("number", "column", "unit", "variable", "role", "interpolation")))
    show(table, False)
    clock = " and ".join(first.reading.time) or f"counted at {first.rate_hz:g} Hz"
    show(f"time: {clock}", False)


def _heading(plan: "Plan") -> str:
    from orchestrator.measurements.dirty.files import separator_words

    files = plan.files[0].path.name if len(plan.files) == 1 else f"{len(plan.files)} files"
    return f"{files}: {separator_words(plan.files[0].reading)}"


def _rows(plan: "Plan", loaded: "Model | None") -> list[dict[str, Any]]:
    why = {each.column: each.why for each in plan.assigned}
    rows = []
    for number, column in enumerate(plan.columns, 1):
        variable = plan.variable_of.get(column, "")
        role = "kept and shown" if not variable else "drives the model" if column in plan.inputs else "compared"
        reason = f" ({why[column]})" if column in why else ""
        drives = column in plan.inputs or loaded is None
        rows.append(
            {
                "number": number,
                "column": column,
                "unit": plan.units.get(column, "not given"),
                "variable": variable,
                "role": f"{role}{reason}" if loaded else "",
                "interpolation": plan.interpolation.get(column, OPEN) if drives else "",
            }
        )
    return rows


def _assumed_units(plan: "Plan", loaded: "Model | None") -> tuple[str, ...]:
    """Degrees taken as radians are an error that no later check may find, so it is said."""
    units = {v.name: v.unit for v in (*loaded.inputs, *loaded.outputs) if v.unit not in ("", "1")} if loaded else {}
    assumed = [
        f"{column} ({units[variable]})"
        for column, variable in plan.variable_of.items()
        if column not in plan.units and variable in units
    ]
    if not assumed:
        return ()
    return (
        f"no unit is stated, so the model's is taken: {', '.join(assumed)}; --unit COLUMN=UNIT says what else it is",
    )


def _require_an_output(plan: "Plan", loaded: "Model | None") -> None:
    from orchestrator.measurements.wording import listed

    if loaded is None:
        return
    if not set(plan.variable_of.values()) & {v.name for v in loaded.outputs}:
        raise MisfitError(
            f"no column is an output of the model; outputs: {listed(v.name for v in loaded.outputs)}; columns: {listed(plan.columns)}; say which is which with --map COLUMN=VARIABLE"
        )


def _document(plan: "Plan", case: Path, notes: tuple[str, ...], loaded: "Model | None") -> dict[str, Any]:
    return {
        "schema": "misfit.import/1",
        "case": str(case),
        "files": [file.path.name for file in plan.files],
        "time": list(plan.files[0].reading.time),
        "columns": [{k: v for k, v in row.items() if k != "number"} for row in _rows(plan, loaded)],
        "notes": list(notes),
    }


def _pairs(option: str, given: tuple[str, ...]) -> dict[str, str]:
    found = {}
    for text in given:
        column, sign, value = text.rpartition("=")
        if not sign or not column:
            raise click.UsageError(f"{option} {text}: expected COLUMN=VALUE")
        found[column.strip()] = value.strip()
    return found


def _units(given: tuple[str, ...]) -> dict[str, str]:
    return {column: _unit(unit) for column, unit in _pairs("--unit", given).items()}


def _unit(text: str) -> str:
    from orchestrator.measurements.dirty.header_units import read_unit

    unit = read_unit(text)
    if unit is None:
        raise click.UsageError(f"{text!r} is no unit that is known; use SI symbols such as N.m, rad/s or deg, or 1")
    return unit


def _interpolations(given: tuple[str, ...]) -> dict[str, str]:
    found = _pairs("--interpolation", given)
    for column, how in found.items():
        if how not in HOW:
            raise click.UsageError(f"--interpolation {column}={how}: expected hold or linear")
    return found


def _numbers(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(",") if part.strip())
    except ValueError:
        raise click.UsageError(f"--held-out {text}: expected trial numbers such as 5,6") from None
