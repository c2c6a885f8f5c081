"""Numbers that the room `referee` decides and computes by, each with its meaning, by the file that uses it first."""


# `conclude.py`

# Below this chance, what a set leaves is no accident: with two tests of it, one right set in a hundred.
CLEAR = 0.005
# Power of what no smooth force explains, over that of the declared noise, up to which it is noise: sensors do not declare
# what inputs do between samples.
MOST_NOISE = 1.5


# `ranking.py`

# What a parameter that was never fitted is charged: half of log(1e9) samples, so that it never beats one that was.
UNFITTED = 10.0


# `referee.py`

# Held-out trials are silent on an effect that changes less than this share of what it changes in the learning trials.
SILENT = 0.1
