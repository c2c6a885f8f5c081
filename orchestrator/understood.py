"""What a model and a recording were understood as, before anything is fitted: the first thing that a user sees."""

from collections.abc import Iterator, Sequence
from itertools import product

from fmus.symbolic.balances import Balance
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.blackbox.source import FmuSource, Source
from orchestrator.greybox.candidates import fits
from orchestrator.greybox.kept import driven
from orchestrator.greybox.laws import laws
from orchestrator.greybox.places import unscaled_places
from orchestrator.greybox.tape import can_be_taped, outline
from orchestrator.measurements import MeasurementSet
from orchestrator.measurements.matching import match_columns
from orchestrator.measurements.wording import counted
from orchestrator.models.patch import free_slots
from orchestrator.report.answer.words import name_of

# What adds up in a balance equation of a unit.
TERMS = {
    "N": "forces",
    "N.m": "torques",
    "W": "heat flows",
    "A": "currents",
    "V": "voltages",
    "Pa.m3/s": "gas flows",
    "m3/s": "volume flows",
    "kg/s": "mass flows",
    "mol/s": "molar flows",
    "Pa": "pressures",
}
MOST_LISTED = 12
# Where effects of each kind of place are tried, in words.
TRIED = {
    "motion": "balances",
    "storage": "balances",
    "between_motions": "two balances",
    "between_storages": "two balances",
    "input": "inputs",
    "output": "outputs",
}


def understood(source: Source, measurements: MeasurementSet) -> list[str]:
    """Say what a model and its data were understood as; of an FMU in model exchange what its rates show about its start.

    Returns:
        Lines of text: states with units, balance equations with their places, columns and the variables that they are, and
        where a missing effect will be looked for.

    Raises:
        ModelicaError: if the model cannot be compiled.
        ComponentError: if an FMU fails.
    """
    if isinstance(source, FmuSource):
        return _of_fmu(source, measurements)
    system, balances = source.balanced()
    names = driven(system, balances)
    inputs = [v for v in system.inputs if v.name in names]
    outputs = [v for v in (*system.states, *system.algebraics) if v.name in system.outputs]
    lines = [
        f"Model {source.class_name}: {counted(len(system.states), 'state')}, {counted(len(inputs), 'input')}, "
        f"{counted(len(system.outputs), 'output')}, {counted(len(system.parameters), 'parameter')}"
    ]
    lines += _listed([f"  {_state(v, balances)}" for v in system.states], "states")
    lines += _listed([f"  {note}" for note in system.notes], "notes")
    lines += _data(measurements, inputs, outputs)
    return [*lines, *_places(system, balances, inputs, outputs)]


def _of_fmu(source: FmuSource, measurements: MeasurementSet) -> list[str]:
    description = source.fmu.started
    inputs, outputs, states, parameters = (
        [port.variable for port in ports]
        for ports in (description.inputs, description.outputs, description.states, description.parameters)
    )
    balances = outline(source).balances if can_be_taped(source) else ()
    kind = "co-simulation" if description.cosimulation else "model exchange"
    lines = [
        f"FMU {source.class_name} ({kind}): {counted(len(states), 'state')}, {counted(len(inputs), 'input')}, "
        f"{counted(len(outputs), 'output')}, {counted(len(parameters), 'parameter')}"
    ]
    if balances:
        lines += _listed([f"  {_state(v, balances)}" for v in states], "states")
    lines += _data(measurements, inputs, outputs)
    where = f"{counted(len(balances), 'balance equation')}, " if balances else ""
    wrong = len(parameters) if balances else len(source.sites.parameters)
    values = f", the values of {counted(wrong, 'parameter')}" if wrong else ""
    paths = f"the paths of {counted(len(inputs), 'input')} and {counted(len(outputs), 'output')}"
    return [*lines, f"Places for an effect: {where}{paths}{values}"]


def _state(state: Variable, balances: Sequence[Balance]) -> str:
    balance = next((b for b in balances if b.state == state.name), None)
    shown = _with_unit(state)
    if balance is None:
        return f"{shown}: follows from other variables, no balance equation"
    what = TERMS.get(balance.unit, "rates") + (f" in {balance.unit}" if balance.unit else "")
    return f"{shown}: balance of {what}" + (f", {balance.place}" if balance.place else "")


def _data(measurements: MeasurementSet, inputs: Sequence[Variable], outputs: Sequence[Variable]) -> Iterator[str]:
    trials = measurements.trials
    columns = tuple(trials[0].columns)
    rows = sum(len(trial.time) for trial in trials)
    seconds = sum(float(trial.time[-1] - trial.time[0]) for trial in trials if len(trial.time))
    yield (
        f"Data: {len(measurements.learning)} learning and {len(measurements.held_out)} held-out trials, {rows} rows, "
        f"{_duration(seconds)}"
    )
    column_of = match_columns(columns, measurements.variables, [v.name for v in (*inputs, *outputs)]).column_of
    for words, variables in (("input", inputs), ("output", outputs)):
        found = [f"{_with_unit(v)} from column {column_of[v.name]}" for v in variables if v.name in column_of]
        missing = [v for v in variables if v.name not in column_of]
        yield from _listed([f"  {words} {text}" for text in found], f"{words}s")
        if missing:
            kept = "stays at its start" if words == "input" else "is not compared"
            yield f"  no column for {words} {', '.join(map(_with_unit, missing[:MOST_LISTED]))}: it {kept}"
    unused = [column for column in columns if column not in column_of.values()]
    if unused:
        yield f"  columns that are not used: {', '.join(unused[:MOST_LISTED])}"


def _places(
    system: SymbolicSystem, balances: Sequence[Balance], inputs: Sequence[Variable], outputs: Sequence[Variable]
) -> list[str]:
    slots = free_slots(system)
    if slots:
        return [f"Effects will be tried in the model's {counted(len(slots), 'slot')}: {', '.join(slots[:MOST_LISTED])}"]
    found = unscaled_places(system, balances, [v.name for v in inputs])
    tried: dict[str, dict[bool, list[str]]] = {}
    for place, law in product(found, laws()):
        if place.kind in TRIED and fits(law, place):
            names = tried.setdefault(TRIED[place.kind], {False: [], True: []})[law.rare]
            names.append(name_of(law.id_at(place.unit)))
    return [
        f"Places for an effect: {counted(len(balances), 'balance equation')}, the paths of {counted(len(inputs), 'input')} and "
        f"{counted(len(outputs), 'output')}, the values of {counted(len(system.parameters), 'parameter')}",
        *(f"  at {where}: {_in_turn(names[False], names[True])}" for where, names in tried.items()),
    ]


def _in_turn(first: Sequence[str], then: Sequence[str]) -> str:
    """Names of what is tried, and of what is tried where that leaves much; each once."""
    parts = [", ".join(dict.fromkeys(names)) for names in (first, [name for name in then if name not in first])]
    return "; if these leave much: ".join(part for part in parts if part)


def _duration(seconds: float) -> str:
    for unit, length in (("days", 86_400.0), ("h", 3_600.0), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds:.3g} s"


def _with_unit(variable: Variable) -> str:
    return f"{variable.name} [{variable.unit}]" if variable.unit not in ("", "1") else variable.name


def _listed(lines: list[str], words: str) -> list[str]:
    more = len(lines) - MOST_LISTED
    return lines if more <= 0 else [*lines[:MOST_LISTED], f"  and {more} more {words}"]
