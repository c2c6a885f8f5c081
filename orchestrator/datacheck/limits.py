"""Limits of the data checks, in one place; docs/data_checks.md shows what each of them is worth."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limit:
    """What a right change has to reach: it leaves less than `left`, and `drop` times less than the record as it is does.

    `close` is how near to a well-known factor of the size of a physical gain the one must be that is fitted freely, `loose` how
    near to one beyond it, where what it leaves has to grow by `worse` on both sides.
    """

    left: float
    drop: float
    close: float
    loose: float = 0.25
    worse: float = 1.0


# Where a model leaves less than this share of what a record shows over short stretches, no column is looked at.
NOTHING_WRONG = 0.01
# Where it leaves more than this, its friction may be what it lacks, and it is looked at with free pushes, too.
WELL_PREDICTED = 0.05
PLAIN = Limit(left=0.15, drop=15.0, close=0.06)
# With free pushes, more is explained of any record, and gains are less sharp.
PUSHED = Limit(left=0.1, drop=8.0, close=0.25, loose=0.9, worse=1.5)
# A model that moves more than ten times as much as the record has the wrong scale, whatever else it lacks; a factor is right
# then if the model predicts with it at all, and worse with nearly twice and with a tenth of it.
OUT_OF_SCALE = 100.0
SCALE = Limit(left=0.5, drop=1000.0, close=0.06, loose=0.9)
# A change of another column that leaves no more than this many times what the best one leaves is an alternative to it.
AS_GOOD = 1.5
# Up to this factor a physical gain may be as large.
NEAR_ONE = 30.0
# How far, in rad, a freely fitted zero may be from a quarter or half turn.
CLOSE_ANGLE = 0.05
# A delay counts if it leaves this much less, is longer than so many samples, and differs by less than a share of
# itself, or a sample, between trials: missing friction makes outputs lead, too, by more at low frequencies.
DELAY_DROP, DELAY_SAMPLES, DELAY_SPREAD = 10.0, 1.5, 0.2
# A lag that counts leaves 0.42 of that or less beside one of the lags that are tried first: errors grow with the square of the time.
DELAY_HINT = 0.6
# A model that cannot be pushed has to come this near to the noise with inputs moved: missing friction leaves more.
NEAR_NOISE = 3.0
# A trial stands out if the model leaves this many times more of it than of the others, and errs by so many times more.
STANDS_OUT, LARGER = 30.0, 5.0
# Below this, a model is too good for a lag to be looked for.
EXACT = 1e-4
# A sensor is stuck if it repeats a value for this share of a trial, at least so many samples, and came to it with steps
# of this many usual ones, or left it with one of so many of its largest.
STUCK_SHARE, STUCK_SAMPLES, STUCK_STOP, STUCK_JUMP = 0.05, 25, 0.5, 3.0
# It is saturated if it is at its greatest or least value in this share of the samples, with two flat stretches at least
# that it runs into and leaves with steps of so many digits, of which the smaller is at least this share of the larger.
SATURATED_SHARE, SATURATED_SPEED, SATURATED_ALIKE = 0.01, 3.0, 0.2
# An input whose record does not tell is held if holding it leaves this much less of an output.
HELD_DROP = 4.0
# One whose record stays and jumps is held unless this leaves more by this factor.
HELD_WORSE = 1.3
