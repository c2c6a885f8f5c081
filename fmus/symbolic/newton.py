"""Solvers for the blocks of equations that no formula solves."""

from collections.abc import Sequence
from typing import Any

import casadi as ca

from fmus.symbolic.solution import Stage, Unknown
from fmus.symbolic.tearing import tear

MOST_ITERATIONS = 60
# Steps relative to the size of an unknown; Newton doubles the digits with each, so the error left is far smaller.
SMALLEST_STEP = 1e-12
# A solution is accepted if changing the unknowns by this share of their size could explain what is left of the equations.
ACCEPTED = 1e-8
# Damped iterations for what plain Newton does not find, and how often each may halve its step.
DAMPED_ITERATIONS, HALVINGS = 40, 8
# Singular matrices give results that are not finite, as they do in generated code, not an exception.
ANY_PIVOT = {"eps": 0.0}


def nonlinear_stage(name: str, equations: ca.SX, unknowns: Sequence[Unknown], knowns: ca.SX, place: str = "") -> Stage:
    """Newton's method with the exact Jacobian; derivatives follow from the implicit function theorem.

    Unknowns are counted in units of their nominal value, else of their guess (1 if that is zero). Where the plain
    method fails, it begins anew from the solution of fewer equations, in which no guess of 0 counts that another equation
    replaces; then damped steps are taken from the guess. The result is NaN if all fail.

    Args:
        name: a C identifier.
        equations: column that becomes zero.
        unknowns: as many as equations, with guesses in terms of `knowns`.
        knowns: all other symbols in the equations.
    """
    symbols = ca.vertcat(*[u.symbol for u in unknowns])
    guess = ca.vertcat(*[u.guess for u in unknowns])
    size = ca.vertcat(*[_size(u) for u in unknowns])
    sizes = ca.SX.sym("size", len(unknowns))
    reduced, parts, values = _parametric(equations, symbols, knowns)
    scaled = ca.SX.sym("scaled", len(unknowns))
    residual = ca.substitute(reduced, symbols, sizes * scaled)
    known = ca.vertcat(sizes, parts)
    rescue = _by_fewer(name, reduced, unknowns, parts)
    solver = _solver(name, scaled, known, residual, sizes, rescue)
    return Stage(symbols, guess, ca.vertcat(size, values), solver, place)


def linear_stage(name: str, matrix: ca.SX, right: ca.SX, unknowns: Sequence[Unknown], place: str = "") -> Stage:
    """Orthogonal factorisation at run time, for coefficients of which none is sure to be a good pivot.

    The result is NaN if the equations are singular.

    Args:
        name: of the solver.
        matrix: coefficients (n, n).
        right: right-hand side (n, 1).
        unknowns: the n unknowns.
        place: file and line of the equations, for messages.
    """
    n = len(unknowns)
    pattern = matrix.sparsity()
    values = ca.vertcat(matrix.nz[:], right)

    guess, column, found = ca.MX.sym("guess", n), ca.MX.sym("values", values.numel()), ca.MX.sym("found", n)
    coefficients = ca.MX(pattern, column[: pattern.nnz()])
    wanted = column[pattern.nnz() :]
    reach = ca.mtimes(ca.fabs(coefficients), ca.fabs(found)) + ca.fabs(wanted)
    # Comparisons with NaN are false, so it is what holds that has to be counted.
    holding = ca.sum1(ca.fabs(ca.mtimes(coefficients, found) - wanted) <= ACCEPTED * reach) >= n
    holds = ca.Function(f"{name}_holds", [found, column], [holding])
    # Equations whose terms are all small, beside large ones, hold after a second step only.
    change = ca.solve(coefficients, wanted - ca.mtimes(coefficients, found), "qr", ANY_PIVOT)
    improve = ca.Function(f"{name}_improve", [found, column], [change])
    nothing = ca.Function(f"{name}_keep", [found, column], [ca.MX.zeros(n)])
    rest = ca.Function.if_else(f"{name}_rest", nothing, improve)
    first = ca.solve(coefficients, wanted, "qr", ANY_PIVOT)
    last = first + ca.stop_diff(rest(holds(first, column), first, column), 1)
    solver = ca.Function(name, [guess, column], [ca.if_else(holds(last, column), last, ca.DM.nan(n))])
    return Stage(ca.vertcat(*[u.symbol for u in unknowns]), ca.SX.zeros(n), values, solver, place)


def _size(unknown: Unknown) -> ca.SX:
    if unknown.nominal:
        return ca.SX(abs(unknown.nominal))
    return ca.if_else(unknown.guess != 0, ca.fabs(unknown.guess), ca.SX(1))


def _parametric(equations: ca.SX, unknowns: ca.SX, knowns: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Replace what does not change during the iteration by symbols; give these and what they stand for."""
    reduced, symbols, parts = ca.extract_parametric(equations, knowns)
    own = {_identity(u) for u in ca.vertsplit(unknowns)} | {_identity(s) for s in symbols}
    plain = [s for s in ca.symvar(reduced) if _identity(s) not in own]
    return reduced, ca.vertcat(ca.SX(0, 1), *symbols, *plain), ca.vertcat(ca.SX(0, 1), *parts, *plain)


def _by_fewer(name: str, equations: ca.SX, unknowns: Sequence[Unknown], parts: ca.SX) -> ca.Function | None:
    """`(found, start, known) -> scaled solution` by fewer equations, None if there are none."""
    torn = tear(ca.vertsplit(equations), unknowns)
    if not torn.assignments:
        return None
    n, left = len(unknowns), [u.symbol for u in torn.unknowns]
    places = [k for k, u in enumerate(unknowns) if any(ca.is_equal(u.symbol, symbol) for symbol in left)]
    scaled, sizes = ca.SX.sym("scaled", len(left)), ca.SX.sym("size", len(left))
    residual = ca.substitute(ca.vertcat(*torn.equations), ca.vertcat(*left), sizes * scaled)
    fewer = _solver(f"{name}_fewer", scaled, ca.vertcat(sizes, parts), residual, sizes, None)
    backwards = list(reversed(torn.assignments))
    everything = [ca.vertcat(*[u.symbol for u in unknowns])]
    _, [values] = ca.substitute_inplace([s for s, _ in backwards], [v for _, v in backwards], everything, False)
    back = ca.Function(f"{name}_back", [ca.vertcat(*left), parts], [values])
    found, start = ca.MX.sym("found", n), ca.MX.sym("start", n)
    known = ca.MX.sym("known", n + parts.numel())
    size = known[:n]
    solution = fewer((start * size)[places], ca.vertcat(size[places], known[n:]))
    return ca.Function(f"{name}_by_fewer", [found, start, known], [back(solution, known[n:]) / size])


def _solver(
    name: str, scaled: ca.SX, known: ca.SX, residual: ca.SX, sizes: ca.SX, rescue: ca.Function | None
) -> ca.Function:
    """`(guess, known) -> solution`, with guess and solution in the unknowns' own units; `rescue` is tried before damped steps."""
    equations = ca.Function(f"{name}_equations", [scaled, known], [residual])
    options: dict[str, Any] = {
        "abstol": 0.0,  # what is small among the equations depends on their units
        "abstolStep": SMALLEST_STEP,
        "max_iter": MOST_ITERATIONS,
        "error_on_fail": False,
    }
    newton = ca.rootfinder(f"{name}_newton", "fast_newton", equations, options)
    accepted = _accepted(scaled, residual)
    holds = ca.Function(f"{name}_holds", [scaled, known], [accepted])
    checked = ca.if_else(accepted, scaled * sizes, ca.DM.nan(scaled.numel()))
    check = ca.Function(f"{name}_checked", [scaled, known], [checked])
    n = scaled.numel()
    guess, values = ca.MX.sym("guess", n), ca.MX.sym("values", known.numel())
    start = guess / values[:n]
    first = newton(start, values)
    keep = _first(n, known.numel())
    # Functions that decide evaluate one branch only.
    if rescue is not None:
        first = ca.Function.if_else(f"{name}_fewer_first", keep, rescue)(holds(first, values), first, start, values)
    better = ca.Function.if_else(f"{name}_rescue", keep, _damped(name, scaled, known, residual))
    # The second call starts at the solution, so it costs one iteration; it alone carries the derivatives.
    second = newton(ca.stop_diff(better(holds(first, values), first, start, values), 1), values)
    return ca.Function(name, [guess, values], [check(second, values)])


def _accepted(scaled: ca.SX, residual: ca.SX) -> ca.SX:
    jacobian = ca.jacobian(residual, scaled)
    reach = ca.mtimes(ca.fabs(jacobian), 1 + ca.fabs(scaled))
    return ca.logic_all(ca.fabs(residual) <= ACCEPTED * reach)


def _first(n: int, n_known: int) -> ca.Function:
    found, start, values = ca.SX.sym("found", n), ca.SX.sym("start", n), ca.SX.sym("values", n_known)
    return ca.Function("keep", [found, start, values], [found])


def _damped(name: str, scaled: ca.SX, known: ca.SX, residual: ca.SX) -> ca.Function:
    """Newton steps from the start, each halved until the equations are nearer to zero than before."""
    n = scaled.numel()
    direction = ca.Function("direction", [scaled, known], [residual, ca.jacobian(residual, scaled)])
    amount = ca.Function("amount", [scaled, known], [ca.sumsqr(residual)])
    at, values = ca.MX.sym("at", n), ca.MX.sym("values", known.numel())
    remainder, jacobian = direction(at, values)
    change = -ca.solve(jacobian, remainder, "qr", ANY_PIVOT)
    best, lowest = at, amount(at, values)
    for halving in range(HALVINGS):
        trial = at + change * 0.5**halving
        remaining = amount(trial, values)
        better = remaining < lowest
        best, lowest = ca.if_else(better, trial, best), ca.if_else(better, remaining, lowest)
    once = ca.Function("once", [at, values], [best])
    found, start = ca.MX.sym("found", n), ca.MX.sym("start", n)
    repeated = once.fold(DAMPED_ITERATIONS)
    last = repeated(start, ca.repmat(values, 1, DAMPED_ITERATIONS))
    return ca.Function(f"{name}_damped", [found, start, values], [last])


def _identity(symbol: ca.SX) -> int:
    return int(symbol.element_hash())
