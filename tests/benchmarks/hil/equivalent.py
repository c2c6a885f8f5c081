"""Mutants that the tests cannot tell from the safety core, and why nobody could: part of what is printed of them, and a reason."""

EQUIVALENT: dict[str, str] = {
    "motion.py:49: 0.0 + 1": "the rate counts with the time that has passed, and here none has",
    "`history` -> True": "what is kept of no changes of sign is none",
    "`not before.owed and (not doubted)` -> False": "what nobody owes or doubts is owed by nobody",
    "`motion is None` -> True": "a motion that is given is the one that is found anew",
    "Gt -> GtE in `torque > 0`": "a torque of zero is not beyond the breakaway, so its way is of no account",
    "Gt -> GtE in `(speed - begun) * way > EFFECT`": "they differ where a filtered speed is the limit to the last bit",
    "Gt -> GtE in `(position - start) * way": "they differ where a way is the limit to the last bit",
    "Gt -> GtE in `t > 0`": "a torque of zero is kept as it is, or replaced by zero",
    "Lt -> LtE in `t < 0`": "a torque of zero is kept as it is, or replaced by zero",
    "Gt -> GtE in `t * speed > 0`": "a torque without power at that speed is zero, and replaced by zero",
    "Gt -> GtE in `t * speed > share`": "where torque times speed is the share, the share by the speed is the torque",
    "Mult -> Div in `t * speed`": "a product and a quotient have the same sign, and the speed is not zero there",
    "Mult -> Div in `(position - start) * way`": "the way is 1 or -1",
    "Mult -> Div in `(speed - begun) * way`": "the way is 1 or -1",
    "1000000.0 + 1": "a millionth of a time that is printed with three digits",
}
