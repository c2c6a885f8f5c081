"""One equation with terms added on the side where they add to the derivative."""

from fmus.errors import ModelicaError
from fmus.frontend.lint.tokens import tokens_of


def with_terms(equation: str, terms: list[tuple[float, str]], file: str) -> str:
    """Add terms to an equation.

    Args:
        equation: its text, `left = right`.
        terms: the sign of the derivative in left minus right, and the expression to add, for each term.
        file: for messages.
    """
    left, between, right = _sides(equation, file)
    for sign, expression in terms:
        if sign > 0:
            right = _sum(right, expression)
        else:
            left = _sum(left, expression)
    return left + between + right


def _sides(equation: str, file: str) -> tuple[str, str, str]:
    depth = 0
    for token in tokens_of(equation, file):
        depth += (token.text in ("(", "{", "[")) - (token.text in (")", "}", "]"))
        if token.text == "=" and depth == 0:
            left, right = equation[: token.start], equation[token.end :]
            first, last = len(left.rstrip()), len(right) - len(right.lstrip())
            return left[:first], left[first:] + "=" + right[:last], right[last:]
    raise ModelicaError(f"{file}: '{equation}' is no equation with two sides")


def _sum(side: str, expression: str) -> str:
    expression = expression.strip()
    if tokens_of(side, "")[0].text == "if":
        side = f"({side})"
    elif side.strip() in ("0", "0.0"):
        return expression
    if tokens_of(expression, "")[0].text == "if":
        expression = f"({expression})"
    if expression.startswith("-"):
        return f"{side} - {expression[1:].lstrip()}"
    return f"{side} + {expression}"


def in_row(expression: str, row: int, rows: int, iterators: tuple[str, ...]) -> str:
    """A term of one row of an equation of arrays, or of one round of a loop."""
    if iterators:
        if len(iterators) > 1:
            raise ModelicaError("an equation inside of two loops cannot be changed; write the loops as one")
        return f"(if {iterators[0]} == {row + 1} then {expression} else 0)"
    if rows == 1:
        return expression
    return "{" + ", ".join(expression if k == row else "0" for k in range(rows)) + "}"
