"""Numbers that the room `fit` decides and computes by, each with its meaning, by the file that uses it first."""


# `extended_class.py`

# Extended models that a process remembers.
KEPT = 128


# `evidence.py`

# A fit ends when the misfit changes by less than this share: a hundredth of a unit for thousands of samples.
TOLERANCE = 1e-6
# A departure from absence shows if it is as many standard deviations.
DEVIATIONS = 2.0
# Errors of parameters that are the same but for this share of their power are one error.
DEPENDENT = 1e-9
# A departure from absence by less than this share of it may be rounding.
ROUNDING = 1e-6
# A parameter is pinned if its standard deviation is less than this share of it.
PINNED = 0.3
# A first value is at a bound if it is nearer to it than this share of the typical size.
AT_BOUND = 1e-9
# A fit whose misfit for each datum is no larger leaves nothing but noise.
NEAR_FLOOR = 1.25
# A fit is repeated with shorter steps if they change its misfit by more than one, and by more than this share of it.
NOTICED = 1e-3
MOST_FINER = 4


# `phases.py`

# A first amplitude grows or shrinks by this factor at most.
MOST_GROWTH = 1e3
