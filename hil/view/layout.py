"""Where a session's window in shared memory holds what; all numbers are doubles, texts are UTF-8 with zeros behind them."""

from hil.safety.rules import RULES

JOINTS = 3
# Controllers may show so many signals of their own.
SIGNALS = 40
# Upper ends of the classes of lateness in us, ten a decade; the last class has none.
EDGES = tuple(step * 10.0**k for k in range(5) for step in (1.0, 1.25, 1.6, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0))

# The writer counts up before and after it writes. Times are monotonic ns, the latest beginning of a cycle is in us.
BEGUN, DONE, PERIOD, BEGAN, LATEST, HEAD = range(6)
# What changes in every cycle, in this order.
NOW = ("time_ns", "cycles", "missing", "missed", "reaction", "stage")
VECTORS = ("angles", "speeds", "torques", "asked", "force")
SHOWN = HEAD + len(NOW) + len(VECTORS) * JOINTS
CLASSES = SHOWN + SIGNALS
TRIPS = CLASSES + len(EDGES) + 1
# Of each rule: first and last cycle that broke it (ns), how many did, the worst reaction.
PER_TRIP = 4
PLACES = TRIPS + len(RULES) * PER_TRIP

RULE_NAMES = tuple(rule.__name__ for rule in RULES)
# Bytes of a rule's words, of what keeps the arm from being armed or has stopped it, and of what never changes (JSON).
WORDS, REASON, ABOUT = 160, 240, 8192
WORDS_AT = PLACES * 8
REASON_AT = WORDS_AT + len(RULES) * WORDS
ABOUT_AT = REASON_AT + REASON
SIZE = ABOUT_AT + ABOUT
