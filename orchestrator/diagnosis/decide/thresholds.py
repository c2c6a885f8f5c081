"""Numbers that the room `decide` decides and computes by, each with its meaning, by the file that uses it first."""


# `confusion.py`

# Odds below which one explanation is not preferred to another: 1 to 20.
DECISIVE = 20.0
# A rival with more parameters often contains the simpler law, which then needs no more than substantial odds.
PARSIMONIOUS = 3.0
# Odds by the learning trials that held-out trials are not asked to turn.
HOPELESS = 1000.0
# Sets that are fitted in another metric beside the best one.
MOST_RIVALS = 6
# A rough fit may end this share of the misfit above what it would come to.
ROUGHLY = 0.01


# `constancy.py`

# Columns that are combinations of the others to this accuracy are no freedom of their own.
APART = 1e-3


# `excitation.py`

# Drop of the misfit, in units of the noise, by which an effect is found with near certainty among a hundred candidates.
FOUND = 36.0
# A site is blind if the data would show no more than this share of its effects.
SHOWN = 0.5
# An effect that does this share (of power) of what it does at another site is excited; noise that hides it hides it
# everywhere. A muscle that is never stimulated does nothing at all; what leaks out of the upper of two tanks does 0.002
# to 0.005 of what leaks out of the lower one, however they are driven.
AS_ELSEWHERE = 0.001
# Effects of a blind site that the next experiment should show, and of a machine that only rested.
MOST_UNSEEN, MOST_AT_REST = 2, 12
# A signal moves if it ranges over this many standard deviations of its noise in some trial; white noise does over 8.
MOVES = 12.0


# `nested.py`

# The rest of a law matters if it may be this share of what the simpler law has in the same unit.
MATTERS = 0.2
# Sizes of the rest that a fit starts from, as shares of that; and factors of the card's first values of anything else.
SIZES, SHAPES = (0.3, 1.0), (0.3, 1.0, 3.0)


# `room.py`

# Shares of the record's samples up to which the rest acts, dense where little of the record tells: near rest, and at
# the top speeds, which a machine may have for a moment only; and sizes of the rest, as shares of the simpler law.
ACTS_IN = (0.01, 0.02, 0.04, 0.07, 0.12, 0.2, 0.35, 0.6, 0.8, 0.9, 0.95, 1.0)
# Likelihoods that are no less than this, and no more than its inverse.
LEAST = 1e-20


# `verdict.py`

# Held-out errors exceed the noise if their mean square is this many times its power. Right sets of the benchmark's
# drives and pendulums end between 0.98 and 1.05, of the arm up to 1.3, as its noise depends on the motion more than the
# metric knows (docs/decisions/010-what-is-left-decides.md).
EXCESS = 1.5
# What a set leaves, as a share of what exceeded the noise (rms), before it counts as another effect: of declared sensors,
# where learning trials show it beside their noise and where only held-out errors exceed theirs; and where the noise is read
# from the record itself, which does not tell slow noise from a slow error. Cards say of which effects more may be left.
LEFT = 0.02
LEFT_HELD_OUT = 0.04
LEFT_UNDECLARED = 0.3
