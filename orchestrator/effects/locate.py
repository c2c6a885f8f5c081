"""Where the balance equation of a state is written, and on which side a term belongs."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from fmus.errors import ModelicaError
from fmus.flat.model import FlatEquation
from fmus.frontend.lint.scope import View
from fmus.frontend.lint.sources import modelica_text
from fmus.frontend.lint.tree import EquationText
from orchestrator.effects.changes import Term
from orchestrator.effects.copies import file_of
from orchestrator.effects.homes import Home, homes_at, split
from orchestrator.effects.names import plain, position
from orchestrator.effects.points import FlatPoints

SMALL = 1e-9


@dataclass(frozen=True)
class Balance:
    """A scalar row of a flat equation that determines the derivative of a state, or a force that does.

    `sign` is that of der(state), or of the force, in left minus right side; `row` of `rows` is the row. `others` are variables that equal der(state)
    but for their sign, one of which the equation holds in its place.
    """

    number: int
    equation: FlatEquation
    sign: float
    row: int
    rows: int
    others: tuple[str, ...] = ()


def balance_of(term: Term, flat: FlatPoints, states: Sequence[str], values: Sequence[Mapping[str, float]]) -> Balance:
    """The flat equation that a term belongs to.

    Args:
        term: what is to be added, and to the balance of which state.
        flat: the flat equations, which can be evaluated.
        states: names of the states.
        values: values of all variables at several points.

    Raises:
        ModelicaError: if there is none, or if it is written nowhere.
    """
    if term.force:
        return _of_force(term, flat, values[0])
    if any(f"der({term.state})" not in at for at in values):
        raise ModelicaError(f"'{term.state}' is no state of the model; its states are {', '.join(states)}")
    found = list(_tries(term.state, states, flat, values))
    if not any(found):
        raise ModelicaError(
            f"no equation of the model determines der({term.state}); name a state with a balance equation"
        )
    file, _, line = term.place.rpartition(":")
    here = [b for each in found for b in each if line.isdigit() and flat.place(b.equation)[:2] == (file, int(line))]
    written = here or [b for b in next(filter(None, found)) if flat.place(b.equation)[0]]
    if not written:
        raise ModelicaError(
            f"the front end made the equation that determines der({term.state}), so it stands in no file that could be "
            "changed; name another state of the same part"
        )
    return written[0]


def _of_force(term: Term, flat: FlatPoints, values: Mapping[str, float]) -> Balance:
    """The flat equation, written at the term's place, that gives a force."""
    moved = {**values, term.force: values[term.force] + 1.0}
    pairs = zip(flat.residuals(values), flat.residuals(moved), strict=True)
    for number, ((equation, before, _), (_, after, _)) in enumerate(pairs):
        file, line, _ = flat.place(equation)
        if f"{file}:{line}" == term.place and before is not None and after is not None:
            slope = after - before
            if np.any(slope != 0.0):
                row = int(np.flatnonzero(slope)[0])
                return Balance(number, equation, float(np.sign(slope[row])), row, len(slope), (term.force,))
    raise ModelicaError(f"no equation at {term.place} gives '{term.force}', so nothing can be added to it")


def _tries(
    state: str, states: Sequence[str], flat: FlatPoints, values: Sequence[Mapping[str, float]]
) -> Iterator[list[Balance]]:
    """The equations that a balance may be, the likeliest way to find them first."""
    table = [_slopes(each, states, flat, values) for each in states]
    yield _candidates(state, states, table, flat)
    own = list(states).index(state)
    # The charge behind an inductor, der(q) = i, or what an input fills, der(m) = mdot.
    table[own] = _slopes(state, states, flat, values, names=True)
    yield _candidates(state, states, table, flat)
    # The angle of a damper between a shaft and its housing, which counts the other way than the shaft.
    table[own] = _slopes(state, states, flat, values, other_way=True)
    others = tuple(_equal(f"der({state})", values, -1.0))
    yield [replace(each, others=others) for each in _candidates(state, states, table, flat)]


@dataclass(frozen=True)
class _Slope:
    """How a flat equation changes with the derivative of a state, row by row."""

    equation: FlatEquation
    slope: np.ndarray


def _slopes(
    state: str,
    states: Sequence[str],
    flat: FlatPoints,
    points: Sequence[Mapping[str, float]],
    names: bool = False,
    other_way: bool = False,
) -> dict[int, _Slope]:
    """By the number of the flat equation, where it changes with der(state), and with the variables that equal it.

    Equations that say that two variables are equal are left out, unless `names`; then the variables that equal it stay. Variables that equal it but for their sign count
    if they go the `other_way`.
    """
    rate, values = f"der({state})", points[0]
    step = max(abs(values[rate]), 1.0)
    changes = {rate: step} if names else {name: step for name in _equal(rate, points)}
    if other_way:
        changes |= {name: -step for name in _equal(rate, points, -1.0)}
    moved = {**values, **{name: values[name] + change for name, change in changes.items() if name not in states}}
    found = {}
    pairs = zip(flat.residuals(values), flat.residuals(moved), strict=True)
    for number, ((equation, before, size), (_, after, _)) in enumerate(pairs):
        if before is None or after is None or before.shape != after.shape or (_is_name(equation) and not names):
            continue
        slope = (after - before) / step
        if np.any(np.abs(slope) > SMALL * max(size / step, 1e-12)):
            found[number] = _Slope(equation, slope)
    return found


def _candidates(
    state: str, states: Sequence[str], table: Sequence[Mapping[int, _Slope]], flat: FlatPoints
) -> list[Balance]:
    """Equations with the derivative of a state; first the one that it has to itself if each state takes one."""
    largest = [max((float(np.max(np.abs(s.slope))) for s in column.values()), default=1.0) for column in table]
    rows = [(n, k) for n in sorted({n for column in table for n in column}) for k in range(_count(n, table))]
    shares = np.zeros((len(rows), len(states)))
    for j, column in enumerate(table):
        for i, (number, row) in enumerate(rows):
            if number in column:
                shares[i, j] = abs(float(column[number].slope[row])) / largest[j]
    pairs = {int(j): int(i) for i, j in zip(*scipy.optimize.linear_sum_assignment(-shares), strict=True)}
    index = list(states).index(state)
    own = rows[pairs[index]] if index in pairs else None
    found = []
    for number, entry in table[index].items():
        rows_with = np.flatnonzero(entry.slope)
        row = _row(state, states, rows_with, len(entry.slope))
        if own is not None and own[0] == number and not position(state):
            row = own[1]
        if entry.slope[row] != 0.0:
            found.append(Balance(number, entry.equation, float(np.sign(entry.slope[row])), row, len(entry.slope)))
    return sorted(found, key=lambda balance: own is None or balance.number != own[0])


def _count(number: int, table: Sequence[Mapping[int, _Slope]]) -> int:
    return next(len(column[number].slope) for column in table if number in column)


def _equal(rate: str, points: Sequence[Mapping[str, float]], sign: float = 1.0) -> list[str]:
    """A derivative and the variables that equal it, such as a in a = der(v), or equal it but for their sign."""
    return [
        name
        for name in points[0]
        if (name == rate and sign > 0)
        or (points[0][rate] != 0.0 and all(values[name] == sign * values[rate] for values in points))
    ]


def _row(state: str, states: Sequence[str], rows: np.ndarray, count: int) -> int:
    elements = [name for name in states if plain(name) == plain(state)]
    if len(elements) == count and position(state):
        return elements.index(state)
    return int(rows[0])


def _is_name(equation: FlatEquation) -> bool:
    """Whether an equation says no more than a = b."""

    def is_variable(tree: tuple[object, ...]) -> bool:
        return tree[0] in ("name", "index") or tree[:2] == ("call", "der")

    return is_variable(equation.left) and is_variable(equation.right)


def written_at(balance: Balance, term: Term, flat: FlatPoints, root: View) -> tuple[Home, list[EquationText]]:
    """The class and the text of a flat equation; several where it stands in the branches of an if.

    Args:
        balance: the flat equation.
        term: what is to be added to it.
        flat: the flat equations, with the texts that they were read from.
        root: the model.

    Raises:
        ModelicaError: if no text is found.
    """
    file, line, start = flat.place(balance.equation)
    span = balance.equation.span
    assert span is not None
    read = flat.files[span["source"]][1]
    length = len(read.encode()[span["start"] : span["end"]].decode(errors="ignore"))
    paths = [split(name.removeprefix("der(").removesuffix(")"))[:-1] for name in (term.state, *balance.others)]
    for path, depth in ((each, depth) for each in paths for depth in range(len(each), -1, -1)):
        for home in homes_at(root, tuple(path[:depth])):
            if file_of(home.definition).name != file:
                continue
            own, prefix = home.definition.equations, "".join(f"{part}." for part in path[:depth])
            whole = modelica_text(file_of(home.definition))
            # The compiler may have read declarations before the equation in other words, in the same lines.
            begin = start + _end_of(line, whole) - _end_of(line, read)
            found = [e for e in own if e.span[0] < begin + length and begin < e.span[1]]
            found = found or _in_block(own, begin, home.definition.span[0])
            if found:
                mentioned = [e for e in found if _mentions(whole[slice(*e.span)], term.state.removeprefix(prefix))]
                return home, mentioned or found
    raise ModelicaError(
        f"{file}:{line}: the equation of '{term.state}' stands outside the classes of its parts, such as in a connection; "
        "name the state of a part whose class has the equation"
    )


def _end_of(line: int, text: str) -> int:
    return sum(len(each) + 1 for each in text.split("\n")[:line])


def _in_block(equations: Sequence[EquationText], place: int, first: int) -> list[EquationText]:
    """Equations of the loop or the if-equation of which the front end reports the iterator or a condition."""
    behind = [e for e in equations if first <= place <= e.span[0]]
    blocks = [begin for e in behind for begin in e.branches if begin <= place]
    if blocks:
        return [e for e in equations if max(blocks) in e.branches]
    return [e for e in behind if e.iterators][:1]


def _mentions(text: str, state: str) -> bool:
    """Whether an equation's text has the derivative of a state."""
    return re.search(rf"\bder\(\s*{re.escape(plain(state))}\b", text) is not None
