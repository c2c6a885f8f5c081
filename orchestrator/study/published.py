"""What the study's paper reports, to stand beside ours. Improvements in percent."""

REGRESSION = {"slope": 1.0, "r2": 0.82}
IMPROVEMENT = {
    "anterior deltoid": 28.0,
    "posterior deltoid": 43.0,
    "triceps long head": 33.0,
    "brachialis": 27.0,
}
IN_WORDS = {
    "biceps": "about 40 % worse with few corrections, recovers with more",
    "triceps short head": "worse with few corrections, recovers with more",
}
