"""All thresholds of the grey-box diagnosis, each with its meaning."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Thresholds:
    """Limits of search and decision.

    Search: sets of up to `largest_set` effects are proposed at once about the model as given, `shortlist` of them are
    fitted; about the best set `additions` further effects are tried, in at most `rounds`, up to `most_effects`. What makes
    left-out blocks less probable by more than `hopeless` nats is not fitted.

    Inputs are taken as linear between samples unless another way makes the record more probable by `interpolation` nats.

    Decision: a set is better than another beyond doubt if its cross-validated log likelihood is higher by `standard_errors`
    of the sum of differences over blocks, and by `nats` for each effect that it has more. Each effect has to bring `least_share`
    of what the whole set gains. An answer is incomplete if more than `complete_share` of the missing force is unexplained.
    Held-out errors may rise by no more than `worse`.
    """

    largest_set: int = 3
    shortlist: int = 12
    additions: int = 4
    rounds: int = 4
    most_effects: int = 4
    hopeless: float = 5.0
    standard_errors: float = 1.64
    nats: float = 3.0
    least_share: float = 0.05
    complete_share: float = 0.1
    worse: float = 0.02
    interpolation: float = 10.0
