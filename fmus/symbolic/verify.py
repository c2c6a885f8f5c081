"""Check a translated model against its flat equations, evaluated in another way at random points."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError
from fmus.flat.compare import Failure, compare, delayed
from fmus.symbolic.system import Relations, SymbolicSystem, Variable

TOLERANCE = 1e-9
# Half of them around the start values, half around zero.
POINTS = 4
# Some points lie where the equations have no solution; so many are tried.
MOST_TRIES = 20


class TranslationError(ModelicaError):
    """A translated model does not satisfy an equation of its source."""


def verify(
    system: SymbolicSystem,
    rates: ca.Function,
    rate_names: Sequence[str],
    dae: Mapping[str, Any],
    equations: int,
    memory: tuple[Sequence[str], ca.Function] | None = None,
) -> tuple[str, ...]:
    """Compare a system with the front end's flat equations, if they are there.

    Args:
        system: the translated model.
        rates: `(t, x, u, d, p) -> values` of all derivatives in the equations; of `(t, x, u, d, p, c)` for a system that is checked
            where its relations have taken sides, as they do at events.
        rate_names: their names, such as `der(x)`.
        dae: the front end's representation with its `flat` equations.
        equations: number of scalar equations of the model.
        memory: names such as `pre(count)`, and `(t, p) -> values` that they start with; None if
            nothing is remembered.

    Returns:
        Notes about what was not checked.

    Raises:
        TranslationError: naming an equation that does not hold.
    """
    flat = dae.get("flat")
    if flat is None:
        return ()
    points = [
        values
        | ({} if memory is None else dict(zip(memory[0], np.array(memory[1](values["time"], p)).ravel(), strict=True)))
        for values, p in _points(system, rates, rate_names)
    ]
    if not points:
        return ("the translation was not checked: at no random point do its equations have a finite solution",)
    files = {entry[0]: (str(entry[1]), str(entry[2])) for entry in dae["source_map"]["files"]}
    sources = [text for _, text in files.values()]
    variables = (*system.states, *system.algebraics)
    result = compare(flat, sources, points, [v.name for v in system.dependents], TOLERANCE, [v.name for v in variables])
    if result.failure is not None:
        raise TranslationError(
            f"{_place(result.failure, files)} does not hold in the translation (relative error "
            f"{result.failure.error:.2g}); either its solution magnifies rounding, as long chains of gears do, or this "
            "is a fault of misfit: please report it with the model"
        )
    missing = equations - result.checked
    if missing <= 0:
        return ()
    why = f": {'; '.join(result.reasons[:3])}" if result.reasons else ""
    return (f"{missing} of {equations} equations were not checked independently{why}",)


def verify_relations(system: SymbolicSystem) -> None:
    """Make sure that relations which keep the side that they have give the same results as relations evaluated.

    Raises:
        ModelicaError: naming a variable that differs.
    """
    relations = system.relations
    if relations is None:
        return
    names = [*(f"der({v.name})" for v in system.states), *(v.name for v in system.algebraics)]
    random = np.random.default_rng(2)
    for _ in range(POINTS):
        x, u, p = (near(random, v, 0.3) for v in (system.states, system.inputs, system.parameters))
        time = float(random.uniform(0.0, 1.0))
        d = np.array(system.history(time, u, p)[0]).ravel()
        c, _ = _sides(relations, (time, x, u, d, p))
        kept = np.vstack([np.array(part) for part in relations.rhs(time, x, u, d, p, c)])
        plain = np.vstack([np.array(part) for part in system.rhs(time, x, u, d, p)])
        with np.errstate(invalid="ignore"):
            wrong = np.isfinite(plain) & (np.abs(kept - plain) > 1e-6 * np.maximum(np.abs(kept), np.abs(plain)))
        if wrong.any():
            name = names[int(np.flatnonzero(wrong)[0])]
            raise TranslationError(
                f"{system.name}: '{name}' is another with relations that keep their side than with relations "
                "evaluated; this is a fault of misfit, please report it with the model"
            )


def _sides(relations: Relations, arguments: tuple[Any, ...]) -> tuple[np.ndarray, bool]:
    """Sides and memories after the event iteration of the relations at t, x, u, d, p; whether it came to an end."""
    time, p = arguments[0], arguments[4]
    instants, rising = (np.array(part).ravel() for part in relations.times(p))
    timed = np.where(rising > 0, time >= instants, time < instants).astype(float)
    sides = np.zeros(relations.n_indicators)
    memory = np.array([] if relations.memory is None else relations.memory.start(time, p)).ravel()
    chance = np.random.default_rng(1)
    for turn in range(20 + 10 * len(sides)):  # a relation may depend on others
        c = np.concatenate([sides, timed, memory])
        g = np.array(relations.indicators(*arguments, c)[0]).ravel()
        wrong = ((g > 0) | ((g == 0) & np.array(relations.holds_at_zero, dtype=bool))) != (sides > 0)
        if not wrong.any():
            return c, True
        if turn > len(sides):  # turning all of them leads round in a circle
            wrong = np.arange(len(sides)) == chance.choice(np.flatnonzero(wrong))
        sides = np.where(wrong, 1 - sides, sides)
    return c, False


def _place(failure: Failure, files: Mapping[int, tuple[str, str]]) -> str:
    """File, line and text of an equation."""
    if failure.parameter is not None:
        return f"the binding of parameter {failure.parameter}"
    span = failure.equation.span
    if span is None or span["source"] not in files:
        return "an equation that the front end made"
    path, text = files[span["source"]]
    content = text.encode()
    # Spans count bytes, not characters.
    line = content[: span["start"]].count(b"\n") + 1
    written = content[span["start"] : span["end"]].decode(errors="replace")
    # Of a for-equation the span covers the iterator only.
    written = " ".join((written if "=" in written else text.splitlines()[line - 1]).split())
    return f"{path.rsplit('/', 1)[-1]}:{line}: the equation '{written}'"


def _points(
    system: SymbolicSystem, rates: ca.Function, rate_names: Sequence[str]
) -> Iterator[tuple[dict[str, float], list[float]]]:
    """Values of all scalars by name, where all of them are finite, and those of the parameters."""
    random = np.random.default_rng(0)
    found = 0
    for attempt in range(MOST_TRIES):
        spread = 0.3 / (1 + attempt // 4)
        time = float(random.uniform(0.0, 1.0))
        states = [v if attempt % 2 else replace(v, start=0.0) for v in system.states]
        x, u = (near(random, variables, spread) for variables in (states, system.inputs))
        # One point has the parameters as declared, for conditions that hold for these only.
        p = near(random, system.parameters, 0.0 if attempt == 0 else 0.1 * spread)
        source, delay = (np.array(part).ravel() for part in system.history(time, u, p))
        d = [delayed(s, t) for s, t in zip(source, delay, strict=True)]
        arguments: tuple[Any, ...] = (time, x, u, d, p)
        rhs, settled = system.rhs, True
        if rates.n_in() > len(arguments) and system.relations is not None:
            c, settled = _sides(system.relations, arguments)
            arguments, rhs = (*arguments, c), system.relations.rhs
        dx, z = (np.array(part).ravel() for part in rhs(*arguments))
        derivatives = np.array(rates(*arguments)).ravel()
        if not (settled and np.isfinite(dx).all() and np.isfinite(z).all() and np.isfinite(derivatives).all()):
            continue
        values = {"time": time, **_named(system.states, x), **_named(system.inputs, u), **_named(system.parameters, p)}
        values |= _named(system.algebraics, z) | _named(system.dependents, np.array(system.dependent(p)).ravel())
        yield values | dict(zip(rate_names, map(float, derivatives), strict=True)), p
        found += 1
        if found == POINTS:
            return


def _named(variables: Sequence[Variable], values: Sequence[float] | np.ndarray) -> dict[str, float]:
    return {v.name: float(value) for v, value in zip(variables, values, strict=True)}


def near(random: np.random.Generator, variables: Sequence[Variable], spread: float) -> list[float]:
    """Values around the starts, within the bounds."""
    found = []
    for v in variables:
        start = v.start if v.start is not None and np.isfinite(v.start) else 0.0
        low, high = (-np.inf if v.minimum is None else v.minimum), (np.inf if v.maximum is None else v.maximum)
        share = float(random.uniform(-1.0, 1.0))
        if np.isfinite(low) and np.isfinite(high) and spread >= 0.1:
            start = 0.5 * (low + high)
            width = 0.45 * (high - low)
        else:
            width = spread * max(abs(start), v.nominal or 1.0)
        found.append(float(np.clip(start + share * width, low, high)))
    return found
