"""Numbers that the room `linear` decides and computes by, each with its meaning, by the file that uses it first."""


# `calibration.py`

NULLS = 199
SIGNIFICANT = 0.05
# An effect, or what is left, is worth mentioning if it is this share of the root mean square error.
PRACTICAL = 0.05
# The same for an effect beside the noise.
NOTABLE = 0.15
AR_ORDER = 6
# What nothing explains is not noise if it is this many times what the sensors are said, or seen, to have.
BEYOND_NOISE = 3.0
# What noise leaves has a mean square that scatters by sqrt(2/rows); what lies within two such deviations is noise.
SCATTER = 2.0
# The saturated fit takes at most this share of the degrees of freedom.
SATURATED = 0.25


# `flexible.py`

POSITION_KNOTS = 16
SPEED_KNOTS = 7
TIME_KNOTS = 6
# Slower than this share of its root mean square speed, an output is near rest.
AT_REST = 0.05


# `kinship.py`

# Odds are given up to this many to one.
MOST_LOG_ODDS = 20.0


# `noise_model.py`

# Noise of an input that moves the outputs by less than this share of the sensors' noise is left out.
LEAST_CARRIED = 0.01
# Waves and draws of such noise where each of them takes a run of its own; draws where none does.
FEW_WAVES, FEW_DRAWS, DRAWS = 40, 4, 8
# If what no waves can follow has more than this share of the sensors' power, they are too few.
COARSE = 0.05


# `input_noise.py`

# Share of what a set lowers the misfit by that noise-free inputs must confirm.
MOSTLY = 0.5


# `noise_free_motion.py`

# Start values are moved to first order so many times; changes whose effects differ by less than this share are one.
CORRECTIONS = 2
DEPENDENT = 1e-6


# `remetric.py`

# Metrics differ if evidence counted in the one misses that in the other by this much (nats): odds of 20 to 1.
ANOTHER_METRIC = 3.0


# `subsets.py`

MOST_EFFECTS = 3
BEAM = 5
# A direction of which less than this share is new explains nothing new.
SEPARATE = 1e-4
# A pair is more than its parts if it explains so many times what they do.
HIDDEN = 2.0


# `tangent.py`

# A shape parameter without a grid of its own (a Stribeck speed, say) is tried at these multiples of its first value.
SHAPES = (0.3, 1.0, 3.0)
# Standard deviation of how much of its second difference is added to an input; a hold for half a sample is a quarter.
BETWEEN_STD = 0.25
# No hold, no straight line and no mean over a sample needs so many of these deviations: half of a second difference is
# a delay of a whole sample.
BEYOND_SAMPLES = 2.0
# A shift of the clock beyond this share of the most that it can be is at its end.
AT_END = 0.999
# Columns of a block that are combinations of the others to this accuracy do not count.
RANK = 1e-6
