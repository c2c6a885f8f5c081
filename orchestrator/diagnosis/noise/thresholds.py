"""Numbers that the room `noise` decides and computes by, each with its meaning, by the file that uses it first."""


# `gaps.py`

GAP = 1.5


# `metric.py`

# Means over samples leave this many of a trial at most; the covariance of their noise is a full matrix.
MOST_BLOCKS = 600
# Noise of a measured input is spread over this many waves in a trial.
WAVES = 200
# The power of an input's noise is at most so many standard deviations above what is expected of it.
MOST_LIKELY = 3.0


# `nuisances.py`

# A parameter ends within this many standard deviations (tolerances) of its nominal value.
REACH = 3.0
# Parameters of which nobody says how well they are known have this standard deviation, as a share of their values.
ASSUMED = 0.03


# `outliers.py`

# An outlier is this many standard deviations from what the errors before and after it let expect, or this many times as far
# as its neighbours, where a model is wrong.
STANDS_OUT = 6.0
NEIGHBOURS = 10
ENDS = 3
# A recorder gets single samples wrong: by itself, one is off by this share of what it is said to be off by. What a missing
# effect does, when a muscle is switched on say, bends the errors and leaves none off by itself.
ALONE = 0.5
# More than this share is no accident.
MOST_SHARE = 0.02
