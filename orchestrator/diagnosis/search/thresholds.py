"""Numbers that the room `search` decides and computes by, each with its meaning, by the file that uses it first."""


# `cutting.py`

# Stretches of a trial: as many start values are fitted at once.
MOST_STRETCHES = 6
# Shorter stretches say little beside their start values.
FEWEST_SAMPLES = 50


# `first_values.py`

# A time constant is at most its first guess over this.
FAINTEST = 1e-4


# `fitting.py`

# All are fitted roughly, the best few to the end.
ROUGH = 1e-3
POLISHED = 3


# `placed.py`

# Shares of the range seen, from the side on which the effect does not act.
LEVELS = (0.95, 0.85, 0.75, 0.6, 0.45, 0.3)
FIRST = 0.6
# The machine itself may have gone farther than its nominal runs, by this share of their range.
FARTHER = 0.25
# Points of a grid that is made finer, at most.
MOST_POINTS = 100
# What moves by less than this share of its size rests but for rounding.
AT_REST = 1e-9


# `proposals.py`

# A larger set must score this much more, a chance of 1 in 20, to be refitted as a whole.
CLEARLY = 3.0
# What an effect leaves of the residual beside a set that is not the best, as a share of what it leaves beside that.
CLEARLY_LESS = 0.9
# Refitted in a round: those that explain the most of the correction residual, and the most of the free runs' error.
BY_RESIDUAL = 5
BY_FREE_RUNS = 3


# `screening.py`

CORNER_HZ = 2.0
# Peaks of a residual's spectrum at which an oscillation may be, and how high they are at least beside the highest: an
# error of another kind swings with the commands, ten times as wide.
MOST_PEAKS = 5
WORTH_A_PEAK = 0.01


# `search.py`

MOST_ROUNDS = 5
# Free runs of the model as given that err by more than this share of the signals' spread: every effect is refitted alone.
LOST = 0.2
# Sets that are extended in the next round, and those whose effects are put together.
BEAM = 2
UNITED = 3
# Other paths that are tried where the first one ends above noise.
OTHER_PATHS = 2
# Operations of fits after which no other path is begun, and one goes on only if its last effect left less than a share of the cost.
MOST_WORK = 3e10
STILL_PAYS = 0.5


# `stretches.py`

# Samples of the first stretch, and how much longer each next one is.
SHORTEST, GROWTH = 8, 1.5
# A stretch shorter than so many means of the metric is followed sample by sample.
FEWEST_MEANS = 16


# `trace.py`

# An effect must take this share off the mean square error above the noise to be worth its parameters.
WORTHWHILE = 0.2
# An effect without which so much of the noise's rms is left matters, however much larger another one is.
VISIBLE = 0.5
