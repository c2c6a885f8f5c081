"""The model specific C files: the functions of a system and the configuration of the runtime."""

import re
from dataclasses import dataclass
from typing import Any

import casadi as ca

from fmus.symbolic.events import without_memory, without_relations
from fmus.symbolic.system import SymbolicSystem

MODEL_FUNCTIONS = ("rhs", "history", "dependent", "initial", "consistent")


@dataclass(frozen=True)
class ModelCode:
    """Generated C of one model: `functions` is `model.c`, `sizes` its work space (CasADi's names)."""

    functions: str
    sizes: dict[str, int]


def model_code(system: SymbolicSystem, *, reverse: bool = False) -> ModelCode:
    """Generate C for the functions of a system, as `model_rhs`, `model_history` and so on, and their tangents.

    With `reverse` their adjoints too.
    """
    relations = system.relations or without_relations(system)
    memory = relations.memory or without_memory(relations.rhs)
    sources = {**model_functions(system), "rhs": relations.rhs}
    plain = [_dense(function, f"model_{name}") for name, function in sources.items()]
    indicators = _dense(relations.indicators, "model_indicators")
    own = [
        *plain,
        _derivatives(plain[0]),
        _jacobian(plain[0]),
        indicators,
        _dense(relations.times, "model_event_times"),
        _dense(memory.start, "model_memory_start"),
        _dense(memory.due, "model_due"),
        _dense(memory.update, "model_update"),
    ]
    functions = [*own, *map(_tangent, [*plain, indicators]), *(map(_adjoint, plain) if reverse else [])]
    options: dict[str, Any] = {
        "with_header": False,
        "casadi_real": "double",
        "casadi_int": "int",
    }
    generator = ca.CodeGenerator("model.c", options)
    for function in functions:
        generator.add(function)
    sizes = {
        "ARG": max(function.sz_arg() for function in functions),
        "RES": max(function.sz_res() for function in functions),
        "IW": max(function.sz_iw() for function in functions),
        "W": max(function.sz_w() for function in functions),
    }
    closed = all(function.is_a("SXFunction") for function in functions)
    # Two FMUs in one process must not see each other's model: the functions stay inside the library.
    return ModelCode("#define CASADI_SYMBOL_EXPORT\n" + _inlined(generator.dump(), closed), sizes)


def model_functions(system: SymbolicSystem) -> dict[str, ca.Function]:
    """The functions of a system by name; start values that nothing has to solve for are consistent as they are."""
    functions = {name: getattr(system, name) for name in MODEL_FUNCTIONS}
    if system.consistent is None:
        sizes = (1, len(system.inputs), len(system.parameters), len(system.states))
        t, u, p, s = (ca.SX.sym(name, size) for name, size in zip("tups", sizes, strict=True))
        functions["consistent"] = ca.Function("consistent", [t, u, p, s], [s])
    return functions


def _inlined(code: str, closed: bool) -> str:
    """Leave out what costs more than the arithmetic around it: calls of fmin and fmax, tests for missing arguments.

    The runtime passes every argument, so in functions that call no others (`closed`) a test is never false; it would
    keep the sine and the cosine of one angle apart.
    """
    code = code.replace("return fmin(x, y);", "return x<y ? x : y;").replace(
        "return fmax(x, y);", "return x>y ? x : y;"
    )
    return re.sub(r"arg\[(\d+)\]\? (arg\[\1\]\[\d+\]) : 0;", r"\2;", code) if closed else code


def model_identifier(name: str) -> str:
    """Turn a model name into a C identifier.

    Example:
        >>> model_identifier("Arm.Two-Link")
        'Arm_Two_Link'
    """
    identifier = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return identifier if identifier[:1].isalpha() else f"model_{identifier}"


def model_config(
    system: SymbolicSystem,
    code: ModelCode,
    variable_names: list[str],
    guid: str,
    tolerance: float,
) -> str:
    """Write `model_config.h`: sizes, start values and names, as macros that the runtime uses once.

    `variable_names` are in the order of the value references. Lists get a closing 0, since C has no
    empty arrays.
    """
    relations = system.relations or without_relations(system)
    memory = relations.memory or without_memory(relations.rhs)
    counts = {
        "INPUTS": len(system.inputs),
        "STATES": len(system.states),
        "ALGEBRAICS": len(system.algebraics),
        "PARAMETERS": len(system.parameters),
        "DEPENDENTS": len(system.dependents),
        "DELAYS": system.n_delays,
        "INDICATORS": relations.n_indicators,
        "TIMED": len(relations.names) - relations.n_indicators,
        "MEMORIES": len(memory.names),
        "CLOCKS": memory.due.numel_out(0),
        "SOLVED": len(_solved(system)),
    }
    macros = {
        "MODEL_GUID": _string(guid),
        "MODEL_TOLERANCE": repr(tolerance),
        **{f"N_{what}": str(count) for what, count in counts.items()},
        **{f"MODEL_SZ_{what}": str(size) for what, size in code.sizes.items()},
        "MODEL_INPUT_STARTS": _numbers([v.start or 0.0 for v in system.inputs]),
        "MODEL_PARAMETER_STARTS": _numbers([v.start or 0.0 for v in system.parameters]),
        "MODEL_COPIES": _list([str(reference) for reference in [*_copies(system), -1]]),
        "MODEL_SOLVED_REFERENCES": _list([*(str(reference) for reference, _ in _solved(system)), "0"]),
        "MODEL_SOLVED_NAMES": _list([*(_string(names) for _, names in _solved(system)), "0"]),
        "MODEL_RELATION_NAMES": _list([*map(_string, relations.names), "0"]),
        "MODEL_HOLDS_AT_ZERO": _list([*(str(int(holds)) for holds in relations.holds_at_zero), "0"]),
        "MODEL_RESETS": str(int(memory.resets)),
        "MODEL_SOLVES_START": str(int(system.consistent is not None)),
        "MODEL_NOMINALS": _numbers([abs(v.nominal or 1.0) for v in system.states]),
        "MODEL_VARIABLE_NAMES": _list([_string(name) for name in variable_names]),
    }
    lines = [f"#define {name} {value}" for name, value in macros.items()]
    return "\n".join(["#ifndef MODEL_CONFIG_H", "#define MODEL_CONFIG_H", *lines, "#endif", ""])


def _dense(function: ca.Function, name: str) -> ca.Function:
    """The same function of dense columns: generated C reads and writes nonzeros only."""
    symbol = ca.SX.sym if function.is_a("SXFunction") else ca.MX.sym
    columns: list[Any] = [symbol(function.name_in(i), function.numel_in(i)) for i in range(function.n_in())]
    shaped = [ca.reshape(column, *function.size_in(i)) for i, column in enumerate(columns)]
    results = [ca.densify(ca.vec(result)) for result in function.call(shaped)]
    return ca.Function(name, columns, results, {"cse": True})


def _derivatives(rhs: ca.Function) -> ca.Function:
    """The first result of `model_rhs` by itself: stages of the integration need no algebraic variables."""
    symbol = ca.SX.sym if rhs.is_a("SXFunction") else ca.MX.sym
    arguments: list[Any] = [symbol(rhs.name_in(i), rhs.numel_in(i)) for i in range(rhs.n_in())]
    return ca.Function("model_derivatives", arguments, rhs.call(arguments)[:1], {"cse": True})


def _jacobian(rhs: ca.Function) -> ca.Function:
    """Derivatives of the first result of `model_rhs` by the states, column by column."""
    symbol = ca.SX.sym if rhs.is_a("SXFunction") else ca.MX.sym
    arguments: list[Any] = [symbol(rhs.name_in(i), rhs.numel_in(i)) for i in range(rhs.n_in())]
    by_states = ca.jacobian(rhs.call(arguments)[0], arguments[1])
    return ca.Function("model_jacobian", arguments, [ca.densify(ca.vec(by_states))], {"cse": True})


def _copies(system: SymbolicSystem) -> list[int]:
    """Value reference of the input, state or parameter that an algebraic variable only repeats, or -1, for each one."""
    rhs = system.between_events
    if not rhs.is_a("SXFunction"):
        return [-1] * len(system.algebraics)
    time, x, u, delayed, p, *kept = (ca.SX.sym(rhs.name_in(i), rhs.numel_in(i)) for i in range(rhs.n_in()))
    first_parameter = len(system.inputs) + 2 * len(system.states) + len(system.algebraics)
    references = {
        element.name(): first + i
        for first, column in ((0, u), (len(system.inputs), x), (first_parameter, p))
        for i, element in enumerate(ca.vertsplit(column))
    }
    _, z = rhs.call([time, x, u, delayed, p, *kept])
    return [references.get(item.name(), -1) if item.is_symbolic() else -1 for item in ca.vertsplit(ca.densify(z))]


def _solved(system: SymbolicSystem) -> list[tuple[int, str]]:
    """For each block that is solved by iteration the value reference of one unknown, and the names of all."""
    first = len(system.inputs) + len(system.states)
    names = [*(f"der({v.name})" for v in system.states), *(v.name for v in system.algebraics)]
    references = {name: first + i for i, name in enumerate(names)}
    visible = ([name for name in block if name in references] for block in system.solved)
    return [(references[block[0]], ", ".join(f"'{name}'" for name in block)) for block in visible if block]


def _tangent(function: ca.Function) -> ca.Function:
    """Forward mode, `model_rhs_tangent` and so on: the arguments, then their seeds -> change of each result."""
    symbol = ca.SX.sym if function.is_a("SXFunction") else ca.MX.sym
    arguments: list[Any] = [symbol(function.name_in(i), function.numel_in(i)) for i in range(function.n_in())]
    seeds: list[Any] = [symbol(f"seed_{function.name_in(i)}", function.numel_in(i)) for i in range(function.n_in())]
    changes = function.forward(1).call([*arguments, *function.call(arguments), *seeds])
    name = f"{function.name()}_tangent"
    return ca.Function(name, [*arguments, *seeds], [ca.densify(change) for change in changes], {"cse": True})


def _adjoint(function: ca.Function) -> ca.Function:
    """Reverse mode, `model_rhs_adjoint` and so on: the arguments, then a seed for each result -> share of each one."""
    symbol = ca.SX.sym if function.is_a("SXFunction") else ca.MX.sym
    arguments: list[Any] = [symbol(function.name_in(i), function.numel_in(i)) for i in range(function.n_in())]
    seeds: list[Any] = [symbol(f"seed_{i}", function.numel_out(i)) for i in range(function.n_out())]
    shares = function.reverse(1).call([*arguments, *function.call(arguments), *seeds])
    name = f"{function.name()}_adjoint"
    return ca.Function(name, [*arguments, *seeds], [ca.densify(ca.vec(share)) for share in shares], {"cse": True})


def _numbers(values: list[float]) -> str:
    return _list([repr(float(value)) for value in [*values, 0.0]])


def _list(items: list[str]) -> str:
    return "{" + ", ".join(items) + "}"


def _string(text: str) -> str:
    """A C string literal of UTF-8 bytes; octal escapes end after three digits, unlike hexadecimal ones."""
    plain = (chr(b) if 32 <= b < 127 and b not in b'"\\?' else f"\\{b:03o}" for b in text.encode())
    return '"' + "".join(plain) + '"'
