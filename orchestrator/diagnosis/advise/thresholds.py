"""Numbers that the room `advise` decides and computes by, each with its meaning, by the file that uses it first."""


# `identifiability.py`

# A change that moves the data by less than this many standard deviations of their noise, all samples taken together.
UNSEEN = 1.0
TRADED = 0.95
UNCERTAIN = 0.3
# Members of a flat direction that count: their share of its largest one.
MEMBER = 0.1
FLAT_MEMBERS = 6


# `latent.py`

# Bounds of length scales, in deviations of a coordinate, and of the noise, as a share of the residual.
LENGTHS = (0.3, 5.0)
NOISES = (0.03, 3.0)
# Coordinates are compared with this length and this noise alone, which costs one factorisation instead of a fit.
ROUGH = (0.8, 0.3)
LATENT_SAMPLES = 180
FOLDS = 4
GRID = 21


# `menu.py`

PLAYED_SAMPLES = 5000
LINES = 7
# Frequencies of the shapes suit a trial of 10 s; those of a slower machine's trial are lower in proportion.
USUAL_S = 10.0
# Shares of their range by which inputs are moved beside what the first trial does: an arm without a controller falls out of
# the postures that were recorded when all its muscles are driven alike.
BESIDE = (0.5, 0.2, 0.05)
# Shares of their range by which inputs are driven: of one that acts to both sides also small ones, as a machine that
# nothing holds runs away under a torque that is large for long.
ONE_SIDED, TWO_SIDED = (1.0, 0.5), (1.0, 0.5, 0.2, 0.05)
# Inputs that were never driven may also go beyond what a slow sine lets them, as a fast one moves a machine less.
BEYOND_SLOW = (100.0, 30.0, 10.0, 3.0)
OUT_OF_REST_ELSE = 0.1


# `next_experiment.py`

# Explanations compared by refits, and experiments for which they are refitted to each other.
MOST_MEMBERS = 5
REFITTED = 3
# Sizes of an input of one shape that are compared for a machine that rested; what is smaller shows less of it.
LARGEST = 2
# Outputs may leave the range seen so far by this share of it.
BEYOND = 0.5
# Below this probability a record of an experiment hardly names the right explanation. Where a few records would, the advice
# says how many do with near certainty.
HOPELESS, NEARLY_CERTAIN = 0.6, 0.9
MOST_RECORDS = 10
# A separation below this is the rounding of a fit.
NOTHING = 1e-9


# `profile.py`

MOST_PARAMETERS = 6
# A rise of the misfit at the end of an interval that differs from a parabola's by more than this factor misleads.
MISLEADING = 1.5
CLOSE = 0.1
MOST_REFITS = 5
# A held parameter stays within this share of its standard deviation.
HELD = 1e-4
# A fit that is given up before so many evaluations has hardly settled; ten of them, of play in long trials, took minutes.
FEWEST_EVALUATIONS = 40


# `rival_laws.py`

# An explanation that imitates another one may change its parameters by so many times their size.
FARTHEST = 10.0


# `parameters_alike.py`

# Parameters that take up this share of an effect's misfit to first order are fitted in its place.
TAKEN_UP = 0.8
# Parameters that are listed, and the least of them, as a share of how far they may be off.
LISTED, SHOWN_SHARE = 4, 0.1
