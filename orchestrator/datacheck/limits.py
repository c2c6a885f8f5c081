"""Limits of the data checks, in one place; docs/data_checks.md shows what each of them is worth."""

# Where a model leaves less than this share of what a record shows over short stretches, no column is looked at.
NOTHING_WRONG = 0.01
# A changed column is right only if it leaves less than this.
WELL_PREDICTED = 0.05
# A change counts if it divides what the model leaves by this much at least.
DROP = 10.0
# A change of another column that leaves no more than this many times what the best one leaves is an alternative to it.
AS_GOOD = 1.5
# How near a factor that is fitted freely must be to the well-known one: up to NEAR_ONE, a physical gain may be as large, and
# beyond it nothing physical is.
NEAR_ONE, CLOSE, LOOSE = 30.0, 0.06, 0.25
# How far, in rad, a freely fitted zero may be from a quarter or half turn.
CLOSE_ANGLE = 0.05
# A delay counts if it leaves this much less, and is longer than this many samples.
DELAY_DROP, DELAY_SAMPLES = 4.0, 1.5
# A trial stands out if the model leaves this many times more in it than in the others.
STANDS_OUT = 30.0
# A sensor is stuck if it repeats a value for this share of a trial, at least so many samples, while others move.
STUCK_SHARE, STUCK_SAMPLES = 0.1, 25
# It is saturated if it is at its greatest or least value in this share of the samples, in at least two runs of three or more.
SATURATED_SHARE = 0.01
# An input is held if this share of its samples repeats the one before, or if holding it leaves this much less.
REPEATED_SHARE, HELD_DROP = 0.4, 1.3
