"""Where an expression decides: derivatives do not see that `if x < 1 then 2 else 3` or `floor(x)` depends on x."""

import casadi as ca

_DECIDING = frozenset((ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_SIGN, ca.OP_FLOOR, ca.OP_CEIL))


def decides(expression: ca.SX, symbols: ca.SX) -> bool:
    """Tell whether some symbols decide between values, so that a constant derivative by them does not mean a line.

    Example:
        >>> t = ca.SX.sym("t")
        >>> decides(t - ca.floor(t), t), decides(3 * t - 1, t)
        (True, False)
    """
    function = ca.Function("f", [symbols, ca.vertcat(*_others(expression, symbols))], [expression])
    depends: dict[int, bool] = {}
    for k in range(function.n_instructions()):
        operation, inputs = function.instruction_id(k), function.instruction_input(k)
        if operation == ca.OP_OUTPUT:
            continue
        if operation == ca.OP_INPUT:
            found = inputs[0] == 0
        else:
            found = operation != ca.OP_CONST and any(depends.get(i, False) for i in inputs)
            if found and operation in _DECIDING:
                return True
        depends[function.instruction_output(k)[0]] = found
    return False


def _others(expression: ca.SX, symbols: ca.SX) -> list[ca.SX]:
    own = {symbol.element_hash() for symbol in ca.symvar(symbols)}
    return [symbol for symbol in ca.symvar(expression) if symbol.element_hash() not in own]
